"""The camera: an ideal picture of the floor at a pose, each pixel the mean of what it covers."""

from __future__ import annotations

import cv2
import numpy as np

from pondwatch.core.frames import image_to_pond
from pondwatch.core.values import Camera, Float, Float32

from .floor import Floor


def photograph(floor: Floor, pose_pond: Float, camera: Camera) -> Float32:
    """(H, W, 3), BGR, 0 to 255: the floor seen from a pose, before water and sensor.

    The floor is sampled on a grid `fine` times finer than the image, which is then averaged: edges are covered by
    area, and a point of the pond lies where `pond_to_image` says, to a hundredth of a pixel.
    """
    fine = max(2, round(camera.metres_per_pixel / floor.metres_per_pixel))
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])  # of the fine grid
    pond = image_to_pond((corners + 0.5) / fine - 0.5, pose_pond, camera)
    x = (pond[:, 0] - floor.left_m) / floor.metres_per_pixel - 0.5
    y = (floor.top_m - pond[:, 1]) / floor.metres_per_pixel - 0.5
    to_floor = np.array([[x[1] - x[0], x[2] - x[0], x[0]], [y[1] - y[0], y[2] - y[0], y[0]]])
    size = (camera.width_px * fine, camera.height_px * fine)
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    sampled = cv2.warpAffine(floor.image, to_floor, size, flags=flags, borderMode=cv2.BORDER_REPLICATE)
    mean = cv2.resize(sampled, (camera.width_px, camera.height_px), interpolation=cv2.INTER_AREA)
    return np.asarray(mean, np.float32)
