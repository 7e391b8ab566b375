"""Uploads under load to a server that is killed at random moments, and what must hold afterwards.

Nothing here looks into the server: it is started as a process, spoken to over HTTP, and killed with SIGKILL.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import random
import select
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Any

import httpx

from .inspected import Inspected, Key, Shot

ROOT = Path(__file__).parents[2]
READY_S = 30.0
WAIT_S = 60.0
AWAY_S = 0.05  # before a station tries again: it shares the processor with the server that starts
MOMENT_S = 0.06  # the longest between what a kill waits for and the kill
ENVIRONMENT = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}


class Server:
    """A server process on a data folder, and beside it what it logs. `start` and `kill` as often as needed."""

    def __init__(self, data: Path, *, lying: bool = False) -> None:
        self._arguments = [str(data), *(["--acknowledge-early"] if lying else [])]
        self._process: subprocess.Popen[str] | None = None
        self.url, self.log = "", data.with_name(f"{data.name}.log")

    def start(self) -> float:
        """Start it; the seconds until it was ready."""
        began = time.monotonic()
        command = [sys.executable, "-m", "tests.reliability.launcher", *self._arguments]
        with self.log.open("a") as log:
            self._process = subprocess.Popen(
                command, cwd=ROOT, env=ENVIRONMENT, stdout=subprocess.PIPE, stderr=log, text=True
            )
        assert self._process.stdout
        assert select.select([self._process.stdout], [], [], READY_S)[0], "the server did not start"
        self.url = self._process.stdout.readline().split()[-1]
        assert httpx.get(f"{self.url}/readyz", timeout=READY_S).status_code == 200
        return time.monotonic() - began

    def kill(self, how: int = signal.SIGKILL) -> None:
        """End it, by default as a crash would."""
        if self._process is not None:
            assert self._process.stdout
            self._process.send_signal(how)
            self._process.wait(20)
            self._process.stdout.close()
            self._process = None

    @property
    def pid(self) -> int:
        """The server's process."""
        assert self._process
        return self._process.pid

    def __enter__(self) -> Server:
        self.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.kill()


@dataclass(slots=True)
class Tide:
    """How far the stations may go, so that every kill meets uploads under way. over: all may end."""

    limit: int = 0
    is_over: bool = False


@dataclass(slots=True)
class Station:
    """A base station: sends its robot's snapshots one after the other, each until it is acknowledged."""

    server: Server
    session: str
    shots: list[tuple[int, Shot]]  # with their places among those of all stations
    tide: Tide
    acknowledged: dict[Key, str] = field(default_factory=dict)
    faults: list[str] = field(default_factory=list)
    client: httpx.Client = field(default_factory=lambda: httpx.Client(timeout=20))

    def run(self) -> None:
        """Send until the last one is acknowledged, or it is over."""
        for place, shot in self.shots:
            while not self._may_end and (place >= self.tide.limit or not self._send(shot)):
                time.sleep(0.01 if place >= self.tide.limit else AWAY_S)
            if self._may_end:
                break
            self.acknowledged[shot.robot, shot.sequence] = shot.digest
        self.client.close()

    @property
    def _may_end(self) -> bool:
        return self.tide.is_over or bool(self.faults)

    def _send(self, shot: Shot) -> bool:
        try:
            answer = self.client.post(f"{self.server.url}/api/sessions/{self.session}/snapshots", files=shot.parts())
        except httpx.HTTPError:
            return False
        if answer.status_code >= 500:
            return False
        if answer.status_code not in (200, 201):
            self.faults.append(f"{answer.status_code} {answer.text}")
        return answer.status_code in (200, 201)


@dataclass(frozen=True, slots=True)
class Ending:
    """What a run came to. lost: acknowledged snapshots that are gone or altered, as of each restart."""

    lost: list[str]
    acknowledged: dict[Key, str]
    slowest_start_s: float
    session: dict[str, Any]
    poses: list[dict[str, Any]]
    rods: list[dict[str, Any]]
    mosaic: bytes


@dataclass(slots=True)
class Trial:
    """Stations that upload an inspection to a server, which is killed and started again as asked."""

    server: Server
    session: str
    stations: list[Station]
    tide: Tide
    chance: random.Random
    lost: list[str] = field(default_factory=list)
    checked: set[Key] = field(default_factory=set)  # what a kill found safe is looked at again at the end
    slowest_start_s: float = 0.0

    def acknowledged(self) -> dict[Key, str]:
        """Snapshots that a station was told are safe, and their digests."""
        return {key: digest for station in self.stations for key, digest in station.acknowledged.copy().items()}

    def kill_after(self, count: int) -> None:
        """Kill the server a moment after so many were acknowledged, with the next ones on their way."""
        self.tide.limit = count + len(self.stations)
        self.wait_for(count)
        time.sleep(self.chance.uniform(0, MOMENT_S))
        self.restart()

    def restart(self) -> None:
        """Kill, start, and look for what was acknowledged since the last time."""
        self.server.kill()
        safe = self.acknowledged()
        self.slowest_start_s = max(self.slowest_start_s, self.server.start())
        self.lost += lost_of(self.server, self.session, {k: d for k, d in safe.items() if k not in self.checked})
        self.checked |= set(safe)

    def wait_for(self, count: int) -> None:
        """Until so many were acknowledged."""
        until = time.monotonic() + WAIT_S
        while len(self.acknowledged()) < count:
            assert [fault for station in self.stations for fault in station.faults] == []
            assert time.monotonic() < until, f"{len(self.acknowledged())} of {count} were acknowledged"
            time.sleep(0.002)

    def ending(self) -> Ending:
        """Kill the server once more as it finishes, let it finish, and read everything."""
        url = f"/api/sessions/{self.session}"
        httpx.post(f"{self.server.url}{url}/finish", params={"wait": 0}, timeout=20).raise_for_status()
        time.sleep(self.chance.uniform(0, 10 * MOMENT_S))
        self.restart()
        self.lost += lost_of(self.server, self.session, self.acknowledged())
        with httpx.Client(base_url=f"{self.server.url}{url}", timeout=90) as client:
            view = client.post("/finish", params={"wait": 60}).json()
            poses, rods = client.get("/poses").json()["poses"], client.get("/rods").json()["rods"]
            mosaic = client.get("/mosaic.png").content
        return Ending(self.lost, self.acknowledged(), self.slowest_start_s, view, poses, rods, mosaic)


def lost_of(server: Server, session: str, acknowledged: dict[Key, str]) -> list[str]:
    """Acknowledged snapshots whose bytes the server does not give back."""
    found = []
    with httpx.Client(base_url=f"{server.url}/api/sessions/{session}/snapshots", timeout=30) as client:
        for (robot, sequence), digest in acknowledged.items():
            answer = client.get(f"/{robot}/0/{sequence}/image")
            if answer.status_code != 200 or hashlib.sha256(answer.content).hexdigest() != digest:
                found.append(f"{robot} {sequence}: {answer.status_code}")
    return found


@contextlib.contextmanager
def uploading(data: Path, inspected: Inspected, seed: int, *, lying: bool = False) -> Iterator[Trial]:
    """A trial whose stations run; they end with it."""
    tide = Tide()
    with Server(data, lying=lying) as server:
        opened = httpx.post(f"{server.url}/api/sessions", json=inspected.document, timeout=20)
        session = opened.raise_for_status().json()["id"]
        robots = sorted({shot.robot for shot in inspected.shots})
        mine = {robot: [(i, s) for i, s in enumerate(inspected.shots) if s.robot == robot] for robot in robots}
        stations = [Station(server, session, mine[robot], tide) for robot in robots]
        threads = [threading.Thread(target=station.run, daemon=True) for station in stations]
        for thread in threads:
            thread.start()
        try:
            yield Trial(server, session, stations, tide, random.Random(seed))
        finally:
            tide.is_over = True
            for thread in threads:
                thread.join(30)


def run(data: Path, inspected: Inspected, kills: int, seed: int) -> Ending:
    """Upload an inspection; kill the server at random moments of that, the last time as it finishes."""
    count = len(inspected.shots)
    with uploading(data, inspected, seed) as trial:
        for after in sorted(trial.chance.randrange(1, count) for _ in range(kills - 1)):
            trial.kill_after(after)
        trial.tide.limit = count
        trial.wait_for(count)
        return trial.ending()


def first_loss(data: Path, inspected: Inspected, kills: int, seed: int) -> list[str]:
    """What the first of some kills lost that lost anything, on a server that acknowledges before it commits."""
    with uploading(data, inspected, seed, lying=True) as trial:
        for after in range(2, 2 + 3 * kills, 3):
            trial.kill_after(after)
            if trial.lost:
                break
        return trial.lost


def descendants(pid: int) -> list[int]:
    """Processes whose parent this is, and theirs. All of a parent's threads count: any may have started one."""
    listed = [child for of in Path(f"/proc/{pid}/task").glob("*/children") for child in of.read_text().split()]
    return [found for child in map(int, listed) for found in (child, *descendants(child))]


def is_alive(pid: int) -> bool:
    """Whether a process still runs (a zombie does not)."""
    try:
        os.kill(pid, 0)
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (ProcessLookupError, FileNotFoundError):
        return False
