"""Uploads under load to a server that is killed at random moments, and what must hold afterwards.

Nothing here looks into the server: it is started as a process, spoken to over HTTP, and killed with SIGKILL.
"""

from __future__ import annotations

import hashlib
import os
import random
import select
import signal
import subprocess
import sys
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Any

import httpx

from tests.fakes.robot import Shot, document

ROOT = Path(__file__).parents[2]
READY_S = 30.0
PAUSE_S = 0.02  # between a station's snapshots


class Server:
    """A server process on a data folder. `start` and `kill` as often as needed."""

    def __init__(self, data: Path, *, lying: bool = False) -> None:
        self._arguments = [str(data), *(["--acknowledge-early"] if lying else [])]
        self._process: subprocess.Popen[str] | None = None
        self.url = ""

    def start(self) -> float:
        """Start it; the seconds until it was ready."""
        began = time.monotonic()
        command = [sys.executable, "-m", "tests.reliability.launcher", *self._arguments]
        self._process = subprocess.Popen(
            command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
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
class Station:
    """A base station: sends its robot's snapshots one after the other, each until it is acknowledged."""

    server: Server
    session: str
    robot: str
    acknowledged: dict[int, str] = field(default_factory=dict)  # sequence to digest
    is_over: bool = False
    faults: list[str] = field(default_factory=list)
    client: httpx.Client = field(default_factory=lambda: httpx.Client(timeout=10))

    def run(self) -> None:
        """Send until it is over and the last one is acknowledged."""
        sequence = 0
        while not (self.is_over or self.faults):
            shot = Shot(sequence, self.robot)
            while not self.faults and not self._send(shot):
                time.sleep(0.02)
            self.acknowledged[sequence] = shot.digest
            sequence += 1
            time.sleep(PAUSE_S)
        self.client.close()

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
    acknowledged: dict[tuple[str, int], str]
    slowest_start_s: float
    session: dict[str, Any]
    poses: list[dict[str, Any]]
    rods: list[dict[str, Any]]
    mosaic: bytes


def lost_of(server: Server, session: str, acknowledged: dict[tuple[str, int], str]) -> list[str]:
    """Acknowledged snapshots whose bytes the server does not give back."""
    found = []
    with httpx.Client(base_url=f"{server.url}/api/sessions/{session}/snapshots", timeout=30) as client:
        for (robot, sequence), digest in acknowledged.items():
            answer = client.get(f"/{robot}/0/{sequence}/image")
            if answer.status_code != 200 or hashlib.sha256(answer.content).hexdigest() != digest:
                found.append(f"{robot} {sequence}: {answer.status_code}")
    return found


def run(
    data: Path, kills: int, seed: int, *, stations: int = 4, lying: bool = False, stop_at_loss: bool = False
) -> Ending:
    """Upload from several stations while the server is killed and started again; then finish and read everything."""
    chance, lost, slowest = random.Random(seed), [], 0.0
    with Server(data, lying=lying) as server:
        session = httpx.post(f"{server.url}/api/sessions", json=document()).json()["id"]
        senders = [Station(server, session, f"bubble-{i}") for i in range(stations)]
        threads = [threading.Thread(target=station.run, daemon=True) for station in senders]
        for thread in threads:
            thread.start()
        checked: dict[tuple[str, int], str] = {}  # what a kill found safe is looked at again at the end
        for _ in range(kills):
            time.sleep(chance.uniform(0.02, 0.5))
            server.kill()
            safe = _acknowledged(senders)
            slowest = max(slowest, server.start())
            lost += lost_of(server, session, {key: digest for key, digest in safe.items() if key not in checked})
            checked = safe
            if lost and stop_at_loss:
                break
        for station in senders:
            station.is_over = True
        for thread in threads:
            thread.join(30)
        assert [fault for station in senders for fault in station.faults] == []
        safe = _acknowledged(senders)
        return _finished(server, session, safe, lost + lost_of(server, session, safe), slowest)


def _acknowledged(senders: list[Station]) -> dict[tuple[str, int], str]:
    return {(s.robot, sequence): digest for s in senders for sequence, digest in s.acknowledged.copy().items()}


def _finished(
    server: Server, session: str, acknowledged: dict[tuple[str, int], str], lost: list[str], slowest: float
) -> Ending:
    with httpx.Client(base_url=f"{server.url}/api/sessions/{session}", timeout=60) as client:
        view = client.post("/finish", params={"wait": 50}).json()
        poses, rods = client.get("/poses").json()["poses"], client.get("/rods").json()["rods"]
        return Ending(lost, acknowledged, slowest, view, poses, rods, client.get("/mosaic.png").content)


def children(pid: int) -> list[int]:
    """Processes whose parent this is."""
    listed = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    return [int(child) for child in listed]


def is_alive(pid: int) -> bool:
    """Whether a process still runs (a zombie does not)."""
    try:
        os.kill(pid, 0)
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (ProcessLookupError, FileNotFoundError):
        return False
