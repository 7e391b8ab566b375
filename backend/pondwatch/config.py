"""Settings of a running Pondwatch: from the environment (`PONDWATCH_…`) or handed in by the command line."""

from __future__ import annotations

import os
from pathlib import Path

from platformdirs import user_data_path
from pydantic import Field
from pydantic_settings import BaseSettings, SettingsConfigDict

from pondwatch.core.conditions import Limits

MIB = 1 << 20


class Settings(BaseSettings):
    """Everything that an operator can set. Sizes are in bytes, times in seconds."""

    model_config = SettingsConfigDict(env_prefix="PONDWATCH_", extra="ignore")

    data: Path = Field(default_factory=lambda: user_data_path("pondwatch"), description="Folder of all that is kept.")
    host: str = Field(
        default="127.0.0.1", description="Address to listen at. Others than loopback expose it to the network."
    )
    port: int = Field(default=8000, ge=0, le=65535, description="Port to listen at; 0 lets the system choose.")
    database_url: str | None = Field(
        default=None, description="SQLAlchemy URL; SQLite in the data folder where absent."
    )
    method: str = Field(default="auto", description="Correction method of sessions that name none.")
    workers: int = Field(
        default_factory=lambda: max(2, (os.cpu_count() or 2) - 1),
        ge=1,
        le=64,
        description="Worker processes that decode, correct and assemble.",
    )
    job_timeout_s: float = Field(
        default=600.0, gt=0, description="After this long a worker that does not answer is replaced."
    )
    max_image_bytes: int = Field(default=32 * MIB, ge=1, description="Largest snapshot file.")
    max_batch_bytes: int = Field(default=64 * MIB, ge=1, description="Largest body of a batch of snapshots.")
    max_batch_items: int = Field(default=256, ge=1, description="Most snapshots in a batch.")
    max_session_bytes: int = Field(default=16 * MIB, ge=1, description="Largest body of a new session (its layout).")
    body_timeout_s: float = Field(default=60.0, gt=0, description="A request body must have arrived after this long.")
    feed_revisions: int = Field(default=1_000, ge=0, description="Revisions whose exact patches are kept for viewers.")
    feed_bytes: int = Field(default=64 * MIB, ge=0, description="Most memory that those patches may take.")
    alarm_silent_s: float = Field(default=8.0, gt=0, description="After this long unheard a robot is called silent.")
    alarm_uncertain_share: float = Field(
        default=0.1, ge=0, le=1, description="Share of snapshots not surely placed from which the correction is poor."
    )
    alarm_least_snapshots: int = Field(default=50, ge=1, description="Snapshots before the correction is judged.")
    alarm_coverage_share: float = Field(
        default=0.5, ge=0, le=1, description="Share of rods seen twice lately below which coverage is stale."
    )
    alarm_coverage_s: float = Field(default=1800.0, gt=0, description="How long ago is lately, for coverage.")
    alarm_disk_bytes: int = Field(default=2048 * MIB, ge=0, description="Free bytes below which the disk is low.")
    rod_looks: int = Field(default=2, ge=1, description="Looks that must agree before a rod's shown state changes.")
    rod_sure: float = Field(default=0.8, ge=0, le=1, description="Probability that a changed state must have by then.")
    rod_fill_change: float = Field(
        default=0.2, gt=0, le=1, description="Change of a partly filled rod's fill that counts against the baseline."
    )
    allowed_origins: tuple[str, ...] = Field(default=(), description="Other origins whose pages may use the API.")

    @property
    def url(self) -> str:
        """The database's URL."""
        return self.database_url or f"sqlite:///{self.data.absolute() / 'pondwatch.sqlite'}"

    @property
    def alarm_limits(self) -> Limits:
        """From where on something is wrong."""
        return Limits(
            self.alarm_silent_s,
            self.alarm_uncertain_share,
            self.alarm_least_snapshots,
            self.alarm_coverage_share,
            self.alarm_coverage_s,
            self.alarm_disk_bytes,
            self.rod_looks,
            self.rod_sure,
            self.rod_fill_change,
        )

    @property
    def blobs(self) -> Path:
        """The folder of the snapshots' bytes."""
        return self.data / "blobs"
