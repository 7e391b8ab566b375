"""The one writer: everything that changes the database goes through its thread, many units to a commit.

While one commit waits for the disk the next units queue up, so commits group by themselves under load and add no wait
without it. Each unit of a group runs in a savepoint of its own: one that fails takes back its own changes alone. A
unit's result is handed out only after the commit that holds it.
"""

from __future__ import annotations

import contextlib
import queue
import sqlite3
import threading
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any, TypeVar

from sqlalchemy import Connection, Engine
from sqlalchemy.exc import DBAPIError

from pondwatch.core.errors import PondwatchError, StorageFull, Unavailable

T = TypeVar("T")
Unit = Callable[[Connection], Any]
GROUP = 64
WAITING = 4096


def database_error(error: DBAPIError) -> PondwatchError:
    """What a failed statement or commit means to the caller."""
    original = error.orig
    if isinstance(original, sqlite3.OperationalError) and "full" in str(original):
        return StorageFull("There is no room left on the disk; nothing was stored.")
    return Unavailable("The database failed; nothing was stored.")


class Writer:
    """Runs units of work on one connection, in the order given, and commits them in groups."""

    def __init__(self, engine: Engine) -> None:
        self._engine = engine
        self._queue: queue.Queue[tuple[Unit, Future[Any]] | None] = queue.Queue(WAITING)
        self._closed = False
        self._thread = threading.Thread(target=self._run, name="writer", daemon=True)
        self._thread.start()

    def submit(self, unit: Callable[[Connection], T]) -> Future[T]:
        """Queue a unit; its future is done once it is committed.

        Raises:
            Unavailable: closed, or too many wait.
        """
        future: Future[T] = Future()
        try:
            if self._closed:
                raise Unavailable("The store is closing.")
            self._queue.put_nowait((unit, future))
        except queue.Full:
            raise Unavailable("Too many writes wait for the disk.") from None
        return future

    def __call__(self, unit: Callable[[Connection], T]) -> T:
        """Run a unit and wait until it is committed."""
        return self.submit(unit).result()

    def close(self) -> None:
        """Commit what waits, then stop."""
        self._closed = True
        self._queue.put(None)
        self._thread.join()

    def _run(self) -> None:
        running = True
        while running:
            group = [self._queue.get()]
            with contextlib.suppress(queue.Empty):
                while group[-1] is not None and len(group) < GROUP:
                    group.append(self._queue.get_nowait())
            running = group[-1] is not None
            units = [item for item in group if item is not None]
            if units:
                self._commit(units)

    def _commit(self, units: list[tuple[Unit, Future[Any]]]) -> None:
        try:
            with self._engine.begin() as connection:
                outcomes = self._run_all(connection, [unit for unit, _ in units])
        except DBAPIError as error:
            outcomes = [(None, database_error(error))] * len(units)
        except Exception as error:  # a border: the writer must outlive any unit
            outcomes = [(None, error)] * len(units)
        for (_, future), (result, failure) in zip(units, outcomes, strict=True):
            if failure is None:
                future.set_result(result)
            else:
                future.set_exception(failure)

    def _run_all(self, connection: Connection, units: list[Unit]) -> list[tuple[Any, BaseException | None]]:
        if len(units) == 1:  # what it did is taken back with the transaction
            return [(units[0](connection), None)]
        return [self._attempt(connection, unit) for unit in units]

    @staticmethod
    def _attempt(connection: Connection, unit: Unit) -> tuple[Any, BaseException | None]:
        try:
            with connection.begin_nested():
                return unit(connection), None
        except DBAPIError as error:
            if error.connection_invalidated:
                raise
            return None, database_error(error)
        except Exception as error:  # handed to whoever waits for it
            return None, error
