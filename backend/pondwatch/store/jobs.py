"""Jobs: at most one of each kind a session, so that the table does not grow with the uploads."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from sqlalchemy import Connection, RowMapping, bindparam, insert, select, update

from pondwatch.core.errors import Missing

from .tables import jobs

_STATE = select(jobs.c.state).where(
    jobs.c.session_id == bindparam("session_id"), jobs.c.kind == bindparam("kind")
)  # made once: every upload asks it


def queue(connection: Connection, session_id: str, kind: str, now_ms: int) -> None:
    """There is work of this kind; nothing changes where it is queued or running already."""
    mine = (jobs.c.session_id == session_id, jobs.c.kind == kind)
    state = connection.execute(_STATE, {"session_id": session_id, "kind": kind}).scalar_one_or_none()
    if state is None:
        row = {"session_id": session_id, "kind": kind, "state": "queued", "created_ms": now_ms, "updated_ms": now_ms}
        connection.execute(insert(jobs), row)
    elif state in ("done", "failed"):
        fresh = {
            "state": "queued",
            "progress": 0.0,
            "attempts": 0,
            "error": None,
            "created_ms": now_ms,
            "updated_ms": now_ms,
        }
        connection.execute(update(jobs).where(*mine).values(fresh))


def mark(connection: Connection, session_id: str, kind: str, now_ms: int, **values: Any) -> None:
    """Set `state`, `progress`, `error` of a job."""
    mine = (jobs.c.session_id == session_id, jobs.c.kind == kind)
    connection.execute(update(jobs).where(*mine).values(updated_ms=now_ms, **values))


def fail(connection: Connection, session_id: str, kind: str, now_ms: int, error: str, *, final: bool) -> int:
    """Count a failed attempt; how many there were."""
    mark(
        connection,
        session_id,
        kind,
        now_ms,
        state="failed" if final else "queued",
        error=error[:500],
        attempts=jobs.c.attempts + 1,
    )
    mine = (jobs.c.session_id == session_id, jobs.c.kind == kind)
    return connection.execute(select(jobs.c.attempts).where(*mine)).scalar_one_or_none() or 0


def rows(connection: Connection, session_id: str | None, limit: int = 200) -> Sequence[RowMapping]:
    """Jobs, the newest first."""
    query = select(jobs).order_by(jobs.c.updated_ms.desc(), jobs.c.id.desc()).limit(limit)
    if session_id is not None:
        query = query.where(jobs.c.session_id == session_id)
    return connection.execute(query).mappings().all()


def get(connection: Connection, job_id: int) -> RowMapping:
    """One job.

    Raises:
        Missing: there is none by this id.
    """
    row = connection.execute(select(jobs).where(jobs.c.id == job_id)).mappings().one_or_none()
    if row is None:
        raise Missing("There is no such job.", kind="job", id=job_id)
    return row
