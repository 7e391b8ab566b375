"""What of the pond was seen, and how often: shares of the floor and of the rods, and which snapshot saw which rod.

Pure: arrays in, arrays out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .values import Bool, Camera, Float, Int, Pond

_CHUNK = 1024  # poses looked at together: bounds the memory at a few megabytes


@dataclass(frozen=True, slots=True)
class Coverage:
    """Shares from 0 to 1; `rods` and `rods_twice` are 0 where there is no layout."""

    floor: float
    floor_twice: float
    rods: float
    rods_twice: float


def coverage(looks: NDArray[np.uint16], views: Int) -> Coverage:
    """How much was seen once and twice.

    Args:
        looks: (h, w), snapshots over each raster pixel, as `Mosaic.looks` counts them.
        views: (R,), snapshots that saw each rod whole, as `rod_views` counts them.
    """

    def share(counts: NDArray[np.uint16] | Int, least: int) -> float:
        return float(np.count_nonzero(counts >= least) / counts.size) if counts.size else 0.0

    return Coverage(share(looks, 1), share(looks, 2), share(views, 1), share(views, 2))


def rods_in_view(poses_pond: Float, pond: Pond, camera: Camera) -> Bool:
    """Which snapshot has which rod's outer circle wholly inside its footprint.

    Args:
        poses_pond: (N, 3), m, m, rad, pond frame; a row that is not finite sees nothing.

    Returns:
        (N, R), in the layout's order.
    """
    poses = np.asarray(poses_pond, dtype=np.float64).reshape(-1, 3)
    rods = np.array([(r.x_m, r.y_m, r.outer_radius_m) for r in pond.rods]).reshape(-1, 3)
    out = np.zeros((len(poses), len(rods)), np.bool_)
    for start in range(0, len(poses), _CHUNK):
        out[start : start + _CHUNK] = _in_view(poses[start : start + _CHUNK], rods, camera)
    return out


def _in_view(poses: Float, rods: Float, camera: Camera) -> Bool:
    dx, dy = (rods[:, k] - poses[:, k, None] for k in (0, 1))
    c, s = np.cos(poses[:, 2, None]), np.sin(poses[:, 2, None])
    half = np.array([camera.width_px, camera.height_px]) * camera.metres_per_pixel / 2
    along, across = np.abs(c * dx + s * dy), np.abs(c * dy - s * dx)
    return np.asarray((along <= half[0] - rods[:, 2]) & (across <= half[1] - rods[:, 2]))


def rod_views(poses_pond: Float, pond: Pond, camera: Camera) -> Int:
    """(R,): how many snapshots saw each rod whole."""
    return np.asarray(rods_in_view(poses_pond, pond, camera).sum(axis=0), np.int64)
