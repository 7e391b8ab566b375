"""How a session's mosaic lies on its layout, rod by rod: measured once a revision, and kept. It can be rebuilt."""

from __future__ import annotations

import numpy as np
from sqlalchemy import Connection, delete, insert, select

from pondwatch.core.values import Float

from .pondtables import registrations


def read(connection: Connection, session_id: str, revision: int) -> Float | None:
    """(R, 3), m, pond frame, in the layout's order: offset and its sigma; None where nothing was measured of this
    revision."""
    c = registrations.c
    query = select(c.offsets).where(c.session_id == session_id, c.revision == revision)
    found = connection.execute(query).scalar_one_or_none()
    return None if found is None else np.frombuffer(found, "<f4").astype(np.float64).reshape(-1, 3)


def write(connection: Connection, session_id: str, revision: int, offsets_m: Float) -> None:
    """Keep what was measured, in place of any before."""
    connection.execute(delete(registrations).where(registrations.c.session_id == session_id))
    row = {"session_id": session_id, "revision": revision, "offsets": offsets_m.astype("<f4").tobytes()}
    connection.execute(insert(registrations), row)
