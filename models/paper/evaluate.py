"""Measures the networks beside doing nothing and the lattice method: the paper's table, for each data set given.

`python -m models.paper.evaluate --data DIR... --runs RUNS` takes RUNS/NOISE/NET, prints the table and keeps what it
found in results.json beside this file; with `--page` it writes docs/paper.md's tables and pictures too, and without
`--data` it only prints and writes what was found before.

Metrics as in the paper: errors of x by the pond's width, y by its height, theta in rad; MSE, MAE and R² over all
snapshots of all sets; IoU of the masks that estimated and true poses cover, on the pond's raster. Theta's error is
wrapped to [-pi, pi).
"""

from __future__ import annotations

import argparse
import json
import subprocess
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import torch

from pondwatch.core.corrector import make_corrector
from pondwatch.core.frames import wrap_angle
from pondwatch.core.paperinputs import covered, denormalised, normalised
from pondwatch.core.values import Bool, Float, Snapshot, SnapshotKey
from pondwatch.simulator.sfp10 import CAMERA, HEIGHT_PX, WIDTH_PX, PondSets, Sfp10Spec, inspection_of, layout
from pondwatch.simulator.sfp10_files import load_pond, load_spec

from . import data, train
from .data import instances_of
from .network import PaperNetwork
from .page import print_tables, write_page
from .recipes import Recipe, told

HERE = Path(__file__).parent
RESULTS = HERE / "results.json"
MIDDLE = (0.5, 0.5, 1.0)  # the mean of the truth


@dataclass(frozen=True, slots=True)
class Row:
    """One method on one data set. mse, mae, r2: x, y, theta. seconds: of CPU, a set."""

    split: str
    noise: str
    method: str
    mse: list[float]
    mae: list[float]
    r2: list[float]
    iou: float
    sets: int
    iou_sets: int
    seconds: float
    seed: int
    commit: str
    how: str = ""


class Tally:
    """Errors summed set by set."""

    def __init__(self, iou_every: int) -> None:
        self._every = iou_every
        self._errors: list[Float] = []
        self._truths: list[Float] = []
        self._ious: list[float] = []
        self.seconds = 0.0

    def add(self, estimate: Float, truth: Float, truth_mask: Bool) -> None:
        """One set: (221, 3) each, normalised."""
        error = estimate - truth
        error[:, 2] = wrap_angle(error[:, 2])
        if len(self._errors) % self._every == 0:
            mask = raster_mask(estimate)
            self._ious.append(float((mask & truth_mask).sum() / (mask | truth_mask).sum()))
        self._errors.append(error)
        self._truths.append(truth)

    def row(self, spec: Sfp10Spec, method: str, how: str = "") -> Row:
        """All of it."""
        error, truth = np.concatenate(self._errors), np.concatenate(self._truths)
        spread = ((truth - truth.mean(axis=0)) ** 2).mean(axis=0)
        mse = (error**2).mean(axis=0)
        mean_squared, mean_off, fit = (v.tolist() for v in (mse, np.abs(error).mean(axis=0), 1 - mse / spread))
        sets = len(self._errors)
        ious = (float(np.mean(self._ious)), sets, len(self._ious))
        return Row(
            spec.split, spec.noise, method, mean_squared, mean_off, fit, *ious, self.seconds / sets, spec.seed,
            commit(), how,
        )  # fmt: skip


def raster_mask(poses: Float) -> Bool:
    """(1587, 2245): what normalised poses cover, on the pond's raster."""
    pond = layout()
    return covered(denormalised(poses, pond), CAMERA, pond, (WIDTH_PX, HEIGHT_PX))


def commit() -> str:
    """The commit that runs, with a + where files that are kept were changed since."""

    def git(*words: str) -> str:
        return subprocess.run(["git", "-C", HERE, *words], capture_output=True, text=True, check=False).stdout.strip()

    return git("rev-parse", "--short=10", "HEAD") + ("+" if git("status", "--porcelain", "-uno", "--", ".") else "")


def ponds_of(folder: Path, limit: int = 0) -> Iterator[tuple[int, PondSets]]:
    """The test ponds."""
    numbers = [n for part, n in load_spec(folder).ponds() if part == "test"]
    for number in numbers[: limit or None]:
        yield number, load_pond(folder, "test", number)


def plain_rows(folder: Path, instances: int, iou_every: int) -> Iterator[Row]:
    """Doing nothing, and always the middle of the pond."""
    spec, pond = load_spec(folder), layout()
    identity, middle = Tally(iou_every), Tally(iou_every)
    for _, sets in ponds_of(folder):
        truth = normalised(sets.truth, pond)
        mask = raster_mask(truth)
        for k in instances_of(len(sets.noisy), instances):
            identity.add(normalised(sets.noisy[k].astype(np.float64), pond), truth, mask)
            middle.add(np.tile(MIDDLE, (len(truth), 1)), truth, mask)
    yield identity.row(spec, "identity")
    yield middle.row(spec, "middle")


def network_row(folder: Path, run: Path, instances: int, iou_every: int) -> Row:
    """One trained network."""
    network, made = train.load(run)
    tally = Tally(iou_every)
    for _, sets in ponds_of(folder):
        tensors = data.as_tensors(sets, network.shape, instances, made["poses"])
        started = time.process_time()
        estimates, truth = predict(network, tensors)
        tally.seconds += time.process_time() - started
        mask = raster_mask(truth)
        for estimate in estimates:
            tally.add(estimate, truth, mask)
    recipe = Recipe(**made["recipe"])
    return tally.row(load_spec(folder), run.name, f"{told(recipe)}, seed {made['seed']}, {made['epochs']} epochs done")


def predict(network: PaperNetwork, one: data.PaperSets) -> tuple[Float, Float]:
    """Of one pond: (K, 221, 3) estimates and (221, 3) truth, normalised."""
    every = torch.arange(one.coordinates.shape[1])[None]
    inputs, _ = one.batch(torch.zeros(1, dtype=torch.long), every)
    with torch.no_grad():
        out = network(**dict(zip(network.shape.inputs, inputs, strict=True)))
    return out.double().numpy(), one.truth[0].double().numpy()


def lattice_row(folder: Path, count: int) -> Row:
    """The lattice method on `count` sets, each of another pond and noise instance."""
    spec, pond, tally = load_spec(folder), layout(), Tally(1)
    for number, sets in ponds_of(folder, count):
        instance = int(instances_of(len(sets.noisy), count)[number])
        truth = normalised(sets.truth, pond)
        started = time.process_time()
        estimate = corrected(sets, spec, instance)
        tally.seconds += time.process_time() - started
        tally.add(normalised(estimate, pond), truth, raster_mask(truth))
    return tally.row(spec, "lattice")


def corrected(sets: PondSets, spec: Sfp10Spec, instance: int) -> Float:
    """(221, 3), pond frame: as the lattice method corrects a set; the noisy pose where it places nothing."""
    noisy = sets.noisy[instance].astype(np.float64)
    keys = [SnapshotKey("bubble", 0, n) for n in range(len(noisy))]
    images = [cv2.cvtColor(s, cv2.COLOR_GRAY2BGR) for s in sets.snapshots]
    corrector = make_corrector(inspection_of(spec.noise, instance), "lattice")
    corrector.add([Snapshot(*one) for one in zip(keys, map(float, range(len(keys))), noisy, images, strict=True)])
    corrector.settle()
    found = [corrector.poses()[key].pose_pond for key in keys]
    return np.stack([n if p is None else p for n, p in zip(noisy, found, strict=True)])


def measure(folder: Path, runs: Path, nets: list[str], instances: int, iou_every: int, lattice: int) -> Iterator[Row]:
    """Every row of one data set."""
    yield from plain_rows(folder, instances, iou_every)
    for net in nets:
        run = runs / load_spec(folder).noise / net
        if (run / "checkpoint.pt").is_file():
            yield network_row(folder, run, instances, iou_every)
    if lattice:
        yield lattice_row(folder, lattice)


def keep(rows: list[Row]) -> list[dict[str, Any]]:
    """All that was found, what is new over what was there."""
    before = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.is_file() else []
    every = {(r["noise"], r["split"], r["method"]): r for r in [*before, *(asdict(row) for row in rows)]}
    RESULTS.write_text(json.dumps([every[k] for k in sorted(every)], indent=1) + "\n", encoding="utf-8")
    return [every[k] for k in sorted(every)]


def main() -> None:
    """Measure, print, keep, and write the page."""
    parser = argparse.ArgumentParser(prog="python -m models.paper.evaluate", description=__doc__)
    parser.add_argument("--data", type=Path, nargs="*", default=[], metavar="DIR")
    parser.add_argument("--runs", type=Path, default=Path("runs"))
    parser.add_argument(
        "--nets", nargs="*", default=["a", "a-longer", "b", "c", "ours", "ours-longer", "ours-oracle", "corrections"]
    )
    parser.add_argument("--instances", type=int, default=0, help="noise instances a test pond; 0 is all")
    parser.add_argument("--iou-every", type=int, default=1, help="IoU of every n-th set")
    parser.add_argument("--lattice", type=int, default=10, help="sets for the lattice method; 0 leaves it out")
    parser.add_argument("--page", action="store_true", help="write docs/paper.md and its pictures")
    asked = parser.parse_args()
    rows = []
    for folder in asked.data:
        for row in measure(folder, asked.runs, asked.nets, asked.instances, asked.iou_every, asked.lattice):
            rows.append(row)
            print(f"{row.noise} {row.split} {row.method}: {row.mse} {row.iou:.4f} ({row.sets})", flush=True)
            found = keep([row])
    found = keep([])
    print_tables(found)
    if asked.page:
        write_page(found, asked.data, asked.runs)


if __name__ == "__main__":
    main()
