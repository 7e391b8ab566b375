"""What is known of every raster pixel beside its colour: looks, when it was last seen, how surely it lies where it is.

Pure: arrays in, arrays out. The raster frame is that of `frames.py`. Memory: 10 bytes a raster pixel, and a
snapshot's rectangle at a time.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .frames import footprint_pond, pond_to_image, pond_to_raster, raster_size_px, raster_to_pond
from .values import Camera, Float, Float32, Pond


@dataclass(frozen=True, slots=True, eq=False)
class Sight:
    """A snapshot as it counts here. pose_pond: (3,), m, m, rad. sigma_xy_m, sigma_theta_rad: None where unknown."""

    pose_pond: Float
    captured_s: float
    sigma_xy_m: float | None = None
    sigma_theta_rad: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Layers:
    """All (h, w). looks: snapshots over a pixel's centre. age_s: how long before the newest snapshot of all it was
    last seen; NaN where never. sigma_m: one standard deviation of its place, by the surest snapshot; NaN where none
    says."""

    looks: NDArray[np.uint16]
    age_s: Float32
    sigma_m: Float32


def layers(sights: Iterable[Sight], camera: Camera, pond: Pond, metres_per_pixel: float) -> Layers:
    """Lay snapshots over the raster; the order does not matter."""
    seen = sorted(sights, key=lambda s: s.captured_s)
    width, height = raster_size_px(pond, metres_per_pixel)
    looks = np.zeros((height, width), np.uint16)
    age, sigma = (np.full((height, width), np.nan, np.float32) for _ in range(2))
    newest = seen[-1].captured_s if seen else 0.0
    for sight in seen:
        corner, size = _rect(sight.pose_pond, camera, pond, metres_per_pixel, (width, height))
        if min(size) <= 0:
            continue
        part = slice(corner[1], corner[1] + size[1]), slice(corner[0], corner[0] + size[0])
        inside, distance = _within(sight.pose_pond, camera, pond, metres_per_pixel, corner, size)
        looks[part] += inside
        np.copyto(age[part], np.float32(newest - sight.captured_s), where=inside)
        if sight.sigma_xy_m is not None:
            turn = distance * (sight.sigma_theta_rad or 0.0)
            mine = np.sqrt(sight.sigma_xy_m**2 + turn**2).astype(np.float32)
            np.copyto(sigma[part], np.fmin(sigma[part], mine), where=inside)
    return Layers(looks, age, sigma)


def _rect(
    pose: Float, camera: Camera, pond: Pond, scale: float, size_px: tuple[int, int]
) -> tuple[tuple[int, int], tuple[int, int]]:
    """The raster pixels whose centres may lie in the footprint: the first (x, y), and (width, height)."""
    corners = pond_to_raster(footprint_pond(pose, camera), pond, scale)
    low = np.clip(np.ceil(corners.min(axis=0)), 0, size_px).astype(int)
    high = np.clip(np.floor(corners.max(axis=0)) + 1, 0, size_px).astype(int)
    return (int(low[0]), int(low[1])), (int(high[0] - low[0]), int(high[1] - low[1]))


def _within(
    pose: Float, camera: Camera, pond: Pond, scale: float, corner: tuple[int, int], size: tuple[int, int]
) -> tuple[NDArray[np.bool_], Float]:
    """Which pixels of a rectangle the snapshot covers, and how far from its centre each lies, m."""
    x, y = np.meshgrid(np.arange(size[0]) + corner[0], np.arange(size[1]) + corner[1])
    places = raster_to_pond(np.stack([x, y], axis=-1), pond, scale)
    at = pond_to_image(places, pose, camera)
    u, v = at[..., 0] + 0.5, at[..., 1] + 0.5
    inside = (u > 0) & (v > 0) & (u < camera.width_px) & (v < camera.height_px)
    return inside, np.hypot(places[..., 0] - pose[0], places[..., 1] - pose[1])
