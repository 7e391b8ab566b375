"""What travels between the server and its worker processes: small values and paths, never pixels."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from pondwatch.core.findings import Condition
from pondwatch.core.values import CorrectedPose, Inspection, Quality, Rect, RodReading, SnapshotKey, Status

Triple = tuple[float, float, float]
Place = tuple[int, int]  # of a tile of the finest level; x right, y down


@dataclass(frozen=True, slots=True)
class Shown:
    """A corrected pose as it is stored: m, m, rad, pond frame; None where rejected."""

    status: Status
    pose: Triple | None
    sigma_xy_m: float | None
    sigma_theta_rad: float | None

    @classmethod
    def of(cls, corrected: CorrectedPose) -> Shown:
        """What is stored of it."""
        pose = None
        if corrected.pose_pond is not None:
            x, y, theta = (float(v) for v in corrected.pose_pond)
            pose = x, y, theta
        return cls(corrected.status, pose, corrected.sigma_xy_m, corrected.sigma_theta_rad)


@dataclass(frozen=True, slots=True)
class SnapshotRef:
    """A stored snapshot. pose_pond: as it came, m, m, rad. shown: as corrected, None before it was."""

    id: int
    key: SnapshotKey
    captured_s: float
    pose_pond: Triple
    digest: str
    path: Path
    shown: Shown | None = None


@dataclass(frozen=True, slots=True)
class Base:
    """All that a worker needs to take up a session at a revision. rods: the readings that are stored. undrawn: its
    tiles that are behind."""

    session: str
    revision: int
    inspection: Inspection
    method: str
    snapshots: tuple[SnapshotRef, ...]
    rods: tuple[RodReading, ...]
    undrawn: tuple[Place, ...] = ()


@dataclass(frozen=True, slots=True)
class Failed:
    """An error as it travels to the server: what raised it may not be fit to."""

    message: str


@dataclass(frozen=True, slots=True)
class EncodedRect:
    """A rectangle of the mosaic's raster as a PNG with alpha."""

    rect: Rect
    content: bytes


@dataclass(frozen=True, slots=True)
class EncodedTile:
    """A tile of a layer's finest level as a PNG; x right, y down, in tiles."""

    layer: str
    x: int
    y: int
    content: bytes


@dataclass(frozen=True, slots=True)
class Moved:
    """A snapshot whose corrected pose is otherwise than stored. fault: why no corrector is shown it."""

    id: int
    shown: Shown
    log_odds: float = 0.0
    fault: str | None = None


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a revision changes. undrawn: tiles that change, to be drawn later; tiles: those drawn at once. seen_share:
    of the raster, from 0 to 1. thinking: a joint decision is being made beside. unshown: some of what moved is
    left for the next revision. correct_s, assemble_s: what deciding took, and what painting and encoding did.
    condition: of the floor, where it was looked over."""

    poses: tuple[Moved, ...]
    rods: tuple[RodReading, ...]
    quality: Quality
    patches: tuple[EncodedRect, ...]
    undrawn: tuple[Place, ...]
    seen_share: float
    thinking: bool = False
    unshown: bool = False
    correct_s: float = 0.0
    assemble_s: float = 0.0
    tiles: tuple[EncodedTile, ...] = ()
    condition: Condition | None = None
