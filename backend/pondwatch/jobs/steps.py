"""One step of a session at a time, and what follows when it fails.

A step that fails is repeated snapshot by snapshot; a snapshot that fails three times alone is rejected and the session
goes on. A session that cannot be taken up or settled three times says so and waits; so does a correction by a further
method. A store that fails is waited for.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Protocol

from sqlalchemy import Connection

from pondwatch.core.conditions import Limits
from pondwatch.core.ports import Clock
from pondwatch.store import jobs, sessions, snapshots
from pondwatch.store.sessions import Session, State
from pondwatch.store.store import Store

from . import advance, correct, finish, registering, sealing
from .advance import CannotLoad, Step
from .drawing import Drawing
from .lanes import Lane, TaskFailed, WorkerLost

STEP_LIMIT = 64  # snapshots
MOST_TRIES = 3
BUSY_PATIENCE = 3.0  # times longer than usual that tiles wait while uploads do
WorkFailed = (WorkerLost, TaskFailed, CannotLoad)


class Observer(Protocol):
    """Hears what became of sessions, from any thread."""

    def committed(self, session_id: str, step: Step, seconds: float) -> None:
        """A revision was written, after so many seconds of work."""

    def changed(self, session_id: str, revision: int) -> None:
        """Something but the revision is otherwise: a job, or the session's state."""


@dataclass(slots=True)
class Trouble:
    """What went wrong with a session lately. tries: in a row. careful: snapshots still to be taken singly."""

    tries: int = 0
    careful: int = 0


class Steps:
    """Takes sessions forward. limits: what must agree before a rod's shown state changes. drawing: when tiles are."""

    def __init__(
        self,
        store: Store,
        clock: Clock,
        observer: Observer,
        limits: Limits | None = None,
        drawing: Drawing | None = None,
    ) -> None:
        self._store, self._clock, self._observer = store, clock, observer
        self._limits = limits or Limits()
        self._drawing = drawing or Drawing(store)
        self._troubles: dict[str, Trouble] = {}
        self._thinking: set[str] = set()

    def thinking(self, session_id: str) -> bool:
        """Whether a joint decision is being made beside, so that a step will be due without an upload."""
        return session_id in self._thinking

    def waits(self, session_id: str) -> bool:
        """Whether a step will be due without an upload."""
        return session_id in self._thinking or self._drawing.waits(session_id)

    def hurry(self, session_id: str) -> None:
        """Somebody waits for this session's tiles. Any thread."""
        self._drawing.hurry(session_id)

    def take(self, lane: Lane, session_id: str) -> bool:
        """One step; whether there is more to do.

        Raises:
            Unavailable, StorageFull: the store failed; try again later.
        """
        trouble = self._troubles.setdefault(session_id, Trouble())
        try:
            more = self._step(lane, session_id, trouble)
        except WorkFailed as error:
            more = self._failed(session_id, trouble, error)
        if not more:
            del self._troubles[session_id]
        return more

    def _step(self, lane: Lane, session_id: str, trouble: Trouble) -> bool:
        started = time.perf_counter()
        limit = 1 if trouble.careful else STEP_LIMIT
        step = advance.advance(self._store, lane, session_id, self._now_ms(), limit, self._limits)
        if step is None:
            session = self._session(session_id)
            if session.state is State.FINISHED:
                return self._correct(lane, session, trouble)
            if session.state is not State.FINISHING:
                return self._reflect(lane, session_id) or self._draw(lane, session_id)
            step = finish.settle(self._store, lane, session_id, self._now_ms())
        trouble.tries, trouble.careful = 0, max(0, trouble.careful - step.covered)
        self._told(session_id, step, started)
        if step.state is State.FINISHED:
            registering.prepare(self._store, session_id)  # so that a comparison finds it done
        else:
            self._draw(lane, session_id, BUSY_PATIENCE)
        due = self._drawing.due(session_id)
        return step.left > 0 or step.unshown or due or step.state is State.FINISHING

    def _correct(self, lane: Lane, session: Session, trouble: Trouble) -> bool:
        """Seal a finished session where that was cut off; correct it by a further method, where that was asked for."""
        sealing.seal_if_possible(self._store, session.id, self._now_ms())
        left = correct.settle(self._store, lane, session.id, self._now_ms())
        if left is not None:
            trouble.tries = 0
            self._observer.changed(session.id, session.revision)
        return bool(left)

    def _told(self, session_id: str, step: Step, started: float) -> None:
        self._remember(session_id, step.thinking)
        if step.state is State.FINISHED:
            self._drawing.over(session_id)
        else:
            self._drawing.left(session_id, step.revision)
        self._observer.committed(session_id, step, time.perf_counter() - started)

    def _draw(self, lane: Lane, session_id: str, patience: float = 1.0) -> bool:
        """Draw some of the tiles that are behind, where it is time; whether more should be drawn now."""
        if not self._drawing.due(session_id, patience):
            return False
        try:
            more = self._drawing.some(lane, session_id)
        except WorkFailed:
            self._drawing.put_off(session_id)
            return False
        if not more:
            self._observer.changed(session_id, self._session(session_id).revision)
        return more

    def _reflect(self, lane: Lane, session_id: str) -> bool:
        """Show what was decided beside, where that is done; whether there is more of it. A worker lost meanwhile
        decides it anew with the next snapshot, or at the end."""
        if session_id not in self._thinking:
            return False
        started = time.perf_counter()
        try:
            step = advance.reflect(self._store, lane, session_id, self._now_ms(), self._limits)
        except (WorkerLost, TaskFailed):
            step = False
        if isinstance(step, Step):
            self._told(session_id, step, started)
            return step.unshown
        self._remember(session_id, step)
        return False

    def _remember(self, session_id: str, thinking: bool) -> None:
        (self._thinking.add if thinking else self._thinking.discard)(session_id)

    def _failed(self, session_id: str, trouble: Trouble, error: Exception) -> bool:
        trouble.tries += 1
        session = self._session(session_id)
        waiting = self._store.read(lambda c: snapshots.count_after(c, session_id, session.covered_through))
        if waiting > 1 and not trouble.careful and not isinstance(error, CannotLoad):
            trouble.tries, trouble.careful = 0, min(waiting, STEP_LIMIT)
        final = trouble.tries >= MOST_TRIES
        kind = "advance" if waiting else "correct" if session.state is State.FINISHED else "finish"
        self._note(session, kind, str(error), final)
        if not final:
            return True
        trouble.tries = 0
        if waiting and not isinstance(error, CannotLoad):
            return self._pass_over(session_id, trouble, str(error))
        return kind == "correct"  # another may wait

    def _note(self, session: Session, kind: str, error: str, final: bool) -> None:
        def unit(connection: Connection) -> None:
            jobs.fail(connection, session.id, kind, self._now_ms(), error, final=final)
            if final and kind == "finish":
                sessions.set_state(connection, session.id, State.FAILED)
            elif final and kind == "correct":
                correct.give_up(connection, session.id, error)

        self._store.write(unit)
        self._observer.changed(session.id, session.revision)

    def _pass_over(self, session_id: str, trouble: Trouble, fault: str) -> bool:
        step = advance.pass_over(self._store, session_id, self._now_ms(), fault)
        trouble.careful = max(0, trouble.careful - 1)
        if step is not None:
            self._observer.committed(session_id, step, 0.0)
        return True

    def _session(self, session_id: str) -> Session:
        return self._store.read(lambda c: sessions.get(c, session_id))

    def _now_ms(self) -> int:
        return int(self._clock.now_s() * 1000)
