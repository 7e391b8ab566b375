"""Two inspections of one pond, rod by rod: what was filled, what was emptied, and where nothing can be said.

A difference is claimed for a rod that both inspections saw, at the same place, with readings that are sure, and where
the two mosaics are known to coincide. Everything else is *not comparable*, and says why. Pure: values in, values out.
"""

from __future__ import annotations

import enum
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from .coincidence import Registration, registration, residuals
from .pond import tree_of
from .values import Bool, Float, RodReading, RodState

PARTLY_LEAST = 0.18  # by how much two partial fills must differ: one reading in murky water may be off by 0.12
SURE = 0.9  # probability that two readings differ, from which a difference is claimed
SURE_OF_AMOUNT = 0.99  # the same for two partial fills: looks that doubt what a rod is are no measure of how full it is
LIMIT_OF_INNER = 0.25  # inner radii: how far two mosaics may lie apart at a rod
MEASURED_LEAST = 0.5  # share of the rods seen in both where the mosaics must be known to coincide
IN_PLACE_LEAST = 0.5  # share of the rods of one name that must stand at one place: else it is chance that some do
SHIFT_LEAST = 8  # rods more that must agree one step away
CONTENT_APART = 0.1  # of a fill, closer than which a rod's content may be what another rod lost
_CODES = {RodState.EMPTY: 0.0, RodState.FULL: 1.0}


class Change(enum.StrEnum):
    """What became of a rod. `partly`: partly filled now, and otherwise before."""

    SAME = "same"
    FILLED = "filled"
    EMPTIED = "emptied"
    PARTLY = "partly"
    NOT_COMPARABLE = "not_comparable"


_BECAME = {RodState.FULL: Change.FILLED, RodState.EMPTY: Change.EMPTIED, RodState.PARTIAL: Change.PARTLY}


class Reason(enum.StrEnum):
    """Why no difference is claimed at a rod."""

    NOT_OBSERVED = "not_observed"  # in neither
    NOT_OBSERVED_BASE = "not_observed_base"
    NOT_OBSERVED_WITH = "not_observed_with"
    ELSEWHERE = "elsewhere"  # the two layouts put it at different places
    RESIDUAL = "residual"  # the mosaics do not coincide here
    UNMEASURED = "unmeasured"  # the readings differ, and whether the mosaics coincide here is not known
    UNSURE = "unsure"  # the readings differ, and one of them is not sure
    WITHHELD = "withheld"  # the comparison as a whole is refused


class Refusal(enum.StrEnum):
    """Why two inspections as a whole are not compared."""

    NO_LAYOUT = "no_layout"
    OTHER_LAYOUT = "other_layout"  # no rod, or too few, are in both
    NOTHING_SEEN = "nothing_seen"  # no rod was seen in both
    RESIDUAL = "residual"  # the mosaics do not coincide
    UNMEASURED = "unmeasured"  # whether they coincide is known at too few rods
    SHIFTED = "shifted"  # the states agree far better one lattice step away


@dataclass(frozen=True, slots=True)
class Seen:
    """One rod of one inspection. place: m, pond frame, by its layout. offset: how far its picture in the mosaic lies
    from there, m, pond frame; None where that was not measured. sigma_m: one standard deviation of it along an axis."""

    reading: RodReading
    place: tuple[float, float]
    inner_radius_m: float
    offset: tuple[float, float] | None = None
    sigma_m: float = 0.0


@dataclass(frozen=True, slots=True)
class RodChange:
    """One rod of both. confidence: probability that both readings are right, so that the change is the one named;
    p_changed: that the states differ at all. residual_m: how far the mosaics lie apart here, None where not measured.
    word: removed, added, replaced or moved; counterpart: the rod that it may have moved to or from."""

    rod_id: str
    change: Change
    base: RodReading
    with_: RodReading
    confidence: float
    p_changed: float
    residual_m: float | None = None
    reason: Reason | None = None
    word: str | None = None
    counterpart: str | None = None


@dataclass(frozen=True, slots=True)
class Comparison:
    """rods: every rod that is in both layouts, in the order of the base's. refusal: set where none is compared."""

    rods: tuple[RodChange, ...]
    registration: Registration
    refusal: Refusal | None
    only_in_base: tuple[str, ...] = ()
    only_in_with: tuple[str, ...] = ()

    def count(self, change: Change) -> int:
        """How many rods."""
        return sum(rod.change is change for rod in self.rods)


def compare(
    base: Mapping[str, Seen], with_: Mapping[str, Seen], steps: Float | None = None, pixel_m: float = 0.0
) -> Comparison:
    """What changed from `base` to `with_`.

    Args:
        base, with_: rods by id, each layout in its order.
        steps: (M, 2), m, the layout's vectors from a rod to its neighbours: given, states that agree far better one
            step away refuse the comparison.
        pixel_m: of the coarser raster: a residual is known where its sigma could not hide a pixel, and its limit is
            never under one.
    """
    common = [rod_id for rod_id in base if rod_id in with_]
    only = tuple(i for i in base if i not in with_), tuple(i for i in with_ if i not in base)
    limit_m = max([pixel_m, *(LIMIT_OF_INNER * base[i].inner_radius_m for i in common[:1])])
    apart, registered = _coincide(base, with_, common, pixel_m, limit_m)
    both = [i for i in common if not _unobserved(base[i].reading, with_[i].reading)]
    refusal = _refusal(base, with_, common, both, registered)
    if refusal is None and steps is not None and _is_shifted(base, with_, both, steps):
        refusal = Refusal.SHIFTED
    rods = [_changed(i, base[i], with_[i], apart.get(i), limit_m) for i in common]
    if refusal:
        rods = [_withheld(rod) for rod in rods]
    return Comparison(tuple(_paired(rods)), registered, refusal, *only)


def probability_of_change(a: RodReading, b: RodReading) -> float:
    """That two rods differ in state, by both readings' posteriors: what a reading leaves of its confidence is shared by
    the two other states."""
    p, q = a.confidence, b.confidence
    rest_p, rest_q = (1 - p) / 2, (1 - q) / 2
    if a.state is b.state:
        return 1 - (p * q + 2 * rest_p * rest_q)
    return 1 - (p * rest_q + rest_p * q + rest_p * rest_q)


def _coincide(
    base: Mapping[str, Seen], with_: Mapping[str, Seen], common: Sequence[str], pixel_m: float, limit_m: float
) -> tuple[dict[str, tuple[float, float]], Registration]:
    """How far the mosaics lie apart, m, pond frame, at each rod where that is known, and as a whole."""
    found = [i for i in common if base[i].offset is not None and with_[i].offset is not None]
    apart = np.array([with_[i].offset for i in found]) - np.array([base[i].offset for i in found])
    apart, places = apart.reshape(-1, 2), np.array([base[i].place for i in found]).reshape(-1, 2)
    sigma = np.array([math.hypot(base[i].sigma_m, with_[i].sigma_m) for i in found])
    residual, known = residuals(apart, sigma, places, pixel_m or limit_m)
    told = {i: (x, y) for i, (x, y) in zip(found, residual.tolist(), strict=True) if x == x}
    return told, registration(apart, np.maximum(sigma, known), residual, limit_m)


def _refusal(
    base: Mapping[str, Seen], with_: Mapping[str, Seen], common: list[str], both: list[str], found: Registration
) -> Refusal | None:
    if not base or not with_:
        return Refusal.NO_LAYOUT
    if not sum(_is_in_place(base[i], with_[i]) for i in common) >= max(1, IN_PLACE_LEAST * len(common)):
        return Refusal.OTHER_LAYOUT
    if not both:
        return Refusal.NOTHING_SEEN
    if found.median_m is not None and found.median_m > found.limit_m:
        return Refusal.RESIDUAL
    return Refusal.UNMEASURED if found.rods < MEASURED_LEAST * len(both) else None


def _is_in_place(a: Seen, b: Seen) -> bool:
    return math.dist(a.place, b.place) < a.inner_radius_m


def _unobserved(a: RodReading, b: RodReading) -> Reason | None:
    if a.state is RodState.UNSEEN:
        return Reason.NOT_OBSERVED if b.state is RodState.UNSEEN else Reason.NOT_OBSERVED_BASE
    return Reason.NOT_OBSERVED_WITH if b.state is RodState.UNSEEN else None


def _changed(rod_id: str, a: Seen, b: Seen, residual: tuple[float, float] | None, limit_m: float) -> RodChange:
    before, after = a.reading, b.reading
    apart_m = None if residual is None else math.hypot(*residual)
    reason = _unobserved(before, after)
    if reason is None and not _is_in_place(a, b):
        reason = Reason.ELSEWHERE
    if reason is None and apart_m is not None and apart_m > limit_m:
        reason = Reason.RESIDUAL
    if reason:
        return RodChange(rod_id, Change.NOT_COMPARABLE, before, after, 0.0, 0.0, apart_m, reason)
    change, p_changed = _claim(before, after)
    sure = before.confidence * after.confidence
    least = SURE_OF_AMOUNT if before.state is after.state else SURE
    if change is not Change.SAME and (p_changed < least or before.conflicting or after.conflicting):
        return RodChange(rod_id, Change.NOT_COMPARABLE, before, after, sure, p_changed, apart_m, Reason.UNSURE)
    if change is not Change.SAME and apart_m is None:
        return RodChange(rod_id, Change.NOT_COMPARABLE, before, after, sure, p_changed, None, Reason.UNMEASURED)
    return RodChange(rod_id, change, before, after, sure, p_changed, apart_m, word=_word(change, before))


def _claim(before: RodReading, after: RodReading) -> tuple[Change, float]:
    """What the readings say, and with what probability there is a difference."""
    p_changed = probability_of_change(before, after)
    if before.state is not after.state:
        return _BECAME[after.state], p_changed
    if after.state is RodState.PARTIAL and abs((before.fill or 0.0) - (after.fill or 0.0)) > PARTLY_LEAST:
        return Change.PARTLY, before.confidence * after.confidence
    return Change.SAME, p_changed


def _word(change: Change, before: RodReading) -> str | None:
    """Of what robotised verification calls a change. `moved` needs both ends, and is found later."""
    if change is Change.SAME:
        return None
    if change is Change.EMPTIED:
        return "removed"
    return "added" if before.state is RodState.EMPTY else "replaced"


def _withheld(rod: RodChange) -> RodChange:
    """The same rod where the whole comparison is refused: nothing is claimed of it."""
    return RodChange(
        rod.rod_id, Change.NOT_COMPARABLE, rod.base, rod.with_, 0.0, 0.0, rod.residual_m, rod.reason or Reason.WITHHELD
    )


def _paired(rods: list[RodChange]) -> list[RodChange]:
    """Where one rod alone lost what one other alone has gained, it may have moved: both say so."""
    gone = [r for r in rods if r.word == "removed"]
    come = [r for r in rods if r.word == "added"]
    ways = [(g, c) for g in gone for c in come if abs((g.base.fill or 0.0) - (c.with_.fill or 0.0)) < CONTENT_APART]
    ends = Counter(rod.rod_id for way in ways for rod in way)
    only = [(g.rod_id, c.rod_id) for g, c in ways if ends[g.rod_id] == ends[c.rod_id] == 1]
    counterpart = {end: other for g, c in only for end, other in ((g, c), (c, g))}
    return [_moved(r, counterpart[r.rod_id]) if r.rod_id in counterpart else r for r in rods]


def _moved(rod: RodChange, counterpart: str) -> RodChange:
    return RodChange(
        rod.rod_id, rod.change, rod.base, rod.with_, rod.confidence, rod.p_changed, rod.residual_m, None, "moved",
        counterpart,
    )  # fmt: skip


def _is_shifted(base: Mapping[str, Seen], with_: Mapping[str, Seen], both: list[str], steps: Float) -> bool:
    """Whether the readings agree far better when one inspection is moved by a lattice step: then one of the two lies
    wrong by that step, which no ring can show."""
    place = np.array([base[i].place for i in both]).reshape(-1, 2)
    before = np.array([_code(base[i].reading) for i in both])
    after = np.array([_code(with_[i].reading) for i in both])
    here = _agree(before, after)
    tree = tree_of(place)
    for step in steps:
        distance, there = tree.query(place + step, distance_upper_bound=0.25 * float(np.hypot(*step)))
        n = np.flatnonzero(np.isfinite(distance))
        m = np.asarray(there)[n]
        best_here = max(here[n].sum(), here[m].sum())  # what the step leaves at the edge proves nothing
        gain = _agree(before[n], after[m]).sum() - best_here
        if gain >= SHIFT_LEAST and gain > 0.5 * (len(n) - best_here):
            return True
    return False


def _code(reading: RodReading) -> float:
    code = _CODES.get(reading.state)
    return code if code is not None else reading.fill or 0.5


def _agree(a: Float, b: Float) -> Bool:
    return np.asarray(np.abs(a - b) < PARTLY_LEAST)
