"""Tiles that are still to be drawn anew."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0007"
down_revision = "0006"


def upgrade() -> None:
    number = sa.BigInteger().with_variant(sa.Integer(), "sqlite")
    op.create_table(
        "behind_tiles",
        sa.Column("session_id", sa.String(length=40), nullable=False),
        sa.Column("x", sa.Integer(), nullable=False),
        sa.Column("y", sa.Integer(), nullable=False),
        sa.Column("since_revision", number, nullable=False),
        sa.Column("until_revision", number, nullable=False),
        sa.ForeignKeyConstraint(
            ["session_id"], ["sessions.id"], name=op.f("fk_behind_tiles_sessions"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("session_id", "x", "y", name=op.f("pk_behind_tiles")),
    )


def downgrade() -> None:
    op.drop_table("behind_tiles")
