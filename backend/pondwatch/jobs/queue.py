"""Which session is worked on when: one at a time in a lane, each session always in the same lane.

A lane's thread takes the session that has waited longest, does one step and looks again. However many uploads woke a
session in between, its next step covers them all.
"""

from __future__ import annotations

import threading
import time
import uuid
from collections import OrderedDict
from collections.abc import Sequence

import structlog

from pondwatch.core.errors import Missing, PondwatchError
from pondwatch.store import behind, sessions
from pondwatch.store.store import Store

from .lanes import Lane, lane_of
from .steps import Steps

GLANCE_S = 0.15  # between looks at what is done without an upload: a joint decision, tiles
DRAWN_S, _POLL_S = 3.0, 0.02
PAUSES_S = (0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 30.0)


class Queue:
    """Runs the steps of all sessions."""

    def __init__(self, store: Store, steps: Steps, lanes: Sequence[Lane]) -> None:
        self._store, self._steps = store, steps
        self._lanes = [_LaneThread(steps, lane) for lane in lanes]

    def start(self) -> None:
        """Begin, with what was left undone before."""
        for lane in self._lanes:
            lane.start()
        for session_id in self._store.read(sessions.unfinished):
            self.wake(session_id)

    def wake(self, session_id: str) -> None:
        """There is work for this session. Any thread; returns at once."""
        self._lanes[lane_of(session_id, len(self._lanes))].wake(session_id)

    def draw(self, session_id: str, patience_s: float = DRAWN_S) -> None:
        """Have the tiles drawn that are behind; returns once they are, or after so many seconds."""
        until = time.monotonic() + patience_s
        through = self._store.read(lambda c: max((t.since for t in behind.of(c, session_id)), default=0))
        while self._store.read(lambda c: behind.of(c, session_id, through, 1)) and time.monotonic() < until:
            self._steps.hurry(session_id)
            self.wake(session_id)
            time.sleep(_POLL_S)

    @property
    def waiting(self) -> int:
        """Sessions that wait for a step."""
        return sum(lane.waiting for lane in self._lanes)

    def close(self) -> None:
        """Stop at once; what is under way is done again at the next start."""
        for lane in self._lanes:
            lane.close()


class _LaneThread:
    """A thread, a lane, and the sessions that wait for both."""

    def __init__(self, steps: Steps, lane: Lane) -> None:
        self._steps, self._lane = steps, lane
        self._due: OrderedDict[str, None] = OrderedDict()
        self._changed = threading.Condition()
        self._waiting: set[str] = set()
        self._closed = False
        self._failures = 0
        self._thread = threading.Thread(target=self._run, name="lane", daemon=True)

    @property
    def waiting(self) -> int:
        return len(self._due)

    def start(self) -> None:
        self._thread.start()

    def wake(self, session_id: str) -> None:
        with self._changed:
            self._due[session_id] = None
            self._changed.notify()

    def close(self) -> None:
        with self._changed:
            self._closed = True
            self._changed.notify()
        self._lane.close()
        if self._thread.is_alive():
            self._thread.join()

    def _run(self) -> None:
        while (session_id := self._next()) is not None:
            if self._step(session_id):
                self.wake(session_id)
            (self._waiting.add if self._steps.waits(session_id) else self._waiting.discard)(session_id)

    def _next(self) -> str | None:
        with self._changed:
            while not self._due and not self._closed:
                if not self._changed.wait(GLANCE_S if self._waiting else None):
                    self._due.update(dict.fromkeys(self._waiting))
            return None if self._closed else self._due.popitem(last=False)[0]

    def _step(self, session_id: str) -> bool:
        try:
            more = self._steps.take(self._lane, session_id)
        except Missing:
            return False
        except Exception as error:  # a border: a lane must outlive any session's fault
            if self._closed:
                return False
            known = isinstance(error, PondwatchError)
            structlog.get_logger().error(
                "step_failed", session=session_id, fault=uuid.uuid4().hex, error=str(error), exc_info=not known
            )
            self._pause()
            return True
        self._failures = 0
        return more

    def _pause(self) -> None:
        pause_s = PAUSES_S[min(self._failures, len(PAUSES_S) - 1)]
        self._failures += 1
        with self._changed:
            self._changed.wait_for(lambda: self._closed, pause_s)
