"""Values that every room speaks of. Frozen; units and frames are in the names (see `frames.py`)."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]
Int = NDArray[np.int64]
Int32 = NDArray[np.int32]
Bool = NDArray[np.bool_]
Image = NDArray[np.uint8]  # (H, W, 3), BGR, 8 bits


class Status(enum.StrEnum):
    """How far a corrected pose can be trusted."""

    PLACED = "placed"
    UNCERTAIN = "uncertain"  # a best guess; another place is nearly as likely
    REJECTED = "rejected"  # not placed: no pose


class RodState(enum.StrEnum):
    """What a rod's inner circle holds. Thresholds on the fill: empty < 0.05, full > 0.95."""

    EMPTY = "empty"
    PARTIAL = "partial"
    FULL = "full"
    UNSEEN = "unseen"


@dataclass(frozen=True, slots=True)
class Camera:
    """A camera looking straight down, its lens taken to be free of distortion."""

    width_px: int
    height_px: int
    metres_per_pixel: float


@dataclass(frozen=True, slots=True)
class PoseNoise:
    """What the localisation claims of itself, one standard deviation; it may be wrong."""

    sigma_xy_m: float
    sigma_theta_rad: float


@dataclass(frozen=True, slots=True)
class Rod:
    """One rod of the design layout, pond frame. Geometry alone: nothing of how it looks."""

    id: str
    x_m: float
    y_m: float
    outer_radius_m: float
    inner_radius_m: float


@dataclass(frozen=True, slots=True)
class Pond:
    """The mapped floor: its size, pond frame, and the design layout. No rods: the pond is unmapped."""

    width_m: float
    height_m: float
    rods: tuple[Rod, ...] = ()


@dataclass(frozen=True, slots=True)
class Inspection:
    """What a session is before its first snapshot: the content of `session.json`."""

    name: str
    camera: Camera
    pond: Pond
    pose_noise: PoseNoise | None = None


@dataclass(frozen=True, slots=True, order=True)
class SnapshotKey:
    """What a snapshot is known by; sorted, it is the order that results do not depend on arrival through."""

    robot: str
    boot: int
    sequence: int


@dataclass(frozen=True, slots=True)
class RobotReport:
    """What a robot may say of itself beside a snapshot, each from 0 to 1, None where it says nothing. battery: charge
    left. link_loss: share of its radio packets that were lost lately. image_quality: by its own judgement."""

    battery: float | None = None
    link_loss: float | None = None
    image_quality: float | None = None


NO_REPORT = RobotReport()


@dataclass(frozen=True, slots=True, eq=False)
class Snapshot:
    """One picture with the pose that came with it.

    pose_pond: (3,), x m, y m, theta rad, noisy. image: (H, W, 3), BGR, 8 bits.
    captured_s: seconds since the epoch, UTC.
    """

    key: SnapshotKey
    captured_s: float
    pose_pond: Float
    image: Image


@dataclass(frozen=True, slots=True, eq=False)
class CorrectedPose:
    """Where a snapshot lies after correction.

    pose_pond: (3,), x m, y m, theta rad; None where rejected. covariance: (3, 3) in those units, None where
    rejected. `log_odds`: natural log of the odds of this place against all others.
    """

    key: SnapshotKey
    pose_pond: Float | None
    covariance: Float | None
    status: Status
    log_odds: float = 0.0

    @property
    def sigma_xy_m(self) -> float | None:
        """One standard deviation of x and of y (root mean square of the two)."""
        return None if self.covariance is None else float(np.sqrt((self.covariance[0, 0] + self.covariance[1, 1]) / 2))

    @property
    def sigma_theta_rad(self) -> float | None:
        """One standard deviation of theta."""
        return None if self.covariance is None else float(np.sqrt(self.covariance[2, 2]))


@dataclass(frozen=True, slots=True)
class RodReading:
    """What one rod was read as. fill: 0 to 1, None when unseen. confidence: probability that `state` is right.
    views: how many snapshots it was read from. conflicting: the looks disagree."""

    rod_id: str
    state: RodState
    fill: float | None
    confidence: float
    views: int
    conflicting: bool = False


@dataclass(frozen=True, slots=True)
class Quality:
    """How well a session is corrected. `sentence` says it to an operator in one line."""

    snapshots: int
    placed: int
    uncertain: int
    rejected: int
    sigma_xy_m: float | None = None  # estimated noise of the poses that came in
    sigma_theta_rad: float | None = None
    residual_px: float | None = None
    sentence: str = ""
    facts: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, eq=False)
class Correction:
    """What changed by a call of a corrector: every new pose and every earlier one that moved; every rod whose
    reading changed; the quality of the whole."""

    poses: tuple[CorrectedPose, ...]
    rods: tuple[RodReading, ...]
    quality: Quality


@dataclass(frozen=True, slots=True)
class Rect:
    """A rectangle of raster pixels, right and down from the pond's upper left corner."""

    x: int
    y: int
    width: int
    height: int
