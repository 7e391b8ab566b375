"""A snapshot that was acknowledged is never lost, doubled or altered, whenever the server dies."""

from __future__ import annotations

import hashlib
import os
import signal
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import cv2
import httpx
import numpy as np
import pytest

from tests.fakes.robot import document

from .harness import Ending, Server, descendants, first_loss, is_alive, run
from .inspected import Inspected, alone, inspected

CLOSE = 1e-6  # m, rad


def check(ending: Ending, given: Inspected) -> None:
    """Every snapshot once, as it was sent; and the result is what the core alone makes of them, undisturbed."""
    assert ending.lost == []
    assert ending.acknowledged == {(s.robot, s.sequence): s.digest for s in given.shots}
    assert (ending.session["state"], ending.session["method"]) == ("finished", "lattice")
    keys = [(p["robot"], p["sequence"]) for p in ending.poses]
    assert sorted(keys) == sorted(ending.acknowledged)  # none lost, none doubled, none made up
    expected = alone(given)
    check_poses(ending.poses, expected.poses)
    names = ("rod_id", "state", "views")
    assert [tuple(r[n] for n in names) for r in ending.rods] == [
        (r.rod_id, r.state.value, r.views) for r in expected.rods
    ]
    served = cv2.imdecode(np.frombuffer(ending.mosaic, np.uint8), cv2.IMREAD_UNCHANGED)
    assert digest(served) == digest(expected.mosaic)


def check_poses(rows: list[dict[str, Any]], expected: dict[tuple[str, int], Any]) -> None:
    for row in rows:
        status, pose = expected[row["robot"], row["sequence"]]
        assert row["status"] == status
        found = [row["x_m"], row["y_m"], row["theta_rad"]]
        if pose is None:
            assert found == [None] * 3
        else:
            np.testing.assert_allclose(found, pose, rtol=0, atol=CLOSE)


def digest(pixels: Any) -> str:
    return hashlib.sha256(np.ascontiguousarray(pixels).tobytes()).hexdigest()


@pytest.mark.timeout(900)
def test_ten_kills_lose_double_and_alter_nothing_and_the_rods_are_read_as_without_them(tmp_path: Path) -> None:
    given = inspected(snapshots=40, seed=3)

    ending = run(tmp_path, given, kills=10, seed=1)

    check(ending, given)
    states = Counter(rod["state"] for rod in ending.rods)  # what is compared is no row of rods that nobody read
    assert min(states["empty"], states["full"]) >= 3
    assert sum(p["status"] == "placed" for p in ending.poses) >= 25


@pytest.mark.long
@pytest.mark.timeout(3600)
def test_two_hundred_kills_lose_double_and_alter_nothing(tmp_path: Path) -> None:
    given = inspected(snapshots=221, seed=4)

    check(run(tmp_path, given, kills=200, seed=2), given)


@pytest.mark.timeout(900)
def test_the_harness_finds_the_loss_of_a_server_that_acknowledges_before_it_commits(tmp_path: Path) -> None:
    assert first_loss(tmp_path, inspected(snapshots=40, seed=3), kills=10, seed=3) != []


def test_a_killed_server_leaves_no_process_behind(tmp_path: Path) -> None:
    server = Server(tmp_path)
    server.start()
    workers = workers_of(server)
    assert workers
    left_behind = descendants(server.pid)

    server.kill()

    until = time.monotonic() + 60
    while (left := [pid for pid in left_behind if is_alive(pid)]) and time.monotonic() < until:
        time.sleep(0.05)
    assert left == []


def test_a_server_that_is_asked_to_stop_does_so_at_once_and_starts_again(tmp_path: Path) -> None:
    server = Server(tmp_path)
    server.start()

    began = time.monotonic()
    server.kill(signal.SIGTERM)

    assert time.monotonic() - began < 10  # and not when requests in progress would be cut off
    server.start()
    server.kill()


def test_a_server_that_is_stopped_while_someone_waits_for_the_end_answers_and_logs_no_fault(tmp_path: Path) -> None:
    server = Server(tmp_path / "data")
    server.start()
    first, session = [httpx.post(f"{server.url}/api/sessions", json=document()).json()["id"] for _ in range(2)]
    httpx.post(f"{server.url}/api/sessions/{first}/finish", params={"wait": 60}, timeout=70)  # the worker is there
    for worker in workers_of(server):
        os.kill(worker, signal.SIGSTOP)  # so that the end does not come
    with ThreadPoolExecutor(1) as pool:
        url = f"{server.url}/api/sessions/{session}"
        waiting = pool.submit(httpx.post, f"{url}/finish", params={"wait": 60}, timeout=70)
        while httpx.get(url, timeout=20).json()["state"] != "finishing":
            time.sleep(0.01)

        began = time.monotonic()
        server.kill(signal.SIGTERM)

        assert time.monotonic() - began < 2.5  # before the server would cut requests off
        answer = waiting.result(10)
    assert (answer.status_code, answer.json()["state"]) == (202, "finishing")
    assert "Traceback" not in server.log.read_text()


def workers_of(server: Server) -> list[int]:
    """Once they have begun: each of them is nicer than its server."""
    until = time.monotonic() + 60
    while not (found := [pid for pid in descendants(server.pid) if is_nice(pid)]) and time.monotonic() < until:
        time.sleep(0.05)
    assert found
    return found


def is_nice(pid: int) -> bool:
    return os.getpriority(os.PRIO_PROCESS, pid) > os.getpriority(os.PRIO_PROCESS, 0)
