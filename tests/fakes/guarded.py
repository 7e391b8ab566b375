"""A house with a watch over its session, whose time passes when a test says so."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from sqlalchemy import update

from pondwatch.core.alarmacts import Act
from pondwatch.core.conditions import Limits
from pondwatch.core.values import RodReading
from pondwatch.jobs.alarms import Deed, Watch
from pondwatch.jobs.alarmviews import event
from pondwatch.store import alarms, revisions, sessions
from pondwatch.store.revisions import NewRevision
from pondwatch.store.sessions import State
from pondwatch.store.tables import snapshots

from .house import House
from .robot import Shot

GIB = 1 << 30


class Time:
    """A clock that stands until it is moved."""

    def __init__(self) -> None:
        self.at_s = 1_800_000_000.0

    def now_s(self) -> float:
        return self.at_s


class Guarded:
    """A house with a watch over it; `at` judges at a number of seconds from the start."""

    def __init__(self, folder: Path) -> None:
        self.house, self.time, self.free, self.told = House(folder), Time(), 100 * GIB, 0
        self.start_s = self.time.at_s
        self.watch = self.fresh()

    def fresh(self, **limits: Any) -> Watch:
        """A watch that knows only what is stored, as after a restart."""
        return Watch(self.house.store, self.time, Limits(**limits), lambda: self.free, self._tell)

    def _tell(self, session_id: str, revision: int) -> None:
        self.told += 1

    def at(self, s: float) -> dict[str, dict[str, Any]]:
        self.time.at_s = self.start_s + s
        self.watch.judge(self.house.session)
        return self.rows()

    def rows(self) -> dict[str, dict[str, Any]]:
        found = self.watch.told(self.house.session).rows
        return {f"{row['kind']}/{row['subject']}".rstrip("/"): row for row in found}

    def hear(self, sequence: int, s: float, robot: str = "bubble-1") -> None:
        """A snapshot that came at a time."""
        self.house.send(Shot(sequence, robot))
        at_ms = round(1000 * (self.start_s + s))
        key = (snapshots.c.sequence == sequence, snapshots.c.robot == robot)
        self.house.store.write(lambda c: c.execute(update(snapshots).where(*key).values(received_ms=at_ms)))

    def read(self, *readings: RodReading, session: str | None = None) -> None:
        """A revision in which rods read so."""
        session_id = session or self.house.session
        found = self.house.store.read(lambda c: sessions.get(c, session_id))
        at_ms = round(1000 * self.time.at_s)
        new = NewRevision(session_id, found.revision, found.covered_through, at_ms, rods=readings)
        self.house.store.write(lambda c: revisions.write(c, new))

    def set_state(self, state: State) -> None:
        self.house.store.write(lambda c: sessions.set_state(c, self.house.session, state))

    def act(self, act: Act, row: dict[str, Any], comment: str = "why", for_s: float | None = None) -> Any:
        return self.watch.act(self.house.session, [row["id"]], Deed(act, "Ada", comment, for_s))[0]

    def events(self, of: str) -> list[tuple[str, str | None, str]]:
        """(act, by, text) of an alarm, in order."""
        found = self.house.store.read(lambda c: alarms.events(c, self.house.session, 1000))
        told = [event(row) for row in found][::-1]
        return [(e["act"], e["by"], e["text"]) for e in told if f"{e['kind']}/{e['subject']}".rstrip("/") == of]
