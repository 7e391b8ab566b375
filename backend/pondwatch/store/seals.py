"""Seals of finished sessions: a manifest and its signature, written once; and the rows that it stands for."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from sqlalchemy import Connection, RowMapping, insert, select

from .tables import poses, seals, snapshots, tiles


@dataclass(frozen=True, slots=True)
class Seal:
    """manifest: JSON, the very bytes that were signed. signature: 64 bytes, Ed25519."""

    manifest: bytes
    signature: bytes


def find(connection: Connection, session_id: str) -> Seal | None:
    """The seal of a session, if it has one."""
    row = connection.execute(select(seals).where(seals.c.session_id == session_id)).one_or_none()
    return Seal(row.manifest, row.signature) if row else None


def keep(connection: Connection, session_id: str, seal: Seal) -> Seal:
    """Keep a session's first seal; the one that is kept."""
    before = find(connection, session_id)
    if before is not None:
        return before
    row = {"session_id": session_id, "manifest": seal.manifest, "signature": seal.signature}
    connection.execute(insert(seals), row)
    return seal


def snapshot_rows(connection: Connection, session_id: str) -> Iterator[RowMapping]:
    """Every snapshot with its noisy and its corrected pose, in order of (robot, boot, sequence)."""
    s, p = snapshots.c, poses.c
    corrected = [p.x_m.label("to_x_m"), p.y_m.label("to_y_m"), p.theta_rad.label("to_theta_rad")]
    query = (
        select(snapshots, p.status, p.sigma_xy_m, p.sigma_theta_rad, p.fault, *corrected)
        .outerjoin(poses, p.snapshot_id == s.id)
        .where(s.session_id == session_id)
        .order_by(s.robot, s.boot, s.sequence)
    )
    yield from connection.execute(query).mappings()


def tile_rows(connection: Connection, session_id: str, layer: str) -> Iterator[RowMapping]:
    """The tiles of a layer, row by row, one in memory at a time."""
    c = tiles.c
    places = select(c.x, c.y).where(c.session_id == session_id, c.layer == layer).order_by(c.y, c.x)
    for x, y in connection.execute(places).all():
        one = (c.session_id == session_id, c.layer == layer, c.x == x, c.y == y)
        yield connection.execute(select(c.x, c.y, c.content).where(*one)).mappings().one()
