"""Condition and position: what is found of things and stains on the floor and of rods off their place, and what is made
up on ponds where all is as it should be.

Writes docs/findings.md. Every inspection is simulated, corrected in this process as `pondwatch correct` does it, and
held against what was put there.
"""

from __future__ import annotations

import tempfile
import time
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from pondwatch.basestation.bundle import Bundle
from pondwatch.basestation.correcting import correct_bundle, sure_looks
from pondwatch.core.findings import Condition, Finding, Kind, find
from pondwatch.core.values import Snapshot
from pondwatch.simulator.bundle import write_bundle
from pondwatch.simulator.simulation import Simulation
from pondwatch.simulator.spec import SimulationSpec
from pondwatch.simulator.things import Thing

from .pages import ROOT, number, table, write_page

FIRST_SEED = 9101
WATERS = ("clear", "murky")
SIZES_PX = (2.0, 4.0, 6.0, 10.0, 16.0)
STAINS_PX = (24.0, 40.0)
OFFSETS_PX = (0.5, 1.0, 2.0, 4.0, 8.0)
THINGS, STAINS, RODS = 8, 4, 8
CLEAN = 5
NEAR_PX = 4.0
SPEC = SimulationSpec(margin_px=24.0)
EXPLAINED = """\
Every row is one simulated inspection of a pond of its own (221 snapshots, about 180 rods). *Seen* counts what lies
on floor that three snapshots show; *found* how many of these are among the findings, *as what they are* how many by
the right name. *Off, px* is the median distance between the place that is told and the true one; *size* the median
of told over true diameter. *Made up* is findings, of any kind, that lie a pitch and more from all that was put
there. An object differs from all that the pond is made of by more than 60 grey levels in one colour at least,
before the water. Made by `python -m tests.bench findings`; nothing here was used to set a limit."""


@dataclass(slots=True)
class Tally:
    """What became of one kind of thing in one inspection."""

    put: int = 0
    seen: int = 0
    found: int = 0
    named: int = 0
    off_px: list[float] = field(default_factory=list)
    size: list[float] = field(default_factory=list)


@dataclass(frozen=True, slots=True, eq=False)
class Looked:
    """An inspection that was looked over. seconds: CPU."""

    simulation: Simulation
    condition: Condition
    looks: list[np.ndarray]
    seconds: float


def run(seeds: int = CLEAN) -> None:
    """Measure and write down."""
    objects, stains, rods, made_up = [], [], [], Counter[str]()
    inspections = Counter[str]()
    for w, water in enumerate(WATERS):
        for k, size in enumerate(SIZES_PX):
            spec = replace(SPEC, objects=THINGS, object_px=size, stains=STAINS, stain_px=STAINS_PX[k % 2])
            looked = look_over(_in(spec, water), FIRST_SEED + 100 * w + k)
            some, others = things_of(looked, "object"), things_of(looked, "stain")
            objects.append((f"{size:g} px", water, *_line(some), str(_made_up(looked))))
            stains.append((f"{spec.stain_px:g} px", water, *_line(others)))
            _tell(objects[-1], stains[-1])
        for k, off in enumerate(OFFSETS_PX):
            looked = look_over(
                _in(replace(SPEC, displaced=RODS, displaced_px=off), water), FIRST_SEED + 100 * w + 20 + k
            )
            rods.append((f"{off:g} px", water, *rods_of(looked)))
            _tell(rods[-1])
        for k in range(seeds):
            looked = look_over(_in(SPEC, water), FIRST_SEED + 100 * w + 40 + k)
            inspections[water] += 1
            made_up[water] += len(looked.condition.findings)
            _tell((water, str(len(looked.condition.findings)), number(looked.seconds)))
    _write(objects, stains, rods, [(w, inspections[w], made_up[w]) for w in WATERS])


def _in(spec: SimulationSpec, water: str) -> SimulationSpec:
    return replace(spec, water="murky", quality=85) if water == "murky" else spec


def _tell(*rows: Sequence[str]) -> None:
    for row in rows:
        print(" | ".join(row), flush=True)


def look_over(spec: SimulationSpec, seed: int) -> Looked:
    """Simulate, correct, and look over the floor."""
    simulation = Simulation(spec, seed)
    with tempfile.TemporaryDirectory() as folder:
        write_bundle(simulation, Path(folder) / "bundle")
        with Bundle(Path(folder) / "bundle") as bundle:
            corrected = correct_bundle(bundle)
            taken = {s.key: s for _, s in bundle.snapshots(bundle.rows) if isinstance(s, Snapshot)}
    looks = sure_looks(taken, {p.key: p for p in corrected.poses})
    started = time.process_time()
    condition = find(looks, spec.camera, simulation.inspection.pond, corrected.rods)
    return Looked(simulation, condition, [look.pose_pond for look in looks], time.process_time() - started)


def things_of(looked: Looked, kind: str) -> Tally:
    """What was found of the objects, or of the stains."""
    tally, m = Tally(), looked.simulation.spec.camera.metres_per_pixel
    name = Kind.FOREIGN_OBJECT if kind == "object" else Kind.STAIN
    for thing in looked.simulation.truth_things:
        if thing.kind == kind:
            tally.put += 1
            tally.seen += _is_seen(looked, thing)
            near = [f for f in looked.condition.findings if f.kind is not Kind.ROD_DISPLACED and _is_at(f, thing, m)]
            if near and _is_seen(looked, thing):
                best = near[0]
                tally.found += 1
                tally.named += best.kind is name
                tally.off_px.append(float(np.hypot(best.x_m - thing.x_m, best.y_m - thing.y_m)) / m)
                tally.size.append(best.size_m / thing.diameter_m)
    return tally


def _made_up(looked: Looked) -> int:
    """Findings that lie a pitch and more from everything that was put there."""
    apart = looked.simulation.spec.pitch_m
    return sum(
        all(np.hypot(f.x_m - t.x_m, f.y_m - t.y_m) > apart + t.diameter_m / 2 for t in looked.simulation.truth_things)
        for f in looked.condition.findings
    )


def _is_at(finding: Finding, thing: Thing, metres_per_pixel: float) -> bool:
    reach = max(0.6 * thing.diameter_m * thing.stretch**0.5, NEAR_PX * metres_per_pixel)
    return bool(np.hypot(finding.x_m - thing.x_m, finding.y_m - thing.y_m) < reach)


def _is_seen(looked: Looked, thing: Thing) -> bool:
    """Whether three snapshots show its middle, by where they truly were."""
    camera, count = looked.simulation.spec.camera, 0
    for x, y, theta in looked.looks:
        c, s = np.cos(theta), np.sin(theta)
        u = (c * (thing.x_m - x) + s * (thing.y_m - y)) / camera.metres_per_pixel
        v = (-s * (thing.x_m - x) + c * (thing.y_m - y)) / camera.metres_per_pixel
        count += abs(u) < camera.width_px / 2 - 3 and abs(v) < camera.height_px / 2 - 3
    return count >= 3


def _line(tally: Tally) -> tuple[str, ...]:
    counts = (tally.put, tally.seen, tally.found, tally.named)
    off = float(np.median(tally.off_px)) if tally.off_px else None
    size = float(np.median(tally.size)) if tally.size else None
    return (*map(str, counts), number(off, 2), number(size, 2))


def rods_of(looked: Looked) -> tuple[str, ...]:
    """What was found of the rods off their place: put, measured, found, made up, and the error of the offset."""
    pond, m = looked.simulation.inspection.pond, looked.simulation.spec.camera.metres_per_pixel
    truth = {rod.id: off for rod, off in zip(pond.rods, looked.simulation.truth_offsets, strict=True) if off.any()}
    found = {f.rod_id: f for f in looked.condition.findings if f.kind is Kind.ROD_DISPLACED}
    offsets = looked.condition.offsets
    assert offsets is not None
    measured = {rod.id for rod, off in zip(pond.rods, offsets.offset_m, strict=True) if np.isfinite(off[0])}
    errors = [float(np.hypot(*(np.array(found[i].offset_m) - truth[i]))) / m for i in truth if i in found]
    error = float(np.median(errors)) if errors else None
    known = len(truth.keys() & measured)
    hits = len(truth.keys() & found.keys())
    return (*map(str, (len(truth), known, hits, len(found.keys() - truth.keys()))), number(error, 2))


def _write(
    objects: Iterable[Sequence[str]], stains: Iterable[Sequence[str]], rods: Iterable[Sequence[str]],
    clean: Sequence[tuple[str, int, int]],
) -> None:  # fmt: skip
    head = ("water", "put", "seen", "found", "as what they are", "off, px", "size")
    wrong = sum(n for *_, n in clean) / max(1, sum(n for _, n, _ in clean))
    parts = [
        EXPLAINED,
        "## Objects, by diameter",
        table(("diameter", *head, "made up"), objects),
        "## Stains, by diameter",
        table(("diameter", *head), stains),
        "## Rods off their place, by how far",
        table(("offset", "water", "put", "measured", "found", "made up", "error, px"), rods),
        "## Ponds where all is as it should be",
        table(("water", "inspections", "findings"), [(w, str(n), str(f)) for w, n, f in clean]),
        f"{number(wrong, 2)} false findings an inspection.",
    ]
    page = write_page("findings.md", "What is found on the floor", parts)
    print(f"written to {page.relative_to(ROOT)}")
