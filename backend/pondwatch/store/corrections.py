"""Corrections of a finished session by other methods than its own: one a method, kept beside the session's result."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Connection, delete, insert, select, update

from pondwatch.core.errors import Missing
from pondwatch.core.values import RodReading

from .history import rod_values
from .revisions import PoseRow, pose_values, with_what_came_in
from .tables import correction_poses, correction_rods, corrections


@dataclass(frozen=True, slots=True)
class Correction:
    """One as stored. state: queued, running, done or failed. revision: the session's, which its snapshots are of."""

    id: int
    session_id: str
    method: str
    state: str
    error: str | None
    revision: int
    quality: str
    created_ms: int
    finished_ms: int | None


def queue(connection: Connection, session_id: str, method: str, revision: int, now_ms: int) -> Correction:
    """Ask for one; nothing changes where it is done or on its way, and one that failed is tried again."""
    before = find(connection, session_id, method)
    if before is None:
        row = {"session_id": session_id, "method": method, "state": "queued", "revision": revision}
        connection.execute(insert(corrections), row | {"created_ms": now_ms})
    elif before.state == "failed":
        mark(connection, before.id, state="queued", error=None)
    return get(connection, session_id, method)


def find(connection: Connection, session_id: str, method: str) -> Correction | None:
    """A session's correction by a method, if there is one."""
    found = [c for c in of(connection, session_id) if c.method == method]
    return found[0] if found else None


def get(connection: Connection, session_id: str, method: str) -> Correction:
    """A session's correction by a method.

    Raises:
        Missing: none was asked for.
    """
    found = find(connection, session_id, method)
    if found is None:
        raise Missing("The session was not corrected by this method.", kind="correction", id=method[:40])
    return found


def of(connection: Connection, session_id: str) -> Sequence[Correction]:
    """All of a session, in the order in which they were first asked for."""
    query = select(corrections).where(corrections.c.session_id == session_id).order_by(corrections.c.id)
    return [Correction(**row) for row in connection.execute(query).mappings()]


def waiting(connection: Connection, session_id: str) -> Sequence[Correction]:
    """Those of a session that are to be made."""
    return [c for c in of(connection, session_id) if c.state in ("queued", "running")]


def mark(connection: Connection, correction_id: int, **values: Any) -> None:
    """Set `state`, `error`, `quality` or `finished_ms`."""
    connection.execute(update(corrections).where(corrections.c.id == correction_id).values(values))


def write(connection: Connection, correction_id: int, poses: Sequence[PoseRow], readings: Sequence[RodReading]) -> None:
    """Keep a correction's result, in place of any before."""
    mine = {"correction_id": correction_id}
    for table, rows in (
        (correction_poses, [pose_values(p) | mine for p in poses]),
        (correction_rods, [rod_values(r) | mine for r in readings]),
    ):
        connection.execute(delete(table).where(table.c.correction_id == correction_id))
        if rows:
            connection.execute(insert(table), rows)


def pose_rows(connection: Connection, correction: Correction) -> list[dict[str, Any]]:
    """Its poses as `revisions.pose_rows` gives the session's own."""
    mine = correction_poses.c.correction_id == correction.id
    rows = with_what_came_in(connection, correction_poses, mine)
    return [{**row, "revision": correction.revision} for row in rows]


def rod_rows(connection: Connection, correction: Correction) -> list[dict[str, Any]]:
    """Its readings, in no order."""
    rows = connection.execute(select(correction_rods).where(correction_rods.c.correction_id == correction.id))
    return [{**row, "revision": correction.revision} for row in rows.mappings()]
