"""What rods read as before, what people said of them, and notes."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"
branch_labels = None
depends_on = None

_BIG = sa.BigInteger().with_variant(sa.Integer(), "sqlite")
_STATES = "state IN ('empty', 'partial', 'full')"


def upgrade() -> None:
    op.create_table(
        "rod_history",
        sa.Column("session_id", sa.String(length=40), nullable=False),
        sa.Column("rod_id", sa.String(), nullable=False),
        sa.Column("revision", _BIG, nullable=False),
        sa.Column("at_ms", _BIG, nullable=False),
        sa.Column("state", sa.String(length=10), nullable=False),
        sa.Column("fill", sa.Float(), nullable=True),
        sa.Column("confidence", sa.Float(), nullable=False),
        sa.Column("views", sa.Integer(), nullable=False),
        sa.Column("conflicting", sa.Boolean(), nullable=False),
        sa.CheckConstraint("state IN ('empty', 'partial', 'full', 'unseen')", name=op.f("ck_rod_history_state")),
        sa.ForeignKeyConstraint(
            ["session_id", "rod_id"],
            ["rods.session_id", "rods.rod_id"],
            name=op.f("fk_rod_history_rods"),
            ondelete="CASCADE",
        ),
        sa.PrimaryKeyConstraint("session_id", "rod_id", "revision", name=op.f("pk_rod_history")),
    )
    op.create_table(
        "judgements",
        sa.Column("id", _BIG, nullable=False),
        sa.Column("session_id", sa.String(length=40), nullable=False),
        sa.Column("rod_id", sa.String(), nullable=False),
        sa.Column("at_ms", _BIG, nullable=False),
        sa.Column("author", sa.String(), nullable=False),
        sa.Column("state", sa.String(length=10), nullable=True),
        sa.Column("fill", sa.Float(), nullable=True),
        sa.Column("reason", sa.String(), nullable=False),
        sa.Column("revision", _BIG, nullable=False),
        sa.Column("machine_state", sa.String(length=10), nullable=False),
        sa.Column("machine_fill", sa.Float(), nullable=True),
        sa.Column("machine_confidence", sa.Float(), nullable=False),
        sa.CheckConstraint(_STATES, name=op.f("ck_judgements_state")),
        sa.ForeignKeyConstraint(
            ["session_id", "rod_id"],
            ["rods.session_id", "rods.rod_id"],
            name=op.f("fk_judgements_rods"),
            ondelete="CASCADE",
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_judgements")),
        sqlite_autoincrement=True,
    )
    op.create_index(op.f("ix_judgements_session_id_judgements_rod_id"), "judgements", ["session_id", "rod_id"])
    op.create_index(op.f("ix_judgements_at_ms"), "judgements", ["at_ms"])
    op.create_table(
        "notes",
        sa.Column("id", _BIG, nullable=False),
        sa.Column("session_id", sa.String(length=40), nullable=False),
        sa.Column("at_ms", _BIG, nullable=False),
        sa.Column("author", sa.String(), nullable=False),
        sa.Column("text", sa.String(), nullable=False),
        sa.Column("rod_id", sa.String(), nullable=True),
        sa.Column("x_m", sa.Float(), nullable=True),
        sa.Column("y_m", sa.Float(), nullable=True),
        sa.Column("moment_ms", _BIG, nullable=True),
        sa.Column("closed_ms", _BIG, nullable=True),
        sa.Column("closed_by", sa.String(), nullable=True),
        sa.Column("revision", _BIG, nullable=False),
        sa.ForeignKeyConstraint(["session_id"], ["sessions.id"], name=op.f("fk_notes_sessions"), ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_notes")),
        sqlite_autoincrement=True,
    )
    op.create_index(op.f("ix_notes_session_id_notes_id"), "notes", ["session_id", "id"])
    op.create_index(op.f("ix_notes_at_ms"), "notes", ["at_ms"])


def downgrade() -> None:
    for table in ("notes", "judgements", "rod_history"):
        op.drop_table(table)
