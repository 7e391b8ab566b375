"""Ponds with versions of their layout, how a mosaic lies on it, and declared inventories.

Sessions that are there already are assigned: those of one layout to one pond. The digest of a layout is written out
here, for a migration must stay as it is: SHA-256 of its canonical JSON, its rods sorted by id; where there are no rods,
of the session's name too.
"""

from __future__ import annotations

import hashlib
import json
from typing import Any

import sqlalchemy as sa
from alembic import op

revision = "0006"
down_revision = "0005"
branch_labels = None
depends_on = None

_BIG = sa.BigInteger().with_variant(sa.Integer(), "sqlite")


def upgrade() -> None:
    op.create_table(
        "ponds",
        sa.Column("id", sa.String(length=40), nullable=False),
        sa.Column("name", sa.String(), nullable=False),
        sa.Column("created_ms", _BIG, nullable=False),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_ponds")),
    )
    op.create_table(
        "layouts",
        sa.Column("pond_id", sa.String(length=40), nullable=False),
        sa.Column("version", sa.Integer(), nullable=False),
        sa.Column("digest", sa.String(length=64), nullable=False),
        sa.Column("source", sa.String(), nullable=False),
        sa.Column("created_ms", _BIG, nullable=False),
        sa.Column("rods", sa.Integer(), nullable=False),
        sa.Column("document", sa.String(), nullable=False),
        sa.ForeignKeyConstraint(["pond_id"], ["ponds.id"], name=op.f("fk_layouts_ponds"), ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("pond_id", "version", name=op.f("pk_layouts")),
    )
    op.create_index(op.f("ix_layouts_digest"), "layouts", ["digest"])
    # plain columns: to make the table anew would take with it, by its cascades, everything that refers to it
    op.add_column("sessions", sa.Column("pond_id", sa.String(length=40), nullable=True))
    op.add_column("sessions", sa.Column("layout_version", sa.Integer(), nullable=True))
    op.create_index(op.f("ix_sessions_pond_id_sessions_id"), "sessions", ["pond_id", "id"])
    op.create_table(
        "registrations",
        sa.Column("session_id", sa.String(length=40), nullable=False),
        sa.Column("revision", _BIG, nullable=False),
        sa.Column("offsets", sa.LargeBinary(), nullable=False),
        sa.ForeignKeyConstraint(
            ["session_id"], ["sessions.id"], name=op.f("fk_registrations_sessions"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("session_id", name=op.f("pk_registrations")),
    )
    _inventories()
    _assign(op.get_bind())


def _inventories() -> None:
    op.create_table(
        "inventories",
        sa.Column("id", sa.String(length=40), nullable=False),
        sa.Column("pond_id", sa.String(length=40), nullable=False),
        sa.Column("name", sa.String(), nullable=False),
        sa.Column("digest", sa.String(length=64), nullable=False),
        sa.Column("layout_version", sa.Integer(), nullable=False),
        sa.Column("created_ms", _BIG, nullable=False),
        sa.ForeignKeyConstraint(["pond_id"], ["ponds.id"], name=op.f("fk_inventories_ponds"), ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_inventories")),
    )
    op.create_index(op.f("ix_inventories_pond_id_inventories_id"), "inventories", ["pond_id", "id"])
    op.create_table(
        "inventory_lines",
        sa.Column("inventory_id", sa.String(length=40), nullable=False),
        sa.Column("line", sa.Integer(), nullable=False),
        sa.Column("item", sa.String(), nullable=False),
        sa.Column("position", sa.String(), nullable=False),
        sa.Column("state", sa.String(length=10), nullable=False),
        sa.Column("date", sa.String(length=10), nullable=False),
        sa.CheckConstraint("state IN ('empty', 'partial', 'full')", name=op.f("ck_inventory_lines_state")),
        sa.ForeignKeyConstraint(
            ["inventory_id"], ["inventories.id"], name=op.f("fk_inventory_lines_inventories"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("inventory_id", "line", name=op.f("pk_inventory_lines")),
    )


def downgrade() -> None:
    for table in ("inventory_lines", "inventories", "registrations"):
        op.drop_table(table)
    op.drop_index(op.f("ix_sessions_pond_id_sessions_id"), "sessions")
    op.drop_column("sessions", "layout_version")
    op.drop_column("sessions", "pond_id")
    op.drop_table("layouts")
    op.drop_table("ponds")


def _assign(connection: Any) -> None:
    rows = connection.execute(
        sa.text("SELECT id, name, created_ms, pond_width_m, pond_height_m FROM sessions ORDER BY id")
    ).all()
    known: dict[str, str] = {}
    for session, name, created_ms, width_m, height_m in rows:
        found = connection.execute(
            sa.text(
                "SELECT rod_id, x_m, y_m, outer_radius_m, inner_radius_m FROM rods WHERE session_id = :s "
                "ORDER BY position"
            ),
            {"s": session},
        ).all()
        columns = ("id", "x_m", "y_m", "outer_radius_m", "inner_radius_m")
        rods = [dict(zip(columns, row, strict=True)) for row in found]
        document = {"width_m": width_m, "height_m": height_m, "rods": rods}
        digest = _digest(document, name)
        if digest not in known:
            known[digest] = session  # a session's id is as good an id for its pond
            _insert(connection, session, name, created_ms, digest, document)
        connection.execute(
            sa.text("UPDATE sessions SET pond_id = :p, layout_version = 1 WHERE id = :s"),
            {"p": known[digest], "s": session},
        )


def _insert(connection: Any, pond: str, name: str, created_ms: int, digest: str, document: dict[str, Any]) -> None:
    connection.execute(
        sa.text("INSERT INTO ponds (id, name, created_ms) VALUES (:id, :name, :ms)"),
        {"id": pond, "name": name, "ms": created_ms},
    )
    connection.execute(
        sa.text(
            "INSERT INTO layouts (pond_id, version, digest, source, created_ms, rods, document) "
            "VALUES (:id, 1, :digest, :source, :ms, :rods, :document)"
        ),
        {
            "id": pond,
            "digest": digest,
            "source": f"session {pond}",
            "ms": created_ms,
            "rods": len(document["rods"]),
            "document": json.dumps(document),
        },
    )


def _digest(document: dict[str, Any], name: str) -> str:
    content = {**document, "rods": sorted(document["rods"], key=lambda rod: rod["id"])}
    if not content["rods"]:
        content["name"] = name
    return hashlib.sha256(json.dumps(content, sort_keys=True, separators=(",", ":")).encode()).hexdigest()
