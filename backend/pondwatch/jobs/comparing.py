"""Two inspections beside each other, as the API tells it: JSON and CSV of what `core.compare` finds."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from sqlalchemy import Connection

from pondwatch.core.compare import Change, Comparison, RodChange, Seen, compare, probability_of_change
from pondwatch.core.pond import neighbour_steps
from pondwatch.core.values import Float, RodReading, RodState
from pondwatch.store import ponds, registrations, sessions, trends
from pondwatch.store.clock import rfc3339
from pondwatch.store.sessions import Session, State
from pondwatch.store.store import Store

from . import registering
from .views import Json, metres_per_pixel

LAST = "last"
COLUMNS = (
    "rod_id", "change", "word", "reason", "confidence", "p_changed", "residual_px", "residual_mm",
    "base_state", "base_fill", "base_confidence", "base_views",
    "with_state", "with_fill", "with_confidence", "with_views", "counterpart", "x_m", "y_m",
)  # fmt: skip
SORTS = ("layout", "rod_id", "change", "confidence", "residual")
_WORDS = {
    None: "The two can be compared.",
    "no_layout": "One of the two has no layout, so there are no rods to compare.",
    "other_layout": "The two have no rod in common, or too few: they are of other ponds, or their layouts differ.",
    "nothing_seen": "No rod was seen in both.",
    "residual": "The two mosaics do not lie on each other; no difference is claimed.",
    "unmeasured": "Whether the two mosaics lie on each other is known to a pixel at too few rods: their rings are not "
    "found where the layout has them, or show too faintly. No difference is claimed.",
    "shifted": "The states agree far better one lattice step away: one of the two lies wrong by a step. No difference "
    "is claimed.",
}


_STATES = {state.value: state for state in RodState}


@dataclass(frozen=True, slots=True, eq=False)
class Side:
    """One inspection as it is compared: rods by id, in the layout's order."""

    session: Session
    rods: Mapping[str, Seen]


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """A comparison with what it is of. pixel_m: a raster pixel of the coarser mosaic."""

    base: Side
    with_: Side
    comparison: Comparison
    pixel_m: float

    def every(self, sort: str = "layout", descending: bool = False) -> list[RodChange]:
        """All rods of both, in an order of `SORTS`."""
        keys: dict[str, Any] = {
            "rod_id": lambda r: r.rod_id,
            "change": lambda r: (list(Change).index(r.change), r.rod_id),
            "confidence": lambda r: r.confidence,
            "residual": lambda r: -1.0 if r.residual_m is None else r.residual_m,
        }
        rods = list(self.comparison.rods)
        if sort in keys:
            return sorted(rods, key=keys[sort], reverse=descending)
        return rods[::-1] if descending else rods


def find(store: Store, base: str, with_: str) -> Found:
    """Compare two sessions; `base` may be `last`: the finished inspection of the same pond before `with_`.

    Raises:
        Missing: there is no such session, or none before.
    """
    if base == LAST:
        base = store.read(lambda c: ponds.before(c, with_))
    sides = store.read(lambda c: (_side(store, c, base), _side(store, c, with_)))
    sides = _measured(store, sides[0]), _measured(store, sides[1])
    pixel_m = max(metres_per_pixel(side.session) for side in sides)
    steps = _steps(tuple(seen.place for seen in sides[0].rods.values()))
    return Found(*sides, compare(sides[0].rods, sides[1].rods, steps, pixel_m), pixel_m)


@lru_cache(maxsize=32)
def _steps(places: tuple[tuple[float, float], ...]) -> Float:
    return neighbour_steps(np.array(places).reshape(-1, 2))


def _side(store: Store, connection: Connection, session_id: str) -> Side:
    session = sessions.get(connection, session_id)
    measured = registrations.read(connection, session_id, session.revision)
    if session.state is not State.FINISHED or measured is None:
        return Side(session, _rods(connection, session_id, measured))
    key = session_id, session.revision
    return Side(session, store.sides.get(key, lambda: _rods(connection, session_id, measured)))


def _rods(connection: Connection, session_id: str, measured: Float | None) -> Mapping[str, Seen]:
    """Rods by id, in the layout's order."""
    rows = trends.side(connection, session_id)
    rods = {}
    for row, (offset, sigma_m) in zip(rows, _offsets(measured, len(rows)), strict=True):
        rod_id, x_m, y_m, inner_m, state, fill, confidence, views, conflicting = row
        reading = (
            RodReading(rod_id, RodState.UNSEEN, None, 0.0, 0)
            if state is None
            else RodReading(rod_id, _STATES[state], fill, confidence, views, conflicting)
        )
        rods[rod_id] = Seen(reading, (x_m, y_m), inner_m, offset, sigma_m)
    return rods


def _offsets(measured: Float | None, count: int) -> list[tuple[tuple[float, float] | None, float]]:
    """Of every rod its offset, None where there is none, and the sigma of that, m."""
    if measured is None or len(measured) != count:
        return [(None, 0.0)] * count
    return [(None, 0.0) if x != x else ((x, y), sigma) for x, y, sigma in measured.tolist()]


def _measured(store: Store, side: Side) -> Side:
    """With the registration, which is measured where it was not yet."""
    session = side.session
    if not side.rods or store.read(lambda c: registrations.read(c, session.id, session.revision)) is not None:
        return side
    registering.prepare(store, session.id)
    return store.read(lambda c: _side(store, c, session.id))


def json_of(found: Found, sort: str = "layout", descending: bool = False) -> Json:
    """The answer of `GET /api/compare`."""
    comparison, registration = found.comparison, found.comparison.registration
    every = found.every(sort, descending)
    told = [_rod(found, r) for r in every if r.change not in (Change.SAME, Change.NOT_COMPARABLE)]
    withheld = [_rod(found, r) for r in every if r.change is Change.NOT_COMPARABLE]
    unseen = [r for r in every if is_unseen(r)]
    refusal = None if comparison.refusal is None else comparison.refusal.value
    return {
        "base": _head(found.base),
        "with": _head(found.with_),
        "comparable": refusal is None,
        "reason": refusal,
        "sentence": _WORDS[refusal],
        "rods": told,
        "not_comparable": withheld,
        "counts": {change.value: comparison.count(change) for change in Change},
        "compared": len(every) - len(unseen),
        "not_observed": len(unseen),
        "only_in_base": sorted(comparison.only_in_base),
        "only_in_with": sorted(comparison.only_in_with),
        "residual": {
            "rods": registration.rods,
            "median_px": _px(found, registration.median_m),
            "p95_px": _px(found, registration.p95_m),
            "max_px": _px(found, registration.max_m),
            "median_mm": _mm(registration.median_m),
            "p95_mm": _mm(registration.p95_m),
            "max_mm": _mm(registration.max_m),
            "shift_mm": None if registration.shift_m is None else [_mm(v) for v in registration.shift_m],
            "sigma_px": _px(found, registration.sigma_m),
            "sigma_mm": _mm(registration.sigma_m),
            "limit_px": _px(found, registration.limit_m),
            "limit_mm": _mm(registration.limit_m),
        },
    }


def csv_of(found: Found, sort: str = "layout", descending: bool = False) -> bytes:
    """Every rod but those that are the same, as CSV."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for rod in found.every(sort, descending):
        if rod.change is not Change.SAME:
            told = _rod(found, rod)
            flat = told | {f"{side}_{k}": v for side in ("base", "with") for k, v in told[side].items()}
            writer.writerow(["" if flat[name] is None else flat[name] for name in COLUMNS])
    return text.getvalue().encode()


def is_unseen(rod: RodChange) -> bool:
    """Whether one of the two inspections did not see the rod."""
    return RodState.UNSEEN in (rod.base.state, rod.with_.state)


def _head(side: Side) -> Json:
    session = side.session
    return {
        "session": session.id,
        "name": session.inspection.name,
        "pond_id": session.pond_id,
        "state": session.state.value,
        "method": session.method,
        "revision": session.revision,
        "created_at": rfc3339(session.created_ms),
        "finished_at": rfc3339(session.finished_ms),
        "coverage": session.seen_share,
        "rods": len(side.rods),
        "rods_seen": sum(seen.reading.state is not RodState.UNSEEN for seen in side.rods.values()),
    }


def _rod(found: Found, rod: RodChange) -> Json:
    place = found.base.rods[rod.rod_id].place
    return {
        "rod_id": rod.rod_id,
        "change": rod.change.value,
        "word": rod.word,
        "reason": None if rod.reason is None else rod.reason.value,
        "confidence": round(rod.confidence, 6),
        "p_changed": round(rod.p_changed, 6),
        "residual_px": _px(found, rod.residual_m),
        "residual_mm": _mm(rod.residual_m),
        "counterpart": rod.counterpart,
        "x_m": place[0],
        "y_m": place[1],
        "base": _reading(rod.base),
        "with": _reading(rod.with_),
    }


def _reading(reading: RodReading) -> Json:
    names = ("fill", "confidence", "views", "conflicting")
    return {"state": reading.state.value} | {name: getattr(reading, name) for name in names}


def _px(found: Found, metres: float | None) -> float | None:
    return None if metres is None else round(metres / found.pixel_m, 4)


def _mm(metres: float | None) -> float | None:
    return None if metres is None else round(metres * 1000, 5)


def verdicts(base: Mapping[str, RodReading], other: Mapping[str, RodReading]) -> list[Json]:
    """Rods whose verdicts two methods differ in, over the same snapshots, with the probability that they do."""
    out = []
    for rod_id, a in base.items():
        b = other.get(rod_id)
        if b is not None and (a.state, a.conflicting) != (b.state, b.conflicting):
            seen = RodState.UNSEEN not in (a.state, b.state)
            chance = round(probability_of_change(a, b), 6) if seen else None
            out.append({"rod_id": rod_id, "base": _reading(a), "with": _reading(b), "p_differ": chance})
    return out
