"""The tables of ponds: versions of their layouts, declared inventories, how mosaics lie on a layout, and what was
found to be otherwise than it says."""

from __future__ import annotations

from sqlalchemy import CheckConstraint, Column, ForeignKey, Index, Integer, LargeBinary, String, Table

from .tables import BigInteger, metadata

ponds = Table(
    "ponds",
    metadata,
    Column("id", String(40), primary_key=True),  # sorts by time of creation
    Column("name", String, nullable=False),
    Column("created_ms", BigInteger, nullable=False),
)

layouts = Table(
    "layouts",
    metadata,
    Column("pond_id", ForeignKey("ponds.id", ondelete="CASCADE"), primary_key=True),
    Column("version", Integer, primary_key=True),  # from 1
    Column("digest", String(64), nullable=False),  # core.layouts.digest
    Column("source", String, nullable=False),
    Column("created_ms", BigInteger, nullable=False),
    Column("rods", Integer, nullable=False),
    Column("document", String, nullable=False),  # JSON, as `pond` of a session.json
    Index(None, "digest"),
)

registrations = Table(
    "registrations",
    metadata,
    Column("session_id", ForeignKey("sessions.id", ondelete="CASCADE"), primary_key=True),
    Column("revision", BigInteger, nullable=False),
    Column("offsets", LargeBinary, nullable=False),  # (R, 3) float32, little-endian, m: x, y, sigma; NaN: none
)

conditions = Table(
    "conditions",
    metadata,
    Column("session_id", ForeignKey("sessions.id", ondelete="CASCADE"), primary_key=True),
    Column("revision", BigInteger, nullable=False),
    Column("document", String, nullable=False),  # JSON, as the API tells it
)

inventories = Table(
    "inventories",
    metadata,
    Column("id", String(40), primary_key=True),  # sorts by time of import
    Column("pond_id", ForeignKey("ponds.id", ondelete="CASCADE"), nullable=False),
    Column("name", String, nullable=False),
    Column("digest", String(64), nullable=False),  # SHA-256 of the file's bytes
    Column("layout_version", Integer, nullable=False),  # that its positions were checked against
    Column("created_ms", BigInteger, nullable=False),
    Index(None, "pond_id", "id"),
)

inventory_lines = Table(
    "inventory_lines",
    metadata,
    Column("inventory_id", ForeignKey("inventories.id", ondelete="CASCADE"), primary_key=True),
    Column("line", Integer, primary_key=True),  # of the file; its header is line 1
    Column("item", String, nullable=False),
    Column("position", String, nullable=False),  # a rod's id
    Column("state", String(10), nullable=False),
    Column("date", String(10), nullable=False),  # 2026-01-31
    CheckConstraint("state IN ('empty', 'partial', 'full')", name="state"),
)
