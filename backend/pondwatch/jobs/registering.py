"""What is worked out once of a mosaic that stands still: how it lies on its layout, and its coarser tiles.

Both are kept with the revision that they are of, and made anew when that is not the newest.
"""

from __future__ import annotations

import numpy as np
from sqlalchemy import Connection

from pondwatch.core.marks import ring_offsets
from pondwatch.core.values import Float, Image
from pondwatch.store import registrations, revisions, sessions
from pondwatch.store.revisions import TileRow
from pondwatch.store.sessions import Session
from pondwatch.store.store import Store

from . import tiles
from .quickpng import png
from .raster import TILE_PX
from .views import metres_per_pixel, raster_size


def offsets(store: Store, session_id: str) -> Float:
    """(R, 3), m, pond frame: how far every rod's picture in the mosaic lies from its place, and one standard deviation
    of that along an axis; NaN where not measured.

    Raises:
        Missing: there is no such session.
    """
    session = store.read(lambda c: sessions.get(c, session_id))
    found = store.read(lambda c: registrations.read(c, session_id, session.revision))
    return prepare(store, session_id) if found is None else found


def prepare(store: Store, session_id: str) -> Float:
    """Measure and keep a session's registration, and keep the coarse tiles of its mosaic.

    Raises:
        Missing: there is no such session. Unavailable, StorageFull: nothing was kept.
    """
    bare, image = tiles.whole(store, session_id)
    session = store.read(lambda c: sessions.get(c, session_id, with_rods=True))
    measured = ring_offsets(image, session.inspection.pond, metres_per_pixel(session))
    coarse = _coarse(session, image)

    def unit(connection: Connection) -> None:
        registrations.write(connection, session_id, bare.revision, measured)
        revisions.keep_tiles(connection, session_id, bare.revision, coarse)

    store.write(unit)
    return measured


def _coarse(session: Session, image: Image) -> list[TileRow]:
    """Tiles of every level but the finest, each halved from the one below it."""
    out = []
    for z in range(tiles.finest(raster_size(session)) - 1, -1, -1):
        rows, columns = image.shape[:2]
        image = tiles.shrunk(np.pad(image, ((0, rows % 2), (0, columns % 2), (0, 0))), 2)  # an odd edge stays in place
        for top in range(0, image.shape[0], TILE_PX):
            for left in range(0, image.shape[1], TILE_PX):
                part = tiles.padded(image[top : top + TILE_PX, left : left + TILE_PX])
                out.append(TileRow(tiles.coarse_layer(z), left // TILE_PX, top // TILE_PX, png(part)))
    return out
