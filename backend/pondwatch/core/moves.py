"""Whether a pose is otherwise than it was."""

from __future__ import annotations

import numpy as np

from .frames import wrap_angle
from .values import CorrectedPose, Float


def same(before: CorrectedPose | None, after: CorrectedPose) -> bool:
    """To the last digit: what is settled must not depend on what stood before."""
    return (
        before is not None
        and (before.status, before.log_odds) == (after.status, after.log_odds)
        and _equal(before.pose_pond, after.pose_pond)
        and _equal(before.covariance, after.covariance)
    )


def _equal(a: Float | None, b: Float | None) -> bool:
    return a is b if a is None or b is None else np.array_equal(a, b)


def differs(before: CorrectedPose | None, after: CorrectedPose, reach_m: float) -> bool:
    """In its status, or by more than the reach, or a thousandth of a radian."""
    if before is None or before.status != after.status or (before.pose_pond is None) != (after.pose_pond is None):
        return True
    if before.pose_pond is None or after.pose_pond is None:
        return False
    d = after.pose_pond - before.pose_pond
    return bool(np.hypot(d[0], d[1]) > reach_m or abs(wrap_angle(d[2])) > 1e-3)
