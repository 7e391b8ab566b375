"""A store, a lane and one session, without threads of their own: steps are taken when a test says so."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pondwatch.core.inspection import parse_inspection
from pondwatch.core.values import SnapshotKey
from pondwatch.jobs import finish, tiles
from pondwatch.jobs.advance import Step
from pondwatch.jobs.drawing import Drawing
from pondwatch.jobs.ingest import Ingest, Upload
from pondwatch.jobs.steps import Steps
from pondwatch.store import jobs, revisions, sessions
from pondwatch.store.clock import SystemClock
from pondwatch.store.store import Store

from .lane import InlineLane
from .robot import Shot, document


@dataclass
class Heard:
    """An observer that remembers."""

    steps: list[Step] = field(default_factory=list)
    changes: list[int] = field(default_factory=list)

    def committed(self, session_id: str, step: Step, seconds: float) -> None:
        self.steps.append(step)

    def changed(self, session_id: str, revision: int) -> None:
        self.changes.append(revision)


class House:
    """Made on a data folder; close its store at the end."""

    def __init__(self, data: Path) -> None:
        self.data = data
        self.store = Store(data, f"sqlite:///{data}/test.sqlite")
        self.time_s = 0.0
        self.lane, self.heard, clock = InlineLane(), Heard(), SystemClock()
        self.steps = Steps(self.store, clock, self.heard, drawing=Drawing(self.store, lambda: self.time_s))
        self.woken: list[str] = []
        self.ingest = Ingest(self.store, clock, self.woken.append)
        inspection = parse_inspection(document())
        self.session = self.store.write(lambda c: sessions.create(c, inspection, "identity", 1_000))

    def restart(self) -> None:
        """The server ended, and another serves the same folder: what was in memory is gone."""
        session = self.session
        self.store.close()
        self.__init__(self.data)  # type: ignore[misc]
        self.session = session

    def send(self, *shots: Shot) -> None:
        session = self.ingest.session(self.session)
        for shot in shots:
            p = shot.pose()
            key = SnapshotKey(shot.robot, shot.boot, shot.sequence)
            self.ingest.accept(session, Upload(key, 0, p["x_m"], p["y_m"], p["theta_rad"], shot.content))

    def take(self) -> bool:
        return self.steps.take(self.lane, self.session)

    def drain(self) -> None:
        """Everything that is to do now, and then what may wait a little: tiles."""
        self._until_done()
        self.time_s += 10
        self._until_done()

    def _until_done(self) -> None:
        for _ in range(500):
            if not self.take():
                return
        raise AssertionError("there is always more to do")

    def finish(self) -> None:
        finish.begin(self.store, self.session, 2_000)
        self.drain()

    def facts(self) -> sessions.Facts:
        return self.store.read(lambda c: sessions.facts(c, self.session))

    def found(self) -> sessions.Session:
        return self.store.read(lambda c: sessions.get(c, self.session))

    def poses(self) -> list[tuple[Any, ...]]:
        rows = self.store.read(lambda c: revisions.pose_rows(c, self.session))
        return [(r["robot"], r["sequence"], r["status"], r["x_m"], r["y_m"], r["theta_rad"]) for r in rows]

    def job(self, kind: str) -> Any:
        return next(j for j in self.store.read(lambda c: jobs.rows(c, self.session)) if j["kind"] == kind)

    def result(self) -> tuple[list[tuple[Any, ...]], bytes]:
        return self.poses(), tiles.whole(self.store, self.session)[1].tobytes()
