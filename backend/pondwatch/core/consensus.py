"""What the looks at a floor agree on: the median of them, pixel by pixel, in the raster.

Pure: arrays in, arrays out. A mean of looks shows faintly whatever drifted through one of them; a median of three looks
or more does not. Light that differs from look to look would, so each look is first brought to the light of their mean,
over `_LIGHT_PX`: what is smaller than that, and in all looks, is left as it is.

A median of a fixed number of 8-bit looks is taken by a sorting network over whole rasters (Batcher, "Sorting networks
and their applications", doi:10.1145/1468075.1468121), which costs two passes a comparison and no sort. Memory: `_DEPTH`
looks of a band of at most `_BAND_PX` pixels, 22 MB, for each band that is worked on.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from .frames import footprint_pond, image_to_raster_affine, pond_to_raster, raster_size_px
from .ports import Spread, one_by_one
from .values import Bool, Camera, Float, Image, Pond, Rect

_DEPTH = 11  # looks at a pixel that are held; further ones are left out
_BAND_PX = 500_000
_LIGHT_PX = 20  # of the raster: over which looks are brought to one light
_COARSE = 4  # pixels a side that the light is worked out on
_MOST_GAIN = 2.5
_BURNT = 248  # grey levels, from which a colour may be brighter than the camera can tell
_BURNT_SHARE = 0.2  # of the looks
_RIM_PX = 2  # of a snapshot's border that is left out


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """A snapshot at its place. image: (H, W, 3), BGR. pose_pond: (3,)."""

    image: Image
    pose_pond: Float


@dataclass(frozen=True, slots=True, eq=False)
class Consensus:
    """image: (h, w, 3), BGR, the median; 0 where nothing was seen. count: (h, w), looks that it is of, at most
    `_DEPTH`. burnt: (h, w), where a colour may be brighter than some looks can tell. metres_per_pixel: of the raster.
    warps: the looks as they lie in it."""

    image: Image
    count: NDArray[np.uint8]
    burnt: Bool
    metres_per_pixel: float
    warps: tuple[Warp, ...]


def consensus(
    looks: Sequence[Look], camera: Camera, pond: Pond, metres_per_pixel: float, spread: Spread = one_by_one
) -> Consensus:
    """The median of the looks at every pixel of a raster over the pond."""
    width, height = raster_size_px(pond, metres_per_pixel)
    warps = tuple(Warp.of(look, camera, pond, metres_per_pixel) for look in looks)
    rows = -(-height // max(1, -(-height * width // _BAND_PX)))
    bands = [Rect(0, top, width, min(rows, height - top)) for top in range(0, height, rows)]
    made = spread(lambda band: _of_band([w for w in warps if w.part(band)], band), bands, (), large=True)
    image, count, burnt = (np.concatenate(part) for part in zip(*made, strict=True))
    return Consensus(image, count, burnt, metres_per_pixel, warps)


@dataclass(frozen=True, slots=True, eq=False)
class Warp:
    """A look as it lies in the raster. rect: what it covers there. back: (2, 3), from the rectangle to the image."""

    look: Look
    rect: Rect
    back: Float

    @classmethod
    def of(cls, look: Look, camera: Camera, pond: Pond, metres_per_pixel: float) -> Warp:
        """Where a look lies in the raster of a pond."""
        corners = pond_to_raster(footprint_pond(look.pose_pond, camera), pond, metres_per_pixel)
        size = np.array(raster_size_px(pond, metres_per_pixel))
        low = np.clip(np.ceil(corners.min(axis=0)), 0, size).astype(int)
        high = np.clip(np.floor(corners.max(axis=0)) + 1, 0, size).astype(int)
        there = image_to_raster_affine(look.pose_pond, camera, pond, metres_per_pixel)
        there[:, 2] -= low
        back = np.linalg.inv(there[:, :2])
        x, y, wide, tall = (int(v) for v in (*low, *np.maximum(high - low, 0)))
        return cls(look, Rect(x, y, wide, tall), np.column_stack([back, -back @ there[:, 2]]))

    def part(self, band: Rect) -> tuple[slice, slice] | None:
        """Which rows of the rectangle lie in a band as wide as the raster, and which of the band's they are."""
        low, high = max(self.rect.y, band.y), min(self.rect.y + self.rect.height, band.y + band.height)
        if low >= high or not self.rect.width:
            return None
        return slice(low - self.rect.y, high - self.rect.y), slice(low - band.y, high - band.y)

    def drawn(self) -> Image:
        """(h, w, 4): the look in its rectangle; alpha 255 where it was seen, its outermost pixels left out."""
        height, width = self.look.image.shape[:2]
        alpha = np.zeros((height, width), np.uint8)
        alpha[_RIM_PX:-_RIM_PX, _RIM_PX:-_RIM_PX] = 255
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        size = (self.rect.width, self.rect.height)
        image = cv2.merge([self.look.image, alpha])
        return np.asarray(cv2.warpAffine(image, self.back, size, flags=flags, borderMode=cv2.BORDER_CONSTANT), np.uint8)


def _of_band(warps: Sequence[Warp], band: Rect) -> tuple[Image, NDArray[np.uint8], Bool]:
    """The median of a band, of how many looks, and where some of them are burnt."""
    parts = [part for warp in warps if (part := _part(warp, band)) is not None]
    mean, ever, burnt = _mean(parts, band)
    stack = np.zeros((_DEPTH, band.height, band.width), np.uint32)  # four bytes a pixel move as one
    count = np.zeros((band.height, band.width), np.uint8)
    place = np.arange(count.size).reshape(count.shape)
    for rows, columns, bgra in parts:
        lit = in_light_of(bgra, mean[rows, columns], ~ever[rows, columns]).view(np.uint32)[..., 0]
        slot = count[rows, columns]
        free = (bgra[..., 3] == 255) & (slot < _DEPTH)
        which = np.flatnonzero(free)
        at = place[rows, columns].reshape(-1)[which] + slot.reshape(-1)[which] * np.int64(count.size)
        stack.reshape(-1)[at] = lit.reshape(-1)[which]
        slot += free
    for slot_number in range(_DEPTH):  # what was not seen is darkest and brightest in turn: it outweighs itself
        for turn, filler in enumerate((0, 0xFFFFFFFF)):
            absent = (count <= slot_number) & ((slot_number - count) % 2 == turn)
            stack[slot_number][absent] = filler
    middle = _median(stack.view(np.uint8).reshape(*stack.shape, 4))[..., :3]
    return np.where((count > 0)[..., None], middle, np.uint8(0)), count, burnt


def _part(warp: Warp, band: Rect) -> tuple[slice, slice, Image] | None:
    """A look's rows and columns in a band, and its pixels there."""
    part = warp.part(band)
    if part is None:
        return None
    columns = slice(warp.rect.x, warp.rect.x + warp.rect.width)
    return part[1], columns, np.ascontiguousarray(warp.drawn()[part[0]])


def _mean(parts: Sequence[tuple[slice, slice, Image]], band: Rect) -> tuple[Image, Bool, Bool]:
    """(h, w, 4): the plain mean of a band's looks; and (h, w), where one of them is burnt, and where some are."""
    total = np.zeros((band.height, band.width, 4), np.float32)
    burnt = np.zeros((band.height, band.width), np.uint8)
    for rows, columns, bgra in parts:
        seen = (bgra[..., 3:] == 255).astype(np.float32)
        total[rows, columns] += cv2.multiply(bgra, cv2.merge([seen] * 4), dtype=cv2.CV_32F)
        within = cv2.inRange(bgra, (0, 0, 0, 0), (_BURNT - 1, _BURNT - 1, _BURNT - 1, 255))
        burnt[rows, columns] += within == 0
    share = np.maximum(total[..., 3:], 1) / 255
    return (total / share + 0.5).clip(0, 255).astype(np.uint8), burnt > 0, burnt > _BURNT_SHARE * share[..., 0]


def in_light_of(bgra: Image, mean: Image, true: Bool) -> Image:
    """An image (h, w, 4) brought to the light of a mean, over `_LIGHT_PX`, by a gain for each colour, which is told by
    what is `true` (h, w): a burnt pixel is darker than the light it had."""
    size = (max(1, bgra.shape[1] // _COARSE), max(1, bgra.shape[0] // _COARSE))
    mask = np.where(true & (bgra[..., 3] == 255), np.uint8(255), np.uint8(0))
    seen = (cv2.bitwise_and(part, part, mask=mask).astype(np.float32) for part in (bgra, mean))
    both = (cv2.resize(part, size, interpolation=cv2.INTER_AREA) for part in seen)
    own, common = (cv2.blur(part, (_LIGHT_PX // _COARSE, _LIGHT_PX // _COARSE)) for part in both)
    gain = np.clip((common + 1) / (own + 1), 1 / _MOST_GAIN, _MOST_GAIN)  # of alpha it is 1
    fine = cv2.resize(gain, bgra.shape[1::-1], interpolation=cv2.INTER_LINEAR)
    return np.asarray(cv2.multiply(bgra, fine, dtype=cv2.CV_8U), np.uint8)


def _median(stack: NDArray[np.uint8]) -> Image:
    """The middle of (K, h, w, n), K odd. The stack is sorted in place."""
    for low, high in _network(len(stack)):
        less = np.minimum(stack[low], stack[high])
        np.maximum(stack[low], stack[high], out=stack[high])
        stack[low] = less
    return np.asarray(stack[len(stack) // 2])


@lru_cache(maxsize=4)
def _network(count: int) -> tuple[tuple[int, int], ...]:
    """The comparisons of Batcher's odd-even merge sort, for as many as `count`."""
    out = []
    p = 1
    while p < count:
        k = p
        while k >= 1:
            for j in range(k % p, count - k, 2 * k):
                for i in range(min(k, count - j - k)):
                    if (i + j) // (2 * p) == (i + j + k) // (2 * p):
                        out.append((i + j, i + j + k))
            k //= 2
        p *= 2
    return tuple(out)
