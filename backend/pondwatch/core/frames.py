"""Rigid motions of the plane, and the three frames that a snapshot lives in.

Pure: arrays in, arrays out.

Frames
    image   pixels, u right, v down; the centre of the first pixel is (0, 0)
    pond    metres, x right, y up; origin at the lower left corner of the mapped floor
    raster  pixels of the mosaic, right and down; the first pixel fills the pond's upper left corner, so its
            centre (0, 0) lies half a pixel right of and below that corner

A pose is (x, y, theta): where the image centre lies in the pond, and the angle from the pond's x axis to the
image's u axis, counter-clockwise (REP-103 for a plan view).
"""

from __future__ import annotations

import numpy as np

from .errors import InvalidPose
from .values import Camera, Float, Pond


def wrap_angle(theta_rad: Float | float) -> Float:
    """The same angle in [-pi, pi)."""
    return np.asarray((np.asarray(theta_rad) + np.pi) % (2 * np.pi) - np.pi)


def centre_px(camera: Camera) -> Float:
    """(2,), px, image frame: the image's centre."""
    return np.array([(camera.width_px - 1) / 2, (camera.height_px - 1) / 2])


def _checked(pose: Float) -> Float:
    pose = np.asarray(pose, dtype=np.float64)
    if not np.isfinite(pose).all():
        raise InvalidPose("A pose has a value that is not finite.")
    return pose


def image_to_pond(points_px: Float, pose: Float, camera: Camera) -> Float:
    """Where image points lie in the pond.

    Args:
        points_px: (..., 2), px, image frame.
        pose: (3,), m, m, rad, pond frame.
        camera: gives the scale; the lens is taken to be free of distortion.

    Returns:
        (..., 2), m, pond frame, in the order given.

    Raises:
        InvalidPose: a pose with a value that is not finite.
    """
    x, y, theta = _checked(pose)
    d = (np.asarray(points_px, dtype=np.float64) - centre_px(camera)) * camera.metres_per_pixel
    c, s = np.cos(theta), np.sin(theta)
    a, b = d[..., 0], -d[..., 1]
    return np.stack([x + c * a - s * b, y + s * a + c * b], axis=-1)


def pond_to_image(points_pond: Float, pose: Float, camera: Camera) -> Float:
    """Where pond points (..., 2), m, lie in a snapshot at `pose`: (..., 2), px. Undoes `image_to_pond`."""
    x, y, theta = _checked(pose)
    d = np.asarray(points_pond, dtype=np.float64) - (x, y)
    c, s = np.cos(theta), np.sin(theta)
    a = c * d[..., 0] + s * d[..., 1]
    b = -s * d[..., 0] + c * d[..., 1]
    return np.stack([a, -b], axis=-1) / camera.metres_per_pixel + centre_px(camera)


def raster_size_px(pond: Pond, metres_per_pixel: float) -> tuple[int, int]:
    """(width, height), px, of a raster that covers the pond."""
    return max(1, round(pond.width_m / metres_per_pixel)), max(1, round(pond.height_m / metres_per_pixel))


def image_to_raster_affine(pose: Float, camera: Camera, pond: Pond, metres_per_pixel: float) -> Float:
    """(2, 3), px to px: the affine map from image points to raster points, as `cv2.warpAffine` takes it."""
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    raster = pond_to_raster(image_to_pond(corners, pose, camera), pond, metres_per_pixel)
    return np.column_stack([raster[1] - raster[0], raster[2] - raster[0], raster[0]])


def pond_to_raster(points_pond: Float, pond: Pond, metres_per_pixel: float) -> Float:
    """(..., 2), m, pond frame, to (..., 2), px, raster frame."""
    p = np.asarray(points_pond, dtype=np.float64)
    return np.stack([p[..., 0] / metres_per_pixel - 0.5, (pond.height_m - p[..., 1]) / metres_per_pixel - 0.5], axis=-1)


def raster_to_pond(points_px: Float, pond: Pond, metres_per_pixel: float) -> Float:
    """(..., 2), px, raster frame, to (..., 2), m, pond frame. Undoes `pond_to_raster`."""
    p = np.asarray(points_px, dtype=np.float64)
    x, y = (p[..., 0] + 0.5) * metres_per_pixel, pond.height_m - (p[..., 1] + 0.5) * metres_per_pixel
    return np.stack([x, y], axis=-1)


def footprint_pond(pose: Float, camera: Camera) -> Float:
    """(4, 2), m, pond frame: the corners of the ground that a snapshot covers, from the first pixel's, clockwise in
    the image."""
    w, h = camera.width_px - 0.5, camera.height_px - 0.5
    return image_to_pond(np.array([[-0.5, -0.5], [w, -0.5], [w, h], [-0.5, h]]), pose, camera)
