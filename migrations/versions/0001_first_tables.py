"""The first tables: sessions, their snapshots and what is derived from them."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0001"
down_revision = None
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "sessions",
        sa.Column("id", sa.String(length=40), nullable=False),
        sa.Column("name", sa.String(), nullable=False),
        sa.Column("method", sa.String(length=40), nullable=False),
        sa.Column("created_ms", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), nullable=False),
        sa.Column("camera_width_px", sa.Integer(), nullable=False),
        sa.Column("camera_height_px", sa.Integer(), nullable=False),
        sa.Column("camera_metres_per_pixel", sa.Float(), nullable=False),
        sa.Column("pond_width_m", sa.Float(), nullable=False),
        sa.Column("pond_height_m", sa.Float(), nullable=False),
        sa.Column("noise_sigma_xy_m", sa.Float(), nullable=True),
        sa.Column("noise_sigma_theta_rad", sa.Float(), nullable=True),
        sa.Column("state", sa.String(length=10), nullable=False),
        sa.Column("finished_ms", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), nullable=True),
        sa.Column("revision", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), nullable=False),
        sa.Column("covered_through", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), nullable=False),
        sa.Column("seen_share", sa.Float(), nullable=False),
        sa.Column("quality", sa.String(), nullable=False),
        sa.CheckConstraint("state IN ('open', 'finishing', 'finished', 'failed')", name=op.f("ck_sessions_state")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_sessions")),
    )
    op.create_table(
        "jobs",
        sa.Column("id", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), nullable=False),
        sa.Column("session_id", sa.String(length=40), nullable=False),
        sa.Column("kind", sa.String(length=20), nullable=False),
        sa.Column("state", sa.String(length=10), nullable=False),
        sa.Column("progress", sa.Float(), nullable=False),
        sa.Column("attempts", sa.Integer(), nullable=False),
        sa.Column("error", sa.String(), nullable=True),
        sa.Column("created_ms", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), nullable=False),
        sa.Column("updated_ms", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), nullable=False),
        sa.CheckConstraint("kind IN ('advance', 'finish')", name=op.f("ck_jobs_kind")),
        sa.CheckConstraint("state IN ('queued', 'running', 'done', 'failed')", name=op.f("ck_jobs_state")),
        sa.ForeignKeyConstraint(["session_id"], ["sessions.id"], name=op.f("fk_jobs_sessions"), ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_jobs")),
        sa.UniqueConstraint("session_id", "kind", name=op.f("uq_jobs")),
        sqlite_autoincrement=True,
    )
    op.create_table(
        "rods",
        sa.Column("session_id", sa.String(length=40), nullable=False),
        sa.Column("rod_id", sa.String(), nullable=False),
        sa.Column("position", sa.Integer(), nullable=False),
        sa.Column("x_m", sa.Float(), nullable=False),
        sa.Column("y_m", sa.Float(), nullable=False),
        sa.Column("outer_radius_m", sa.Float(), nullable=False),
        sa.Column("inner_radius_m", sa.Float(), nullable=False),
        sa.ForeignKeyConstraint(["session_id"], ["sessions.id"], name=op.f("fk_rods_sessions"), ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("session_id", "rod_id", name=op.f("pk_rods")),
    )
    op.create_table(
        "snapshots",
        sa.Column("id", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), nullable=False),
        sa.Column("session_id", sa.String(length=40), nullable=False),
        sa.Column("robot", sa.String(), nullable=False),
        sa.Column("boot", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), nullable=False),
        sa.Column("sequence", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), nullable=False),
        sa.Column("captured_ms", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), nullable=False),
        sa.Column("received_ms", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), nullable=False),
        sa.Column("x_m", sa.Float(), nullable=False),
        sa.Column("y_m", sa.Float(), nullable=False),
        sa.Column("theta_rad", sa.Float(), nullable=False),
        sa.Column("digest", sa.String(length=64), nullable=False),
        sa.Column("size_bytes", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), nullable=False),
        sa.Column("media_type", sa.String(length=20), nullable=False),
        sa.ForeignKeyConstraint(
            ["session_id"], ["sessions.id"], name=op.f("fk_snapshots_sessions"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_snapshots")),
        sa.UniqueConstraint("session_id", "robot", "boot", "sequence", name=op.f("uq_snapshots")),
        sqlite_autoincrement=True,
    )
    op.create_index(
        op.f("ix_snapshots_session_id_snapshots_captured_ms"), "snapshots", ["session_id", "captured_ms"], unique=False
    )
    op.create_index(op.f("ix_snapshots_session_id_snapshots_id"), "snapshots", ["session_id", "id"], unique=False)
    op.create_table(
        "tiles",
        sa.Column("session_id", sa.String(length=40), nullable=False),
        sa.Column("layer", sa.String(length=20), nullable=False),
        sa.Column("x", sa.Integer(), nullable=False),
        sa.Column("y", sa.Integer(), nullable=False),
        sa.Column("revision", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), nullable=False),
        sa.Column("content", sa.LargeBinary(), nullable=False),
        sa.ForeignKeyConstraint(["session_id"], ["sessions.id"], name=op.f("fk_tiles_sessions"), ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("session_id", "layer", "x", "y", name=op.f("pk_tiles")),
    )
    op.create_table(
        "poses",
        sa.Column("snapshot_id", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), nullable=False),
        sa.Column("session_id", sa.String(length=40), nullable=False),
        sa.Column("revision", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), nullable=False),
        sa.Column("status", sa.String(length=10), nullable=False),
        sa.Column("x_m", sa.Float(), nullable=True),
        sa.Column("y_m", sa.Float(), nullable=True),
        sa.Column("theta_rad", sa.Float(), nullable=True),
        sa.Column("sigma_xy_m", sa.Float(), nullable=True),
        sa.Column("sigma_theta_rad", sa.Float(), nullable=True),
        sa.Column("log_odds", sa.Float(), nullable=False),
        sa.Column("fault", sa.String(), nullable=True),
        sa.CheckConstraint("status IN ('placed', 'uncertain', 'rejected')", name=op.f("ck_poses_status")),
        sa.ForeignKeyConstraint(["session_id"], ["sessions.id"], name=op.f("fk_poses_sessions"), ondelete="CASCADE"),
        sa.ForeignKeyConstraint(["snapshot_id"], ["snapshots.id"], name=op.f("fk_poses_snapshots"), ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("snapshot_id", name=op.f("pk_poses")),
    )
    op.create_index(op.f("ix_poses_session_id_poses_revision"), "poses", ["session_id", "revision"], unique=False)
    op.create_index(op.f("ix_poses_session_id_poses_status"), "poses", ["session_id", "status"], unique=False)
    op.create_table(
        "rod_readings",
        sa.Column("session_id", sa.String(length=40), nullable=False),
        sa.Column("rod_id", sa.String(), nullable=False),
        sa.Column("revision", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), nullable=False),
        sa.Column("state", sa.String(length=10), nullable=False),
        sa.Column("fill", sa.Float(), nullable=True),
        sa.Column("confidence", sa.Float(), nullable=False),
        sa.Column("views", sa.Integer(), nullable=False),
        sa.Column("conflicting", sa.Boolean(), nullable=False),
        sa.CheckConstraint("state IN ('empty', 'partial', 'full', 'unseen')", name=op.f("ck_rod_readings_state")),
        sa.ForeignKeyConstraint(
            ["session_id", "rod_id"],
            ["rods.session_id", "rods.rod_id"],
            name=op.f("fk_rod_readings_rods"),
            ondelete="CASCADE",
        ),
        sa.PrimaryKeyConstraint("session_id", "rod_id", name=op.f("pk_rod_readings")),
    )


def downgrade() -> None:
    op.drop_table("rod_readings")
    op.drop_index(op.f("ix_poses_session_id_poses_status"), table_name="poses")
    op.drop_index(op.f("ix_poses_session_id_poses_revision"), table_name="poses")
    op.drop_table("poses")
    op.drop_table("tiles")
    op.drop_index(op.f("ix_snapshots_session_id_snapshots_id"), table_name="snapshots")
    op.drop_index(op.f("ix_snapshots_session_id_snapshots_captured_ms"), table_name="snapshots")
    op.drop_table("snapshots")
    op.drop_table("rods")
    op.drop_table("jobs")
    op.drop_table("sessions")
