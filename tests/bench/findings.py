"""Condition and position: what is found of things and stains on the floor and of rods off their place, and what is made
up on ponds where all is as it should be.

Writes docs/findings.md. Every inspection is simulated, corrected in this process as `pondwatch correct` does it, and
held against what was put there.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
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
from .ponds import CORE, SIMULATOR, Kept, Record

FIRST_SEED = 19101
WATERS = ("clear", "murky")
SIZES_PX = (2.0, 4.0, 6.0, 10.0, 16.0)
STAINS_PX = (24.0, 40.0)
OFFSETS_PX = (0.5, 1.0, 2.0, 4.0, 8.0)
THINGS, STAINS, RODS = 8, 4, 8
SEEDS, CLEAN = 2, 7
NEAR_PX = 4.0
SPEC = SimulationSpec(margin_px=24.0)
EXPLAINED = """\
Every inspection is simulated, of a pond of its own (221 snapshots, about 180 rods); a row holds several. *Seen* counts
what lies on floor that three snapshots show; *found* how many of these are among the findings, *as what they are* how
many by the right name. *Off, px* is the median distance between the place that is told and the true one; *size* the
median of told over true diameter. *Made up* is findings, of any kind, that lie a pitch and more from all that was put
there. An object differs from all that the pond is made of by more than 60 grey levels in one colour at least, before
the water. Made by `python -m tests.bench findings`, which goes on where it was cut off; nothing here was used to set a
limit."""


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


def run(seeds: int = SEEDS) -> None:
    """Measure what is not measured yet, and write all of it down."""
    kept = Kept("findings", code=(CORE, SIMULATOR))
    done = {record["case"]: record for record in kept.records()}
    for case in cases(seeds):
        if case.name not in done:
            done[case.name] = measured(case)
            kept.add(done[case.name])
            print(done[case.name], flush=True)
    _write([done[case.name] for case in cases(seeds)])


@dataclass(frozen=True, slots=True)
class Case:
    """One inspection: which table it is of, what was put there in what size, and the water."""

    of: str  # things, rods or clean
    water: str
    spec: SimulationSpec
    seed: int

    @property
    def name(self) -> str:
        """What it is called among the kept records."""
        return f"{self.of}, {self.water}, {self.seed}"


def cases(seeds: int) -> list[Case]:
    """So many inspections of every kind, and `CLEAN` times as many where all is as it should be."""
    out = []
    for w, water in enumerate(WATERS):
        for seed in range(FIRST_SEED + 100 * w, FIRST_SEED + 100 * w + 1000 * seeds, 1000):
            for k, size in enumerate(SIZES_PX):
                spec = replace(SPEC, objects=THINGS, object_px=size, stains=STAINS, stain_px=STAINS_PX[k % 2])
                out.append(Case("things", water, _in(spec, water), seed + k))
            for k, off in enumerate(OFFSETS_PX):
                spec = replace(SPEC, displaced=RODS, displaced_px=off)
                out.append(Case("rods", water, _in(spec, water), seed + 20 + k))
            out += [Case("clean", water, _in(SPEC, water), seed + 40 + k) for k in range(CLEAN)]
    return out


def measured(case: Case) -> Record:
    """What one inspection found and missed."""
    looked = look_over(case.spec, case.seed)
    told: Record = {"case": case.name, "of": case.of, "water": case.water, "seconds": looked.seconds}
    told["findings"], told["made_up"] = len(looked.condition.findings), _made_up(looked)
    if case.of == "things":
        told |= {kind: asdict(things_of(looked, kind)) for kind in ("object", "stain")}
        told |= {"object_px": case.spec.object_px, "stain_px": case.spec.stain_px}
    if case.of == "rods":
        told |= {"rods": rods_of(looked), "displaced_px": case.spec.displaced_px}
    return told


def _in(spec: SimulationSpec, water: str) -> SimulationSpec:
    return replace(spec, water="murky", quality=85) if water == "murky" else spec


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
    return bool(count >= 3)


def _line(tallies: Sequence[Record]) -> tuple[str, ...]:
    """Tallies of one kind in several inspections, as one row."""
    counts = [sum(t[name] for t in tallies) for name in ("put", "seen", "found", "named")]
    middles = [[v for t in tallies for v in t[name]] for name in ("off_px", "size")]
    return (*map(str, counts), *(number(float(np.median(m)) if m else None, 2) for m in middles))


def rods_of(looked: Looked) -> Record:
    """What was found of the rods off their place; error_px: of each offset."""
    pond, m = looked.simulation.inspection.pond, looked.simulation.spec.camera.metres_per_pixel
    truth = {rod.id: off for rod, off in zip(pond.rods, looked.simulation.truth_offsets, strict=True) if off.any()}
    found = {f.rod_id: f for f in looked.condition.findings if f.kind is Kind.ROD_DISPLACED}
    offsets = looked.condition.offsets
    assert offsets is not None
    measured = {rod.id for rod, off in zip(pond.rods, offsets.offset_m, strict=True) if np.isfinite(off[0])}
    errors = [float(np.hypot(*(np.array(found[i].offset_m) - truth[i]))) / m for i in truth if i in found]
    counts = {"put": len(truth), "measured": len(truth.keys() & measured), "found": len(truth.keys() & found.keys())}
    return counts | {"made_up": len(found.keys() - truth.keys()), "error_px": errors}


def _rods_line(rods: Sequence[Record]) -> tuple[str, ...]:
    errors = [error for r in rods for error in r["error_px"]]
    counts = [sum(r[name] for r in rods) for name in ("put", "measured", "found", "made_up")]
    return (*map(str, counts), number(float(np.median(errors)) if errors else None, 2))


def _write(done: Sequence[Record]) -> None:
    head = ("water", "put", "seen", "found", "as what they are", "off, px", "size")
    of = {name: [r for r in done if r["of"] == name] for name in ("things", "rods", "clean")}
    objects, stains, rods, clean = list[Sequence[str]](), list[Sequence[str]](), list[Sequence[str]](), []
    for water in WATERS:
        for size in SIZES_PX:
            some = [r for r in of["things"] if (r["water"], r["object_px"]) == (water, size)]
            made_up = str(sum(r["made_up"] for r in some))
            objects.append((f"{size:g} px", water, *_line([r["object"] for r in some]), made_up))
        for size in STAINS_PX:
            some = [r["stain"] for r in of["things"] if (r["water"], r["stain_px"]) == (water, size)]
            stains.append((f"{size:g} px", water, *_line(some)))
        for off in OFFSETS_PX:
            here = [r["rods"] for r in of["rods"] if (r["water"], r["displaced_px"]) == (water, off)]
            rods.append((f"{off:g} px", water, *_rods_line(here)))
        still = [r for r in of["clean"] if r["water"] == water]
        clean.append((water, str(len(still)), str(sum(r["findings"] for r in still))))
    wrong = sum(r["findings"] for r in of["clean"]) / max(1, len(of["clean"]))
    seconds = float(np.median([r["seconds"] for r in done]))
    parts = [
        EXPLAINED,
        "## Objects, by diameter",
        table(("diameter", *head, "made up"), objects),
        "## Stains, by diameter",
        table(("diameter", *head), stains),
        "## Rods off their place, by how far",
        table(("offset", "water", "put", "measured", "found", "made up", "error, px"), rods),
        "## Ponds where all is as it should be",
        table(("water", "inspections", "findings"), clean),
        f"{number(wrong, 2)} false findings an inspection. Looking one over takes {number(seconds, 2)} s of CPU.",
    ]
    page = write_page("findings.md", "What is found on the floor", parts)
    print(f"written to {page.relative_to(ROOT)}")
