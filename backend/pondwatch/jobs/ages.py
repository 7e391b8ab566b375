"""The layer `age`: how long before the newest snapshot each place was last photographed, drawn when it is asked for.

It is not stored, for each new snapshot makes every other place older.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import RowMapping

from pondwatch.core.frames import footprint_pond, pond_to_image, pond_to_raster, raster_to_pond
from pondwatch.core.values import Float, Image
from pondwatch.store.sessions import Session

from .raster import TILE_PX
from .views import metres_per_pixel

MOST_S = (1 << 24) - 1


def age_tile(session: Session, poses: Sequence[RowMapping], corner: tuple[int, int], across: int) -> Image:
    """A tile, (TILE_PX, TILE_PX, 4), BGRA: 65536 R + 256 G + B is an age in whole seconds, alpha 0 where never seen.

    Args:
        corner: the raster pixel at the tile's upper left.
        across: raster pixels to a tile's pixel; where more than one, the one in the middle decides.
    """
    shown = [row for row in poses if row["x_m"] is not None]
    last_s = np.full((TILE_PX, TILE_PX), -np.inf)
    for row in shown:
        _stamp(last_s, session, row, corner, across)
    seen = np.isfinite(last_s)
    newest_s = max((row["captured_ms"] / 1000 for row in shown), default=0.0)
    age_s = np.where(seen, np.clip(newest_s - np.where(seen, last_s, newest_s), 0, MOST_S), 0).astype(np.uint32)
    bytes_ = [age_s & 255, age_s >> 8 & 255, age_s >> 16 & 255, np.where(seen, 255, 0)]
    return np.stack(bytes_, axis=-1).astype(np.uint8)


def _stamp(last_s: Float, session: Session, row: RowMapping, corner: tuple[int, int], across: int) -> None:
    """Set the time of the tile's pixels whose centre a snapshot covers, where it is later."""
    camera, pond, scale = session.inspection.camera, session.inspection.pond, metres_per_pixel(session)
    pose = np.array([row["x_m"], row["y_m"], row["theta_rad"]])
    outline = (pond_to_raster(footprint_pond(pose, camera), pond, scale) + 0.5 - corner) / across
    low = np.clip(np.floor(outline.min(axis=0)), 0, TILE_PX).astype(int)
    high = np.clip(np.ceil(outline.max(axis=0)), 0, TILE_PX).astype(int)
    if (high <= low).any():
        return
    x, y = np.meshgrid(np.arange(low[0], high[0]), np.arange(low[1], high[1]))
    centres = (np.stack([x, y], axis=-1) + 0.5) * across + corner - 0.5
    inside = _is_inside(
        pond_to_image(raster_to_pond(centres, pond, scale), pose, camera), camera.width_px, camera.height_px
    )
    view = last_s[low[1] : high[1], low[0] : high[0]]
    captured_s = row["captured_ms"] / 1000
    np.copyto(view, captured_s, where=inside & (view < captured_s))


def _is_inside(points_px: Float, width_px: int, height_px: int) -> NDArray[np.bool_]:
    u, v = points_px[..., 0], points_px[..., 1]
    return (u >= -0.5) & (u < width_px - 0.5) & (v >= -0.5) & (v < height_px - 0.5)
