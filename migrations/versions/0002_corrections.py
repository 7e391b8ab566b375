"""Finished sessions corrected again by other methods: their poses and rods, beside the session's own."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None

_BIG = sa.BigInteger().with_variant(sa.Integer(), "sqlite")


def upgrade() -> None:
    op.create_table(
        "corrections",
        sa.Column("id", _BIG, nullable=False),
        sa.Column("session_id", sa.String(length=40), nullable=False),
        sa.Column("method", sa.String(length=40), nullable=False),
        sa.Column("state", sa.String(length=10), nullable=False),
        sa.Column("error", sa.String(), nullable=True),
        sa.Column("revision", _BIG, nullable=False),
        sa.Column("quality", sa.String(), nullable=False),
        sa.Column("created_ms", _BIG, nullable=False),
        sa.Column("finished_ms", _BIG, nullable=True),
        sa.CheckConstraint("state IN ('queued', 'running', 'done', 'failed')", name=op.f("ck_corrections_state")),
        sa.ForeignKeyConstraint(
            ["session_id"], ["sessions.id"], name=op.f("fk_corrections_sessions"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_corrections")),
        sa.UniqueConstraint("session_id", "method", name=op.f("uq_corrections")),
        sqlite_autoincrement=True,
    )
    op.create_table(
        "correction_poses",
        sa.Column("correction_id", _BIG, nullable=False),
        sa.Column("snapshot_id", _BIG, nullable=False),
        sa.Column("status", sa.String(length=10), nullable=False),
        sa.Column("x_m", sa.Float(), nullable=True),
        sa.Column("y_m", sa.Float(), nullable=True),
        sa.Column("theta_rad", sa.Float(), nullable=True),
        sa.Column("sigma_xy_m", sa.Float(), nullable=True),
        sa.Column("sigma_theta_rad", sa.Float(), nullable=True),
        sa.Column("log_odds", sa.Float(), nullable=False),
        sa.Column("fault", sa.String(), nullable=True),
        sa.CheckConstraint("status IN ('placed', 'uncertain', 'rejected')", name=op.f("ck_correction_poses_status")),
        sa.ForeignKeyConstraint(
            ["correction_id"], ["corrections.id"], name=op.f("fk_correction_poses_corrections"), ondelete="CASCADE"
        ),
        sa.ForeignKeyConstraint(
            ["snapshot_id"], ["snapshots.id"], name=op.f("fk_correction_poses_snapshots"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("correction_id", "snapshot_id", name=op.f("pk_correction_poses")),
    )
    op.create_table(
        "correction_rods",
        sa.Column("correction_id", _BIG, nullable=False),
        sa.Column("rod_id", sa.String(), nullable=False),
        sa.Column("state", sa.String(length=10), nullable=False),
        sa.Column("fill", sa.Float(), nullable=True),
        sa.Column("confidence", sa.Float(), nullable=False),
        sa.Column("views", sa.Integer(), nullable=False),
        sa.Column("conflicting", sa.Boolean(), nullable=False),
        sa.CheckConstraint("state IN ('empty', 'partial', 'full', 'unseen')", name=op.f("ck_correction_rods_state")),
        sa.ForeignKeyConstraint(
            ["correction_id"], ["corrections.id"], name=op.f("fk_correction_rods_corrections"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("correction_id", "rod_id", name=op.f("pk_correction_rods")),
    )
    _allow_kinds("advance", "finish", "correct")


def downgrade() -> None:
    op.execute("DELETE FROM jobs WHERE kind = 'correct'")
    _allow_kinds("advance", "finish")
    op.drop_table("correction_rods")
    op.drop_table("correction_poses")
    op.drop_table("corrections")


def _allow_kinds(*kinds: str) -> None:
    """SQLite cannot change a constraint: the table is made anew there, with its rows."""
    listed = ", ".join(f"'{kind}'" for kind in kinds)
    with op.batch_alter_table("jobs", copy_from=_jobs()) as jobs:
        jobs.drop_constraint(op.f("ck_jobs_kind"), type_="check")
        jobs.create_check_constraint(op.f("ck_jobs_kind"), f"kind IN ({listed})")


def _jobs() -> sa.Table:
    """The jobs as `0001` made them; which kinds the old constraint allowed does not matter, for it goes."""
    return sa.Table(
        "jobs",
        sa.MetaData(),
        sa.Column("id", _BIG, nullable=False),
        sa.Column("session_id", sa.String(length=40), nullable=False),
        sa.Column("kind", sa.String(length=20), nullable=False),
        sa.Column("state", sa.String(length=10), nullable=False),
        sa.Column("progress", sa.Float(), nullable=False),
        sa.Column("attempts", sa.Integer(), nullable=False),
        sa.Column("error", sa.String(), nullable=True),
        sa.Column("created_ms", _BIG, nullable=False),
        sa.Column("updated_ms", _BIG, nullable=False),
        sa.CheckConstraint("kind <> ''", name="ck_jobs_kind"),
        sa.CheckConstraint("state IN ('queued', 'running', 'done', 'failed')", name="ck_jobs_state"),
        sa.ForeignKeyConstraint(["session_id"], ["sessions.id"], name="fk_jobs_sessions", ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("id", name="pk_jobs"),
        sa.UniqueConstraint("session_id", "kind", name="uq_jobs"),
        sqlite_autoincrement=True,
    )
