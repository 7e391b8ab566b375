"""A finished session corrected again by another method. Its own result stays as it is; both are kept."""

from __future__ import annotations

from dataclasses import replace

from sqlalchemy import Connection

from pondwatch.core.errors import Conflict
from pondwatch.core.values import Status
from pondwatch.store import corrections, jobs, sessions, snapshots
from pondwatch.store.corrections import Correction
from pondwatch.store.revisions import PoseRow
from pondwatch.store.sessions import State
from pondwatch.store.store import Store

from .advance import base, pose_row
from .lanes import Lane
from .tasks import Outcome


class NotFinished(Conflict):
    """Only a finished session is corrected again. facts: session, state."""


class SameMethod(Conflict):
    """The session's own result is by this method. facts: session, method."""


def begin(store: Store, session_id: str, method: str, now_ms: int) -> Correction:
    """Ask for a correction by a method. Again is as good as once; one that failed is tried again.

    Raises:
        Missing: there is no such session. NotFinished, SameMethod: nothing is asked for.
    """

    def unit(connection: Connection) -> Correction:
        session = sessions.get(connection, session_id)
        if session.state is not State.FINISHED:
            said = f"The session is {session.state.value}; it can be corrected again once it is finished."
            raise NotFinished(said, session=session_id, state=session.state.value)
        if method == session.method:
            raise SameMethod(f"The session's own result is by {method}.", session=session_id, method=method)
        correction = corrections.queue(connection, session_id, method, session.revision, now_ms)
        if correction.state == "queued":
            jobs.queue(connection, session_id, "correct", now_ms)
        return correction

    return store.write(unit)


def settle(store: Store, lane: Lane, session_id: str, now_ms: int) -> int | None:
    """Make the correction that waits longest; how many wait after it, None where none did.

    Raises:
        WorkerLost, TaskFailed, Unavailable, StorageFull: nothing changed.
    """
    waiting = store.read(lambda c: corrections.waiting(c, session_id))
    if not waiting:
        return None
    correction, left = waiting[0], len(waiting) - 1
    store.write(lambda c: _mark(c, correction, now_ms, "running"))
    stored = base(store, session_id)
    unshown = tuple(replace(ref, shown=None) for ref in stored.snapshots)
    outcome: Outcome = lane.call("settle", replace(stored, method=correction.method, snapshots=unshown, rods=()))
    told = {moved.id for moved in outcome.poses}

    def unit(connection: Connection) -> int:
        silent = [s for s in snapshots.covered(connection, session_id) if s.id not in told]
        poses = [
            *(pose_row(moved) for moved in outcome.poses),
            *(PoseRow(s.id, Status.REJECTED, None, fault=s.fault) for s in silent),
        ]
        corrections.write(connection, correction.id, poses, outcome.rods)
        corrections.mark(
            connection,
            correction.id,
            state="done",
            error=None,
            quality=outcome.quality.sentence,
            finished_ms=now_ms,
        )
        state = "queued" if left else "done"
        jobs.mark(
            connection, session_id, "correct", now_ms, state=state, progress=1 / (1 + left), attempts=0, error=None
        )
        return left

    return store.write(unit)


def give_up(connection: Connection, session_id: str, error: str) -> None:
    """The correction that waits longest failed too often."""
    for correction in corrections.waiting(connection, session_id)[:1]:
        corrections.mark(connection, correction.id, state="failed", error=error[:500])


def _mark(connection: Connection, correction: Correction, now_ms: int, state: str) -> None:
    corrections.mark(connection, correction.id, state=state)
    jobs.mark(connection, correction.session_id, "correct", now_ms, state=state)
