"""What all inspections of a pond said: one rod through time, and how many rods of each state."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from sqlalchemy import Connection, Integer, RowMapping, cast, func, select

from .tables import rod_readings, rods, sessions

MOST = 500  # inspections looked back over


def of_rod(connection: Connection, pond_id: str, rod_id: str, limit: int = MOST) -> Sequence[RowMapping]:
    """A rod in every inspection of its pond, oldest first; `in_layout` is 0 where the layout then had no such rod, and
    the reading's columns are empty where it was never read."""
    latest = (
        select(sessions.c.id, sessions.c.name, sessions.c.state.label("session_state"), sessions.c.created_ms)
        .add_columns(sessions.c.finished_ms, sessions.c.method, sessions.c.layout_version)
        .where(sessions.c.pond_id == pond_id)
        .order_by(sessions.c.id.desc())
        .limit(limit)
        .subquery()
    )
    r, known = rod_readings.c, rods.c
    query = (
        select(latest, r.state, r.fill, r.confidence, r.views, r.conflicting)
        .add_columns((known.rod_id.is_not(None)).label("in_layout"))
        .outerjoin(rods, (known.session_id == latest.c.id) & (known.rod_id == rod_id))
        .outerjoin(rod_readings, (r.session_id == latest.c.id) & (r.rod_id == rod_id))
        .order_by(latest.c.id)
    )
    return connection.execute(query).mappings().all()


def inspections(connection: Connection, pond_id: str, limit: int = 100) -> Sequence[RowMapping]:
    """The newest inspections of a pond, oldest first."""
    c = sessions.c
    query = (
        select(c.id, c.name, c.state, c.revision, c.created_ms, c.finished_ms, c.seen_share)
        .where(c.pond_id == pond_id)
        .order_by(c.id.desc())
        .limit(limit)
    )
    return connection.execute(query).mappings().all()[::-1]


def counts(connection: Connection, session_id: str) -> dict[str, Any]:
    """How many rods of a session's layout were read as what; `conflicting`; `rods`, of the layout; `mean_fill`."""
    r = rod_readings.c
    query = (
        select(
            r.state,
            func.count().label("n"),
            func.sum(cast(r.conflicting, Integer)),
            func.sum(r.fill),
            func.count(r.fill),
        )
        .where(r.session_id == session_id)
        .group_by(r.state)
    )
    found = connection.execute(query).all()
    known = {state: n for state, n, *_ in found}
    fills = sum(row[4] for row in found)
    n_rods = connection.execute(select(func.count()).where(rods.c.session_id == session_id)).scalar_one()
    return {
        "empty": known.get("empty", 0),
        "partial": known.get("partial", 0),
        "full": known.get("full", 0),
        "conflicting": sum(row[2] for row in found),
        "rods": n_rods,
        "mean_fill": sum(row[3] or 0.0 for row in found) / fills if fills else None,
    }


def side(connection: Connection, session_id: str) -> Sequence[tuple[Any, ...]]:
    """Every rod of a session's layout, in its order, beside its reading: (id, x_m, y_m, inner_radius_m, state, fill,
    confidence, views, conflicting); the reading's are None where it was never read."""
    known, r = rods.c, rod_readings.c
    query = (
        select(known.rod_id, known.x_m, known.y_m, known.inner_radius_m, r.state, r.fill, r.confidence, r.views)
        .add_columns(r.conflicting)
        .outerjoin(rod_readings, (r.session_id == known.session_id) & (r.rod_id == known.rod_id))
        .where(known.session_id == session_id)
        .order_by(known.position)
    )
    return connection.execute(query).all()
