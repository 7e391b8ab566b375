"""Which earlier inspection of the same pond a session is held against."""

from __future__ import annotations

import math

from sqlalchemy import Connection

from pondwatch.core.errors import Conflict
from pondwatch.core.values import Pond
from pondwatch.store import alarms, sessions
from pondwatch.store.sessions import State

_SAME_M = 1e-6


class WrongBaseline(Conflict):
    """The session cannot be held against that one. facts: session, baseline."""


def choose(connection: Connection, session_id: str, baseline_id: str | None, now_ms: int) -> int:
    """Hold a session against an earlier one, None for none; the session's revision.

    Raises:
        Missing: one of them is not there. WrongBaseline: it is not finished, not earlier, or of another pond.
    """
    session = sessions.get(connection, session_id, with_rods=True)
    if baseline_id is not None:
        baseline = sessions.get(connection, baseline_id, with_rods=True)
        if baseline.id >= session.id:
            raise _refusal("It is not earlier than the session itself.", session_id, baseline_id)
        if baseline.state is not State.FINISHED:
            raise _refusal(f"It is {baseline.state.value}, not finished.", session_id, baseline_id)
        fault = _other_pond(session.inspection.pond, baseline.inspection.pond)
        if fault:
            raise _refusal(f"It is of another pond: {fault}.", session_id, baseline_id)
    alarms.set_baseline(connection, session_id, baseline_id, now_ms)
    return session.revision


def _refusal(why: str, session_id: str, baseline_id: str) -> WrongBaseline:
    return WrongBaseline(f"This session cannot be the baseline. {why}", session=session_id, baseline=baseline_id)


def _other_pond(one: Pond, other: Pond) -> str:
    """What is different about two ponds; empty where nothing is."""
    if not one.rods or not other.rods:
        return "one has no layout, so that no rods are read"
    sizes = (one.width_m, other.width_m), (one.height_m, other.height_m)
    if not all(math.isclose(a, b, abs_tol=_SAME_M) for a, b in sizes):
        return "their sizes differ"
    places = {rod.id: rod for rod in other.rods}
    for rod in one.rods:
        there = places.get(rod.id)
        if there is None or math.hypot(rod.x_m - there.x_m, rod.y_m - there.y_m) > rod.inner_radius_m / 2:
            return f"rod {rod.id} is not at the same place in both"
    return "" if len(one.rods) == len(other.rods) else "one has more rods"
