"""What alarms are judged by: who was heard when, how rods read, how much was seen lately. Only news is read."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from sqlalchemy import Connection, bindparam, func, select

from pondwatch.core.conditions import Limits
from pondwatch.core.coverage import rods_in_view
from pondwatch.core.values import Float, Pond, Rod, RodReading
from pondwatch.store import alarms, judgements, revisions, sessions
from pondwatch.store.sessions import Session, State
from pondwatch.store.tables import poses, snapshots

from .views import reading

COVERAGE_EVERY_S = 30.0
_GRID = 24  # points a side of a pond without a layout
_HEARD = (  # made once: asked every second
    select(snapshots.c.robot, func.max(snapshots.c.received_ms), func.max(snapshots.c.id))
    .where(snapshots.c.session_id == bindparam("session_id"), snapshots.c.id > bindparam("after"))
    .group_by(snapshots.c.robot)
)


@dataclass(slots=True)
class Facts:
    """Of one session, kept up to date by `look`. since_s: nobody is called silent for what came before. heard_s: when
    each robot was. judged: rods that a person judged. seen_twice: share of the rods seen twice lately; None while the
    window is not over."""

    session: Session
    since_s: float
    heard_s: dict[str, float] = field(default_factory=dict)
    rods: dict[str, RodReading] = field(default_factory=dict)
    baseline: dict[str, RodReading] = field(default_factory=dict)
    judged: frozenset[str] = frozenset()
    snapshots: int = 0
    doubtful: int = 0
    seen_twice: float | None = None
    _heard_through: int = 0
    _read_through: int = -1
    _counted_at: int = -1
    _baseline_id: str | None = None
    _covered_s: float = -1e18

    def look(self, connection: Connection, now_s: float, limits: Limits) -> None:
        """Read what is new."""
        self.session = sessions.get(connection, self.session.id)
        self._hear(connection)
        said = judgements.newest(connection, self.session.id)
        self.judged = frozenset(rod for rod, row in said.items() if row["state"] is not None)
        self._compare(connection)
        revision = self.session.revision
        if revision == self._read_through:
            return self._cover(connection, now_s, limits)
        rows = revisions.rod_rows(connection, self.session.id, self._read_through)
        self.rods |= {row["rod_id"]: reading(row) for row in rows}
        facts = sessions.facts(connection, self.session.id)
        self.snapshots = facts.snapshots - facts.pending
        self.doubtful = facts.uncertain + facts.rejected
        self._read_through = revision
        return self._cover(connection, now_s, limits)

    def _hear(self, connection: Connection) -> None:
        named = {"session_id": self.session.id, "after": self._heard_through}
        for robot, at_ms, number in connection.execute(_HEARD, named).all():
            self.heard_s[robot] = max(at_ms / 1000, self.since_s)
            self._heard_through = max(self._heard_through, number)

    def _compare(self, connection: Connection) -> None:
        chosen = alarms.baseline(connection, self.session.id)
        if chosen != self._baseline_id:
            rows = revisions.rod_rows(connection, chosen) if chosen else ()
            self.baseline = {row["rod_id"]: reading(row) for row in rows}
            self._baseline_id = chosen

    def _cover(self, connection: Connection, now_s: float, limits: Limits) -> None:
        if self.session.state is not State.OPEN or now_s - self._covered_s < COVERAGE_EVERY_S:
            return
        self._covered_s = now_s
        begin_ms = round(1000 * (now_s - limits.coverage_window_s))
        c = snapshots.c
        mine = c.session_id == self.session.id
        first = connection.execute(select(c.received_ms).where(mine).order_by(c.id).limit(1)).scalar_one_or_none()
        self.seen_twice = None
        if first is not None and first <= begin_ms:
            query = select(poses.c.x_m, poses.c.y_m, poses.c.theta_rad).join(c.id.table, c.id == poses.c.snapshot_id)
            rows = connection.execute(query.where(mine, c.received_ms >= begin_ms, poses.c.x_m.is_not(None))).all()
            layout = sessions.layout(connection, self.session.id)
            self.seen_twice = _seen_twice(np.array([tuple(row) for row in rows]).reshape(-1, 3), self.session, layout)


def _seen_twice(poses_pond: Float, session: Session, layout: tuple[Rod, ...]) -> float:
    """Share of the rods' centres, or of points all over a pond without a layout, that two footprints hold."""
    pond = session.inspection.pond
    places = [(rod.x_m, rod.y_m) for rod in layout] or [
        ((i + 0.5) / _GRID * pond.width_m, (j + 0.5) / _GRID * pond.height_m)
        for i in range(_GRID)
        for j in range(_GRID)
    ]
    points = Pond(pond.width_m, pond.height_m, tuple(Rod("", x, y, 0.0, 0.0) for x, y in places))
    looks = np.zeros(len(places), np.int64)
    for start in range(0, len(poses_pond), 1024):
        looks += rods_in_view(poses_pond[start : start + 1024], points, session.inspection.camera).sum(axis=0)
    return float(np.mean(looks >= 2))
