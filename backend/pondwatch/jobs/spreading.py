"""The same work on many things, on all cores: child processes by `fork` that see what this one holds.

Each has a stretch of the things, and then helps the others with theirs, so that none waits long for another that had
more to do or a busier core; its results come back through a pipe, in which values that this process holds too are
named, not sent. What a child that fails, or is killed, had begun is done by this process. Where there is no `fork`,
or one core, or little to do, it is done here.
"""

from __future__ import annotations

import mmap
import os
import pickle
import sys
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Generic, TypeVar

import cv2

from .thought import answer, loads, whole

T = TypeVar("T")
R = TypeVar("R")

LEAST = 24  # things, from which a child is worth its start
MOST_CORES = 8


def cores() -> int:
    """How many this process may use."""
    allowed = len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1
    return min(allowed, MOST_CORES) if hasattr(os, "fork") else 1


def spread_out(work: Callable[[T], R], things: Sequence[T], shared: Sequence[object], large: bool = False) -> list[R]:
    """What `work` makes of each thing, in their order. It must change nothing that is looked at afterwards.

    Args:
        shared: values that `work` may return, none of which ever changes.
        large: each thing is much work: two are enough for a child.
    """
    count = len(things)
    parts = min(cores(), count) if count >= (2 if large else LEAST) else 1
    if parts == 1:
        return [work(thing) for thing in things]
    with mmap.mmap(-1, count) as begun:  # a byte for each thing, which all processes see
        own, *others = (partial(_some, work, things, begun, _turns(count, k, parts)) for k in range(parts))
        children = [beside(other, shared) for other in others]
        done = own()
        for child in children:
            done = child() | done
    return [done[k] if k in done else work(things[k]) for k in range(count)]


def _turns(count: int, k: int, parts: int) -> Iterator[int]:
    """In which order process k of some begins things: its own stretch, then what the others have left, from its end."""
    cuts = [count * part // parts for part in range(parts + 1)]
    yield from range(cuts[k], cuts[k + 1])
    for other in (*range(k + 1, parts), *range(k)):
        yield from reversed(range(cuts[other], cuts[other + 1]))


def _some(work: Callable[[T], R], things: Sequence[T], begun: mmap.mmap, turns: Iterator[int]) -> dict[int, R]:
    """What this process makes of the things that no other has begun. That two begin one at the same moment costs time
    and nothing else: what they make of it is the same."""
    done = {}
    for k in turns:
        if not begun[k]:
            begun[k] = 1
            done[k] = work(things[k])
    return done


def beside(work: Callable[[], R], shared: Sequence[object] = ()) -> Callable[[], R]:
    """Begin some work on another core.

    Returns:
        What waits for its result and gives it.
    """
    return _Child(work, shared).result if cores() > 1 else work


class _Child(Generic[R]):
    """A process that does one piece of work and ends."""

    def __init__(self, work: Callable[[], R], shared: Sequence[object]) -> None:
        self._work, self._shared = work, shared
        cv2.setNumThreads(1)  # a child has none of the threads that OpenCV keeps
        self._source, sink = os.pipe()
        self._pid = os.fork()
        if self._pid == 0:
            answer(work, shared, sink)
        os.close(sink)

    def result(self) -> R:
        """What it made; made here where it failed."""
        content = whole(self._source)
        os.waitpid(self._pid, 0)
        try:
            made: R = loads(content, self._shared)
        except (pickle.UnpicklingError, EOFError):  # it ended in mid-sentence
            return self._work()
        return made
