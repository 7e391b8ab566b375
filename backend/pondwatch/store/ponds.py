"""Ponds: each has versions of its layout, and inspections that belong to it."""

from __future__ import annotations

import json
import secrets
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Connection, Row, RowMapping, func, insert, select, update

from pondwatch.core.errors import Conflict, Missing
from pondwatch.core.inspection import parse_pond
from pondwatch.core.layouts import digest, document_of
from pondwatch.core.values import Pond

from .pondtables import layouts, ponds
from .tables import sessions


@dataclass(frozen=True, slots=True)
class StoredPond:
    """One pond, with the newest version of its layout."""

    id: str
    name: str
    created_ms: int
    version: int
    rods: int


@dataclass(frozen=True, slots=True)
class LayoutVersion:
    """A version of a layout, without its rods. source: where it is from, for a person."""

    version: int
    digest: str
    source: str
    created_ms: int
    rods: int


@dataclass(frozen=True, slots=True)
class Wish:
    """Which pond a new session is said to belong to; nothing said: the one with its layout, else a new one."""

    id: str | None = None
    name: str | None = None


NOTHING_SAID = Wish()


def create(connection: Connection, name: str, pond: Pond, source: str, now_ms: int) -> str:
    """A new pond; its id. Ids sort by the time of creation.

    Raises:
        Conflict: there is one by this name.
    """
    if _named(connection, name):
        raise Conflict("There is a pond by this name.", kind="pond", name=name)
    return _create(connection, name, pond, digest(pond, name), source, now_ms)


def _create(connection: Connection, name: str, pond: Pond, mark: str, source: str, now_ms: int) -> str:
    pond_id = f"{now_ms:012x}{secrets.token_hex(8)}"
    connection.execute(insert(ponds), {"id": pond_id, "name": name, "created_ms": now_ms})
    _write(connection, pond_id, 1, pond, mark, source, now_ms)
    return pond_id


def add_layout(connection: Connection, pond_id: str, pond: Pond, source: str, now_ms: int) -> int:
    """A further version of a pond's layout; its number. The same as the newest, or one without rods, is that one again.

    Raises:
        Missing: there is no such pond.
    """
    name = get(connection, pond_id).name
    newest = versions(connection, pond_id)[0]
    mark = digest(pond, name)
    if newest.digest == mark or not pond.rods:
        return newest.version
    _write(connection, pond_id, newest.version + 1, pond, mark, source, now_ms)
    return newest.version + 1


def _write(connection: Connection, pond_id: str, version: int, pond: Pond, mark: str, source: str, now_ms: int) -> None:
    row = {
        "pond_id": pond_id,
        "version": version,
        "digest": mark,
        "source": source,
        "created_ms": now_ms,
        "rods": len(pond.rods),
        "document": json.dumps(document_of(pond)),
    }
    connection.execute(insert(layouts), row)


def rename(connection: Connection, pond_id: str, name: str) -> None:
    """Give a pond another name.

    Raises:
        Missing: there is no such pond. Conflict: another has this name.
    """
    get(connection, pond_id)
    if _named(connection, name) not in (None, pond_id):
        raise Conflict("There is a pond by this name.", kind="pond", name=name)
    connection.execute(update(ponds).where(ponds.c.id == pond_id).values(name=name))


def get(connection: Connection, pond_id: str) -> StoredPond:
    """One pond.

    Raises:
        Missing: there is none by this id.
    """
    row = connection.execute(_query().where(ponds.c.id == pond_id)).one_or_none()
    if row is None:
        raise Missing("There is no such pond.", kind="pond", id=pond_id[:40])
    return _pond(row)


def every(connection: Connection, limit: int = 500) -> Sequence[StoredPond]:
    """The ponds, newest first."""
    return [_pond(row) for row in connection.execute(_query().order_by(ponds.c.id.desc()).limit(limit))]


def versions(connection: Connection, pond_id: str) -> Sequence[LayoutVersion]:
    """The versions of a pond's layout, newest first."""
    c = layouts.c
    query = select(c.version, c.digest, c.source, c.created_ms, c.rods).where(c.pond_id == pond_id)
    return [LayoutVersion(*row) for row in connection.execute(query.order_by(c.version.desc()))]


def layout(connection: Connection, pond_id: str, version: int | None = None) -> Pond:
    """A layout of a pond, the newest where no version is named.

    Raises:
        Missing: there is no such pond or version.
    """
    get(connection, pond_id)
    query = select(layouts.c.document).where(layouts.c.pond_id == pond_id)
    if version is not None:
        query = query.where(layouts.c.version == version)
    found = connection.execute(query.order_by(layouts.c.version.desc()).limit(1)).scalar_one_or_none()
    if found is None:
        raise Missing("There is no such version of the layout.", kind="layout", id=str(version))
    return parse_pond(json.loads(found))


def assign(connection: Connection, pond: Pond, name: str, now_ms: int, wish: Wish = NOTHING_SAID) -> tuple[str, int]:
    """The pond of a new session, and the version of the layout that it has.

    Args:
        name: the session's: a pond that is made for it is called so.

    Raises:
        Missing: a pond was named by an id that there is none of.
    """
    source = f"inspection {name!r}"
    wanted = wish.id or (_named(connection, wish.name) if wish.name else None)
    if wanted:
        get(connection, wanted)
        return wanted, _version_of(connection, wanted, pond, source, now_ms)
    mark = digest(pond, name)
    if wish.name is None:
        query = select(layouts.c.pond_id, layouts.c.version).where(layouts.c.digest == mark)
        found = connection.execute(query.order_by(layouts.c.pond_id).limit(1)).one_or_none()
        if found:
            return found.pond_id, found.version
    return _create(connection, wish.name or _free_name(connection, name), pond, mark, source, now_ms), 1


def _version_of(connection: Connection, pond_id: str, pond: Pond, source: str, now_ms: int) -> int:
    mark = digest(pond, get(connection, pond_id).name)
    known = [v.version for v in versions(connection, pond_id) if v.digest == mark]
    return known[0] if known else add_layout(connection, pond_id, pond, source, now_ms)


def _named(connection: Connection, name: str) -> str | None:
    found = connection.execute(select(ponds.c.id).where(ponds.c.name == name).order_by(ponds.c.id).limit(1))
    return found.scalar_one_or_none()


def _free_name(connection: Connection, name: str) -> str:
    """The name, or the first of `name (2)`, `name (3)` … that no pond has."""
    number, free = 1, name
    while _named(connection, free):
        number += 1
        free = f"{name} ({number})"
    return free


def _query() -> Any:
    all_ = layouts.alias()
    newest = select(func.max(all_.c.version)).where(all_.c.pond_id == ponds.c.id).scalar_subquery()
    c = layouts.c
    return (
        select(ponds, c.version, c.rods)
        .select_from(ponds)
        .join(layouts, (c.pond_id == ponds.c.id) & (c.version == newest))
    )


def _pond(row: Row[Any]) -> StoredPond:
    return StoredPond(row.id, row.name, row.created_ms, row.version, row.rods)


def inspections(connection: Connection, pond_id: str, limit: int = 500) -> Sequence[RowMapping]:
    """A pond's sessions, newest first."""
    query = select(sessions).where(sessions.c.pond_id == pond_id).order_by(sessions.c.id.desc()).limit(limit)
    return connection.execute(query).mappings().all()


def counted(connection: Connection) -> dict[str, tuple[int, str]]:
    """How many sessions every pond has, and the id of the last."""
    c = sessions.c
    rows = connection.execute(select(c.pond_id, func.count(), func.max(c.id)).group_by(c.pond_id))
    return {pond_id: (count, last) for pond_id, count, last in rows if pond_id}


def before(connection: Connection, session_id: str) -> str:
    """The finished inspection of the same pond that was the last before this one.

    Raises:
        Missing: there is no such session, or none before it.
    """
    pond_id = connection.execute(select(sessions.c.pond_id).where(sessions.c.id == session_id)).scalar_one_or_none()
    if pond_id is None:
        raise Missing("There is no such session.", kind="session", id=session_id[:40])
    c = sessions.c
    earlier = (c.pond_id == pond_id, c.id < session_id, c.state == "finished")
    found = connection.execute(select(c.id).where(*earlier).order_by(c.id.desc()).limit(1)).scalar_one_or_none()
    if found is None:
        raise Missing("There is no finished inspection of this pond before it.", kind="session", id="last")
    return str(found)
