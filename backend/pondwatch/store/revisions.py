"""Revisions: what is derived from the snapshots, as of a number that only grows. One commit writes one revision."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import BindParameter, ColumnElement, Connection, RowMapping, Select, Table, bindparam, select, update

from pondwatch.core.errors import Conflict
from pondwatch.core.values import RodReading

from . import behind, history
from .history import rod_values
from .sessions import State
from .tables import poses, rod_readings, rods, sessions, snapshots, tiles
from .upsert import insert_or


@dataclass(frozen=True, slots=True)
class PoseRow:
    """A snapshot's corrected pose: m, m, rad, pond frame; None where rejected. fault: why no corrector saw it."""

    snapshot_id: int
    status: str
    pose: tuple[float, float, float] | None
    sigma_xy_m: float | None = None
    sigma_theta_rad: float | None = None
    log_odds: float = 0.0
    fault: str | None = None


@dataclass(frozen=True, slots=True)
class TileRow:
    """An encoded tile of the finest level of a layer; x right, y down, in tiles."""

    layer: str
    x: int
    y: int
    content: bytes


@dataclass(frozen=True, slots=True)
class NewRevision:
    """All that one revision changes. It follows `base`, and covers the snapshots up to `covered_through`. undrawn:
    tiles that change and are to be drawn later."""

    session_id: str
    base: int
    covered_through: int
    at_ms: int
    poses: Sequence[PoseRow] = ()
    rods: Sequence[RodReading] = ()
    tiles: Sequence[TileRow] = ()
    undrawn: Sequence[behind.Place] = ()
    seen_share: float | None = None
    quality: str | None = None
    state: State | None = None
    finished_ms: int | None = None


_FOLLOWS = update(sessions).where(sessions.c.id == bindparam("of_session"), sessions.c.revision == bindparam("base"))


def write(connection: Connection, new: NewRevision, before: history.Readings | None = None) -> int:
    """Write a revision; its number. before: what its rods read as, where it was asked in this transaction already.

    Raises:
        Conflict: another revision came between.
    """
    revision = new.base + 1
    values: dict[str, Any] = {"revision": revision, "covered_through": new.covered_through}
    optional = {
        "seen_share": new.seen_share,
        "quality": new.quality,
        "state": new.state,
        "finished_ms": new.finished_ms,
    }
    values |= {name: value for name, value in optional.items() if value is not None}
    if connection.execute(_FOLLOWS, {"of_session": new.session_id, "base": new.base, **values}).rowcount != 1:
        raise Conflict("Another revision came between.", session=new.session_id)
    of_revision = {"session_id": new.session_id, "revision": revision}
    _upsert(connection, poses, [pose_values(p) | of_revision for p in new.poses])
    if before is None:
        before = readings_of(connection, new.session_id, [r.rod_id for r in new.rods])
    history.keep(connection, of_revision | {"at_ms": new.at_ms}, new.rods, before)
    _upsert(connection, rod_readings, [rod_values(r) | of_revision for r in new.rods])
    keep_tiles(connection, new.session_id, revision, new.tiles)
    behind.mark(connection, new.session_id, revision, new.undrawn)
    return revision


def _upsert(connection: Connection, table: Any, rows: list[dict[str, Any]]) -> None:
    if rows:
        keys = {column.name for column in table.primary_key}
        insert_or(connection, table, rows, [name for name in rows[0] if name not in keys])


def pose_values(p: PoseRow) -> dict[str, Any]:
    """A pose by the names of its columns."""
    x, y, theta = p.pose or (None, None, None)
    return {
        "snapshot_id": p.snapshot_id,
        "status": p.status,
        "x_m": x,
        "y_m": y,
        "theta_rad": theta,
        "sigma_xy_m": p.sigma_xy_m,
        "sigma_theta_rad": p.sigma_theta_rad,
        "log_odds": p.log_odds,
        "fault": p.fault,
    }


_MINE: BindParameter[str] = bindparam("session_id")
_SINCE: BindParameter[int] = bindparam("since")


def pose_rows(connection: Connection, session_id: str, since: int = -1) -> Sequence[RowMapping]:
    """Corrected poses that changed after a revision, with what came in, in order of (robot, boot, sequence)."""
    return connection.execute(_POSES, {"session_id": session_id, "since": since}).mappings().all()


def with_what_came_in(connection: Connection, table: Table, which: ColumnElement[bool]) -> Sequence[RowMapping]:
    """Rows of a table of poses beside the snapshots that they are of, in order of (robot, boot, sequence)."""
    return connection.execute(_beside_what_came_in(table, which)).mappings().all()


def _beside_what_came_in(table: Table, which: ColumnElement[bool]) -> Select[Any]:
    s = snapshots.c
    came_in = [
        s.robot,
        s.boot,
        s.sequence,
        s.captured_ms,
        s.received_ms,
        s.x_m.label("raw_x_m"),
        s.y_m.label("raw_y_m"),
        s.theta_rad.label("raw_theta_rad"),
        s.battery,
        s.link_loss,
        s.image_quality,
    ]
    return (
        select(*came_in, table)
        .join(snapshots, snapshots.c.id == table.c.snapshot_id)
        .where(which)
        .order_by(s.robot, s.boot, s.sequence)
    )


# made once: both are asked for every viewer's news
_POSES = _beside_what_came_in(poses, (poses.c.session_id == _MINE) & (poses.c.revision > _SINCE))
_RODS = (
    select(rod_readings, rods.c.position)
    .join(rods, (rods.c.session_id == rod_readings.c.session_id) & (rods.c.rod_id == rod_readings.c.rod_id))
    .where(rod_readings.c.session_id == _MINE, rod_readings.c.revision > _SINCE)
    .order_by(rods.c.position)
)


def rod_rows(connection: Connection, session_id: str, since: int = -1) -> Sequence[RowMapping]:
    """Rod readings that changed after a revision, in the layout's order. Rods never read have no row."""
    return connection.execute(_RODS, {"session_id": session_id, "since": since}).mappings().all()


_NAMED = 400  # rods that a statement names one by one
_READINGS = select(rod_readings).where(rod_readings.c.session_id == _MINE)
_READINGS_OF = _READINGS.where(rod_readings.c.rod_id.in_(bindparam("rod_ids", expanding=True)))


def readings_of(connection: Connection, session_id: str, rod_ids: Sequence[str]) -> dict[str, RowMapping]:
    """The readings of these rods at least, by their ids; those never read have none."""
    if not rod_ids:
        return {}
    named = {"session_id": session_id, "rod_ids": list(rod_ids)}
    found = connection.execute(_READINGS_OF, named) if len(rod_ids) <= _NAMED else connection.execute(_READINGS, named)
    return {row["rod_id"]: row for row in found.mappings()}


def tile_rows(connection: Connection, session_id: str, layer: str, since: int = -1) -> Sequence[RowMapping]:
    """Tiles of a layer that changed after a revision, row by row."""
    query = select(tiles).where(tiles.c.session_id == session_id, tiles.c.layer == layer, tiles.c.revision > since)
    return connection.execute(query.order_by(tiles.c.y, tiles.c.x)).mappings().all()


def tiles_in(connection: Connection, session_id: str, layer: str, x: range, y: range) -> dict[tuple[int, int], bytes]:
    """The tiles of a layer within a block, by (x, y); tiles never written are not among them."""
    c = tiles.c
    block = (c.session_id == session_id, c.layer == layer, c.x >= x.start, c.x < x.stop, c.y >= y.start, c.y < y.stop)
    return {(row.x, row.y): row.content for row in connection.execute(select(c.x, c.y, c.content).where(*block))}


def tile_of(connection: Connection, session_id: str, layer: str, x: int, y: int, revision: int) -> bytes | None:
    """One tile, where it is of this revision."""
    c = tiles.c
    one = (c.session_id == session_id, c.layer == layer, c.x == x, c.y == y, c.revision == revision)
    return connection.execute(select(c.content).where(*one)).scalar_one_or_none()


def keep_tiles(connection: Connection, session_id: str, revision: int, made: Sequence[TileRow]) -> None:
    """Keep tiles that show a revision, in place of any before; they are not behind any more."""
    of_revision = {"session_id": session_id, "revision": revision}
    rows = [{"layer": t.layer, "x": t.x, "y": t.y, "content": t.content} | of_revision for t in made]
    _upsert(connection, tiles, rows)
    behind.clear(connection, session_id, sorted({(t.x, t.y) for t in made if t.layer == "mosaic"}))
