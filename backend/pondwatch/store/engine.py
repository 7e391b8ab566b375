"""Opening the database: one connection that writes and checkpoints, any number that only read.

SQLite from 3.7.0 to 3.51.2 can corrupt a write-ahead log when two connections checkpoint at once. So exactly one
connection here may write (`uow.Writer`), and readers are opened read-only: such a connection never checkpoints, not
even when it closes. A lock on the data folder keeps a second server out.
"""

from __future__ import annotations

import fcntl
import os
import sqlite3
from pathlib import Path
from typing import Any

from sqlalchemy import Connection, Engine, create_engine, event, inspect, make_url, text
from sqlalchemy.pool import QueuePool

from pondwatch.core.errors import Unavailable
from pondwatch.resources import migrations_dir

WAL_BUG_FIXED = (3, 51, 3)
_WRITER_PRAGMAS = (
    "journal_mode=WAL",
    "synchronous=FULL",
    "foreign_keys=ON",
    "busy_timeout=10000",
    "wal_autocheckpoint=1000",
)
_READER_PRAGMAS = ("query_only=ON", "busy_timeout=10000", "wal_autocheckpoint=0")


def wal_is_sound() -> bool:
    """Whether the SQLite that is linked would survive two connections that checkpoint at once."""
    return sqlite3.sqlite_version_info >= WAL_BUG_FIXED


def _prepare(engine: Engine, pragmas: tuple[str, ...], begin: str) -> Engine:
    @event.listens_for(engine, "connect")
    def _connect(connection: Any, _record: object) -> None:
        connection.isolation_level = None  # the driver's own transactions break savepoints
        for pragma in pragmas:
            connection.execute(f"PRAGMA {pragma}")

    @event.listens_for(engine, "begin")
    def _begin(connection: Connection) -> None:
        connection.exec_driver_sql(begin)

    return engine


def writer_engine(url: str) -> Engine:
    """An engine for the one connection that writes."""
    if make_url(url).get_backend_name() != "sqlite":
        return create_engine(url, pool_size=2)
    return _prepare(
        create_engine(url, poolclass=QueuePool, pool_size=1, max_overflow=0), _WRITER_PRAGMAS, "BEGIN IMMEDIATE"
    )


def reader_engine(url: str) -> Engine:
    """An engine whose connections only read; open it after the writer's first connection."""
    parsed = make_url(url)
    if parsed.get_backend_name() != "sqlite":
        one_state = {"isolation_level": "REPEATABLE READ", "postgresql_readonly": True}  # for all that a unit reads
        return create_engine(url, pool_size=16, execution_options=one_state)
    read_only = parsed.set(database=f"file:{parsed.database}", query={"mode": "ro", "uri": "true"})
    return _prepare(
        create_engine(read_only, poolclass=QueuePool, pool_size=16, max_overflow=48), _READER_PRAGMAS, "BEGIN"
    )


def migrate(engine: Engine) -> None:
    """Bring the tables to this version, in one transaction. Where they are at it already, nothing is loaded for it."""
    with engine.begin() as connection:
        if _revision(connection) == newest_revision():
            return
        from alembic import command  # a fifth of a second, at the first start of a version alone
        from alembic.config import Config

        config = Config()
        config.set_main_option("script_location", str(migrations_dir()).replace("%", "%%"))
        config.attributes["connection"] = connection
        command.upgrade(config, "head")


def newest_revision() -> str:
    """The number of the last migration, which its file's name begins with."""
    return max(path.name for path in (migrations_dir() / "versions").glob("*.py")).partition("_")[0]


def _revision(connection: Connection) -> str | None:
    if not inspect(connection).has_table("alembic_version"):
        return None
    found: str | None = connection.execute(text("SELECT version_num FROM alembic_version")).scalar()
    return found


class FolderLock:
    """Held by the one server of a data folder; the system lets go of it when the process ends, however it ends."""

    def __init__(self, folder: Path) -> None:
        self._handle = os.open(folder / "lock", os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        try:
            fcntl.flock(self._handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(self._handle)
            raise Unavailable(f"Another Pondwatch already serves the data folder {folder}.") from None

    def close(self) -> None:
        """Let another server in."""
        os.close(self._handle)
