"""Worker processes: a few lanes of one process each. A session keeps to its lane, where its state is held.

They are forked from a process of their own that has loaded, once for all of them, what a worker needs; the server's
process loads none of it. So a server listens sooner, many workers cost little more than one, and one that is lost is
replaced within hundredths of a second.
"""

from __future__ import annotations

import os
import socket
import struct
import threading
import zlib
from multiprocessing.connection import Connection
from typing import Any, Protocol

from .nursery import context
from .tasks import Failed

_END_S = 5.0  # for a process that was killed to be gone


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
    """One worker process at the other end of a pipe, replaced when it dies or takes longer than `timeout_s`. One call
    at a time; `close` may come from any thread."""

    def __init__(self, timeout_s: float) -> None:
        self._timeout_s = timeout_s
        self._lock = threading.Lock()
        self._closed = False
        self._open()

    def _open(self) -> None:
        pipe, its_end = context().Pipe()
        with its_end:
            process = context().Process(target=_work, args=(its_end,), name="worker", daemon=True)
            process.start()
        _bound(pipe, self._timeout_s)
        self._pipe, self._process = pipe, process

    @property
    def worker(self) -> int:
        """The number of the process."""
        assert self._process.pid is not None
        return self._process.pid

    def call(self, method: str, *args: Any) -> Any:
        """The desk's answer.

        Raises:
            WorkerLost: there is none. TaskFailed: the method raised.
        """
        try:
            self._pipe.send((method, args))
            answer = self._pipe.recv()
        except (EOFError, OSError) as error:
            self._replace()
            why = "it did not answer in time" if isinstance(error, BlockingIOError) else "it ended"
            raise WorkerLost(f"The worker process was lost: {why}.") from error
        if isinstance(answer, Failed):
            raise TaskFailed(answer.message)
        return answer

    def _replace(self) -> None:
        with self._lock:
            self._process.kill()
            self._process.join(_END_S)
            if not self._closed:
                self._pipe.close()
                self._open()

    def close(self) -> None:
        """End the process now; whatever it was at will be done again."""
        with self._lock:
            self._closed = True
            self._process.kill()


def _bound(pipe: Connection, most_s: float) -> None:
    """Let neither sending nor receiving wait longer: both raise BlockingIOError then."""
    limit = struct.pack("ll", int(most_s), int(most_s % 1 * 1e6))
    with socket.socket(fileno=os.dup(pipe.fileno())) as shared:
        shared.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, limit)
        shared.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, limit)


def _work(pipe: Connection) -> None:
    """In the worker: answer one call after the other, until there is nobody to answer."""
    from .worker import on_desk, start

    start()
    while True:
        try:
            method, args = pipe.recv()
        except EOFError:
            return
        pipe.send(on_desk(method, *args))


def lane_of(session: str, lanes: int) -> int:
    """The lane that a session keeps to."""
    return zlib.crc32(session.encode()) % lanes
