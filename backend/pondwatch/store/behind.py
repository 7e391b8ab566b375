"""Tiles that are behind: a revision changed what they show, and they are not drawn anew yet.

A tile that many snapshots touch is drawn once for all of them. What is behind is committed with the revision that
left it so; a crash forgets none.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from sqlalchemy import Connection, delete, select, tuple_

from .tables import behind_tiles
from .upsert import insert_or

Place = tuple[int, int]


@dataclass(frozen=True, slots=True)
class Behind:
    """A tile (x, y) of the finest level. since, until: the first and the last revision that it does not show."""

    x: int
    y: int
    since: int
    until: int


def mark(connection: Connection, session_id: str, revision: int, places: Sequence[Place]) -> None:
    """A revision changes what these tiles show."""
    if places:
        rows = [
            {"session_id": session_id, "x": x, "y": y, "since_revision": revision, "until_revision": revision}
            for x, y in places
        ]
        insert_or(connection, behind_tiles, rows, ["until_revision"])


def of(connection: Connection, session_id: str, through: int | None = None, limit: int | None = None) -> list[Behind]:
    """Those of a session that are behind since `through` or earlier, the longest first."""
    c = behind_tiles.c
    query = select(c.x, c.y, c.since_revision, c.until_revision).where(c.session_id == session_id)
    if through is not None:
        query = query.where(c.since_revision <= through)
    query = query.order_by(c.since_revision, c.y, c.x).limit(limit)
    return [Behind(*row) for row in connection.execute(query)]


def clear(connection: Connection, session_id: str, places: Sequence[Place]) -> None:
    """These tiles show the newest revision."""
    c = behind_tiles.c
    for start in range(0, len(places), 400):  # a statement takes only so many values
        some = tuple_(c.x, c.y).in_(places[start : start + 400])
        connection.execute(delete(behind_tiles).where(c.session_id == session_id, some))
