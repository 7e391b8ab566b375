"""The end of a session: no more uploads, then one last correction over everything at once, then the seal."""

from __future__ import annotations

from sqlalchemy import Connection

from pondwatch.store import conditions, jobs, revisions, sessions
from pondwatch.store.revisions import NewRevision
from pondwatch.store.sessions import State
from pondwatch.store.store import Store

from .advance import Step, base, pose_row, tile_rows
from .findingviews import document
from .lanes import Lane
from .sealing import seal_if_possible
from .tasks import Outcome
from .views import Json


def begin(store: Store, session_id: str, now_ms: int) -> State:
    """Close a session to uploads; its state. Again and again is as good as once.

    Raises:
        Missing: there is no such session.
    """

    def unit(connection: Connection) -> State:
        session = sessions.get(connection, session_id)
        if session.state not in (State.OPEN, State.FAILED):
            return session.state
        sessions.set_state(connection, session_id, State.FINISHING)
        jobs.queue(connection, session_id, "finish", now_ms)
        return State.FINISHING

    return store.write(unit)


def settle(store: Store, lane: Lane, session_id: str, now_ms: int) -> Step:
    """The last correction, in one revision with the state `finished`. Every snapshot is covered before.

    Raises:
        WorkerLost, TaskFailed, Unavailable, StorageFull: nothing changed.
    """
    session = store.read(lambda c: sessions.get(c, session_id))
    store.write(lambda c: jobs.mark(c, session_id, "finish", now_ms, state="running"))
    outcome: Outcome = lane.call("settle", base(store, session_id), True)
    condition = _condition(store, session_id, outcome)
    new = NewRevision(
        session_id,
        session.revision,
        session.covered_through,
        now_ms,
        poses=[pose_row(m) for m in outcome.poses],
        rods=outcome.rods,
        tiles=tile_rows(outcome.tiles),
        seen_share=outcome.seen_share,
        quality=outcome.quality.sentence,
        state=State.FINISHED,
        finished_ms=now_ms,
    )

    def unit(connection: Connection) -> Step:
        revision = revisions.write(connection, new)
        if condition is not None:
            conditions.write(connection, session_id, revision, condition)
        jobs.mark(connection, session_id, "finish", now_ms, state="done", progress=1.0, error=None)
        return Step(revision, 0, 0, outcome.patches, State.FINISHED)

    step = store.write(unit)
    seal_if_possible(store, session_id, now_ms)
    lane.call("forget", session_id)
    return step


def _condition(store: Store, session_id: str, outcome: Outcome) -> Json | None:
    if outcome.condition is None:
        return None
    session = store.read(lambda c: sessions.get(c, session_id, with_rods=True))
    return document(outcome.condition, session.inspection.pond)
