"""Rows that may be there already."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from importlib import import_module
from typing import Any

from sqlalchemy import Connection, Executable, Table


def insert_or(connection: Connection, table: Table, rows: Sequence[dict[str, Any]], changed: Sequence[str]) -> None:
    """Insert rows; of those whose key is taken, change these columns."""
    connection.execute(_statement(connection.dialect.name, table, tuple(changed)), list(rows))


@cache  # made once: making it takes longer than running it
def _statement(dialect: str, table: Table, changed: tuple[str, ...]) -> Executable:
    statement = import_module(f"sqlalchemy.dialects.{dialect}").insert(table)  # sqlite or postgresql, not both
    keys = [column.name for column in table.primary_key]
    values = {name: statement.excluded[name] for name in changed}
    made: Executable = statement.on_conflict_do_update(index_elements=keys, set_=values)
    return made
