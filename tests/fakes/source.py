"""A keeper of revisions in memory, for tests of the live feed: what changed when, and nothing else."""

from __future__ import annotations

import threading
import time
from typing import Any

from pondwatch.core.errors import Missing
from pondwatch.live.source import Alarms, Changes, Patch, Raster


class ScriptedSource:
    """One session, `s1`. `step` makes a revision. reads: every (since, revision) that was asked and answered."""

    def __init__(self, raster: Raster | None = None, oldest: int = 0, delay_s: float = 0.0) -> None:
        self.grid = raster or Raster(0.001, 64, 48)
        self.revision = 0
        self.oldest = oldest
        self.delay_s = delay_s
        self.session: dict[str, Any] = {"id": "s1", "name": "A pond", "state": "running"}
        self.reads: list[tuple[int | None, int]] = []
        self._lock = threading.Lock()
        self._rods: dict[str, tuple[int, dict[str, Any]]] = {}
        self._poses: dict[tuple[str, int], tuple[int, dict[str, Any]]] = {}
        self._patches: dict[tuple[int, int], tuple[int, Patch]] = {}
        self.jobs: list[dict[str, Any]] = []
        self.alarms = Alarms()

    def ring(self, *rows: dict[str, Any]) -> None:
        """The alarms as they stand from now on; each with `id`, `retained` and `quiet`."""
        self.alarms = Alarms(self.alarms.version + 1, rows)

    def step(
        self,
        patches: list[Patch] | None = None,
        rods: list[dict[str, Any]] | None = None,
        poses: list[dict[str, Any]] | None = None,
        **session: Any,
    ) -> int:
        """One revision on. A patch of the same corner replaces the one before it."""
        with self._lock:
            self.revision += 1
            for patch in patches or []:
                self._patches[(patch.x, patch.y)] = (self.revision, patch)
            for rod in rods or []:
                self._rods[rod["rod_id"]] = (self.revision, rod)
            for pose in poses or []:
                self._poses[(pose["robot"], pose["sequence"])] = (self.revision, pose)
            self.session = {**self.session, **session}
            return self.revision

    def raster(self, session: str) -> Raster:
        if session != "s1":
            raise Missing(f"There is no session {session!r}.", kind="session", id=session)
        return self.grid

    def changes(self, session: str, since: int | None) -> Changes:
        self.raster(session)
        time.sleep(self.delay_s)
        with self._lock:
            full = since is None or since < self.oldest or since > self.revision
            after = -1 if full or since is None else since
            self.reads.append((since, self.revision))
            return Changes(
                session=dict(self.session),
                revision=self.revision,
                full=full,
                poses=[pose for revision, pose in self._poses.values() if revision > after],
                rods=[rod for revision, rod in self._rods.values() if revision > after],
                patches=[patch for revision, patch in self._patches.values() if revision > after],
                jobs=list(self.jobs),
                alarms=self.alarms,
            )
