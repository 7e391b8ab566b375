"""The method `identity`: the poses as they came. What every other method is shown beside."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from .values import (
    CorrectedPose,
    Correction,
    Inspection,
    Quality,
    RodReading,
    RodState,
    Snapshot,
    SnapshotKey,
    Status,
)


class IdentityCorrector:
    """Believes the localisation. Reads no rods."""

    method = "identity"

    def __init__(self, inspection: Inspection) -> None:
        self._inspection = inspection
        self._poses: dict[SnapshotKey, CorrectedPose] = {}

    def add(self, snapshots: Sequence[Snapshot]) -> Correction:
        """Every snapshot lies where its pose says."""
        noise = self._inspection.pose_noise
        sigma = (noise.sigma_xy_m, noise.sigma_xy_m, noise.sigma_theta_rad) if noise else (0.0, 0.0, 0.0)
        covariance = np.diag(np.square(sigma))
        new = tuple(CorrectedPose(s.key, s.pose_pond, covariance, Status.PLACED) for s in snapshots)
        self._poses.update({p.key: p for p in new})
        return Correction(new, (), self.quality())

    def settle(self) -> Correction:
        """Nothing moves."""
        return Correction((), (), self.quality())

    def poses(self) -> Mapping[SnapshotKey, CorrectedPose]:
        """Every pose as it came."""
        return self._poses

    def rods(self) -> tuple[RodReading, ...]:
        """All unseen."""
        return tuple(RodReading(r.id, RodState.UNSEEN, None, 0.0, 0) for r in self._inspection.pond.rods)

    def quality(self) -> Quality:
        """Counts alone."""
        n = len(self._poses)
        return Quality(n, n, 0, 0, sentence=f"{n} snapshots lie where their robots said; nothing was corrected.")
