"""The store of a data folder: the database's one writer, its readers, the blobs and the signing key."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import TypeVar

from sqlalchemy import Connection
from sqlalchemy.exc import DBAPIError

from .blobs import FolderBlobs
from .engine import FolderLock, migrate, reader_engine, writer_engine
from .remembered import Remembered
from .signing import Signer
from .uow import Writer, database_error

T = TypeVar("T")
_SIDES = 64  # inspections of some hundred rods each, as they are compared: a quarter of a megabyte
_COUNTS = 4096  # inspections, of which a few numbers


class Store:
    """Everything that is kept. Opening it migrates the tables; one process at a time may hold a data folder.

    Raises:
        Unavailable: another process holds the folder.
    """

    def __init__(self, folder: Path, url: str) -> None:
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        self._lock = FolderLock(folder)
        self.folder = folder
        self.blobs = FolderBlobs(folder / "blobs")
        self.signer = Signer(folder)
        self._writing = writer_engine(url)
        migrate(self._writing)
        self._reading = reader_engine(url)
        self.writer = Writer(self._writing)
        self.sides = Remembered(_SIDES)
        self.counts = Remembered(_COUNTS)

    def read(self, look: Callable[[Connection], T]) -> T:
        """Run `look` on one consistent state of the database.

        Raises:
            Unavailable: the database failed.
        """
        try:
            with self._reading.connect() as connection, connection.begin():
                return look(connection)
        except DBAPIError as error:
            raise database_error(error) from error

    def write(self, unit: Callable[[Connection], T]) -> T:
        """Run a unit of work; returns once it is committed and on disk."""
        return self.writer(unit)

    def close(self) -> None:
        """Commit what waits, then let go of everything."""
        self.writer.close()
        self._reading.dispose()
        self._writing.dispose()
        self._lock.close()

    def __enter__(self) -> Store:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
