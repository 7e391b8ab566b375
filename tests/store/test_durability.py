"""The database and the blobs: one writer, readers that only read, and nothing half-done when the disk fails."""

from __future__ import annotations

import errno
import os
import sqlite3
import threading
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from sqlalchemy import create_engine, event, text
from sqlalchemy.exc import DBAPIError

from pondwatch.core.errors import Conflict, Missing, StorageFull, Unavailable
from pondwatch.core.inspection import parse_inspection
from pondwatch.store import sessions
from pondwatch.store.blobs import FolderBlobs, digest_of
from pondwatch.store.engine import migrate
from pondwatch.store.store import Store
from pondwatch.store.tables import metadata
from tests.fakes.robot import document


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with Store(tmp_path, f"sqlite:///{tmp_path}/test.sqlite") as opened:
        yield opened


def test_the_migrations_end_at_the_tables_that_the_code_uses(tmp_path: Path) -> None:
    engine = create_engine(f"sqlite:///{tmp_path}/m.sqlite")
    migrate(engine)
    migrate(engine)  # again is as good as once

    with engine.connect() as connection:
        assert compare_metadata(MigrationContext.configure(connection), metadata) == []
    engine.dispose()


@pytest.mark.sqlite
def test_the_writer_syncs_every_commit_and_readers_can_neither_write_nor_checkpoint(store: Store) -> None:
    def ask(connection: Any, *names: str) -> list[Any]:
        return [connection.execute(text(f"PRAGMA {name}")).scalar_one() for name in names]

    assert store.write(lambda c: ask(c, "journal_mode", "synchronous", "foreign_keys")) == ["wal", 2, 1]
    assert store.read(lambda c: ask(c, "wal_autocheckpoint", "query_only")) == [0, 1]
    with pytest.raises(Unavailable):
        store.read(lambda c: c.execute(text("DELETE FROM sessions")))


def test_a_failed_unit_takes_back_its_own_changes_alone(store: Store) -> None:
    inspection = parse_inspection(document())
    gate = threading.Event()

    def fails(connection: Any) -> None:
        sessions.create(connection, inspection, "identity", 2)
        raise Conflict("no")

    waiting = store.writer.submit(lambda c: gate.wait(5))  # so that what follows is one group
    futures = [
        store.writer.submit(partial(sessions.create, inspection=inspection, method="identity", now_ms=n))
        for n in (1, 3)
    ]
    failing = store.writer.submit(fails)
    gate.set()

    assert waiting.result(5)
    created = {future.result(5) for future in futures}
    with pytest.raises(Conflict):
        failing.result(5)
    assert {s.id for s in store.read(lambda c: sessions.page(c, 10, None))} == created


def test_a_unit_that_fails_with_none_beside_it_leaves_nothing_either(store: Store) -> None:
    def fails(connection: Any) -> None:
        sessions.create(connection, parse_inspection(document()), "identity", 2)
        raise Conflict("no")

    with pytest.raises(Conflict):
        store.write(fails)
    with pytest.raises(Unavailable):
        store.write(lambda c: c.execute(text("DELETE FROM nothing_of_the_kind")))

    assert store.read(lambda c: sessions.page(c, 10, None)) == []
    assert store.write(lambda c: sessions.page(c, 10, None)) == []  # and the next finds the writer at work


def test_a_result_is_handed_out_only_after_the_commit_that_holds_it(store: Store, monkeypatch: Any) -> None:
    seen = []
    engine = store._writing

    @event.listens_for(engine, "commit")
    def committing(_connection: Any) -> None:
        seen.append(future.done())

    gate = threading.Event()
    future = store.writer.submit(lambda c: gate.wait(5))
    gate.set()
    future.result(5)

    assert seen == [False]


def test_a_commit_that_finds_the_disk_full_fails_every_unit_and_the_next_one_works(store: Store) -> None:
    engine = store._writing

    def full(_connection: Any) -> None:
        raise DBAPIError("COMMIT", None, sqlite3.OperationalError("database or disk is full"))

    event.listen(engine, "commit", full)
    inspection = parse_inspection(document())
    with pytest.raises(StorageFull):
        store.write(lambda c: sessions.create(c, inspection, "identity", 1))
    event.remove(engine, "commit", full)

    kept = store.write(lambda c: sessions.create(c, inspection, "identity", 2))
    assert [s.id for s in store.read(lambda c: sessions.page(c, 10, None))] == [kept]


def test_what_does_not_belong_together_is_not_stored(store: Store) -> None:
    orphan = text("INSERT INTO rods VALUES ('nosuch', 'R0', 0, 0, 0, 1, 1)")

    with pytest.raises(Unavailable):
        store.write(lambda c: c.execute(orphan))


def test_a_second_server_on_the_same_folder_is_refused(store: Store, tmp_path: Path) -> None:
    with pytest.raises(Unavailable, match="Another Pondwatch"):
        Store(tmp_path, f"sqlite:///{tmp_path}/test.sqlite")


def test_a_closed_store_takes_nothing(tmp_path: Path) -> None:
    store = Store(tmp_path, f"sqlite:///{tmp_path}/test.sqlite")
    store.close()

    with pytest.raises(Unavailable):
        store.write(lambda c: None)
    Store(tmp_path, f"sqlite:///{tmp_path}/test.sqlite").close()


def test_a_blob_is_synced_then_renamed_then_its_folder_synced(tmp_path: Path, monkeypatch: Any) -> None:
    blobs, calls = FolderBlobs(tmp_path / "blobs"), []
    fsync, rename = os.fsync, os.rename

    def noted_fsync(handle: int) -> None:
        kind = "folder" if Path(f"/proc/self/fd/{handle}").resolve().is_dir() else "file"
        calls.append(f"sync {kind}")
        fsync(handle)

    def noted_rename(source: Any, target: Any) -> None:
        calls.append("rename")
        rename(source, target)

    monkeypatch.setattr(os, "fsync", noted_fsync)
    monkeypatch.setattr(os, "rename", noted_rename)
    digest = blobs.put(b"hello")

    assert calls == ["sync file", "rename", "sync folder"]
    assert digest == "2cf24dba5fb0a30e26e83b2ac5b9e29e1b161e5c1fa7425e73043362938b9824"  # sha256sum of hello
    assert (blobs.get(digest), list(blobs)) == (b"hello", [digest])


@pytest.mark.parametrize("operation", ["fsync", "rename"])
@pytest.mark.parametrize(
    ("code", "error"), [(errno.ENOSPC, StorageFull), (errno.EDQUOT, StorageFull), (errno.EIO, Unavailable)]
)
def test_a_failing_disk_leaves_no_half_a_blob(
    tmp_path: Path, monkeypatch: Any, operation: str, code: int, error: type[Exception]
) -> None:
    blobs = FolderBlobs(tmp_path / "blobs")

    def broken(*_: Any) -> None:
        raise OSError(code, os.strerror(code))

    with monkeypatch.context() as patch:
        patch.setattr(os, operation, broken)
        with pytest.raises(error):
            blobs.put(b"hello")

    assert [p for p in (tmp_path / "blobs").rglob("*") if p.is_file()] == []
    assert blobs.put(b"hello") == digest_of(b"hello")


def test_a_damaged_blob_is_not_handed_out_and_is_mended_by_the_same_bytes(tmp_path: Path) -> None:
    blobs = FolderBlobs(tmp_path / "blobs")
    digest = blobs.put(b"hello")
    blobs.path(digest).write_bytes(b"jello")

    with pytest.raises(Unavailable, match="damaged"):
        blobs.get(digest)

    blobs.put(b"hello")
    assert blobs.get(digest) == b"hello"


def test_a_blob_that_was_never_put_is_missing(tmp_path: Path) -> None:
    blobs = FolderBlobs(tmp_path / "blobs")

    assert not blobs.has("00" * 32)
    with pytest.raises(Missing):
        blobs.get("00" * 32)


def test_what_a_crash_left_half_written_is_swept_at_the_next_start(tmp_path: Path) -> None:
    FolderBlobs(tmp_path / "blobs")
    (tmp_path / "blobs/tmp/left").write_bytes(b"half")

    FolderBlobs(tmp_path / "blobs")

    assert list((tmp_path / "blobs/tmp").iterdir()) == []
