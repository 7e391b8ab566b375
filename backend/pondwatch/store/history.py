"""What rods read as before: a row wherever a reading became otherwise than a person would have seen it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from sqlalchemy import Connection, RowMapping, insert, select

from pondwatch.core.values import RodReading

from .tables import rod_history

FILL_STEP, CONFIDENCE_STEP = 0.005, 0.01
Readings = Mapping[str, RowMapping]  # rows by the rod's id
_ADD = insert(rod_history)


def rod_values(r: RodReading) -> dict[str, Any]:
    """A reading by the names of its columns."""
    return {
        "rod_id": r.rod_id,
        "state": r.state.value,
        "fill": r.fill,
        "confidence": r.confidence,
        "views": r.views,
        "conflicting": r.conflicting,
    }


def keep(connection: Connection, mine: Mapping[str, Any], now: Sequence[RodReading], before: Readings) -> None:
    """Add what a revision changes. mine: `session_id`, `revision` and `at_ms`; before: what its rods read as then."""
    changed = [rod_values(r) for r in now]
    changed = [{**row, **mine} for row in changed if _differs(before.get(row["rod_id"]), row)]
    if changed:
        connection.execute(_ADD, changed)


def of_rod(connection: Connection, session_id: str, rod_id: str) -> Sequence[RowMapping]:
    """A rod's readings in order of revision."""
    mine = (rod_history.c.session_id == session_id, rod_history.c.rod_id == rod_id)
    return connection.execute(select(rod_history).where(*mine).order_by(rod_history.c.revision)).mappings().all()


def of_session(connection: Connection, session_id: str) -> Sequence[RowMapping]:
    """All rods' readings in order of revision."""
    mine = select(rod_history).where(rod_history.c.session_id == session_id)
    return connection.execute(mine.order_by(rod_history.c.revision, rod_history.c.rod_id)).mappings().all()


def _differs(before: RowMapping | None, now: Mapping[str, Any]) -> bool:
    if before is None:
        return bool(now["views"] > 0 or now["state"] != "unseen")
    if any(before[name] != now[name] for name in ("state", "views", "conflicting")):
        return True
    if (before["fill"] is None) != (now["fill"] is None):
        return True
    fill_moved = abs((before["fill"] or 0.0) - (now["fill"] or 0.0))
    return bool(fill_moved >= FILL_STEP or abs(before["confidence"] - now["confidence"]) >= CONFIDENCE_STEP)
