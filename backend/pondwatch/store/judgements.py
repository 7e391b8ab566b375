"""What people say of a rod: each judgement kept beside what the machine read when it was made. Only ever added to."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Connection, RowMapping, bindparam, func, insert, select

from pondwatch.core.errors import Missing

from .tables import judgements, rod_readings, rods, sessions


@dataclass(frozen=True, slots=True)
class NewJudgement:
    """What a person says. state: None where the machine's reading stands again. fill: 0 to 1."""

    rod_id: str
    state: str | None
    fill: float | None
    reason: str
    author: str


def add(connection: Connection, session_id: str, new: NewJudgement, now_ms: int) -> RowMapping:
    """Keep a judgement, with the machine's reading as it stands; its row.

    Raises:
        Missing: the layout has no such rod.
    """
    machine = _machine(connection, session_id, new.rod_id)
    revision = connection.execute(select(sessions.c.revision).where(sessions.c.id == session_id)).scalar_one()
    row = {
        "session_id": session_id,
        "rod_id": new.rod_id,
        "at_ms": now_ms,
        "author": new.author,
        "state": new.state,
        "fill": new.fill,
        "reason": new.reason,
        "revision": revision,
        "machine_state": machine["state"],
        "machine_fill": machine["fill"],
        "machine_confidence": machine["confidence"],
    }
    made = connection.execute(insert(judgements).returning(judgements), row)
    return made.mappings().one()


def of_rod(connection: Connection, session_id: str, rod_id: str) -> Sequence[RowMapping]:
    """All that was said of a rod, in order."""
    mine = (judgements.c.session_id == session_id, judgements.c.rod_id == rod_id)
    return connection.execute(select(judgements).where(*mine).order_by(judgements.c.id)).mappings().all()


_NEWEST = select(judgements).where(  # made once: asked for every viewer's news
    judgements.c.id.in_(
        select(func.max(judgements.c.id))
        .where(judgements.c.session_id == bindparam("session_id"))
        .group_by(judgements.c.rod_id)
    )
)


def newest(connection: Connection, session_id: str) -> dict[str, RowMapping]:
    """The last word on each rod that was judged, by its id. One without a state takes earlier ones back."""
    rows = connection.execute(_NEWEST, {"session_id": session_id}).mappings()
    return {row["rod_id"]: row for row in rows}


def since(connection: Connection, from_ms: int, limit: int) -> Sequence[RowMapping]:
    """What was said of any rod of any session since a moment, the newest first, with the session's name."""
    query = select(judgements, sessions.c.name).join(sessions, sessions.c.id == judgements.c.session_id)
    recent = query.where(judgements.c.at_ms >= from_ms).order_by(judgements.c.id.desc()).limit(limit)
    return connection.execute(recent).mappings().all()


def _machine(connection: Connection, session_id: str, rod_id: str) -> Mapping[str, Any]:
    mine = (rods.c.session_id == session_id, rods.c.rod_id == rod_id)
    if connection.execute(select(rods.c.rod_id).where(*mine)).first() is None:
        raise Missing("There is no such rod.", kind="rod", id=rod_id[:100])
    read = (rod_readings.c.session_id == session_id, rod_readings.c.rod_id == rod_id)
    row = connection.execute(select(rod_readings).where(*read)).mappings().one_or_none()
    return {"state": "unseen", "fill": None, "confidence": 0.0} if row is None else dict(row)
