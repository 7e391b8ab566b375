"""A database of an earlier version is brought to this one with what it holds."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from alembic import command
from alembic.autogenerate import compare_metadata
from alembic.config import Config
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import Engine, select, text
from sqlalchemy.exc import IntegrityError

from pondwatch.core.values import Camera, Inspection, Pond, Rod
from pondwatch.resources import migrations_dir
from pondwatch.store import alarmtables, ponds, sessions, tables
from pondwatch.store.engine import migrate, newest_revision, writer_engine

SESSION = (
    "INSERT INTO sessions (id, name, method, created_ms, camera_width_px, camera_height_px, camera_metres_per_pixel, "
    "pond_width_m, pond_height_m, state, revision, covered_through, seen_share, quality) "
    "VALUES ('s1', 'Pond', 'lattice', 1, 160, 110, 0.001, 1, 1, 'finished', 7, 0, 0, '')"
)
JOB = (
    "INSERT INTO jobs (session_id, kind, state, progress, attempts, created_ms, updated_ms) "
    "VALUES ('s1', '{}', 'done', 1, 0, 5, 6)"
)


def to(engine: Engine, version: str, way: Any = command.upgrade) -> None:
    config = Config()
    config.set_main_option("script_location", str(migrations_dir()))
    with engine.begin() as connection:
        config.attributes["connection"] = connection
        way(config, version)


def kinds(engine: Engine) -> list[str]:
    with engine.begin() as connection:
        return list(connection.execute(text("SELECT kind FROM jobs ORDER BY id")).scalars())


def test_jobs_of_the_first_version_are_kept_and_a_correction_may_be_one_after_it(tmp_path: Path) -> None:
    engine = writer_engine(f"sqlite:///{tmp_path}/m.sqlite")
    to(engine, "0001")
    with engine.begin() as connection:
        connection.execute(text(SESSION))
        connection.execute(text(JOB.format("finish")))

    migrate(engine)

    with engine.begin() as connection:
        connection.execute(text(JOB.format("correct")))
    assert kinds(engine) == ["finish", "correct"]
    with pytest.raises(IntegrityError), engine.begin() as connection:
        connection.execute(text(JOB.format("magic")))
    with engine.begin() as connection:
        connection.execute(text("DELETE FROM sessions"))
    assert kinds(engine) == []  # they still end with their session
    to(engine, "0001", command.downgrade)
    engine.dispose()


ALARM = (
    "INSERT INTO alarms (session_id, kind, subject, detail, active, acknowledged, latched, suppressed, out_of_service, "
    "shelved, since_ms, occurrences) VALUES ('s1', 'robot-silent', 'a', '', 1, 0, 0, 0, 0, 0, 5, 1)"
)


def test_sessions_of_the_third_version_are_kept_and_may_have_alarms_after_it(tmp_path: Path) -> None:
    engine = writer_engine(f"sqlite:///{tmp_path}/m.sqlite")
    to(engine, "0003")
    with engine.begin() as connection:
        connection.execute(text(SESSION))

    migrate(engine)

    with engine.begin() as connection:
        connection.execute(text(ALARM))
    with pytest.raises(IntegrityError), engine.begin() as connection:
        connection.execute(text(ALARM))  # one of a kind and a subject a session
    with engine.begin() as connection:
        assert connection.execute(text("SELECT name FROM sessions")).scalars().all() == ["Pond"]
    to(engine, "0003", command.downgrade)
    engine.dispose()


def test_the_tables_are_those_that_the_program_speaks_of(tmp_path: Path) -> None:
    engine = writer_engine(f"sqlite:///{tmp_path}/m.sqlite")
    migrate(engine)

    with engine.connect() as connection:
        found = compare_metadata(MigrationContext.configure(connection), alarmtables.metadata)
    engine.dispose()

    assert [change for change in found if "alarm" in str(change) or "baseline" in str(change)] == []


ROD = (
    "INSERT INTO rods (session_id, rod_id, position, x_m, y_m, outer_radius_m, inner_radius_m) "
    "VALUES ('{}', '{}', {}, {}, 0.5, 0.02, 0.01)"
)


def test_sessions_of_one_layout_are_assigned_to_one_pond_and_later_ones_join_it(tmp_path: Path) -> None:
    engine = writer_engine(f"sqlite:///{tmp_path}/m.sqlite")
    to(engine, "0005")
    with engine.begin() as connection:
        for session, first in (("s1", 0.1), ("s2", 0.1), ("s3", 0.2)):
            connection.execute(text(SESSION.replace("'s1'", f"'{session}'")))
            connection.execute(text(ROD.format(session, "A", 0, first)))
            connection.execute(text(ROD.format(session, "B", 1, 0.7)))

    migrate(engine)

    rods = [Rod("B", 0.7, 0.5, 0.02, 0.01), Rod("A", 0.1, 0.5, 0.02, 0.01)]  # in another order
    inspection = Inspection("next", Camera(160, 110, 0.001), Pond(1.0, 1.0, tuple(rods)))
    with engine.begin() as connection:
        after = sessions.create(connection, inspection, "lattice", 2)
        found = {row.id: (row.pond_id, row.layout_version) for row in connection.execute(select(tables.sessions))}
        assert [p.rods for p in ponds.every(connection)] == [2, 2]
    assert found["s1"] == found["s2"] == found[after] == ("s1", 1)
    assert found["s3"] == ("s3", 1)
    to(engine, "0005", command.downgrade)
    with engine.begin() as connection:
        assert connection.execute(text("SELECT count(*) FROM rods")).scalar_one() == 8
    engine.dispose()


def test_the_newest_revision_is_where_the_migrations_end() -> None:
    assert newest_revision() == ScriptDirectory(str(migrations_dir())).get_current_head()


def test_tables_that_are_of_this_version_are_not_migrated_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    engine = writer_engine(f"sqlite:///{tmp_path}/m.sqlite")
    migrate(engine)

    monkeypatch.setattr(command, "upgrade", None)

    migrate(engine)
