"""Declared inventories of a pond: each import is kept whole, and none is ever changed."""

from __future__ import annotations

import secrets
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Connection, Row, func, insert, select

from pondwatch.core.errors import Missing
from pondwatch.core.inventory import Declared
from pondwatch.core.values import RodState

from .pondtables import inventories, inventory_lines


@dataclass(frozen=True, slots=True)
class Inventory:
    """One import. digest: hexadecimal SHA-256 of the file. count: its lines."""

    id: str
    pond_id: str
    name: str
    digest: str
    layout_version: int
    created_ms: int
    count: int


def add(
    connection: Connection, pond_id: str, name: str, digest: str, version: int, lines: Sequence[Declared], now_ms: int
) -> str:
    """Keep an inventory; its id. Ids sort by the time of import."""
    inventory_id = f"{now_ms:012x}{secrets.token_hex(8)}"
    row = {
        "id": inventory_id,
        "pond_id": pond_id,
        "name": name,
        "digest": digest,
        "layout_version": version,
        "created_ms": now_ms,
    }
    connection.execute(insert(inventories), row)
    rows = [(d.line, d.item, d.position, d.state.value, d.on) for d in lines]
    columns = ("line", "item", "position", "state", "date")
    told = [{"inventory_id": inventory_id, **dict(zip(columns, row, strict=True))} for row in rows]
    connection.execute(insert(inventory_lines), told)
    return inventory_id


def of_pond(connection: Connection, pond_id: str, limit: int = 200) -> Sequence[Inventory]:
    """Those of a pond, newest first."""
    query = _query().where(inventories.c.pond_id == pond_id).order_by(inventories.c.id.desc()).limit(limit)
    return [_inventory(row) for row in connection.execute(query)]


def get(connection: Connection, inventory_id: str) -> Inventory:
    """One.

    Raises:
        Missing: there is none by this id.
    """
    row = connection.execute(_query().where(inventories.c.id == inventory_id)).one_or_none()
    if row is None:
        raise Missing("There is no such inventory.", kind="inventory", id=inventory_id[:40])
    return _inventory(row)


def newest(connection: Connection, pond_id: str | None) -> Inventory:
    """The last that was imported for a pond.

    Raises:
        Missing: there is none.
    """
    found = of_pond(connection, pond_id, 1) if pond_id else []
    if not found:
        raise Missing("No inventory was imported for this pond.", kind="inventory", id="latest")
    return found[0]


def lines(connection: Connection, inventory_id: str) -> tuple[Declared, ...]:
    """The lines of one, in the file's order."""
    c = inventory_lines.c
    query = select(c.line, c.item, c.position, c.state, c.date).where(c.inventory_id == inventory_id).order_by(c.line)
    rows = connection.execute(query)
    return tuple(Declared(line, item, position, RodState(state), day) for line, item, position, state, day in rows)


def _query() -> Any:
    mine = inventory_lines.c.inventory_id == inventories.c.id
    return select(inventories, select(func.count()).where(mine).scalar_subquery().label("count"))


def _inventory(row: Row[Any]) -> Inventory:
    return Inventory(row.id, row.pond_id, row.name, row.digest, row.layout_version, row.created_ms, row[-1])
