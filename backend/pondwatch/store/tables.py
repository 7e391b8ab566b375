"""The tables. Times are whole milliseconds since the epoch, UTC; lengths in metres, pond frame; angles in radians.

Evidence (`sessions`, `rods`, `snapshots`) is written once and never changed but for a session's state; what is derived
(`poses`, `rod_readings`, `tiles`) carries the revision that last changed it, and can be rebuilt; `behind_tiles` says
which tiles are still to be drawn anew. `corrections` by further methods can be rebuilt too, and stand beside the
session's own result. `rod_history` keeps what rods read as before. What people said (`judgements`, `notes`) is only
ever added to.
"""

from __future__ import annotations

from sqlalchemy import BigInteger as _BigInteger
from sqlalchemy import (
    Boolean,
    CheckConstraint,
    Column,
    Float,
    ForeignKey,
    ForeignKeyConstraint,
    Index,
    Integer,
    LargeBinary,
    MetaData,
    String,
    Table,
    UniqueConstraint,
)

BigInteger = _BigInteger().with_variant(Integer(), "sqlite")

metadata = MetaData(
    naming_convention={
        "pk": "pk_%(table_name)s",
        "fk": "fk_%(table_name)s_%(referred_table_name)s",
        "uq": "uq_%(table_name)s",
        "ck": "ck_%(table_name)s_%(constraint_name)s",
        "ix": "ix_%(column_0_N_label)s",
    }
)

sessions = Table(
    "sessions",
    metadata,
    Column("id", String(40), primary_key=True),  # sorts by time of creation
    Column("name", String, nullable=False),
    Column("method", String(40), nullable=False),
    Column("created_ms", BigInteger, nullable=False),
    Column("camera_width_px", Integer, nullable=False),
    Column("camera_height_px", Integer, nullable=False),
    Column("camera_metres_per_pixel", Float, nullable=False),
    Column("pond_width_m", Float, nullable=False),
    Column("pond_height_m", Float, nullable=False),
    Column("noise_sigma_xy_m", Float),
    Column("noise_sigma_theta_rad", Float),
    Column("state", String(10), nullable=False),
    Column("finished_ms", BigInteger),
    Column("revision", BigInteger, nullable=False, default=0),
    Column("covered_through", BigInteger, nullable=False, default=0),  # the last snapshot id in a revision
    Column("seen_share", Float, nullable=False, default=0.0),  # of the raster
    Column("quality", String, nullable=False, default=""),
    Column("pond_id", String(40)),  # of `ponds`
    Column("layout_version", Integer),
    CheckConstraint("state IN ('open', 'finishing', 'finished', 'failed')", name="state"),
    Index(None, "pond_id", "id"),
)

rods = Table(
    "rods",
    metadata,
    Column("session_id", ForeignKey("sessions.id", ondelete="CASCADE"), primary_key=True),
    Column("rod_id", String, primary_key=True),
    Column("position", Integer, nullable=False),  # in the layout, from 0
    Column("x_m", Float, nullable=False),
    Column("y_m", Float, nullable=False),
    Column("outer_radius_m", Float, nullable=False),
    Column("inner_radius_m", Float, nullable=False),
)

snapshots = Table(
    "snapshots",
    metadata,
    Column("id", BigInteger, primary_key=True),  # in order of receipt
    Column("session_id", ForeignKey("sessions.id", ondelete="CASCADE"), nullable=False),
    Column("robot", String, nullable=False),
    Column("boot", BigInteger, nullable=False),
    Column("sequence", BigInteger, nullable=False),
    Column("captured_ms", BigInteger, nullable=False),
    Column("received_ms", BigInteger, nullable=False),
    Column("x_m", Float, nullable=False),
    Column("y_m", Float, nullable=False),
    Column("theta_rad", Float, nullable=False),
    Column("digest", String(64), nullable=False),  # SHA-256 of the image's bytes, hexadecimal
    Column("size_bytes", BigInteger, nullable=False),
    Column("media_type", String(20), nullable=False),
    Column("battery", Float),  # this and the next two: what the robot said of itself, 0 to 1
    Column("link_loss", Float),
    Column("image_quality", Float),
    UniqueConstraint("session_id", "robot", "boot", "sequence"),
    Index(None, "session_id", "id"),
    Index(None, "session_id", "captured_ms"),
    sqlite_autoincrement=True,
)

poses = Table(
    "poses",
    metadata,
    Column("snapshot_id", ForeignKey("snapshots.id", ondelete="CASCADE"), primary_key=True),
    Column("session_id", ForeignKey("sessions.id", ondelete="CASCADE"), nullable=False),  # for the index below
    Column("revision", BigInteger, nullable=False),
    Column("status", String(10), nullable=False),
    Column("x_m", Float),
    Column("y_m", Float),
    Column("theta_rad", Float),
    Column("sigma_xy_m", Float),
    Column("sigma_theta_rad", Float),
    Column("log_odds", Float, nullable=False, default=0.0),
    Column("fault", String),  # why no corrector was shown it
    CheckConstraint("status IN ('placed', 'uncertain', 'rejected')", name="status"),
    Index(None, "session_id", "revision"),
    Index(None, "session_id", "status"),
)

rod_readings = Table(
    "rod_readings",
    metadata,
    Column("session_id", String(40), primary_key=True),
    Column("rod_id", String, primary_key=True),
    Column("revision", BigInteger, nullable=False),
    Column("state", String(10), nullable=False),
    Column("fill", Float),
    Column("confidence", Float, nullable=False),
    Column("views", Integer, nullable=False),
    Column("conflicting", Boolean(create_constraint=False), nullable=False, default=False),
    ForeignKeyConstraint(["session_id", "rod_id"], ["rods.session_id", "rods.rod_id"], ondelete="CASCADE"),
    CheckConstraint("state IN ('empty', 'partial', 'full', 'unseen')", name="state"),
)

rod_history = Table(  # what a rod read as, from a revision on
    "rod_history",
    metadata,
    Column("session_id", String(40), primary_key=True),
    Column("rod_id", String, primary_key=True),
    Column("revision", BigInteger, primary_key=True),
    Column("at_ms", BigInteger, nullable=False),
    Column("state", String(10), nullable=False),
    Column("fill", Float),
    Column("confidence", Float, nullable=False),
    Column("views", Integer, nullable=False),
    Column("conflicting", Boolean(create_constraint=False), nullable=False, default=False),
    ForeignKeyConstraint(["session_id", "rod_id"], ["rods.session_id", "rods.rod_id"], ondelete="CASCADE"),
    CheckConstraint("state IN ('empty', 'partial', 'full', 'unseen')", name="state"),
)

judgements = Table(  # what a person says of a rod, beside what the machine read then; no state: the machine is right
    "judgements",
    metadata,
    Column("id", BigInteger, primary_key=True),
    Column("session_id", String(40), nullable=False),
    Column("rod_id", String, nullable=False),
    Column("at_ms", BigInteger, nullable=False),
    Column("author", String, nullable=False),
    Column("state", String(10)),
    Column("fill", Float),
    Column("reason", String, nullable=False),
    Column("revision", BigInteger, nullable=False),  # the session's, when it was said
    Column("machine_state", String(10), nullable=False),
    Column("machine_fill", Float),
    Column("machine_confidence", Float, nullable=False),
    ForeignKeyConstraint(["session_id", "rod_id"], ["rods.session_id", "rods.rod_id"], ondelete="CASCADE"),
    CheckConstraint("state IN ('empty', 'partial', 'full')", name="state"),
    Index(None, "session_id", "rod_id"),
    Index(None, "at_ms"),
    sqlite_autoincrement=True,
)

notes = Table(  # of a rod, a place, a moment, or of all
    "notes",
    metadata,
    Column("id", BigInteger, primary_key=True),
    Column("session_id", ForeignKey("sessions.id", ondelete="CASCADE"), nullable=False),
    Column("at_ms", BigInteger, nullable=False),
    Column("author", String, nullable=False),
    Column("text", String, nullable=False),
    Column("rod_id", String),
    Column("x_m", Float),
    Column("y_m", Float),
    Column("moment_ms", BigInteger),
    Column("closed_ms", BigInteger),
    Column("closed_by", String),
    Column("revision", BigInteger, nullable=False),  # the session's, when it last changed
    Index(None, "session_id", "id"),
    Index(None, "at_ms"),
    sqlite_autoincrement=True,
)

tiles = Table(
    "tiles",
    metadata,
    Column("session_id", ForeignKey("sessions.id", ondelete="CASCADE"), primary_key=True),
    Column("layer", String(20), primary_key=True),
    Column("x", Integer, primary_key=True),  # in tiles of the finest level, right and down
    Column("y", Integer, primary_key=True),
    Column("revision", BigInteger, nullable=False),
    Column("content", LargeBinary, nullable=False),
)

behind_tiles = Table(
    "behind_tiles",
    metadata,
    Column("session_id", ForeignKey("sessions.id", ondelete="CASCADE"), primary_key=True),
    Column("x", Integer, primary_key=True),
    Column("y", Integer, primary_key=True),
    Column("since_revision", BigInteger, nullable=False),  # the first that the tile does not show
    Column("until_revision", BigInteger, nullable=False),  # the last
)

corrections = Table(
    "corrections",
    metadata,
    Column("id", BigInteger, primary_key=True),
    Column("session_id", ForeignKey("sessions.id", ondelete="CASCADE"), nullable=False),
    Column("method", String(40), nullable=False),
    Column("state", String(10), nullable=False),
    Column("error", String),
    Column("revision", BigInteger, nullable=False),  # the session's, of which it corrects the snapshots
    Column("quality", String, nullable=False, default=""),
    Column("created_ms", BigInteger, nullable=False),
    Column("finished_ms", BigInteger),
    UniqueConstraint("session_id", "method"),
    CheckConstraint("state IN ('queued', 'running', 'done', 'failed')", name="state"),
    sqlite_autoincrement=True,
)

correction_poses = Table(
    "correction_poses",
    metadata,
    Column("correction_id", ForeignKey("corrections.id", ondelete="CASCADE"), primary_key=True),
    Column("snapshot_id", ForeignKey("snapshots.id", ondelete="CASCADE"), primary_key=True),
    Column("status", String(10), nullable=False),
    Column("x_m", Float),
    Column("y_m", Float),
    Column("theta_rad", Float),
    Column("sigma_xy_m", Float),
    Column("sigma_theta_rad", Float),
    Column("log_odds", Float, nullable=False, default=0.0),
    Column("fault", String),
    CheckConstraint("status IN ('placed', 'uncertain', 'rejected')", name="status"),
)

correction_rods = Table(
    "correction_rods",
    metadata,
    Column("correction_id", ForeignKey("corrections.id", ondelete="CASCADE"), primary_key=True),
    Column("rod_id", String, primary_key=True),
    Column("state", String(10), nullable=False),
    Column("fill", Float),
    Column("confidence", Float, nullable=False),
    Column("views", Integer, nullable=False),
    Column("conflicting", Boolean(create_constraint=False), nullable=False, default=False),
    CheckConstraint("state IN ('empty', 'partial', 'full', 'unseen')", name="state"),
)

seals = Table(
    "seals",
    metadata,
    Column("session_id", ForeignKey("sessions.id", ondelete="CASCADE"), primary_key=True),
    Column("manifest", LargeBinary, nullable=False),  # JSON, as it was signed
    Column("signature", LargeBinary, nullable=False),
)

jobs = Table(
    "jobs",
    metadata,
    Column("id", BigInteger, primary_key=True),
    Column("session_id", ForeignKey("sessions.id", ondelete="CASCADE"), nullable=False),
    Column("kind", String(20), nullable=False),
    Column("state", String(10), nullable=False),
    Column("progress", Float, nullable=False, default=0.0),
    Column("attempts", Integer, nullable=False, default=0),
    Column("error", String),
    Column("created_ms", BigInteger, nullable=False),
    Column("updated_ms", BigInteger, nullable=False),
    UniqueConstraint("session_id", "kind"),
    CheckConstraint("kind IN ('advance', 'finish', 'correct')", name="kind"),
    CheckConstraint("state IN ('queued', 'running', 'done', 'failed')", name="state"),
    sqlite_autoincrement=True,
)
