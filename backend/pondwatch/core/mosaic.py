"""The mosaic: every snapshot warped into one raster over the pond, blended, and taken out again when it moves.

Pure: arrays in, arrays out. The raster frame is that of `frames.py`.

The sums are whole numbers: a snapshot adds `value x weight` (8 bits x 8 bits) a channel, so a mosaic does not depend
on the order of its snapshots, and one that moves or goes is subtracted without a trace. A weight falls smoothly from
255 to 1 towards the snapshot's border, so that seams fade.

A raster pixel takes 18 bytes: 3 x uint32 colour sums and a uint32 weight sum (65,535 looks of 255 x 255 fit), a
uint16 count of looks. `MAX_RASTER_PX` bounds the whole at 300 MB, of which an unseen floor touches nothing. The
pictures stay referenced, since subtracting needs them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from .errors import Invalid, InvalidImage
from .frames import image_to_pond, pond_to_raster, raster_size_px
from .values import Camera, Float, Float32, Image, Pond, Rect, SnapshotKey

MAX_RASTER_PX = 1 << 24
MAX_SIDE_PX = 16_384
_MARGIN = 0.25  # of the shorter side: how far from the border the weight is full


@dataclass(frozen=True, slots=True, eq=False)
class _Placed:
    image: Image
    pose_pond: Float
    captured_s: float
    rect: Rect
    raster_to_image: Float  # (2, 3), from pixels counted from the rectangle's first


def default_metres_per_pixel(camera: Camera, pond: Pond) -> float:
    """The camera's own scale, or as coarse as a raster within bounds needs."""
    scale = camera.metres_per_pixel
    coarser = math.sqrt(pond.width_m * pond.height_m / (MAX_RASTER_PX * 0.999)) / scale
    return scale * max(1.0, coarser, max(pond.width_m, pond.height_m) / MAX_SIDE_PX / scale)


class Mosaic:
    """A blended raster of the pond's floor.

    Raises:
        Invalid: a scale that asks for more pixels than `MAX_RASTER_PX`.
    """

    def __init__(self, camera: Camera, pond: Pond, metres_per_pixel: float | None = None) -> None:
        self._camera, self._pond = camera, pond
        self._scale = metres_per_pixel or default_metres_per_pixel(camera, pond)
        width, height = raster_size_px(pond, self._scale)
        if width * height > MAX_RASTER_PX or max(width, height) > MAX_SIDE_PX:
            raise Invalid(f"A mosaic of {width} x {height} pixels is over the limit.", limit_px=MAX_RASTER_PX)
        self._colour = np.zeros((height, width, 3), np.uint32)
        self._weight = np.zeros((height, width), np.uint32)
        self._looks = np.zeros((height, width), np.uint16)
        self._placed: dict[SnapshotKey, _Placed] = {}

    @property
    def size_px(self) -> tuple[int, int]:
        """(width, height), px."""
        return self._weight.shape[1], self._weight.shape[0]

    @property
    def metres_per_pixel(self) -> float:
        """The raster's scale."""
        return self._scale

    def put(self, key: SnapshotKey, image: Image, pose_pond: Float, captured_s: float = 0.0) -> list[Rect]:
        """Adds a snapshot, or moves it, or takes another picture for it.

        Args:
            image: (H, W, 3), BGR, the camera's size. Kept by reference: it must not change afterwards.
            pose_pond: (3,), m, m, rad, pond frame.

        Returns:
            The raster rectangles that changed, clipped to the raster; none where it lies off the pond.

        Raises:
            InvalidPose: not finite. InvalidImage: not of the camera's size.
        """
        if image.shape != (self._camera.height_px, self._camera.width_px, 3) or image.dtype != np.uint8:
            raise InvalidImage(f"The picture is {image.shape} of {image.dtype}, not of the camera's size.")
        pose = np.array(pose_pond, dtype=np.float64)
        before = self._placed.get(key)
        if before and before.image is image and (before.pose_pond == pose).all():
            self._placed[key] = self._place(image, pose, captured_s)
            return [] if before.captured_s == captured_s else self._rects(before)
        placed = self._place(image, pose, captured_s)
        changed = self.drop(key)
        self._add(placed)
        self._placed[key] = placed
        return merged([*changed, *self._rects(placed)])

    def drop(self, key: SnapshotKey) -> list[Rect]:
        """Takes a snapshot out; the raster rectangles that changed. Nothing where it never was in."""
        placed = self._placed.pop(key, None)
        if placed is None or not self._rects(placed):
            return []
        colour, weight = self._stamp(placed)
        part = _slices(placed.rect)
        self._colour[part] -= colour
        self._weight[part] -= weight
        self._looks[part] -= weight > 0
        return [placed.rect]

    def bgra(self, rect: Rect | None = None) -> Image:
        """(h, w, 4), 8 bits: the mosaic, or a rectangle of it; alpha 255 where seen, all 0 where not."""
        part = self._part(rect)
        weight = self._weight[part]
        out = np.zeros((*weight.shape, 4), np.uint8)
        divisor = np.maximum(weight, 1)
        for channel in range(3):  # in floats, whose quotients of such numbers never round up to a whole one
            sums = self._colour[(*part, channel)] + (divisor >> 1)
            np.divide(sums, divisor, out=out[..., channel], dtype=np.float64, casting="unsafe")
        np.multiply(weight > 0, 255, out=out[..., 3], casting="unsafe")
        return out

    def looks(self, rect: Rect | None = None) -> NDArray[np.uint16]:
        """(h, w): how many snapshots cover a pixel's centre."""
        return self._looks[self._part(rect)].copy()

    def last_seen_s(self, rect: Rect | None = None) -> Float:
        """(h, w), seconds since the epoch: when a pixel was last photographed; NaN where it never was."""
        area = rect or Rect(0, 0, *self.size_px)
        out = np.full((area.height, area.width), -np.inf)
        for placed in self._placed.values():
            both = _intersection(area, placed.rect)
            if both:
                inside = self._weights(placed, both) > 0
                view = out[_slices(Rect(both.x - area.x, both.y - area.y, both.width, both.height))]
                np.copyto(view, placed.captured_s, where=inside & (view < placed.captured_s))
        out[np.isneginf(out)] = np.nan
        return out

    def _place(self, image: Image, pose: Float, captured_s: float) -> _Placed:
        points = image_to_pond(_marks_px(self._camera), pose, self._camera)
        points = pond_to_raster(points, self._pond, self._scale)
        origin, right, down = points[4:]
        spans = zip(points[:4].min(axis=0).tolist(), points[:4].max(axis=0).tolist(), self.size_px, strict=True)
        (x, width), (y, height) = (_within(low, high, size) for low, high, size in spans)
        rect = Rect(x, y, width, height)
        to_raster = np.column_stack([right - origin, down - origin, origin - (x, y)])
        back = np.linalg.inv(to_raster[:, :2])
        return _Placed(image, pose, captured_s, rect, np.column_stack([back, -back @ to_raster[:, 2]]))

    def _rects(self, placed: _Placed) -> list[Rect]:
        return [placed.rect] if placed.rect.width and placed.rect.height else []

    def _add(self, placed: _Placed) -> None:
        if self._rects(placed):
            colour, weight = self._stamp(placed)
            part = _slices(placed.rect)
            self._colour[part] += colour
            self._weight[part] += weight
            self._looks[part] += weight > 0

    def _stamp(self, placed: _Placed) -> tuple[NDArray[np.uint16], NDArray[np.uint8]]:
        """What a snapshot adds to its rectangle: (h, w, 3) colour sums and (h, w) weights."""
        weight = self._weights(placed, placed.rect)
        size, flags = (placed.rect.width, placed.rect.height), cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        image = _prefiltered(placed.image, self._camera.metres_per_pixel / self._scale)
        warped = cv2.warpAffine(image, placed.raster_to_image, size, flags=flags, borderMode=cv2.BORDER_REPLICATE)
        return np.multiply(warped, cv2.merge([weight] * 3), dtype=np.uint16), weight

    def _weights(self, placed: _Placed, rect: Rect) -> NDArray[np.uint8]:
        """(h, w): the snapshot's weight at the pixels of a rectangle; 0 outside its footprint, else 1 to 255."""
        x = np.arange(rect.x - placed.rect.x, rect.x - placed.rect.x + rect.width)
        y = np.arange(rect.y - placed.rect.y, rect.y - placed.rect.y + rect.height)[:, None]
        camera, margin = self._camera, _MARGIN * min(self._camera.width_px, self._camera.height_px)
        inside: Float32 | None = None  # how deep a pixel lies in the footprint, in margins
        for (a, b, c), size in zip(placed.raster_to_image, (camera.width_px, camera.height_px), strict=True):
            depth = (a * x + (c - (size - 1) / 2)).astype(np.float32) + (b * y).astype(np.float32)
            np.subtract(np.float32(size / 2), np.abs(depth, out=depth), out=depth)
            depth *= np.float32(1 / margin)
            inside = depth if inside is None else np.minimum(inside, depth, out=inside)
        assert inside is not None
        seen = inside > 0
        t = np.clip(inside, 0, 1, out=inside)
        smooth = t * t
        smooth *= np.subtract(3, np.multiply(t, 2, out=t), out=t)
        smooth *= 254
        smooth += seen
        return smooth.astype(np.uint8)

    def _part(self, rect: Rect | None) -> tuple[slice, slice]:
        return _slices(rect or Rect(0, 0, *self.size_px))


def merged(rects: list[Rect]) -> list[Rect]:
    """The same pixels in one rectangle where that costs little more than two."""
    if len(rects) != 2:
        return rects
    a, b = rects
    x, y = min(a.x, b.x), min(a.y, b.y)
    width = max(a.x + a.width, b.x + b.width) - x
    height = max(a.y + a.height, b.y + b.height) - y
    worth = width * height <= 1.3 * (a.width * a.height + b.width * b.height)
    return [Rect(x, y, width, height)] if worth else rects


@lru_cache(maxsize=8)
def _marks_px(camera: Camera) -> Float:
    """(7, 2), px: the corners of the footprint, then the first pixel and those right of and below it."""
    w, h = camera.width_px - 0.5, camera.height_px - 0.5
    return np.array([[-0.5, -0.5], [w, -0.5], [w, h], [-0.5, h], [0, 0], [1, 0], [0, 1]])


def _within(low: float, high: float, size: int) -> tuple[int, int]:
    """The whole numbers from low to high that are at least 0 and less than size: the first, and how many."""
    first = math.ceil(min(max(low, 0), size))
    return first, max(0, math.floor(min(max(high, -1), size - 1)) + 1 - first)


def _slices(rect: Rect) -> tuple[slice, slice]:
    return slice(rect.y, rect.y + rect.height), slice(rect.x, rect.x + rect.width)


def _intersection(a: Rect, b: Rect) -> Rect | None:
    x, y = max(a.x, b.x), max(a.y, b.y)
    width, height = min(a.x + a.width, b.x + b.width) - x, min(a.y + a.height, b.y + b.height) - y
    return Rect(x, y, width, height) if width > 0 and height > 0 else None


def _prefiltered(image: Image, raster_px: float) -> Image:
    """The image without what a raster of `raster_px` pixels an image pixel cannot hold."""
    if raster_px > 0.8:
        return image
    sigma = 0.5 * math.sqrt(raster_px**-2 - 1)
    return np.asarray(cv2.GaussianBlur(image, (0, 0), sigma, borderType=cv2.BORDER_REPLICATE), np.uint8)
