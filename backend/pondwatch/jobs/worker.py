"""What a worker process does: it holds a few sessions' correctors and mosaics between calls.

What it holds is a cache of the store at a revision. A call that finds it missing or at another revision is answered
with None; the server then hands the session over as stored (`load`) and asks again. So a worker may be killed at any
moment, and what it did for a revision that was never committed is forgotten.
"""

from __future__ import annotations

import gc
import multiprocessing
import os
import signal
import threading
import time
import traceback
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import replace
from multiprocessing.connection import wait
from typing import Any

import cv2

from pondwatch.core.corrector import Deliberates, hold
from pondwatch.core.ports import Spread, one_by_one

from .held import MOVED_AT_ONCE, MOVED_BESIDE, Held, as_stored
from .raster import encode_tiles
from .spreading import spread_out
from .tasks import Base, EncodedTile, Failed, Outcome, Place, SnapshotRef
from .thought import Begin, ForkThought, ThreadThought

SESSIONS_HELD = 8
_LOAD_CHUNK = 256
_NICER = 5  # whoever waits for an acknowledgement comes before the correction


class Desk:
    """The sessions that one worker holds, the longest unused let go of first. begin: how joint decisions are begun;
    spread: how what is decided for each snapshot is."""

    def __init__(self, begin: Begin = ThreadThought, spread: Spread = one_by_one) -> None:
        self._held: OrderedDict[str, Held] = OrderedDict()
        self._begin, self._spread = begin, spread

    def load(self, base: Base) -> None:
        """Take up a session as it is stored."""
        held, snapshots = as_stored(base, self._spread)
        held.begin = self._begin
        for i in range(0, len(snapshots), _LOAD_CHUNK):
            held.corrector.add(snapshots[i : i + _LOAD_CHUNK])
        if isinstance(held.corrector, Deliberates):
            held.corrector.beside()
        held.stale = True
        self._keep(base.session, held)

    def advance(self, session: str, revision: int, refs: Sequence[SnapshotRef]) -> Outcome | None:
        """Correct and assemble with further snapshots; None where the session is not held at this revision."""
        held = self._take(session, revision)
        if held is None:
            return None
        began = time.perf_counter()
        poses = [*held.corrector.add(held.take(refs)).poses, *(held.reflect(len(refs)) or ())] if refs else []
        decided = time.perf_counter()
        most_moved = MOVED_BESIDE if refs else MOVED_AT_ONCE
        outcome = held.outcome(held.corrector.poses().values() if held.stale else poses, most_moved)
        self._keep(session, held)
        return replace(outcome, correct_s=decided - began, assemble_s=time.perf_counter() - decided)

    def reflect(self, session: str, revision: int) -> Outcome | bool | None:
        """What a joint decision made beside changed, and is not shown yet; True while it is being made, False where
        there is none; None where the session is not held at this revision."""
        held = self._take(session, revision)
        if held is None:
            return None
        poses = held.reflect()
        outcome: Outcome | bool = held.thought is not None
        if poses is not None or held.unshown:
            outcome = held.outcome(poses or ())
        self._keep(session, held)
        return outcome

    def settle(self, base: Base, look_over: bool = False) -> Outcome:
        """Decide all at once, in the order of the keys, so that nothing of the order of arrival is left; then look the
        floor over, where that is asked for."""
        self.forget(base.session)
        held, snapshots = as_stored(base, self._spread)
        hold(held.corrector, sorted(snapshots, key=lambda s: s.key))
        held.corrector.settle()
        outcome = held.outcome(sorted(held.corrector.poses().values(), key=lambda p: p.key), most_moved=None)
        places = sorted({*outcome.undrawn, *base.undrawn})
        tiles = tuple(encode_tiles(held.mosaic, places))
        return replace(outcome, undrawn=(), tiles=tiles, condition=held.condition(self._spread) if look_over else None)

    def draw(self, session: str, revision: int, places: Sequence[Place]) -> list[EncodedTile] | None:
        """Tiles as they are at this revision; None where the session is not held at it."""
        held = self._take(session, revision)
        if held is None:
            return None
        tiles = encode_tiles(held.mosaic, places)
        self._keep(session, held)
        return tiles

    def forget(self, session: str) -> None:
        """Let go of a session."""
        held = self._held.pop(session, None)
        if held is not None:
            held.abandon()

    def _take(self, session: str, revision: int) -> Held | None:
        """What fails half-way is not held any more."""
        held = self._held.pop(session, None)
        if held is not None and held.revision != revision:
            held.abandon()
            return None
        return held

    def _keep(self, session: str, held: Held) -> None:
        self._held[session] = held
        while len(self._held) > SESSIONS_HELD:
            self._held.popitem(last=False)[1].abandon()


_desk = Desk(ForkThought, spread_out)  # this process's own


def answered(desk: Desk, method: str, *args: Any) -> Any:
    """What a desk's method returns; `Failed` where it raises."""
    try:
        return getattr(desk, method)(*args)
    except Exception as error:  # a border: the server must hear of any error
        where = traceback.extract_tb(error.__traceback__)[-1]
        return Failed(f"{type(error).__name__}: {error} ({where.name}, line {where.lineno})"[:500])


def on_desk(method: str, *args: Any) -> Any:
    """Call a method of this process's desk."""
    return answered(_desk, method, *args)


def start() -> int:
    """Set up a new worker process; its id."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.nice(_NICER)
    cv2.setNumThreads(1)
    gc.collect()
    gc.freeze()  # what is imported stays, and a child by fork shares it
    threading.Thread(target=_die_with_parent, name="parent-watch", daemon=True).start()
    return os.getpid()


def _die_with_parent() -> None:
    """A server that was killed leaves no worker behind."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)
