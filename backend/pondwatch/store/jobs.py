"""Jobs: at most one of each kind a session, so that the table does not grow with the uploads."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from sqlalchemy import BindParameter, Connection, RowMapping, bindparam, insert, select, update

from pondwatch.core.errors import Missing

from .tables import jobs

_SESSION: BindParameter[str] = bindparam("of_session")
_KIND: BindParameter[str] = bindparam("of_kind")
_MINE = (jobs.c.session_id == _SESSION, jobs.c.kind == _KIND)
_STATE = select(jobs.c.state).where(*_MINE)  # made once, like all here: every upload asks it
_CHANGE = update(jobs).where(*_MINE)
_COUNT_AND_CHANGE = _CHANGE.values(attempts=jobs.c.attempts + 1)
_ATTEMPTS = select(jobs.c.attempts).where(*_MINE)
_ROWS = select(jobs).order_by(jobs.c.updated_ms.desc(), jobs.c.id.desc()).limit(bindparam("most"))
_ROWS_OF = _ROWS.where(jobs.c.session_id == _SESSION)


def queue(connection: Connection, session_id: str, kind: str, now_ms: int) -> None:
    """There is work of this kind; nothing changes where it is queued or running already."""
    mine = {"of_session": session_id, "of_kind": kind}
    state = connection.execute(_STATE, mine).scalar_one_or_none()
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
        connection.execute(_CHANGE, mine | fresh)


def mark(connection: Connection, session_id: str, kind: str, now_ms: int, **values: Any) -> None:
    """Set `state`, `progress`, `error` of a job."""
    connection.execute(_CHANGE, {"of_session": session_id, "of_kind": kind, "updated_ms": now_ms, **values})


def fail(connection: Connection, session_id: str, kind: str, now_ms: int, error: str, *, final: bool) -> int:
    """Count a failed attempt; how many there were."""
    mine = {"of_session": session_id, "of_kind": kind}
    failed = {"state": "failed" if final else "queued", "error": error[:500], "updated_ms": now_ms}
    connection.execute(_COUNT_AND_CHANGE, mine | failed)
    return connection.execute(_ATTEMPTS, mine).scalar_one_or_none() or 0


def rows(connection: Connection, session_id: str | None, limit: int = 200) -> Sequence[RowMapping]:
    """Jobs, the newest first."""
    query = _ROWS if session_id is None else _ROWS_OF
    named = {} if session_id is None else {"of_session": session_id}
    return connection.execute(query, {"most": limit, **named}).mappings().all()


def get(connection: Connection, job_id: int) -> RowMapping:
    """One job.

    Raises:
        Missing: there is none by this id.
    """
    row = connection.execute(select(jobs).where(jobs.c.id == job_id)).mappings().one_or_none()
    if row is None:
        raise Missing("There is no such job.", kind="job", id=job_id)
    return row
