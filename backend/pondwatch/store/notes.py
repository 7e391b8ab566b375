"""Notes of the people at the console: of a rod, a place, a moment or the inspection. Closed, never deleted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass

from sqlalchemy import Connection, RowMapping, bindparam, insert, select, update

from pondwatch.core.errors import Conflict, Missing

from .tables import notes, rods, sessions


@dataclass(frozen=True, slots=True)
class NewNote:
    """What somebody writes. x_m, y_m: pond frame. moment_ms: what time it is about, where not the time of writing."""

    text: str
    author: str
    rod_id: str | None = None
    x_m: float | None = None
    y_m: float | None = None
    moment_ms: int | None = None


def add(connection: Connection, session_id: str, new: NewNote, now_ms: int) -> RowMapping:
    """Keep a note; its row.

    Raises:
        Missing: there is no such session, or the layout has no such rod.
    """
    revision = _revision(connection, session_id)
    if new.rod_id is not None:
        rod = (rods.c.session_id == session_id, rods.c.rod_id == new.rod_id)
        if connection.execute(select(rods.c.rod_id).where(*rod)).first() is None:
            raise Missing("There is no such rod.", kind="rod", id=new.rod_id[:100])
    row = {**asdict(new), "session_id": session_id, "at_ms": now_ms, "revision": revision}
    return connection.execute(insert(notes).returning(notes), row).mappings().one()


def close(connection: Connection, session_id: str, note_id: int, by: str, now_ms: int) -> RowMapping:
    """Mark a note as dealt with.

    Raises:
        Missing: there is none by this id. Conflict: it is closed.
    """
    mine = (notes.c.session_id == session_id, notes.c.id == note_id)
    found = connection.execute(select(notes).where(*mine)).mappings().one_or_none()
    if found is None:
        raise Missing("There is no such note.", kind="note", id=str(note_id))
    if found["closed_ms"] is not None:
        raise Conflict(f"{found['closed_by']} closed this note before.", kind="note", id=str(note_id))
    values = {"closed_ms": now_ms, "closed_by": by, "revision": _revision(connection, session_id)}
    changed = connection.execute(update(notes).where(*mine).values(values).returning(notes))
    return changed.mappings().one()


_OF = (  # made once: asked for every viewer's news
    select(notes)
    .where(notes.c.session_id == bindparam("session_id"), notes.c.revision >= bindparam("since"))
    .order_by(notes.c.id)
)


def of(connection: Connection, session_id: str, since: int = -1, rod_id: str | None = None) -> Sequence[RowMapping]:
    """A session's notes that changed at revision `since` or later, in order; those of one rod where asked for."""
    query = _OF if rod_id is None else _OF.where(notes.c.rod_id == rod_id)
    return connection.execute(query, {"session_id": session_id, "since": since}).mappings().all()


def handed_over(connection: Connection, from_ms: int, limit: int) -> Sequence[RowMapping]:
    """Notes of any session that are open, or were written or closed since a moment; the newest first, with the
    session's name."""
    query = select(notes, sessions.c.name).join(sessions, sessions.c.id == notes.c.session_id)
    told = (notes.c.closed_ms.is_(None)) | (notes.c.at_ms >= from_ms) | (notes.c.closed_ms >= from_ms)
    return connection.execute(query.where(told).order_by(notes.c.id.desc()).limit(limit)).mappings().all()


def _revision(connection: Connection, session_id: str) -> int:
    found = connection.execute(select(sessions.c.revision).where(sessions.c.id == session_id)).scalar_one_or_none()
    if found is None:
        raise Missing("There is no such session.", kind="session", id=session_id[:40])
    return int(found)
