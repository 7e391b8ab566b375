"""From rectangles that changed to what is stored and sent: patches of the mosaic and tiles of its layers, as PNG.

PNG: lossless, so that every viewer ends with the same pixels, and it has alpha.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from pondwatch.core.mosaic import Mosaic
from pondwatch.core.values import Image, Rect

from .quickpng import png
from .tasks import EncodedRect, EncodedTile

TILE_PX = 256
LAYERS = ("mosaic", "coverage")
_MOST_PATCHES = 64


def encoded(picture: Image, kind: str) -> bytes:
    """A picture as a file of a kind, `.png` or `.jpg`."""
    done, content = cv2.imencode(kind, picture)
    assert done
    return content.tobytes()


def joined(rects: Iterable[Rect]) -> list[Rect]:
    """Fewer rectangles that cover the same: two become one where that sends no more pixels than both."""
    out: list[Rect] = []
    for rect in rects:
        merged = rect
        while (other := next((o for o in out if _is_worth(merged, o)), None)) is not None:
            out.remove(other)
            merged = _union(merged, other)
        out.append(merged)
    return out


def _union(a: Rect, b: Rect) -> Rect:
    x, y = min(a.x, b.x), min(a.y, b.y)
    return Rect(x, y, max(a.x + a.width, b.x + b.width) - x, max(a.y + a.height, b.y + b.height) - y)


def _is_worth(a: Rect, b: Rect) -> bool:
    both = _union(a, b)
    return both.width * both.height <= a.width * a.height + b.width * b.height


def tiles_of(rects: Iterable[Rect]) -> list[tuple[int, int]]:
    """The tiles (x, y) that the rectangles touch."""
    touched = {
        (x, y)
        for r in rects
        for y in range(r.y // TILE_PX, (r.y + r.height - 1) // TILE_PX + 1)
        for x in range(r.x // TILE_PX, (r.x + r.width - 1) // TILE_PX + 1)
    }
    return sorted(touched, key=lambda tile: (tile[1], tile[0]))


def tile_rect(x: int, y: int, size_px: tuple[int, int]) -> Rect:
    """The part of a raster (width, height) that a tile covers."""
    left, top = x * TILE_PX, y * TILE_PX
    return Rect(left, top, min(TILE_PX, size_px[0] - left), min(TILE_PX, size_px[1] - top))


def encode_tiles(mosaic: Mosaic, touched: Sequence[tuple[int, int]]) -> list[EncodedTile]:
    """Every layer's tile at each place, cut off where the raster ends."""
    out = []
    for x, y in touched:
        rect = tile_rect(x, y, mosaic.size_px)
        looks = np.minimum(mosaic.looks(rect), 255).astype(np.uint8)
        out.append(EncodedTile("mosaic", x, y, png(mosaic.bgra(rect))))
        out.append(EncodedTile("coverage", x, y, png(looks)))
    return out


def seen_in(mosaic: Mosaic, touched: Sequence[tuple[int, int]]) -> dict[tuple[int, int], int]:
    """How many raster pixels of each tile were seen."""
    return {t: int(np.count_nonzero(mosaic.looks(tile_rect(*t, mosaic.size_px)))) for t in touched}


def encode_patches(mosaic: Mosaic, rects: Sequence[Rect]) -> list[EncodedRect]:
    """The changed rectangles of the mosaic; whole tiles where they are too many to be worth it."""
    patches = joined(rects) if len(rects) <= 4 * _MOST_PATCHES else []
    if not patches or len(patches) > _MOST_PATCHES:
        patches = [tile_rect(x, y, mosaic.size_px) for x, y in tiles_of(rects)]
    return [EncodedRect(rect, png(_opaque(mosaic.bgra(rect)))) for rect in patches]


def _opaque(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Without its alpha, (h, w, 3), where all of it was seen: a quarter less to encode, send and decode."""
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGRA2BGR), np.uint8) if image[..., 3].all() else image
