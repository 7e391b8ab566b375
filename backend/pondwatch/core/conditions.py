"""What is wrong now, from facts: the conditions that alarms are about. Pure: time and limits are arguments.

Each function gives the conditions that hold, by alarm, with a sentence that stays the same while nothing changes. A
value that rang must come back past its limit by a fifth before its condition is gone.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from datetime import UTC, datetime

from .alarms import AlarmKey, Kind
from .values import RodReading, RodState

_BAND = 0.8
_LEAST_FILL_CHANGE = 0.05  # where the states differ too: less is a rod near a threshold

Conditions = dict[AlarmKey, str]


@dataclass(frozen=True, slots=True)
class Limits:
    """From where on something is wrong.

    robot_silent_s: since a robot was last heard. uncertain_share: of the snapshots, once there are `least_snapshots`.
    coverage_share: of the rods seen twice within `coverage_window_s`. disk_bytes: free. looks, sure: a rod's state
    counts from so many looks and this probability. fill_change: of a rod that is partly filled before and after.
    """

    robot_silent_s: float = 8.0
    uncertain_share: float = 0.1
    least_snapshots: int = 50
    coverage_share: float = 0.5
    coverage_window_s: float = 1800.0
    disk_bytes: int = 2 << 30
    looks: int = 2
    sure: float = 0.8
    fill_change: float = 0.2


def published(before: RodReading | None, now: RodReading, limits: Limits) -> RodReading:
    """What is shown of a rod that is read anew: a state that was shown gives way only to looks that agree on another.

    Until then the earlier state stays, with the doubt that the new reading casts on it. A rod that no look shows any
    more is not observed at once.
    """
    if before is None or RodState.UNSEEN in (before.state, now.state) or before.state is now.state:
        return now
    if _counts(now, limits):
        return now
    doubted = min(before.confidence, 1 - now.confidence)
    return replace(before, views=now.views, conflicting=now.conflicting, confidence=doubted)


def changed(readings: Iterable[RodReading], baseline: Mapping[str, RodReading], limits: Limits) -> Conditions:
    """Rods that read otherwise than in the baseline, where both readings count."""
    found = {}
    for now in readings:
        before = baseline.get(now.rod_id)
        if before is not None and _differ(before, now, limits):
            said = f"Rod {now.rod_id} was {_words(before)} in the baseline, and reads {_words(now)}."
            found[AlarmKey(Kind.ROD_CHANGED, now.rod_id)] = said
    return found


def conflicting(readings: Iterable[RodReading], limits: Limits) -> Conditions:
    """Rods whose looks disagree."""
    return {
        AlarmKey(Kind.ROD_CONFLICTING, r.rod_id): f"Looks at rod {r.rod_id} disagree."
        for r in readings
        if r.conflicting and r.state is not RodState.UNSEEN and r.views >= limits.looks
    }


def silent(heard_s: Mapping[str, float], now_s: float, limits: Limits) -> Conditions:
    """Robots that were not heard for too long. heard_s: when each last was, seconds since the epoch."""
    return {
        AlarmKey(Kind.ROBOT_SILENT, robot): f"Robot {robot} was last heard at {_clock(at_s)} UTC."
        for robot, at_s in heard_s.items()
        if now_s - at_s >= limits.robot_silent_s
    }


def poor(snapshots: int, doubtful: int, limits: Limits, *, is_active: bool) -> Conditions:
    """Too many snapshots are not surely placed."""
    share = doubtful / max(snapshots, 1)
    if snapshots < limits.least_snapshots or share <= limits.uncertain_share * (_BAND if is_active else 1.0):
        return {}
    return {AlarmKey(Kind.CORRECTION_POOR): f"About {_coarse(share)} % of the snapshots are not surely placed."}


def stale(seen_twice: float | None, limits: Limits, *, is_active: bool) -> Conditions:
    """Too little was seen twice lately. seen_twice: share of the rods; None while it says nothing yet."""
    if seen_twice is None or seen_twice >= limits.coverage_share / (_BAND if is_active else 1.0):
        return {}
    minutes = f"{limits.coverage_window_s / 60:g} minutes"
    return {AlarmKey(Kind.COVERAGE_STALE): f"About {_coarse(seen_twice)} % was seen twice in the last {minutes}."}


def low(free_bytes: int, limits: Limits, *, is_active: bool) -> Conditions:
    """The disk of the data folder is nearly full."""
    if free_bytes >= limits.disk_bytes / (_BAND if is_active else 1.0):
        return {}
    return {AlarmKey(Kind.DISK_LOW): f"About {free_bytes / 1e9:.1f} GB are free in the data folder."}


def _counts(reading: RodReading, limits: Limits) -> bool:
    return not reading.conflicting and reading.views >= limits.looks and reading.confidence >= limits.sure


def _differ(before: RodReading, now: RodReading, limits: Limits) -> bool:
    if RodState.UNSEEN in (before.state, now.state) or before.conflicting or not _counts(now, limits):
        return False
    if before.confidence * now.confidence < limits.sure:
        return False
    off = abs((before.fill or 0.0) - (now.fill or 0.0))
    return off >= (limits.fill_change if before.state is now.state else _LEAST_FILL_CHANGE)


def _words(reading: RodReading) -> str:
    if reading.state is not RodState.PARTIAL:
        return reading.state.value
    return f"partly filled (about {round(10 * (reading.fill or 0.0)) * 10} %)"


def _coarse(share: float) -> int:
    """Per cent in steps of five, so that a sentence does not change with every snapshot."""
    return 5 * round(20 * share)


def _clock(at_s: float) -> str:
    return datetime.fromtimestamp(at_s, UTC).strftime("%H:%M:%S")
