"""One step of a session: what no revision covers yet becomes one new revision, in one commit.

Idempotent: killed anywhere, it leaves the store at the revision before or the one after, and runs again from there.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

from sqlalchemy import Connection, RowMapping

from pondwatch.core.conditions import Limits, published
from pondwatch.core.values import RodReading, Status
from pondwatch.store import behind, jobs, revisions, sessions, snapshots
from pondwatch.store.history import Readings
from pondwatch.store.revisions import NewRevision, PoseRow, TileRow
from pondwatch.store.sessions import Session, State
from pondwatch.store.snapshots import StoredSnapshot
from pondwatch.store.store import Store

from .lanes import Lane, TaskFailed, WorkerLost
from .tasks import Base, EncodedRect, EncodedTile, Moved, Outcome, Shown, SnapshotRef
from .views import reading

DEFAULT_LIMITS = Limits()
SOON = 16  # snapshots in a step, where fewer wait than it might take: viewers need not wait for all of them


class CannotLoad(Exception):
    """A worker could not take up a session as it is stored: no fault of the snapshots that wait."""


@dataclass(frozen=True, slots=True)
class Stages:
    """Where the time of a step went, seconds. wait_s: from receipt to its start, the mean of what it covers."""

    wait_s: float
    correct_s: float
    assemble_s: float
    commit_s: float


@dataclass(frozen=True, slots=True)
class Step:
    """What was committed. left: snapshots that still wait. thinking: more will change without a further snapshot;
    unshown: at once."""

    revision: int
    covered: int
    left: int
    patches: tuple[EncodedRect, ...]
    state: State
    thinking: bool = False
    unshown: bool = False
    stages: Stages | None = None


def advance(
    store: Store, lane: Lane, session_id: str, now_ms: int, limit: int, limits: Limits = DEFAULT_LIMITS
) -> Step | None:
    """Cover the next snapshots, `limit` where so many wait, else SOON at most; None where all are covered.

    Raises:
        WorkerLost, TaskFailed: the worker could not; nothing changed. CannotLoad: nor take up what is stored.
        Unavailable, StorageFull: the store could not; nothing changed.
    """
    session, fresh = store.read(lambda c: _waiting(c, session_id, limit))
    if not fresh:
        return None
    fresh = fresh if len(fresh) == limit else fresh[:SOON]
    refs = [snapshot_ref(store, s) for s in fresh]
    outcome = lane.call("advance", session_id, session.revision, refs)
    if outcome is None:
        _load(store, lane, session_id)
        outcome = lane.call("advance", session_id, session.revision, refs)
    began = time.perf_counter()
    step = commit(store, session, fresh, outcome, now_ms, limits)
    wait_s = now_ms / 1000 - sum(s.received_ms for s in fresh) / len(fresh) / 1000
    stages = Stages(wait_s, outcome.correct_s, outcome.assemble_s, time.perf_counter() - began)
    return replace(step, stages=stages)


def _waiting(connection: Connection, session_id: str, limit: int) -> tuple[Session, list[StoredSnapshot]]:
    session = sessions.get(connection, session_id)
    return session, snapshots.uncovered(connection, session_id, session.covered_through, limit)


def reflect(store: Store, lane: Lane, session_id: str, now_ms: int, limits: Limits = DEFAULT_LIMITS) -> Step | bool:
    """Record what a joint decision that was made beside the uploads changed.

    Returns:
        The revision that was written; else whether a decision is still being made.
    """
    session = store.read(lambda c: sessions.get(c, session_id))
    outcome = lane.call("reflect", session_id, session.revision)
    if outcome is None or isinstance(outcome, bool):
        return bool(outcome)
    return commit(store, session, (), outcome, now_ms, limits)


def draw(store: Store, lane: Lane, session_id: str, through: int, limit: int) -> int:
    """Draw tiles that are behind since a revision or longer, at most `limit`; how many were.

    Raises:
        WorkerLost, TaskFailed, CannotLoad: the worker could not; nothing changed.
        Unavailable, StorageFull: the store could not; nothing changed.
    """
    session = store.read(lambda c: sessions.get(c, session_id))
    places = [(t.x, t.y) for t in store.read(lambda c: behind.of(c, session_id, through, limit))]
    if places:
        tiles = lane.call("draw", session_id, session.revision, places)
        if tiles is None:
            _load(store, lane, session_id)
            tiles = lane.call("draw", session_id, session.revision, places)
        rows = tile_rows(tiles)
        store.write(lambda c: revisions.keep_tiles(c, session_id, session.revision, rows))
    return len(places)


def tile_rows(tiles: Sequence[EncodedTile]) -> list[TileRow]:
    """Tiles as they are stored."""
    return [TileRow(t.layer, t.x, t.y, t.content) for t in tiles]


def _load(store: Store, lane: Lane, session_id: str) -> None:
    try:
        lane.call("load", base(store, session_id))
    except (WorkerLost, TaskFailed) as error:
        raise CannotLoad(str(error)) from error


def commit(
    store: Store,
    session: Session,
    fresh: Sequence[StoredSnapshot],
    outcome: Outcome,
    now_ms: int,
    limits: Limits = DEFAULT_LIMITS,
) -> Step:
    """Write one revision that covers `fresh`. A rod's shown state changes only where its looks agree on another."""
    through = fresh[-1].id if fresh else session.covered_through
    told = {moved.id for moved in outcome.poses}
    silent = [PoseRow(s.id, Status.REJECTED, None) for s in fresh if s.id not in told]  # every snapshot has a row
    new = NewRevision(
        session.id,
        session.revision,
        through,
        now_ms,
        poses=[*(pose_row(m) for m in outcome.poses), *silent],
        undrawn=outcome.undrawn,
        seen_share=outcome.seen_share,
        quality=outcome.quality.sentence,
    )

    def unit(connection: Connection) -> Step:
        before = revisions.readings_of(connection, session.id, [r.rod_id for r in outcome.rods])
        revision = revisions.write(connection, replace(new, rods=_published(before, outcome.rods, limits)), before)
        left = snapshots.count_after(connection, session.id, through)
        share = len(fresh) / max(1, len(fresh) + left)
        jobs.mark(
            connection,
            session.id,
            "advance",
            now_ms,
            attempts=0,
            error=None,
            progress=share,
            state="running" if left else "done",
        )
        thinking = outcome.thinking or outcome.unshown
        return Step(revision, len(fresh), left, outcome.patches, session.state, thinking, outcome.unshown)

    return store.write(unit)


def _published(before: Readings, read: Sequence[RodReading], limits: Limits) -> tuple[RodReading, ...]:
    """What is shown of rods that were read anew. before: what is shown of them until then."""
    shown = {rod_id: reading(row) for rod_id, row in before.items()}
    return tuple(published(shown.get(r.rod_id), r, limits) for r in read)


def pass_over(store: Store, session_id: str, now_ms: int, fault: str) -> Step | None:
    """Reject the next snapshot without asking a worker, which it broke too often. The session goes on."""
    session, fresh = store.read(lambda c: _waiting(c, session_id, 1))
    if not fresh:
        return None
    new = NewRevision(
        session_id,
        session.revision,
        fresh[0].id,
        now_ms,
        poses=[PoseRow(fresh[0].id, Status.REJECTED, None, fault=fault[:500])],
    )

    def unit(connection: Connection) -> Step:
        revision = revisions.write(connection, new)
        left = snapshots.count_after(connection, session_id, fresh[0].id)
        jobs.mark(connection, session_id, "advance", now_ms, attempts=0, state="running" if left else "done")
        return Step(revision, 1, left, (), session.state)

    return store.write(unit)


def base(store: Store, session_id: str) -> Base:
    """A session as it is stored, for a worker to take up."""

    def look(connection: Connection) -> Base:
        session = sessions.get(connection, session_id, with_rods=True)
        rows = snapshots.covered(connection, session_id)
        shown = {row["snapshot_id"]: row for row in revisions.pose_rows(connection, session_id)}
        refs = tuple(snapshot_ref(store, s, shown[s.id]) for s in rows if s.fault is None)
        rods = tuple(reading(row) for row in revisions.rod_rows(connection, session_id))
        undrawn = tuple((t.x, t.y) for t in behind.of(connection, session_id))
        return Base(session_id, session.revision, session.inspection, session.method, refs, rods, undrawn)

    return store.read(look)


def snapshot_ref(store: Store, stored: StoredSnapshot, pose: RowMapping | None = None) -> SnapshotRef:
    """A snapshot as a worker is told of it."""
    s = stored.snapshot
    return SnapshotRef(
        stored.id,
        s.key,
        s.captured_ms / 1000,
        (s.x_m, s.y_m, s.theta_rad),
        s.digest,
        store.blobs.path(s.digest),
        None if pose is None else _shown(pose),
    )


def _shown(row: RowMapping) -> Shown:
    pose = None if row["x_m"] is None else (row["x_m"], row["y_m"], row["theta_rad"])
    return Shown(Status(row["status"]), pose, row["sigma_xy_m"], row["sigma_theta_rad"])


def pose_row(moved: Moved) -> PoseRow:
    """A corrected pose as it is stored."""
    s = moved.shown
    return PoseRow(moved.id, s.status, s.pose, s.sigma_xy_m, s.sigma_theta_rad, moved.log_odds, moved.fault)
