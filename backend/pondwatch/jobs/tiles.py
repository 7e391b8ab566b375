"""Tiles of every level, and the whole raster, put together from the stored tiles of the finest level."""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray
from sqlalchemy import Connection

from pondwatch.core.errors import Missing
from pondwatch.core.values import Image, Rect
from pondwatch.store import behind, revisions, sessions
from pondwatch.store.sessions import Session
from pondwatch.store.store import Store

from .ages import age_tile
from .quickpng import png
from .raster import LAYERS, TILE_PX
from .views import raster_size

_CHANNELS = {"mosaic": (4,), "coverage": ()}


def finest(size_px: tuple[int, int]) -> int:
    """The level at which a raster pixel is a screen pixel; at level 0 one tile holds the whole raster."""
    return max(0, math.ceil(math.log2(max(size_px) / TILE_PX)))


def tile(store: Store, session_id: str, layer: str, z: int, x: int, y: int) -> tuple[bytes, int]:
    """A 256-pixel tile as PNG, and the revision that it is of.

    Raises:
        Missing: no such session, layer or place.
    """

    if layer == "age":
        return _age(store, session_id, z, x, y)

    def look(connection: Connection) -> tuple[Session, int, bytes | None, dict[tuple[int, int], bytes]]:
        session = sessions.get(connection, session_id)
        across = _tiles_across(session, layer, z, x, y)
        if across > 1 and layer == "mosaic":
            kept = revisions.tile_of(connection, session_id, coarse_layer(z), x, y, session.revision)
            if kept is not None:
                return session, session.revision, kept, {}
        block = range(x * across, (x + 1) * across), range(y * across, (y + 1) * across)
        lacking = [t.since for t in behind.of(connection, session_id) if t.x in block[0] and t.y in block[1]]
        shown = min(lacking) - 1 if lacking else session.revision
        return session, shown, None, revisions.tiles_in(connection, session_id, layer, *block)

    session, shown, kept, stored = store.read(look)
    if kept is not None:
        return kept, shown
    across = _tiles_across(session, layer, z, x, y)
    if across == 1 and stored and _is_whole(session, x, y):
        return next(iter(stored.values())), shown
    out = _blank(layer, TILE_PX, TILE_PX)
    size = TILE_PX // across if across <= TILE_PX else 1
    for (column, row), content in stored.items():
        small = shrunk(_decoded(content), across)
        top, left = (row - y * across) * TILE_PX // across, (column - x * across) * TILE_PX // across
        out[top : top + small.shape[0], left : left + small.shape[1]] = small[:size, :size]
    return png(out), shown


def _is_whole(session: Session, x: int, y: int) -> bool:
    width, height = raster_size(session)
    return (x + 1) * TILE_PX <= width and (y + 1) * TILE_PX <= height


def _age(store: Store, session_id: str, z: int, x: int, y: int) -> tuple[bytes, int]:
    session, poses = store.read(lambda c: (sessions.get(c, session_id), revisions.pose_rows(c, session_id)))
    across = _tiles_across(session, "age", z, x, y)
    corner = x * across * TILE_PX, y * across * TILE_PX
    return png(age_tile(session, poses, corner, across)), session.revision


def whole(store: Store, session_id: str) -> tuple[Session, Image]:
    """The mosaic as it stands: (h, w, 4) BGRA.

    Raises:
        Missing: no such session.
    """
    session, rows = store.read(lambda c: (sessions.get(c, session_id), revisions.tile_rows(c, session_id, "mosaic")))
    width, height = raster_size(session)
    out = _blank("mosaic", width, height)
    for row in rows:
        image = _decoded(row["content"])
        top, left = row["y"] * TILE_PX, row["x"] * TILE_PX
        out[top : top + image.shape[0], left : left + image.shape[1]] = image
    return session, out


def _tiles_across(session: Session, layer: str, z: int, x: int, y: int) -> int:
    """How many tiles of the finest level lie along a tile's side."""
    size = raster_size(session)
    deepest = finest(size)
    if layer not in (*LAYERS, "age"):
        known = ", ".join((*LAYERS, "age"))
        raise Missing(f"There is no layer {layer[:40]!r}; there are {known}.", kind="layer", id=layer[:40])
    if 0 <= z <= deepest:
        across = 1 << (deepest - z)
        side = TILE_PX * across
        if 0 <= x <= (size[0] - 1) // side and 0 <= y <= (size[1] - 1) // side:
            return across
    raise Missing("There is no such tile.", kind="tile", id=f"{z}/{x}/{y}"[:40])


def coarse_layer(z: int) -> str:
    """What the mosaic's tiles of a coarser level are kept as, once they were made."""
    return f"mosaic@{z}"


def padded(image: Image) -> Image:
    """A tile cut off where the raster ends, (h, w, 4), made whole; nothing was seen beyond."""
    out = _blank("mosaic", TILE_PX, TILE_PX)
    out[: image.shape[0], : image.shape[1]] = image
    return out


def part(store: Store, session_id: str, rect: Rect) -> tuple[Session, Image]:
    """A rectangle of the mosaic, (h, w, 4) BGRA; what lies beyond the raster was not seen.

    Raises:
        Missing: no such session.
    """
    columns = range(max(0, rect.x // TILE_PX), (rect.x + rect.width - 1) // TILE_PX + 1)
    rows = range(max(0, rect.y // TILE_PX), (rect.y + rect.height - 1) // TILE_PX + 1)
    session, stored = store.read(
        lambda c: (sessions.get(c, session_id), revisions.tiles_in(c, session_id, "mosaic", columns, rows))
    )
    room = _blank("mosaic", len(columns) * TILE_PX, len(rows) * TILE_PX)
    for (column, row), content in stored.items():
        image = _decoded(content)
        left, top = (column - columns.start) * TILE_PX, (row - rows.start) * TILE_PX
        room[top : top + image.shape[0], left : left + image.shape[1]] = image
    out = _blank("mosaic", rect.width, rect.height)
    x0, y0 = max(0, rect.x), max(0, rect.y)
    inside = room[y0 - rows.start * TILE_PX :, x0 - columns.start * TILE_PX :]
    inside = inside[: rect.y + rect.height - y0, : rect.x + rect.width - x0]
    out[y0 - rect.y : y0 - rect.y + inside.shape[0], x0 - rect.x : x0 - rect.x + inside.shape[1]] = inside
    return session, out


def _blank(layer: str, width: int, height: int) -> NDArray[np.uint8]:
    return np.zeros((height, width, *_CHANNELS[layer]), np.uint8)


def _decoded(content: bytes) -> NDArray[np.uint8]:
    return np.asarray(cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED), np.uint8)


def shrunk(image: NDArray[np.uint8], factor: int) -> NDArray[np.uint8]:
    """A picture `factor` times smaller. Colours are those of the pixels that were seen, weighted by their alpha."""
    if factor == 1:
        return image
    size = max(1, math.ceil(image.shape[1] / factor)), max(1, math.ceil(image.shape[0] / factor))
    if image.ndim == 2:
        return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8)
    alpha = image[..., 3:].astype(np.float32)
    colour = cv2.resize(image[..., :3] * alpha, size, interpolation=cv2.INTER_AREA)
    weight = cv2.resize(alpha[..., 0], size, interpolation=cv2.INTER_AREA)[..., None]
    mean = np.divide(colour, weight, out=np.zeros_like(colour), where=weight > 0)
    return np.concatenate([mean, weight], axis=2).round().astype(np.uint8)
