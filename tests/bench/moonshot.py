"""No jump in 100,000 snapshots: ponds by chance at up to half a pitch of noise, counted until told to stop.

Writes docs/moonshot.md. Each pond is kept as it comes (`ponds.py`), so it goes on where it was, in as many runs as it
takes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from itertools import pairwise
from typing import Any

import numpy as np

from pondwatch.simulator.spec import SimulationSpec

from .pages import ROOT, number, percent, table, write_page
from .ponds import Kept, Record, measured, pooled

GOAL = 100_000
FIRST_SEED = 20_001
BANDS = (0.1, 0.2, 0.3, 0.4, 0.5)  # of the pose noise, pitch
TIMES_BOUND = 3.0
TELLING = ("noise_pitch", "noise", "coverage", "lattice", "fills", "path", "water")
EXPLAINED = """\
Every pond is another one by chance: pose noise from 0.1 to 0.5 of the pitch, independent or drifting, 0.05 to 0.15
rad of heading; hexagonal or square, turned, pitch 46 to 66 px, up to 10 % of the rods missing, filled by quarters or
wedges; 4.5 to 8 looks at a point, {snapshots} snapshots, JPEG 85 to 95; one pond in five murky. A *jump* is an error
over half a pitch; errors over 5 px are counted too. *Over the bound*: the error of a placed snapshot as a multiple of
its Cramér-Rao bound, on {bounds} of them a pond, see [what makes a session hard](factors.md)."""
BOUNDS = 6


def spec_of(seed: int) -> SimulationSpec:
    """The pond that a seed gives."""
    rng = np.random.default_rng([seed, 31])
    options: dict[str, Any] = {
        "noise_pitch": round(rng.uniform(BANDS[0], BANDS[-1] - 0.001), 3),
        "noise_theta_rad": round(rng.uniform(0.05, 0.15), 3),
        "noise": str(rng.choice(["independent", "independent", "drift"])),
        "lattice": str(rng.choice(["hexagonal", "square"])),
        "lattice_angle_rad": round(rng.uniform(-0.5, 0.5), 3),
        "pitch_px": round(rng.uniform(46, 66), 1),
        "missing": round(rng.uniform(0, 0.1), 3),
        "fills": str(rng.choice(["quarters", "wedges"])),
        "coverage": round(rng.uniform(4.5, 8), 2),
        "path": str(rng.choice(["uniform", "smooth", "sweep"])),
        "water": str(rng.choice(["clear", "murky"], p=[0.8, 0.2])),
        "quality": int(rng.integers(85, 96)),
    }
    return SimulationSpec(margin_px=48.0, **options)


def run(snapshots: int = GOAL) -> None:
    """Go on until so many snapshots are counted, and write down."""
    kept = Kept("moonshot")
    records = kept.records()
    done, seeds = sum(r["jumps"]["snapshots"] for r in records), {r["seed"] for r in records}
    seed = FIRST_SEED
    while done < snapshots:
        if seed not in seeds:
            record = measured(spec_of(seed), seed, bounds=BOUNDS)
            kept.add(record)
            done += record["jumps"]["snapshots"]
            print(f"{done} snapshots; seed {seed}: {record['jumps']}", flush=True)
        seed += 1
    write(kept.records())


def write(records: Sequence[Record]) -> None:
    """The page, of what is there."""
    snapshots = sum(r["jumps"]["snapshots"] for r in records)
    parts = [
        EXPLAINED.format(snapshots=SimulationSpec().snapshots, bounds=BOUNDS),
        f"**{snapshots} snapshots of {len(records)} ponds were counted; the goal is {GOAL}.** {_verdict(records)}",
        table(HEAD, [_line(name, some) for name, some in _groups(records) if some]),
        "## Ponds with a gross error among `placed`\n\n" + _worst(records),
        "Made by `python -m tests.bench moonshot --snapshots N`.",
    ]
    page = write_page("moonshot.md", "How far from never a jump", parts)
    print(f"written to {page.relative_to(ROOT)}")


def _verdict(records: Sequence[Record]) -> str:
    jumped, sure = _total(records, "half_pitch_placed"), _total(records, "placed")
    near = [v for r in records for v in r["over_bound"]]
    within = percent(float(np.mean(np.array(near) <= TIMES_BOUND))) if near else "-"
    limit = f"; with none seen, fewer than {3 / max(sure, 1):.1e} at 95 % confidence" if not jumped else ""
    return (
        f"Among the {sure} that were called `placed`, {jumped} lie over half a pitch off{limit}. Of {len(near)} errors "
        f"{within} are within {TIMES_BOUND:g} times their bound."
    )


HEAD = ("", "ponds", "snapshots", "`placed`", "jumps", "jumps among `placed`", "over 5 px", "over 5 px among `placed`",
        "over the bound: median", "90 %", "99 %")  # fmt: skip


def _groups(records: Sequence[Record]) -> list[tuple[str, list[Record]]]:
    specs = {r["seed"]: spec_of(r["seed"]) for r in records}
    bands = [
        (f"noise {a:g} to {b:g} pitch", [r for r in records if a <= specs[r["seed"]].noise_pitch < b])
        for a, b in pairwise(BANDS)
    ]
    waters = [(f"{w} water", [r for r in records if specs[r["seed"]].water == w]) for w in ("clear", "murky")]
    return [("all", list(records)), *bands, *waters]


def _line(name: str, records: Sequence[Record]) -> tuple[str, ...]:
    snapshots = _total(records, "snapshots")
    counts = (str(_total(records, key)) for key in ("half_pitch", "half_pitch_placed", "gross", "gross_placed"))
    over = (number(pooled(records, share)) for share in (0.5, 0.9, 0.99))
    return name, str(len(records)), str(snapshots), percent(_total(records, "placed") / snapshots), *counts, *over


def _worst(records: Sequence[Record]) -> str:
    found = sorted((r for r in records if r["jumps"]["gross_placed"]), key=lambda r: -r["jumps"]["gross_placed"])
    if not found:
        return "None."
    body = []
    for record in found[:20]:
        spec, jumps = asdict(spec_of(record["seed"])), record["jumps"]
        counts = (str(jumps[key]) for key in ("gross_placed", "half_pitch_placed", "placed"))
        body.append((str(record["seed"]), *counts, *(str(spec[name]) for name in TELLING)))
    return table(("seed", "over 5 px", "jumps", "of", *TELLING), body)


def _total(records: Sequence[Record], key: str) -> int:
    return sum(int(r["jumps"][key]) for r in records)
