"""Snapshots: the evidence. Written once, never changed."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from sqlalchemy import Connection, Row, bindparam, func, insert, select

from pondwatch.core.errors import Missing, SnapshotConflict
from pondwatch.core.values import NO_REPORT, RobotReport, SnapshotKey

from .tables import poses, snapshots


@dataclass(frozen=True, slots=True)
class NewSnapshot:
    """What a robot sent, checked. x_m, y_m, theta_rad: the noisy pose, pond frame. digest: hexadecimal SHA-256."""

    key: SnapshotKey
    captured_ms: int
    x_m: float
    y_m: float
    theta_rad: float
    digest: str
    size_bytes: int
    media_type: str
    report: RobotReport = NO_REPORT

    @property
    def content(self) -> tuple[object, ...]:
        """What must be the same for two to be the same: not what the robot says of itself."""
        return self.captured_ms, self.x_m, self.y_m, self.theta_rad, self.digest


@dataclass(frozen=True, slots=True)
class StoredSnapshot:
    """A snapshot with its place in the order of receipt. fault: why no corrector is shown it."""

    id: int
    received_ms: int
    snapshot: NewSnapshot
    fault: str | None = None
    shown: tuple[float, float, float] | None = None


_BY_KEY = select(snapshots).where(  # made once: every upload asks it twice
    *(snapshots.c[name] == bindparam(name) for name in ("session_id", "robot", "boot", "sequence"))
)


def find(connection: Connection, session_id: str, key: SnapshotKey) -> StoredSnapshot | None:
    """The snapshot by its key."""
    named = {"session_id": session_id, "robot": key.robot, "boot": key.boot, "sequence": key.sequence}
    row = connection.execute(_BY_KEY, named).one_or_none()
    return _stored(row) if row else None


def get(connection: Connection, session_id: str, key: SnapshotKey) -> StoredSnapshot:
    """The snapshot by its key.

    Raises:
        Missing: there is none.
    """
    found = find(connection, session_id, key)
    if found is None:
        raise Missing("There is no such snapshot.", kind="snapshot", id=f"{key.robot}/{key.boot}/{key.sequence}")
    return found


def matched(stored: StoredSnapshot, new: NewSnapshot) -> StoredSnapshot:
    """The stored snapshot, if the new one is the same.

    Raises:
        SnapshotConflict: it has other content.
    """
    if stored.snapshot.content != new.content:
        key = new.key
        raise SnapshotConflict(
            f"{key.robot} already sent snapshot {key.sequence} of boot {key.boot} with other content.",
            robot=key.robot,
            boot=key.boot,
            sequence=key.sequence,
            stored_digest=f"sha256:{stored.snapshot.digest}",
        )
    return stored


_ADD = insert(snapshots)


def add(connection: Connection, session_id: str, new: NewSnapshot, now_ms: int) -> StoredSnapshot:
    """Keep a snapshot whose key is not taken."""
    row = {
        "session_id": session_id,
        "robot": new.key.robot,
        "boot": new.key.boot,
        "sequence": new.key.sequence,
        "captured_ms": new.captured_ms,
        "received_ms": now_ms,
        "x_m": new.x_m,
        "y_m": new.y_m,
        "theta_rad": new.theta_rad,
        "digest": new.digest,
        "size_bytes": new.size_bytes,
        "media_type": new.media_type,
        **asdict(new.report),
    }
    result = connection.execute(_ADD, row)
    assert result.inserted_primary_key
    return StoredSnapshot(int(result.inserted_primary_key[0]), now_ms, new)


_AFTER = (snapshots.c.session_id == bindparam("session_id"), snapshots.c.id > bindparam("after"))
_UNCOVERED = select(snapshots).where(*_AFTER).order_by(snapshots.c.id).limit(bindparam("most"))  # made once: every
_COUNT_AFTER = select(func.count()).where(*_AFTER)  # step asks both


def uncovered(connection: Connection, session_id: str, covered_through: int, limit: int) -> list[StoredSnapshot]:
    """The next snapshots that no revision covers, in order of receipt."""
    named = {"session_id": session_id, "after": covered_through, "most": limit}
    return [_stored(row) for row in connection.execute(_UNCOVERED, named)]


def covered(connection: Connection, session_id: str) -> list[StoredSnapshot]:
    """Every snapshot of a session that a revision covers, with the pose that is shown, in order of receipt."""
    shown = [
        poses.c.fault,
        poses.c.x_m.label("shown_x"),
        poses.c.y_m.label("shown_y"),
        poses.c.theta_rad.label("shown_theta"),
    ]
    query = select(snapshots, *shown).join(poses, poses.c.snapshot_id == snapshots.c.id)
    rows = connection.execute(query.where(snapshots.c.session_id == session_id).order_by(snapshots.c.id))
    return [_stored(row, row.fault, _shown(row)) for row in rows]


def count_after(connection: Connection, session_id: str, snapshot_id: int) -> int:
    """How many came after this one."""
    return connection.execute(_COUNT_AFTER, {"session_id": session_id, "after": snapshot_id}).scalar_one()


def _shown(row: Row[Any]) -> tuple[float, float, float] | None:
    return None if row.shown_x is None else (row.shown_x, row.shown_y, row.shown_theta)


def _stored(row: Row[Any], fault: str | None = None, shown: tuple[float, float, float] | None = None) -> StoredSnapshot:
    new = NewSnapshot(
        SnapshotKey(row.robot, row.boot, row.sequence),
        row.captured_ms,
        row.x_m,
        row.y_m,
        row.theta_rad,
        row.digest,
        row.size_bytes,
        row.media_type,
        RobotReport(row.battery, row.link_loss, row.image_quality),
    )
    return StoredSnapshot(row.id, row.received_ms, new, fault, shown)
