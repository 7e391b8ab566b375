"""Worker processes: a few lanes of one process each. A session keeps to its lane, where its state is held.

They are forked from a process of their own that has loaded, once for all of them, what a worker needs; the server's
process loads none of it. So a server listens sooner, many workers cost little more than one, and one that is lost is
replaced within hundredths of a second.
"""

from __future__ import annotations

import contextlib
import os
import signal
import threading
import zlib
from concurrent.futures import CancelledError, Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from typing import Any, Protocol

from .nursery import context
from .tasks import Failed


class WorkerLost(Exception):
    """The worker died or did not answer in time; a new one is there for the next call."""


class TaskFailed(Exception):
    """What the worker was asked to do raised an error; the message says which."""


class Lane(Protocol):
    """Calls a method of `worker.Desk` and waits for the answer."""

    def call(self, method: str, *args: Any) -> Any:
        """The answer."""

    def close(self) -> None:
        """Stop at once."""


class ProcessLane:
    """One worker process, replaced when it dies or takes longer than `timeout_s`."""

    def __init__(self, timeout_s: float) -> None:
        self._timeout_s = timeout_s
        self._lock = threading.Lock()
        self._closed = False
        self._open()

    def _open(self) -> None:
        self._pool = ProcessPoolExecutor(1, mp_context=context())
        self._started: Future[int] = self._pool.submit(_start)

    def call(self, method: str, *args: Any) -> Any:
        """The desk's answer.

        Raises:
            WorkerLost: there is none. TaskFailed: the method raised.
        """
        try:
            answer = self._pool.submit(_on_desk, method, *args).result(self._timeout_s)
        except (BrokenProcessPool, CancelledError, RuntimeError, TimeoutError) as error:
            self._replace()
            raise WorkerLost(f"The worker process was lost ({type(error).__name__}).") from error
        if isinstance(answer, Failed):
            raise TaskFailed(answer.message)
        return answer

    def _replace(self) -> None:
        with self._lock:
            self._kill()
            if not self._closed:
                self._open()

    def _kill(self) -> None:
        with contextlib.suppress(BrokenProcessPool, CancelledError, TimeoutError, ProcessLookupError):
            os.kill(self._started.result(timeout=0), signal.SIGKILL)
        self._pool.shutdown(wait=False, cancel_futures=True)

    def close(self) -> None:
        """End the process now; whatever it was at will be done again."""
        with self._lock:
            self._closed = True
            self._kill()


def _start() -> int:
    """In the worker."""
    from .worker import start

    return start()


def _on_desk(method: str, *args: Any) -> Any:
    """In the worker."""
    from .worker import on_desk

    return on_desk(method, *args)


def lane_of(session: str, lanes: int) -> int:
    """The lane that a session keeps to."""
    return zlib.crc32(session.encode()) % lanes
