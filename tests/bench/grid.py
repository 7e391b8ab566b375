"""How right over ponds, lattices, waters and seeds that nothing was tuned on: every case with several seeds.

Writes docs/grid.md: for each case the median over the seeds and the worst of them, beside the goal. The correction
runs in this process, on the snapshots as a base station would have sent them; ponds are kept as they come (`ponds.py`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pondwatch.simulator.spec import SimulationSpec

from .pages import ROOT, number, percent, spread, table, write_page
from .ponds import Kept, Record, measured

FIRST_SEED = 7001


@dataclass(frozen=True, slots=True)
class Goal:
    """Shares are at most (gross) or at least (rods, sure); None where nothing is asked."""

    gross: float | None
    gross_among_sure: float
    median_px: float | None
    rods: float | None
    sure: float | None = None


@dataclass(frozen=True, slots=True)
class Case:
    """One row of the table."""

    name: str
    spec: SimulationSpec
    goal: Goal


USUAL, WIDE = 0.97, 0.9  # called `placed`: up to 0.32 pitch of noise, and up to 0.64
WALL_PX = 48.0  # from the wall to the nearest snapshot's centre: a robot has a hull


def _spec(**options: Any) -> SimulationSpec:
    return SimulationSpec(margin_px=WALL_PX, **options)


CASES = (
    Case("plain", _spec(print_colours=True, image_kind="png"), Goal(0.005, 0, 0.02, 0.995, USUAL)),
    Case(
        "wide-noise (0.64 pitch)",
        _spec(print_colours=True, image_kind="png", noise_pitch=0.64, noise_theta_rad=0.15),
        Goal(0.025, 0.001, 0.02, 0.99, WIDE),
    ),
    Case("murky", _spec(water="murky", quality=85), Goal(0.01, 0, 0.1, 0.99, USUAL)),
    Case(
        "drifting",
        _spec(path="smooth", noise="drift", noise_pitch=0.48, noise_theta_rad=0.12),
        Goal(0.01, 0, 0.05, 0.99, WIDE),
    ),
    Case(
        "paper-geometry",
        _spec(coverage=1.09, noise_pitch=0.08, noise_theta_rad=0.5, theta_range_rad=2.0),
        Goal(0.01, 0, 0.05, 0.99, USUAL),
    ),
    Case(
        "pose noise 0.96 pitch, heading 0.2 rad",
        _spec(noise_pitch=0.96, noise_theta_rad=0.2),
        Goal(0.04, 0.002, 0.02, 0.98),
    ),
    Case(
        "heading unknown, position within 0.1 pitch",
        _spec(noise_pitch=0.1, heading_known=False, theta_range_rad=np.pi),
        Goal(0.01, 0, 0.05, 0.99, USUAL),
    ),
    Case("8 % of poses grossly wrong", _spec(outliers=0.08), Goal(0.01, 0, 0.05, 0.99, USUAL)),
    Case("square lattice, other pitch", _spec(lattice="square", pitch_px=52.0), Goal(0.01, 0, 0.05, 0.99, USUAL)),
    Case("all rods empty", _spec(fills="empty"), Goal(None, 0.01, None, 0.99)),
    Case("unmapped floor, after alignment", _spec(mapped=False), Goal(0.01, 0, 0.1, None, USUAL)),
    Case("robots up to the wall", SimulationSpec(), Goal(0.01, 0, 0.05, 0.99, USUAL)),
)


HEAD = ("case", "gross", "gross among `placed`", "median px", "rod states right", "`placed`", "within 3 sigma",
        "worst seed", "CPU s")  # fmt: skip


def run(seeds: int = 5) -> None:
    """Measure what is not yet there, and write down."""
    kept = Kept("grid")
    for seed in range(FIRST_SEED, FIRST_SEED + seeds):
        for case in CASES:
            if not any((r["case"], r["seed"]) == (case.name, seed) for r in kept.records()):
                record = _measured(case, seed)
                kept.add(record)
                print(f"{case.name}, seed {seed}: {record['gross']:.4f} {record['median_px']:.4f}", flush=True)
    write(kept.records(), seeds)


def write(records: Sequence[Record], seeds: int) -> None:
    """The page."""
    wanted = [r for r in records if r["seed"] < FIRST_SEED + seeds]
    body = [_line(case, [r for r in wanted if r["case"] == case.name]) for case in CASES]
    explained = (
        f"Each figure is the median over {seeds} seeds (from {FIRST_SEED}), in brackets the worst of them, after the "
        "slash what is asked. *Worst seed*: the one with the most gross errors, of several the one with the largest "
        "median error. Every seed is another pond: palette, fills, missing rods, water, poses and noise. The method is "
        "the one that `auto` takes. Property by property: [factors](factors.md). Made by `python -m tests.bench grid`."
    )
    page = write_page("grid.md", "How right it is on ponds never seen", [explained, table(HEAD, body)])
    print(f"written to {page.relative_to(ROOT)}")


def _measured(case: Case, seed: int) -> Record:
    record = measured(case.spec, seed, bounds=0)
    frame = "" if case.spec.mapped else "_aligned"  # without a layout only the noisy poses know the frame
    figures = record["figures"]
    own = {"case": case.name, "gross": figures[f"gross{frame}"], "median_px": figures[f"median_px{frame}"]}
    return {**record, **own}


def _line(case: Case, records: Sequence[Record]) -> tuple[str, ...]:
    goal = case.goal

    def told(name: str) -> list[float]:
        return [float(v) for r in records if (v := r["figures"].get(name)) is not None]

    worst = max(records, key=lambda r: (r["gross"], r["median_px"]))
    return (
        case.name,
        spread([r["gross"] for r in records], max, percent, goal.gross),
        spread(told("gross_among_sure") if case.spec.mapped else [], max, percent, goal.gross_among_sure),
        spread([r["median_px"] for r in records], max, number, goal.median_px),
        spread(told("rod_state_accuracy"), min, percent, goal.rods),
        spread(told("sure"), min, percent, goal.sure),
        spread(told("within_3_sigma"), min, percent, 0.98),
        str(worst["seed"]),
        spread([r["seconds"] for r in records], max, number),
    )
