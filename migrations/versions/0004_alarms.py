"""Alarms, every transition of them, and which earlier session is a session's baseline."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0003"
branch_labels = None
depends_on = None

_BIG = sa.BigInteger().with_variant(sa.Integer(), "sqlite")


def upgrade() -> None:
    op.create_table(
        "alarms",
        sa.Column("id", _BIG, nullable=False),
        sa.Column("session_id", sa.String(length=40), nullable=False),
        sa.Column("kind", sa.String(length=40), nullable=False),
        sa.Column("subject", sa.String(), nullable=False),
        sa.Column("detail", sa.String(), nullable=False),
        sa.Column("active", sa.Boolean(), nullable=False),
        sa.Column("acknowledged", sa.Boolean(), nullable=False),
        sa.Column("latched", sa.Boolean(), nullable=False),
        sa.Column("suppressed", sa.Boolean(), nullable=False),
        sa.Column("out_of_service", sa.Boolean(), nullable=False),
        sa.Column("shelved", sa.Boolean(), nullable=False),
        sa.Column("shelved_until_ms", _BIG, nullable=True),
        sa.Column("since_ms", _BIG, nullable=False),
        sa.Column("occurrences", sa.Integer(), nullable=False),
        sa.ForeignKeyConstraint(["session_id"], ["sessions.id"], name=op.f("fk_alarms_sessions"), ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_alarms")),
        sa.UniqueConstraint("session_id", "kind", "subject", name=op.f("uq_alarms")),
        sqlite_autoincrement=True,
    )
    op.create_table(
        "alarm_events",
        sa.Column("id", _BIG, nullable=False),
        sa.Column("session_id", sa.String(length=40), nullable=False),
        sa.Column("alarm_id", _BIG, nullable=False),
        sa.Column("at_ms", _BIG, nullable=False),
        sa.Column("act", sa.String(length=30), nullable=False),
        sa.Column("who", sa.String(), nullable=True),
        sa.Column("text", sa.String(), nullable=False),
        sa.ForeignKeyConstraint(
            ["session_id"], ["sessions.id"], name=op.f("fk_alarm_events_sessions"), ondelete="CASCADE"
        ),
        sa.ForeignKeyConstraint(["alarm_id"], ["alarms.id"], name=op.f("fk_alarm_events_alarms"), ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_alarm_events")),
        sqlite_autoincrement=True,
    )
    op.create_index(op.f("ix_alarm_events_session_id_alarm_events_id"), "alarm_events", ["session_id", "id"])
    op.create_index(op.f("ix_alarm_events_alarm_id_alarm_events_id"), "alarm_events", ["alarm_id", "id"])
    op.create_table(
        "baselines",
        sa.Column("session_id", sa.String(length=40), nullable=False),
        sa.Column("baseline_id", sa.String(length=40), nullable=False),
        sa.Column("set_ms", _BIG, nullable=False),
        sa.ForeignKeyConstraint(
            ["session_id"], ["sessions.id"], name=op.f("fk_baselines_sessions"), ondelete="CASCADE"
        ),
        sa.ForeignKeyConstraint(
            ["baseline_id"], ["sessions.id"], name=op.f("fk_baselines_baseline"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("session_id", name=op.f("pk_baselines")),
    )


def downgrade() -> None:
    op.drop_table("baselines")
    op.drop_table("alarm_events")
    op.drop_table("alarms")
