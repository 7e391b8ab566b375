"""Measures the networks beside doing nothing and the lattice method: the paper's table, for each data set given.

`python -m models.paper.evaluate --data DIR... --runs RUNS` takes RUNS/NOISE/NET, prints the table and keeps what it
found in results.json beside this file; with `--page` it writes docs/paper.md's tables and pictures too, and without
`--data` it only prints and writes what was found before. `--lattice-only` measures the lattice method alone, and needs
no torch.

Metrics as in the paper: errors of x by the pond's width, y by its height, theta in rad; MSE, MAE and R² over all
snapshots of all sets; IoU of the masks that estimated and true poses cover, on the pond's raster. Theta's error is
wrapped to [-pi, pi).
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from pondwatch.core.corrector import make_corrector
from pondwatch.core.paperinputs import normalised
from pondwatch.core.values import Float, Snapshot, SnapshotKey
from pondwatch.simulator.sfp10 import PondSets, Sfp10Spec, inspection_of, layout
from pondwatch.simulator.sfp10_files import load_spec

from .page import print_tables, write_page
from .tally import Row, Tally, instances_of, ponds_of, raster_mask

HERE = Path(__file__).parent
RESULTS = HERE / "results.json"
MIDDLE = (0.5, 0.5, 1.0)  # the mean of the truth


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


def lattice_row(folder: Path, count: int) -> Row:
    """The lattice method on `count` sets, each of another noise instance, the test ponds in turn."""
    spec, pond, tally = load_spec(folder), layout(), Tally(1)
    ponds = sum(1 for part, _ in spec.ponds() if part == "test")
    for number, sets in ponds_of(folder, count):
        for instance in map(int, instances_of(len(sets.noisy), count)[number::ponds]):
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
            from .predict import network_row  # torch: where there are networks only

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
    parser.add_argument("--lattice-only", action="store_true", help="leave out all other methods")
    parser.add_argument("--page", action="store_true", help="write docs/paper.md and its pictures")
    asked = parser.parse_args()
    rows = []
    for folder in asked.data:
        whole = measure(folder, asked.runs, asked.nets, asked.instances, asked.iou_every, asked.lattice)
        for row in [lattice_row(folder, asked.lattice)] if asked.lattice_only else whole:
            rows.append(row)
            print(f"{row.noise} {row.split} {row.method}: {row.mse} {row.iou:.4f} ({row.sets})", flush=True)
            found = keep([row])
    found = keep([])
    print_tables(found)
    if asked.page:
        write_page(found, asked.data, asked.runs)


if __name__ == "__main__":
    main()
