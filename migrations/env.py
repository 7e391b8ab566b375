"""Alembic's entry: brings the database of `pondwatch serve` to this version, on the connection handed in."""

from __future__ import annotations

from alembic import context

from pondwatch.store.tables import metadata

connection = context.config.attributes.get("connection")
if connection is None:
    raise SystemExit("Migrations run when `pondwatch serve` starts; they need its connection.")
context.configure(connection=connection, target_metadata=metadata, render_as_batch=True)
with context.begin_transaction():
    context.run_migrations()
