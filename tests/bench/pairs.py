"""Two inspections of one pond: are planted changes found, is nothing made up, and does a pair that cannot be compared
say why.

Writes docs/pairs.md. Both inspections of a pair have poses, noise, water and a palette of their own; the second one's
pond is otherwise in so many rods. They are corrected in this process, stored, and compared by what `GET /api/compare`
answers.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from pondwatch.basestation.bundle import Bundle, Row
from pondwatch.basestation.correcting import correct_bundle
from pondwatch.core.values import Image
from pondwatch.jobs import comparing
from pondwatch.jobs.views import Json
from pondwatch.simulator.bundle import write_bundle
from pondwatch.simulator.simulation import Simulation
from pondwatch.simulator.spec import SimulationSpec
from pondwatch.store.store import Store
from tests.fakes.inspections import stored

from .pages import ROOT, number, table, write_page
from .ponds import CORE, SIMULATOR, Kept, Record

FIRST_SEED = 8101
SMALL = SimulationSpec(margin_px=24.0)
LARGE = replace(SMALL, snapshots=620, coverage=5.2)
CLEAR: Mapping[str, Any] = {}
OTHER: Mapping[str, Any] = {"noise": "drift", "noise_pitch": 0.48, "noise_theta_rad": 0.12}
MURKY: Mapping[str, Any] = {"water": "murky", "quality": 85}
PLANTED = (0, 1, 5, 20)
_PX = ("residual, px", "p95, px")
HEADS = ("rods", "water", "planted", "seen in both", "listed", "as what they are", "made up", "unsure", *_PX)
EXPLAINED = """\
Every row is a pair of inspections of one simulated pond; rows of one water share the first of the two. Both have
paths, noisy poses, water, light and colours of their own; *planted* is how many rods are filled otherwise in the
second. *Seen in both* says how many of those both inspections read, *listed* how many of these the comparison names,
*as what they are* how many with the right change (filled, emptied, partly). *Made up* is rods listed though nothing
of them changed, *unsure* rods that both saw and of which nothing is claimed. The residual is that between the two
mosaics, measured at the rods."""


@dataclass(frozen=True, slots=True)
class Pair:
    """What to simulate: a pond, its two inspections, and how many rods change between them."""

    pond: SimulationSpec
    planted: int
    words: str
    base: Mapping[str, Any]
    with_: Mapping[str, Any]
    seed: int = FIRST_SEED


@dataclass(frozen=True, slots=True)
class Found:
    """One row of the table. told: what the program answers."""

    pair: Pair
    rods: int
    in_both: int
    listed: int
    as_it_is: int
    made_up: int
    unsure: int
    told: Json


_WAYS = (
    (SMALL, "clear, clear", CLEAR, OTHER),
    (SMALL, "clear, murky", CLEAR, MURKY),
    (SMALL, "murky, murky", MURKY, MURKY),
    (LARGE, "clear, clear", CLEAR, OTHER),
    (LARGE, "murky, clear", MURKY, OTHER),
)
PAIRS = tuple(
    Pair(pond, planted, words, base, with_, FIRST_SEED + 10 * way)
    for way, (pond, words, base, with_) in enumerate(_WAYS)
    for planted in PLANTED
)


@dataclass(frozen=True, slots=True, eq=False)
class Inspected:
    """A stored inspection and its truth: rod to fill."""

    session: str
    fills: dict[str, float]


@dataclass(frozen=True, slots=True, eq=False)
class Twist:
    """What is done to an inspection before and after its correction."""

    keep: Callable[[Row], bool] = lambda _row: True
    shift_m: tuple[float, float] = (0.0, 0.0)
    draw: Callable[[Image], Image] = lambda image: image


def run() -> None:
    """Measure what is not measured yet, and write all of it down."""
    kept = Kept("pairs", code=(CORE, SIMULATOR))
    done = {record["case"]: record for record in kept.records()}
    with tempfile.TemporaryDirectory() as folder, Store(Path(folder), f"sqlite:///{folder}/t.sqlite") as store:
        bases = dict[int, Inspected]()
        for n, pair in enumerate(PAIRS):
            if _case(pair) not in done:
                if pair.seed not in bases:
                    bases[pair.seed] = inspect(store, replace(pair.pond, pond_seed=pair.seed, **pair.base), pair.seed)
                _keep(kept, done, _record(measured(store, pair, bases[pair.seed], pair.seed + 1 + n)))
        for name in REFUSED:
            if name not in done:
                answer, said = _refusal(store, name)
                _keep(kept, done, {"case": name, "answer": answer, "said": said})
    rows = [done[_case(pair)] for pair in PAIRS]
    parts = [
        EXPLAINED,
        table(HEADS, [[number(row[head]) if head in _PX else str(row[head]) for head in HEADS] for row in rows]),
        _sum(rows),
        "## Pairs that cannot be compared",
        table(("pair", "answer", "what it says"), [(n, done[n]["answer"], done[n]["said"]) for n in REFUSED]),
        "Made by `python -m tests.bench pairs`, which goes on where it was cut off.",
    ]
    page = write_page("pairs.md", "Two inspections of one pond", parts)
    print(f"{_sum(rows)}\nwritten to {page.relative_to(ROOT)}")


def _case(pair: Pair) -> str:
    """What a pair is called among the kept records."""
    return f"{pair.seed}, {pair.words}, {pair.planted} planted"


def _keep(kept: Kept, done: dict[str, Record], record: Record) -> None:
    kept.add(record)
    done[record["case"]] = record
    print(" | ".join(str(value) for value in record.values()), flush=True)


def measured(store: Store, pair: Pair, base: Inspected, seed: int) -> Found:
    """Simulate and correct the second inspection of a pair, and compare the two."""
    with_ = inspect(store, replace(pair.pond, pond_seed=pair.seed, changed=pair.planted, **pair.with_), seed)
    found = comparing.find(store, base.session, with_.session)
    told = comparing.json_of(found)
    changed = {rod for rod, fill in base.fills.items() if with_.fills[rod] != fill}
    assert len(changed) == pair.planted
    seen = {rod.rod_id for rod in found.every() if not comparing.is_unseen(rod)}
    named = {rod["rod_id"]: rod["change"] for rod in told["rods"]}
    listed = changed & seen & named.keys()
    return Found(
        pair,
        len(base.fills),
        len(changed & seen),
        len(listed),
        sum(named[rod] == _change(with_.fills[rod]) for rod in listed),
        len(named.keys() - changed),
        len([rod for rod in told["not_comparable"] if rod["rod_id"] in seen]),
        told,
    )


def inspect(store: Store, spec: SimulationSpec, seed: int, twist: Twist | None = None) -> Inspected:
    """Simulate an inspection, correct it, and store it as finished."""
    twist = twist or Twist()
    simulation = Simulation(spec, seed)
    simulation.poses[:, :2] += twist.shift_m
    with tempfile.TemporaryDirectory() as folder:
        write_bundle(simulation, Path(folder) / "bundle")
        with Bundle(Path(folder) / "bundle") as bundle:
            bundle.rows = [row for row in bundle.rows if twist.keep(row)]
            corrected = correct_bundle(bundle)
    session = stored(store, simulation.inspection, corrected.rods, twist.draw(corrected.mosaic), 1000 * seed)
    rods = simulation.inspection.pond.rods
    return Inspected(session, {rod.id: float(f) for rod, f in zip(rods, simulation.truth_fills, strict=True)})


def _change(fill: float) -> str:
    return {0.0: "emptied", 1.0: "filled"}.get(fill, "partly")


def _record(row: Found) -> Record:
    """A row of the table, by its heads."""
    residual = row.told["residual"]
    cells = (row.rods, row.pair.words, row.pair.planted, row.in_both, row.listed, row.as_it_is, row.made_up, row.unsure)
    return {"case": _case(row.pair)} | dict(
        zip(HEADS, (*cells, residual["median_px"], residual["p95_px"]), strict=True)
    )


def _sum(rows: Sequence[Record]) -> str:
    both, listed, made_up, rods = (sum(r[head] for r in rows) for head in ("seen in both", "listed", "made up", "rods"))
    most = max(r["made up"] * 600 / r["rods"] for r in rows)
    worst = max(float(r["residual, px"] or np.inf) for r in rows)
    return (
        f"{len(rows)} pairs: {listed} of {both} changed rods that both inspections saw are listed (recall "
        f"{listed / max(1, both):.3f}); made up: {made_up} in {rods} rods, at most {most:.1f} in 600; the greatest "
        f"median residual is {number(worst)} px."
    )


def _refusal(store: Store, name: str) -> tuple[str, str]:
    """What the program answers to a pair that cannot be compared: the reason, and its sentence."""
    (spec, twist), (other, otherwise) = REFUSED[name]
    seed = FIRST_SEED + 100 + 2 * list(REFUSED).index(name)
    base, with_ = inspect(store, spec, seed, twist), inspect(store, other, seed + 1, otherwise)
    told = comparing.json_of(comparing.find(store, base.session, with_.session))
    listed = len(told["rods"])
    said = "comparable" if told["reason"] is None else str(told["reason"])
    return f"`{said}`", f"{told['sentence']} {'' if not listed else f'{listed} rods are listed.'}".strip()


_ONE = replace(SMALL, pond_seed=FIRST_SEED)
_INNER = replace(_ONE, margin_px=150.0, missing=0.0, snapshots=221)
_WEST = 0.4 * SMALL.pond_size_m[0]
_PLAIN = Twist()
REFUSED: Mapping[str, tuple[tuple[SimulationSpec, Twist], tuple[SimulationSpec, Twist]]] = {
    "an unmapped pond": ((_ONE, _PLAIN), (replace(SMALL, mapped=False, snapshots=40), _PLAIN)),
    "another pond": ((_ONE, _PLAIN), (replace(SMALL, pond_seed=FIRST_SEED + 50, lattice="square"), _PLAIN)),
    "one saw the west alone, the other the east": (
        (_ONE, Twist(keep=lambda row: row.pose[0] < _WEST - 0.05)),
        (_ONE, Twist(keep=lambda row: row.pose[0] > _WEST + 0.05)),
    ),
    "a mosaic that lies 5 px off": (
        (_ONE, _PLAIN),
        (_ONE, Twist(draw=lambda image: np.roll(image, 5, axis=1))),
    ),
    "a localisation that is off by a lattice step, away from every edge": (
        (_INNER, _PLAIN),
        (_INNER, Twist(shift_m=(_INNER.pitch_m, 0.0))),
    ),
}
