"""How right over ponds, lattices, waters and seeds that nothing was tuned on: every case with several seeds.

Writes docs/grid.md: for each case the median over the seeds and the worst of them, beside the goal. The correction
runs in this process, on the snapshots as a base station would have sent them.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pondwatch.simulator.bundle import write_bundle
from pondwatch.simulator.simulation import Simulation
from pondwatch.simulator.spec import SimulationSpec

from .accuracy import Row, measure
from .pages import ROOT, number, percent, table, write_page

FIRST_SEED = 7001


@dataclass(frozen=True, slots=True)
class Goal:
    """Shares are at most (gross) or at least (rods); None where nothing is asked."""

    gross: float | None
    gross_among_sure: float
    median_px: float | None
    rods: float | None


@dataclass(frozen=True, slots=True)
class Case:
    """One row of the table."""

    name: str
    spec: SimulationSpec
    goal: Goal


WALL_PX = 48.0  # from the wall to the nearest snapshot's centre: a robot has a hull


def _spec(**options: Any) -> SimulationSpec:
    return SimulationSpec(margin_px=WALL_PX, **options)


CASES = (
    Case("plain", _spec(print_colours=True, image_kind="png"), Goal(0.005, 0, 0.02, 0.995)),
    Case(
        "wide-noise (0.64 pitch)",
        _spec(print_colours=True, image_kind="png", noise_pitch=0.64, noise_theta_rad=0.15),
        Goal(0.025, 0.001, 0.02, 0.99),
    ),
    Case("murky", _spec(water="murky", quality=85), Goal(0.01, 0, 0.1, 0.99)),
    Case(
        "drifting",
        _spec(path="smooth", noise="drift", noise_pitch=0.48, noise_theta_rad=0.12),
        Goal(0.01, 0, 0.05, 0.99),
    ),
    Case(
        "paper-geometry",
        _spec(coverage=1.09, noise_pitch=0.08, noise_theta_rad=0.5, theta_range_rad=2.0),
        Goal(0.01, 0, 0.05, 0.99),
    ),
    Case(
        "pose noise 0.96 pitch, heading 0.2 rad",
        _spec(noise_pitch=0.96, noise_theta_rad=0.2),
        Goal(0.04, 0.002, 0.02, 0.98),
    ),
    Case(
        "heading unknown, position within 0.1 pitch",
        _spec(noise_pitch=0.1, heading_known=False, theta_range_rad=np.pi),
        Goal(0.01, 0, 0.05, 0.99),
    ),
    Case("8 % of poses grossly wrong", _spec(outliers=0.08), Goal(0.01, 0, 0.05, 0.99)),
    Case("square lattice, other pitch", _spec(lattice="square", pitch_px=52.0), Goal(0.01, 0, 0.05, 0.99)),
    Case("all rods empty", _spec(fills="empty"), Goal(None, 0.01, None, 0.99)),
    Case("unmapped floor, after alignment", _spec(mapped=False), Goal(0.01, 0, 0.1, None)),
    Case("robots up to the wall", SimulationSpec(), Goal(0.01, 0, 0.05, 0.99)),
)


def run(seeds: int = 4) -> None:
    """Measure and write down."""
    body = []
    for case in CASES:
        rows = [_measured(case, FIRST_SEED + k) for k in range(seeds)]
        body.append(_line(case, rows))
        print(" | ".join(body[-1]), flush=True)
    head = (
        "case",
        "gross",
        "gross among `placed`",
        "median px",
        "rod states right",
        "`placed`",
        "within 3 sigma",
        "CPU s",
    )
    explained = (
        f"Each figure is the median over {seeds} seeds (from {FIRST_SEED}), in brackets the worst of them, after the "
        "slash what is asked. Every seed is another pond: palette, fills, missing rods, water, poses and noise. The "
        "method is the one that `auto` takes. Made by `python -m tests.bench grid`."
    )
    page = write_page("grid.md", "How right it is on ponds never seen", [explained, table(head, body)])
    print(f"written to {page.relative_to(ROOT)}")


def _measured(case: Case, seed: int) -> Row:
    with tempfile.TemporaryDirectory() as folder:
        bundle = Path(folder) / f"case-{seed}"
        write_bundle(Simulation(case.spec, seed), bundle)
        return measure(bundle, "auto", Path(folder) / "results")[1]


def _line(case: Case, rows: Sequence[Row]) -> tuple[str, ...]:
    goal = case.goal

    def told(name: str) -> list[float]:
        return [float(v) for r in rows if (v := r.figures.get(name)) is not None]

    return (
        case.name,
        _cell([r.gross for r in rows], max, goal.gross, percent),
        _cell(told("gross_among_sure") if rows[0].mapped else [], max, goal.gross_among_sure, percent),
        _cell([r.median_px for r in rows], max, goal.median_px, number),
        _cell(told("rod_state_accuracy"), min, goal.rods, percent),
        _cell(told("sure"), min, None, percent),
        _cell(told("within_3_sigma"), min, 0.98, percent),
        _cell([r.seconds for r in rows if r.seconds is not None], max, None, number),
    )


def _cell(
    values: Sequence[float],
    worst: Callable[[Sequence[float]], float],
    goal: float | None,
    show: Callable[[float], str],
) -> str:
    if not values:
        return "-"
    asked = "" if goal is None else f" / {show(goal)}"
    return f"{show(float(np.median(values)))} ({show(worst(values))}){asked}"
