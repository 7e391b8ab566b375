"""When the tiles that revisions left behind are drawn: together, a little later, and a few at a time.

Snapshots that come meanwhile go first. Viewers do not wait for tiles: what changed reaches them as patches.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

from pondwatch.store.store import Store

from . import advance
from .lanes import Lane

AFTER_S = 1.0  # a tile is behind for so long at most, while there is time
QUIET_S = 0.3  # or until no revision came for so long
AT_ONCE = 2  # tiles: what a snapshot may have to wait for
_EVERYTHING = 1 << 62


@dataclass(slots=True)
class _Round:
    """since_s: when the first tile fell behind, touched_s: the last, seconds of the clock. newest: the revision that
    left it so. through: while a round is under way, the revision up to which it draws."""

    since_s: float
    touched_s: float
    newest: int
    through: int | None = None


class Drawing:
    """All sessions' tiles. now_s: seconds of any clock that only grows."""

    def __init__(
        self,
        store: Store,
        now_s: Callable[[], float] = time.monotonic,
        after_s: float = AFTER_S,
        quiet_s: float = QUIET_S,
    ) -> None:
        self._store, self._now_s, self._after_s, self._quiet_s = store, now_s, after_s, quiet_s
        self._rounds: dict[str, _Round] = {}
        self._known: set[str] = set()

    def left(self, session_id: str, revision: int) -> None:
        """A revision was written, which may have left tiles behind."""
        now_s = self._now_s()
        known = self._rounds.setdefault(session_id, _Round(now_s, now_s, revision))
        known.touched_s, known.newest = now_s, revision

    def over(self, session_id: str) -> None:
        """The session has ended, which drew all its tiles."""
        self._rounds.pop(session_id, None)

    def waits(self, session_id: str) -> bool:
        """Whether tiles are behind, so that a step will be due without an upload."""
        return session_id in self._rounds

    def hurry(self, session_id: str) -> None:
        """Draw at the next occasion."""
        known = self._rounds.get(session_id)
        if known is not None:
            known.since_s = known.touched_s = -math.inf

    def due(self, session_id: str, patience: float = 1.0) -> bool:
        """Whether tiles should be drawn now. patience: how much longer than usual they may wait."""
        known = self._rounds.get(session_id)
        if known is None:
            return session_id not in self._known  # what was behind when the server ended
        now_s = self._now_s()
        late = now_s - known.since_s >= self._after_s * patience or now_s - known.touched_s >= self._quiet_s
        return known.through is not None or late

    def some(self, lane: Lane, session_id: str) -> bool:
        """Draw a few; whether more are due now.

        Raises:
            WorkerLost, TaskFailed, CannotLoad, Unavailable, StorageFull: none was drawn.
        """
        known = self._rounds.get(session_id)
        if known is not None and known.through is None:
            known.through = known.newest
        through = _EVERYTHING if known is None or known.through is None else known.through
        if advance.draw(self._store, lane, session_id, through, AT_ONCE) == AT_ONCE:
            return True
        self._known.add(session_id)
        if known is not None and known.newest > through:
            known.since_s, known.through = self._now_s(), None
            return self.due(session_id)
        self._rounds.pop(session_id, None)
        return False

    def put_off(self, session_id: str) -> None:
        """They could not be drawn: later."""
        self._known.add(session_id)
        known = self._rounds.get(session_id)
        if known is not None:
            known.since_s = known.touched_s = self._now_s()
            known.through = None
