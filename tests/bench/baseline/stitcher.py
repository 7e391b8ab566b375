"""Baseline: OpenCV's own stitcher, in the mode that it has for scans of a plane.

It takes pictures and no poses, keeps the largest group that it believes to hang together, and gives each of these
an affine map into a frame of its own. One similarity, fitted by RANSAC to the noisy poses, brings that frame into the
pond.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import cv2
import numpy as np

from pondwatch.core.frames import centre_px
from pondwatch.core.values import Bool, Float, Image, Inspection

REACH_SIGMA, REACH_PX = 3.0, 60.0  # of the fit to the noisy poses, where they say how far they are off and where not


def stitched(inspection: Inspection, images: Sequence[Image], noisy: Float) -> tuple[Float, Bool]:
    """Poses (N, 3), pond frame, and which of them the stitcher gave: (N,). The others are as they came."""
    given = np.zeros(len(images), bool)
    maps = _maps(images)
    if len(maps) < 3:
        return noisy, given
    # which way round its maps go is not documented: the way that fits the noisy poses better is taken
    ways = [
        _in_pond(inspection, which, noisy)
        for which in (maps, {k: np.asarray(np.linalg.inv(v)) for k, v in maps.items()})
    ]
    agreed, poses = max(ways, key=lambda way: way[0])
    if not agreed:
        return noisy, given
    given[list(maps)] = True
    return np.where(given[:, None], poses, noisy), given


def _maps(images: Sequence[Image]) -> dict[int, Float]:
    """Picture to (3, 3), px to px; empty where it refuses or fails."""
    stitcher = cv2.Stitcher.create(cv2.Stitcher_SCANS)
    try:
        if stitcher.estimateTransform(list(images)) != cv2.Stitcher_OK:
            return {}
    except cv2.error:
        return {}
    found = {int(k): c.R.astype(np.float64) for k, c in zip(stitcher.component(), stitcher.cameras(), strict=True)}
    return {k: r for k, r in found.items() if np.isfinite(r).all() and abs(np.linalg.det(r)) > 1e-6}


def _in_pond(inspection: Inspection, maps: Mapping[int, Float], noisy: Float) -> tuple[int, Float]:
    """How many centres the fit brings near their noisy ones, and (N, 3) poses in the pond."""
    m, noise = inspection.camera.metres_per_pixel, inspection.pose_noise
    order, centre = list(maps), np.append(centre_px(inspection.camera), 1.0)
    flip = np.array([1.0, -1.0])  # its v goes down, the pond's y up
    placed = np.array([(maps[k] @ centre)[:2] for k in order]) * flip
    reach = REACH_SIGMA * noise.sigma_xy_m / m if noise else REACH_PX
    fit, inliers = cv2.estimateAffinePartial2D(
        placed, noisy[order, :2] / m, method=cv2.RANSAC, ransacReprojThreshold=reach
    )
    poses = noisy.copy()
    if fit is None:
        return 0, poses
    turn = np.array([np.arctan2(-maps[k][1, 0], maps[k][0, 0]) for k in order]) + np.arctan2(fit[1, 0], fit[0, 0])
    poses[order] = np.column_stack([(placed @ fit[:, :2].T + fit[:, 2]) * m, turn])
    return int(inliers.sum()), poses
