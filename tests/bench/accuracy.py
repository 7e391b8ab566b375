"""How right: corrects every session that has a truth and scores it, `identity` beside it.

Writes docs/accuracy.md and the README's table.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from .pages import ROOT, number, percent, replace_block, table, write_page
from .score import Figures, Truth, identity, read_result, read_truth, score
from .simulated import simulated_bundles

EXPLAINED = """\
Every session here has a truth that the correction never sees. `identity` is the poses as they came: what doing
nothing gives. *Median* and *p95* are errors of a snapshot's centre in its own pixels; a *gross* error is over 5.
*Sure* is the share called `placed`, *within 3 sigma* how many of those lie within three of their own standard
deviations. *Rod states* are right or wrong over all rods that some snapshot shows whole. Sessions marked ° have no
layout: their median and gross errors are those after one rigid motion of all poses, since only the noisy poses know
their frame."""


@dataclass(frozen=True, slots=True)
class Row:
    """One session, corrected by one method."""

    session: str
    method: str
    figures: Figures
    seconds: float | None
    mapped: bool

    @property
    def median_px(self) -> float:
        """Of the poses as they are, or for an unmapped pond as they are after one rigid motion."""
        return float(self.figures["median_px" if self.mapped else "median_px_aligned"])

    @property
    def gross(self) -> float:
        """The share over 5 px, in the same frame as `median_px`."""
        return float(self.figures["gross" if self.mapped else "gross_aligned"])


def run(bundles: Path | None, method: str) -> None:
    """Measure and write down."""
    with tempfile.TemporaryDirectory() as folder:
        found = sorted(p.parent for p in bundles.glob("*/truth_poses.csv")) if bundles else []
        found += simulated_bundles(Path(folder))
        rows = [row for bundle in found for row in measure(bundle, method, Path(folder) / "results")]
    replace_block(ROOT / "README.md", "accuracy", short_table(rows))
    page = write_page("accuracy.md", "How right it is", [EXPLAINED, long_table(rows), paper_table(rows)])
    print(f"{long_table(rows)}\nwritten to {page}")


def measure(bundle: Path, method: str, results: Path) -> list[Row]:
    """The row of `identity` and that of the method."""
    truth = read_truth(bundle)
    mapped = bool(truth.inspection.pond.rods)
    before = Row(bundle.name, "identity", score(truth, identity(truth)), None, mapped)
    figures, seconds = _corrected(bundle, truth, method, results / bundle.name)
    return [before, Row(bundle.name, method, figures, seconds, mapped)]


def _corrected(bundle: Path, truth: Truth, method: str, out: Path) -> tuple[Figures, float]:
    """Run as a user would, in a process of its own; the CPU seconds that it took."""
    command: list[str | Path] = [Path(sys.executable).parent / "pondwatch", "correct", bundle]
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    started = time.monotonic()
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    subprocess.run([*command, "--out", out, "--method", method], check=True, env=environment, stdout=sys.stderr)
    print(f"{bundle.name}: {time.monotonic() - started:.1f} s", file=sys.stderr)
    now = resource.getrusage(resource.RUSAGE_CHILDREN)
    return score(truth, read_result(out, truth)), now.ru_utime + now.ru_stime - spent.ru_utime - spent.ru_stime


def short_table(rows: list[Row]) -> str:
    """For the README."""
    head = ("session", "method", "median error", "gross errors", "sure", "gross among sure", "rod states right")
    return table(head, [(*_named(row), *_brief(row)) for row in rows])


def _named(row: Row) -> tuple[str, str]:
    return row.session + ("" if row.mapped else "°"), f"`{row.method}`"


def _brief(row: Row) -> tuple[str, ...]:
    told = row.figures if row.method != "identity" else {}
    return (
        f"{number(row.median_px)} px",
        percent(row.gross),
        percent(told.get("sure")),
        percent(told.get("gross_among_sure")) if row.mapped else "-",
        percent(told.get("rod_state_accuracy")),
    )


def long_table(rows: list[Row]) -> str:
    """For docs/accuracy.md: everything about places and rods."""
    head = ("session", "method", "median error", "gross errors", "sure", "gross among sure", "rod states right")
    more = ("p95, px", "theta, mrad", "within 3 sigma", "footprint IoU", "fill error", "made-up rods", "CPU s")
    return table((*head, *more), [(*_named(row), *_brief(row), *_detail(row)) for row in rows])


def _detail(row: Row) -> tuple[str, ...]:
    figures = row.figures
    made_up = figures.get("rods_read_though_never_visible")
    return (
        number(figures["p95_px"]),
        number(1000 * figures["theta_median_rad"]),
        percent(figures["within_3_sigma"]),
        f"{figures['iou_footprint']:.3f}",
        number(figures.get("rod_fill_mae"), 2),
        "-" if made_up is None else str(made_up),
        number(row.seconds, 2),
    )


def paper_table(rows: list[Row]) -> str:
    """The figures that the literature gives: x by the pond's width, y by its height, theta in radians."""
    head = ("session", "method", *(f"{m} {axis}" for m in ("MSE", "MAE", "R²") for axis in ("x", "y", "theta")), "IoU")
    body = []
    for row in rows:
        errors = [f"{v:.2e}" for name in ("mse", "mae") for v in row.figures[name]]
        fits = [f"{v:.4f}" for v in row.figures["r2"]]
        body.append((*_named(row), *errors, *fits, f"{row.figures['iou_union']:.4f}"))
    return "## In the literature's figures\n\n" + table(head, body)
