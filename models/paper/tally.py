"""The paper's figures, summed set by set. Needs no torch."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pondwatch.core.frames import wrap_angle
from pondwatch.core.paperinputs import covered, denormalised
from pondwatch.core.values import Bool, Float
from pondwatch.simulator.sfp10 import CAMERA, HEIGHT_PX, WIDTH_PX, PondSets, Sfp10Spec, layout
from pondwatch.simulator.sfp10_files import load_pond, load_spec

HERE = Path(__file__).parent


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


def instances_of(all_sets: int, wanted: int) -> NDArray[np.int64]:
    """`wanted` noise instances of a pond, evenly spread: where noise grows with the instance, all sizes are there."""
    wanted = min(wanted or all_sets, all_sets)
    return np.asarray(((np.arange(wanted) + 0.5) * all_sets / wanted).astype(np.int64))


def ponds_of(folder: Path, limit: int = 0) -> Iterator[tuple[int, PondSets]]:
    """The test ponds."""
    numbers = [n for part, n in load_spec(folder).ponds() if part == "test"]
    for number in numbers[: limit or None]:
        yield number, load_pond(folder, "test", number)
