"""Every store of a test run in PostgreSQL: `pytest -p tests.fakes.postgres --postgres URL tests/api tests/store`.

The URL is that of a server whose user may make databases; each SQLite file that a test names becomes one of them, and
is dropped at the end. Tests marked `sqlite` are left out.
"""

from __future__ import annotations

import hashlib

import pytest
from sqlalchemy import create_engine, text

from pondwatch.store import store

PREFIX = "pondwatch_test_"


def pytest_addoption(parser: pytest.Parser) -> None:
    """The option."""
    parser.addoption("--postgres", metavar="URL", help="run every store on this PostgreSQL server")


def pytest_configure(config: pytest.Config) -> None:
    """From now on stores open databases of the server."""
    if url := config.getoption("--postgres"):
        databases = config.stash[_KEY] = Databases(url)
        for name in ("writer_engine", "reader_engine"):
            made = getattr(store, name)
            setattr(store, name, lambda file, made=made: made(databases.of(file)))


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """What is said of SQLite alone."""
    if config.getoption("--postgres"):
        items[:] = [item for item in items if item.get_closest_marker("sqlite") is None]


def pytest_unconfigure(config: pytest.Config) -> None:
    """Leave nothing on the server."""
    if _KEY in config.stash:
        config.stash[_KEY].drop()


class Databases:
    """Of one server, one for each file that is asked for."""

    def __init__(self, url: str) -> None:
        self._url = url.rstrip("/")
        self._server = create_engine(f"{self._url}/postgres", isolation_level="AUTOCOMMIT")
        self._made: set[str] = set()

    def of(self, file: str) -> str:
        """The URL of the database that stands for an SQLite file."""
        name = PREFIX + hashlib.sha256(file.encode()).hexdigest()[:16]
        if name not in self._made:
            self._made.add(name)
            self._run(f"CREATE DATABASE {name}")
        return f"{self._url}/{name}"

    def drop(self) -> None:
        """All that were made."""
        for name in sorted(self._made):
            self._run(f"DROP DATABASE {name} WITH (FORCE)")
        self._server.dispose()

    def _run(self, statement: str) -> None:
        with self._server.connect() as connection:
            connection.execute(text(statement))


_KEY = pytest.StashKey[Databases]()
