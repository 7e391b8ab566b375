"""The same work on many things, on all cores: child processes by `fork` that see what this one holds.

Each takes a stretch of the things; its results come back through a pipe, in which values that this process holds too
are named, not sent. A child that fails, or is killed, leaves its stretch to this process. Where there is no `fork`, or
one core, or little to do, it is done here.
"""

from __future__ import annotations

import os
import pickle
import sys
from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise
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


def spread_out(work: Callable[[T], R], things: Sequence[T], shared: Sequence[object]) -> list[R]:
    """What `work` makes of each thing, in their order. It must change nothing that is looked at afterwards.

    Args:
        shared: values that `work` may return, none of which ever changes.
    """
    return _spread(work, things, shared, LEAST)


def spread_few(work: Callable[[T], R], things: Sequence[T], shared: Sequence[object]) -> list[R]:
    """The same, of things each of which is much work."""
    return _spread(work, things, shared, 2)


def _spread(work: Callable[[T], R], things: Sequence[T], shared: Sequence[object], least: int) -> list[R]:
    parts = min(cores(), len(things)) if len(things) >= least else 1
    cuts = [len(things) * k // parts for k in range(parts + 1)]
    own, *others = (partial(_each, work, things[a:b]) for a, b in pairwise(cuts))
    children = [beside(other, shared) for other in others]
    done = own()
    for child in children:
        done += child()
    return done


def beside(work: Callable[[], R], shared: Sequence[object] = ()) -> Callable[[], R]:
    """Begin some work on another core.

    Returns:
        What waits for its result and gives it.
    """
    return _Child(work, shared).result if cores() > 1 else work


def _each(work: Callable[[T], R], things: Sequence[T]) -> list[R]:
    return [work(thing) for thing in things]


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
