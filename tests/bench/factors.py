"""What makes a session hard: one property of a base case changed at a time, several ponds each.

Writes docs/factors.md and its plots. Ponds run in this process (`ponds.py`) and are kept as they come, the first pond
of every case before the second of any: cut off, it goes on where it was; `--quick` runs one pond a case, none large.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from pondwatch.core.values import Camera
from pondwatch.simulator.spec import SimulationSpec

from .pages import ROOT, number, percent, spread, table, write_page
from .plots import Axis, Panel, write_plot
from .ponds import Kept, Record, measured, pooled

FIRST_SEED = 8001
BASE = SimulationSpec(margin_px=48.0)
MOST = 2000  # snapshots of all ponds of a case together, where it has more than one
QUICK = 500  # snapshots of a pond, at most, where it must be quick
PICTURES = ROOT / "docs" / "pictures"
EXPLAINED = """\
The base case is a pond of {snapshots} snapshots that look {coverage} times at a point of its floor: a hexagonal
lattice, pitch {pitch_px:.0f} px, colours by chance, clear water, 3 % of the rods missing, JPEG {quality}; poses are
off by {noise_pitch} pitch in x and in y and by {noise_theta_rad} rad. Each row changes one property of it; where the
heading is unknown, positions are known to 0.1 pitch. A figure is the median over the row's ponds (from seed {seed},
every one another pond), in brackets the worst. *Over the bound* is the error of a placed snapshot as a multiple of
its Cramér-Rao bound: the least error that its own pixels allow to a method that knows the floor, the light and the
noise (`tests/bench/bound.py`), so that an estimate at the bound has a root mean square of 1. Gross is over 5 px. What
each failing case would need to be solvable is told in
[method](method.md#what-cannot-be-solved-and-what-the-pond-would-need)."""


@dataclass(frozen=True, slots=True)
class Factor:
    """A property, and what it is set to: a short name for the plot's axis, and the spec's options."""

    name: str
    levels: tuple[tuple[str, dict[str, Any]], ...]


def _numbers(option: str, values: Sequence[float]) -> tuple[tuple[str, dict[str, Any]], ...]:
    return tuple((f"{value:g}", {option: value}) for value in values)


FACTORS = (
    Factor("pose noise, pitch", _numbers("noise_pitch", (0.1, 0.2, 0.32, 0.48, 0.64, 0.8, 0.96, 1.2))),
    Factor(
        "heading noise, rad",
        (
            *_numbers("noise_theta_rad", (0.05, 0.1, 0.2, 0.4, 0.8)),
            ("unknown", {"heading_known": False, "theta_range_rad": np.pi, "noise_pitch": 0.1}),
        ),
    ),
    Factor("water", (("clear", {}), ("murky", {"water": "murky", "quality": 85}))),
    Factor("looks at a point", _numbers("coverage", (1, 1.5, 2, 3, 4, 6, 8))),
    Factor("snapshots", tuple((str(n), {"snapshots": n}) for n in (30, 60, 120, 221, 500, 1000, 2000, 5000))),
    Factor("lattice", (("hexagonal", {}), ("square", {"lattice": "square", "pitch_px": 52.0}))),
    Factor("rods missing", tuple((f"{100 * v:g} %", {"missing": v}) for v in (0, 0.03, 0.1, 0.25, 0.5))),
    Factor("pitch, px", _numbers("pitch_px", (24, 36, 45, 60, 80))),
    Factor(
        "rods, radii in pitches",
        (
            ("0.36 and 0.23", {}),
            ("thin ring", {"inner_radius_pitch": 0.31}),
            ("thick ring", {"inner_radius_pitch": 0.12}),
            ("small", {"outer_radius_pitch": 0.25, "inner_radius_pitch": 0.15}),
            ("large", {"outer_radius_pitch": 0.47, "inner_radius_pitch": 0.3}),
        ),
    ),
    Factor("radii in the layout, of the true", _numbers("layout_radius", (0.9, 0.95, 1, 1.05, 1.1))),
    Factor("metres in a pixel as stated, of the true", _numbers("stated_scale", (0.97, 0.99, 1, 1.01, 1.03))),
    Factor("noise as stated, of the true (0: nothing is said)", _numbers("claim", (0, 0.3, 1, 3))),
    Factor(
        "camera",
        (
            ("160 x 110", {}),
            ("96 x 66", {"camera": Camera(96, 66, 0.0005625 * 160 / 96), "pitch_px": 36.0}),
            ("128 x 128", {"camera": Camera(128, 128, 0.0005625)}),
            ("320 x 220", {"camera": Camera(320, 220, 0.0005625 / 2), "pitch_px": 120.0}),
            ("grey", {"grey": True}),
            ("JPEG 60", {"quality": 60}),
        ),
    ),
    Factor("filling", tuple((v, {"fills": v}) for v in ("quarters", "wedges", "striped", "empty", "full"))),
)


def run(seeds: int = 3, quick: bool = False) -> None:
    """Measure what is not yet there, and write down."""
    kept = Kept("factors")
    for name, spec, seed in _wanted(seeds, quick):
        if not any((r["case"], r["seed"]) == (name, seed) for r in kept.records()):
            record = measured(spec, seed)
            kept.add({"case": name, **record})
            told = record["figures"]
            print(f"{name}, seed {seed}: {told['gross']:.3f} {told['median_px']:.4f}", flush=True)
    write(kept.records())


def _wanted(seeds: int, quick: bool) -> Iterator[tuple[str, SimulationSpec, int]]:
    """Every case with every seed, by seed first; large ponds last, and fewer of them."""
    every = {name: spec for factor in FACTORS for name, spec in _cases(factor)}
    small_first = sorted(every.items(), key=lambda one: one[1].snapshots > QUICK)
    for k in range(1 if quick else seeds):
        for name, spec in small_first:
            few = k == 0 or spec.snapshots * (k + 1) <= max(MOST, BASE.snapshots * seeds)
            if few and not (quick and spec.snapshots > QUICK):
                yield name, spec, FIRST_SEED + k


def _cases(factor: Factor) -> Iterator[tuple[str, SimulationSpec]]:
    """What is the base case again has the base case's name."""
    for level, options in factor.levels:
        spec = replace(BASE, **options)
        yield "base" if spec == BASE else f"{factor.name}: {level}", spec


def write(records: Sequence[Record]) -> None:
    """The page and its plots, of what is there."""
    by_case: dict[str, list[Record]] = {}
    for record in records:
        by_case.setdefault(record["case"], []).append(record)
    PICTURES.mkdir(exist_ok=True)
    write_plot(PICTURES / "factors-gross.svg", list(_panels(by_case, SHARES)), PERCENT)
    write_plot(PICTURES / "factors-error.svg", list(_panels(by_case, ERRORS)), PIXELS)
    parts = [
        EXPLAINED.format(**asdict(BASE), seed=FIRST_SEED),
        "![Share wrong and share placed, by property](pictures/factors-gross.svg)",
        "![Median error in px, by property](pictures/factors-error.svg)",
        *(_section(factor, by_case) for factor in FACTORS),
        f"{len(records)} ponds, {sum(r['figures']['snapshots'] for r in records)} snapshots. Made by "
        "`python -m tests.bench factors`.",
    ]
    page = write_page("factors.md", "What makes a session hard", parts)
    print(f"written to {page.relative_to(ROOT)}")


def _section(factor: Factor, by_case: dict[str, list[Record]]) -> str:
    head = ("", "ponds", "`identity`, median px", "gross", "gross among `placed`", "`placed`", "median px")
    more = ("within 3 sigma", "rod states right", "over the bound: median", "95 %", "CPU s")
    body = [
        (level, *_line(by_case[name]))
        for (level, _), (name, _) in zip(factor.levels, _cases(factor), strict=True)
        if name in by_case
    ]
    return f"## {factor.name.capitalize()}\n\n{table((*head, *more), body)}"


def _line(records: Sequence[Record]) -> tuple[str, ...]:
    def told(name: str) -> list[float]:
        return [float(v) for r in records if (v := r["figures"].get(name)) is not None]

    return (
        str(len(records)),
        number(float(np.median([r["identity"]["median_px"] for r in records]))),
        spread(told("gross"), max, percent),
        spread(told("gross_among_sure"), max, percent),
        spread(told("sure"), min, percent),
        spread(told("median_px"), max, number),
        spread(told("within_3_sigma"), min, percent),
        spread(told("rod_state_accuracy"), min, percent),
        number(pooled(records, 0.5), 2),
        number(pooled(records, 0.95), 2),
        spread([r["seconds"] for r in records], max, number),
    )


SHARES = {
    "gross errors": lambda r: r["figures"]["gross"],
    "gross among placed": lambda r: r["figures"]["gross_among_sure"],
    "not placed": lambda r: 1 - r["figures"]["sure"],
}
ERRORS = {
    "as the poses came": lambda r: r["identity"]["median_px"],
    "corrected": lambda r: r["figures"]["median_px"],
}
PERCENT = Axis(0, 1, (0, 0.25, 0.5, 0.75, 1), lambda v: f"{100 * v:.0f} %")
PIXELS = Axis(0.001, 100, (0.001, 0.01, 0.1, 1, 10, 100), lambda v: f"{v:g} px", logarithmic=True)


def _panels(by_case: dict[str, list[Record]], lines: dict[str, Any]) -> Iterator[Panel]:
    for factor in FACTORS:
        cases = [by_case.get(name, []) for name, _ in _cases(factor)]
        drawn = {
            name: [[float(v) for r in records if (v := value(r)) is not None] for records in cases]
            for name, value in lines.items()
        }
        yield Panel(factor.name, [level for level, _ in factor.levels], drawn)
