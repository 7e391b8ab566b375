"""What all inspections of a pond said: one rod through time, and how many rods of each state."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from sqlalchemy import Connection, RowMapping, case, func, select

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


def trend(connection: Connection, pond_id: str, limit: int = 100) -> Sequence[RowMapping]:
    """Counts of rods by state in every inspection of a pond, oldest first."""
    latest = (
        select(sessions).where(sessions.c.pond_id == pond_id).order_by(sessions.c.id.desc()).limit(limit).subquery()
    )
    state = rod_readings.c.state

    def count(which: str) -> Any:
        return func.coalesce(func.sum(case((state == which, 1), else_=0)), 0).label(which)

    doubt = func.coalesce(func.sum(case((rod_readings.c.conflicting, 1), else_=0)), 0).label("conflicting")
    mean = func.avg(rod_readings.c.fill).label("mean_fill")
    n_rods = select(func.count()).where(rods.c.session_id == latest.c.id).scalar_subquery().label("rods")
    c = latest.c
    query = (
        select(c.id, c.name, c.state.label("session_state"), c.created_ms, c.finished_ms, c.seen_share, n_rods)
        .add_columns(count("empty"), count("partial"), count("full"), doubt, mean)
        .outerjoin(rod_readings, rod_readings.c.session_id == c.id)
        .group_by(c.id, c.name, c.state, c.created_ms, c.finished_ms, c.seen_share)
        .order_by(c.id)
    )
    return connection.execute(query).mappings().all()


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
