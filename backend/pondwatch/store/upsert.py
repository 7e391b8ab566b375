"""Rows that may be there already."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from typing import Any

from sqlalchemy import Connection, Table


def insert_or(connection: Connection, table: Table, rows: Sequence[dict[str, Any]], changed: Sequence[str]) -> None:
    """Insert rows; of those whose key is taken, change these columns."""
    dialect = import_module(f"sqlalchemy.dialects.{connection.dialect.name}")  # sqlite or postgresql, not both
    statement = dialect.insert(table)
    keys = [column.name for column in table.primary_key]
    values = {name: statement.excluded[name] for name in changed}
    connection.execute(statement.on_conflict_do_update(index_elements=keys, set_=values), list(rows))
