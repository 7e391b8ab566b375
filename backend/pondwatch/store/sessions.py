"""Sessions: an inspection, its state and how far its revisions have come."""

from __future__ import annotations

import enum
import secrets
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import (
    BindParameter,
    ColumnElement,
    Connection,
    Row,
    ScalarSelect,
    bindparam,
    func,
    insert,
    select,
    update,
)

from pondwatch.core.errors import Missing
from pondwatch.core.values import Camera, Inspection, Pond, PoseNoise, Rod

from . import ponds
from .alarmtables import baselines
from .tables import behind_tiles, corrections, judgements, notes, poses, rod_readings, rods, seals, sessions, snapshots


class State(enum.StrEnum):
    """A session's life: open, finishing, then finished or failed."""

    OPEN = "open"
    FINISHING = "finishing"
    FINISHED = "finished"
    FAILED = "failed"


@dataclass(frozen=True, slots=True)
class Session:
    """One session as stored. `inspection.pond` has its rods only where they were asked for."""

    id: str
    inspection: Inspection
    method: str
    state: State
    revision: int
    covered_through: int
    seen_share: float
    quality: str
    created_ms: int
    finished_ms: int | None
    pond_id: str | None = None
    layout_version: int | None = None


@dataclass(frozen=True, slots=True)
class Facts:
    """What is counted over a session's rows, and the session that it is held against. judgements, notes: of people."""

    snapshots: int
    placed: int
    uncertain: int
    rejected: int
    rods: int
    rods_seen: int
    last_captured_ms: int | None
    last_received_ms: int | None
    baseline: str | None
    judgements: int
    notes: int

    @property
    def pending(self) -> int:
        """Snapshots that no revision covers yet."""
        return self.snapshots - self.placed - self.uncertain - self.rejected


def create(
    connection: Connection,
    inspection: Inspection,
    method: str,
    now_ms: int,
    wish: ponds.Wish = ponds.NOTHING_SAID,
) -> str:
    """A new, open session; its id. Ids sort by the time of creation.

    Raises:
        Missing: it is said to belong to a pond that there is not.
    """
    pond_id, version = ponds.assign(connection, inspection.pond, inspection.name, now_ms, wish)
    session_id = f"{now_ms:012x}{secrets.token_hex(8)}"
    camera, pond, noise = inspection.camera, inspection.pond, inspection.pose_noise
    row = {
        "id": session_id,
        "name": inspection.name,
        "method": method,
        "created_ms": now_ms,
        "state": State.OPEN,
        "camera_width_px": camera.width_px,
        "camera_height_px": camera.height_px,
        "camera_metres_per_pixel": camera.metres_per_pixel,
        "pond_width_m": pond.width_m,
        "pond_height_m": pond.height_m,
        "noise_sigma_xy_m": noise and noise.sigma_xy_m,
        "noise_sigma_theta_rad": noise and noise.sigma_theta_rad,
        "pond_id": pond_id,
        "layout_version": version,
    }
    connection.execute(insert(sessions), row)
    if pond.rods:
        connection.execute(insert(rods), [_rod_row(session_id, i, rod) for i, rod in enumerate(pond.rods)])
    return session_id


def _rod_row(session_id: str, position: int, rod: Rod) -> dict[str, Any]:
    return {
        "session_id": session_id,
        "rod_id": rod.id,
        "position": position,
        "x_m": rod.x_m,
        "y_m": rod.y_m,
        "outer_radius_m": rod.outer_radius_m,
        "inner_radius_m": rod.inner_radius_m,
    }


_BY_ID = select(sessions).where(sessions.c.id == bindparam("session_id"))  # made once: asked at every turn
_STATE = select(sessions.c.state).where(sessions.c.id == bindparam("session_id"))


def get(connection: Connection, session_id: str, *, with_rods: bool = False) -> Session:
    """One session.

    Raises:
        Missing: there is none by this id.
    """
    row = connection.execute(_BY_ID, {"session_id": session_id}).one_or_none()
    if row is None:
        raise _missing(session_id)
    return _session(row, layout(connection, session_id) if with_rods else ())


def state_of(connection: Connection, session_id: str) -> State:
    """Where a session is in its life.

    Raises:
        Missing: there is none by this id.
    """
    state = connection.execute(_STATE, {"session_id": session_id}).scalar_one_or_none()
    if state is None:
        raise _missing(session_id)
    return State(state)


def _missing(session_id: str) -> Missing:
    return Missing("There is no such session.", kind="session", id=session_id[:40])


def layout(connection: Connection, session_id: str) -> tuple[Rod, ...]:
    """The design layout, in its order."""
    rows = connection.execute(select(rods).where(rods.c.session_id == session_id).order_by(rods.c.position))
    return tuple(Rod(r.rod_id, r.x_m, r.y_m, r.outer_radius_m, r.inner_radius_m) for r in rows)


def page(connection: Connection, limit: int, before: str | None, named: str | None = None) -> Sequence[Session]:
    """Sessions newest first, from the one after `before`; those whose name holds `named`, in either case."""
    query = select(sessions).order_by(sessions.c.id.desc()).limit(limit)
    if before is not None:
        query = query.where(sessions.c.id < before)
    if named:
        query = query.where(sessions.c.name.icontains(named, autoescape=True))
    return [_session(row, ()) for row in connection.execute(query)]


_MINE: BindParameter[str] = bindparam("session_id")


def _one(what: ColumnElement[Any], *which: ColumnElement[bool]) -> ScalarSelect[Any]:
    return select(what).where(*which).scalar_subquery()


_COUNTED = {  # by the names of `Facts`
    "snapshots": _one(func.count(), snapshots.c.session_id == _MINE),
    "placed": _one(func.count(), poses.c.session_id == _MINE, poses.c.status == "placed"),
    "uncertain": _one(func.count(), poses.c.session_id == _MINE, poses.c.status == "uncertain"),
    "rejected": _one(func.count(), poses.c.session_id == _MINE, poses.c.status == "rejected"),
    "rods": _one(func.count(), rods.c.session_id == _MINE),
    "rods_seen": _one(func.count(), rod_readings.c.session_id == _MINE, rod_readings.c.state != "unseen"),
    "last_captured_ms": _one(func.max(snapshots.c.captured_ms), snapshots.c.session_id == _MINE),
    "last_received_ms": _one(func.max(snapshots.c.received_ms), snapshots.c.session_id == _MINE),
    "baseline": _one(baselines.c.baseline_id, baselines.c.session_id == _MINE),
    "judgements": _one(func.count(), judgements.c.session_id == _MINE),
    "notes": _one(func.count(), notes.c.session_id == _MINE),
}
_FACTS = select(*(value.label(name) for name, value in _COUNTED.items()))  # made once: asked at every revision


def facts(connection: Connection, session_id: str) -> Facts:
    """Counts over a session's snapshots, poses and rods."""
    return Facts(**connection.execute(_FACTS, {"session_id": session_id}).mappings().one())


def set_state(connection: Connection, session_id: str, state: State, finished_ms: int | None = None) -> None:
    """Where a session is in its life."""
    values = {"state": state, "finished_ms": finished_ms}
    connection.execute(update(sessions).where(sessions.c.id == session_id).values(values))


def unfinished(connection: Connection) -> list[str]:
    """Sessions with snapshots that no revision covers, or tiles that are behind, or whose finishing, seal or a further
    correction was cut off."""
    newest = select(func.max(snapshots.c.id)).where(snapshots.c.session_id == sessions.c.id).scalar_subquery()
    behind = (sessions.c.state == State.FINISHING) | (func.coalesce(newest, 0) > sessions.c.covered_through)
    again = select(corrections.c.session_id).where(corrections.c.state.in_(("queued", "running")))
    unsealed = (sessions.c.state == State.FINISHED) & sessions.c.id.not_in(select(seals.c.session_id))
    undrawn = select(behind_tiles.c.session_id)
    due = behind | unsealed | sessions.c.id.in_(again) | sessions.c.id.in_(undrawn)
    return list(connection.execute(select(sessions.c.id).where(due).order_by(sessions.c.id)).scalars())


def _session(row: Row[Any], rods_: tuple[Rod, ...]) -> Session:
    camera = Camera(row.camera_width_px, row.camera_height_px, row.camera_metres_per_pixel)
    noise = None
    if row.noise_sigma_xy_m is not None:
        noise = PoseNoise(row.noise_sigma_xy_m, row.noise_sigma_theta_rad)
    inspection = Inspection(row.name, camera, Pond(row.pond_width_m, row.pond_height_m, rods_), noise)
    return Session(
        row.id,
        inspection,
        row.method,
        State(row.state),
        row.revision,
        row.covered_through,
        row.seen_share,
        row.quality,
        row.created_ms,
        row.finished_ms,
        row.pond_id,
        row.layout_version,
    )
