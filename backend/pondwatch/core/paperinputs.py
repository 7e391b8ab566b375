"""What the networks of Chen et al. (arXiv 2503.02752) look at: normalised poses, the mask of what is covered, the
noisy stitched image, binarised snapshots. Training and running share it, so that both see the same.

Pure: arrays in, arrays out. A canvas is a square picture of the whole pond, right and down from its upper left corner;
where the pond is not square its pixels are not either, as in the paper.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from .frames import footprint_pond, image_to_pond
from .values import Bool, Camera, Float, Float32, Pond

COUNT = 221  # snapshots of a session that the networks are built for
CANVAS_PX = 256
DARK_BELOW = 128  # grey levels: what is darker is a line or a fill
_SHIFT = 4  # bits behind the point of a polygon's corners
Grey = NDArray[np.uint8]


def normalised(poses_pond: Float, pond: Pond) -> Float:
    """(..., 3), m, m, rad, to x by the pond's width, y by its height, theta in rad."""
    return np.asarray(poses_pond, dtype=np.float64) / (pond.width_m, pond.height_m, 1.0)


def denormalised(poses: Float, pond: Pond) -> Float:
    """Undoes `normalised`."""
    return np.asarray(poses, dtype=np.float64) * (pond.width_m, pond.height_m, 1.0)


def covered(poses_pond: Float, camera: Camera, pond: Pond, size_px: tuple[int, int] = (CANVAS_PX, CANVAS_PX)) -> Bool:
    """Where a canvas is covered by at least one footprint.

    Args:
        poses_pond: (N, 3), m, m, rad.
        size_px: (width, height) of the canvas.

    Returns:
        (height, width).
    """
    width, height = size_px
    canvas = np.zeros((height, width), np.uint8)
    for pose in poses_pond:
        corners = _on_canvas(footprint_pond(pose, camera), pond, size_px)
        fixed = np.round(np.clip(corners, -1e6, 1e6) * (1 << _SHIFT)).astype(np.int32)
        cv2.fillConvexPoly(canvas, fixed, 1, cv2.LINE_8, _SHIFT)
    return canvas.astype(np.bool_)


def binarised(snapshots: Grey, size_px: tuple[int, int]) -> Float32:
    """Light as 1 and dark as 0, made smaller by area.

    Args:
        snapshots: (N, H, W), grey.
        size_px: (width, height) of what comes out.

    Returns:
        (N, height, width), 0 to 1.
    """
    light = [np.where(s < DARK_BELOW, np.float32(0), np.float32(1)) for s in snapshots]
    return np.stack([cv2.resize(s, size_px, interpolation=cv2.INTER_AREA) for s in light]).astype(np.float32)


def stitched(tiles: Float32, poses_pond: Float, camera: Camera, pond: Pond, side_px: int = CANVAS_PX) -> Float32:
    """The snapshots laid on a square canvas, later ones over earlier ones; 0 where there is none.

    Args:
        tiles: (N, h, w), 0 to 1, as `binarised` makes them in the size that `tile_size` says.

    Returns:
        (side_px, side_px), 0 to 1.
    """
    height, width = tiles.shape[1:]
    u, v = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
    points = np.stack([u * camera.width_px - 0.5, v * camera.height_px - 0.5], axis=-1)
    canvas = np.zeros(side_px * side_px, np.float32)
    for tile, pose in zip(tiles, poses_pond, strict=True):
        at = np.round(_on_canvas(image_to_pond(points, pose, camera), pond, (side_px, side_px))).astype(np.int64)
        inside = ((at >= 0) & (at < side_px)).all(axis=-1)
        canvas[at[inside][:, 1] * side_px + at[inside][:, 0]] = tile[inside]
    return canvas.reshape(side_px, side_px)


def tile_size(camera: Camera, pond: Pond, side_px: int = CANVAS_PX) -> tuple[int, int]:
    """(width, height), px, of tiles fine enough to leave no holes in a canvas."""
    scale = 1.5 * side_px * camera.metres_per_pixel / min(pond.width_m, pond.height_m)
    return max(1, int(np.ceil(scale * camera.width_px))), max(1, int(np.ceil(scale * camera.height_px)))


def grey_stack(images: Sequence[NDArray[np.uint8]]) -> Grey:
    """(N, H, W): pictures (H, W, 3), BGR, as grey."""
    return np.stack([cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) for image in images]).astype(np.uint8)


def smaller(canvas: NDArray[np.float32] | Bool, side_px: int) -> Float32:
    """A canvas made smaller by area: (side_px, side_px), 0 to 1."""
    shrunk = cv2.resize(np.asarray(canvas, np.float32), (side_px, side_px), interpolation=cv2.INTER_AREA)
    return np.asarray(shrunk, np.float32)


def _on_canvas(points_pond: Float, pond: Pond, size_px: tuple[int, int]) -> Float:
    """(..., 2), m, to px of a canvas; the first pixel's centre is (0, 0)."""
    x, y = points_pond[..., 0] / pond.width_m, 1 - points_pond[..., 1] / pond.height_m
    return np.stack([x * size_px[0] - 0.5, y * size_px[1] - 0.5], axis=-1)
