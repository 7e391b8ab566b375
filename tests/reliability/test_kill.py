"""A snapshot that was acknowledged is never lost, doubled or altered, whenever the server dies."""

from __future__ import annotations

import signal
import time
from pathlib import Path

import cv2
import numpy as np
import pytest

from pondwatch.core.corrector import make_corrector
from pondwatch.core.images import decode
from pondwatch.core.inspection import parse_inspection
from pondwatch.core.mosaic import Mosaic
from pondwatch.core.values import Image, Snapshot, SnapshotKey
from tests.fakes.robot import Shot, document

from .harness import Ending, Server, children, is_alive, run


def undisturbed(ending: Ending) -> tuple[dict[tuple[str, int], list[float]], list[tuple[str, str]], Image]:
    """Poses, rods and mosaic of the same snapshots by the core alone, in one go."""
    inspection = parse_inspection(document())
    taken = []
    for robot, sequence in sorted(ending.acknowledged):
        shot = Shot(sequence, robot)
        pose = shot.pose()
        at = np.array([pose["x_m"], pose["y_m"], pose["theta_rad"]])
        taken.append(Snapshot(SnapshotKey(robot, 0, sequence), 0.0, at, decode(shot.content, inspection.camera)))
    corrector = make_corrector(inspection, "identity")
    corrector.add(taken)
    corrector.settle()
    mosaic = Mosaic(inspection.camera, inspection.pond)
    poses = {}
    for snapshot in taken:
        placed = corrector.poses()[snapshot.key].pose_pond
        assert placed is not None
        mosaic.put(snapshot.key, snapshot.image, placed)
        poses[snapshot.key.robot, snapshot.key.sequence] = [float(v) for v in placed]
    return poses, [(r.rod_id, r.state.value) for r in corrector.rods()], mosaic.bgra()


def check(ending: Ending) -> None:
    assert ending.lost == []
    assert ending.session["state"] == "finished"
    keys = [(p["robot"], p["sequence"]) for p in ending.poses]
    assert sorted(keys) == sorted(ending.acknowledged)  # none lost, none doubled, none made up
    poses, rods, mosaic = undisturbed(ending)
    assert {(p["robot"], p["sequence"]): [p["x_m"], p["y_m"], p["theta_rad"]] for p in ending.poses} == poses
    assert [(r["rod_id"], r["state"]) for r in ending.rods] == rods
    served = cv2.imdecode(np.frombuffer(ending.mosaic, np.uint8), cv2.IMREAD_UNCHANGED)
    np.testing.assert_array_equal(served, mosaic)


@pytest.mark.timeout(300)
def test_ten_kills_lose_double_and_alter_nothing(tmp_path: Path) -> None:
    ending = run(tmp_path, kills=10, seed=1)

    check(ending)
    assert len(ending.acknowledged) > 50


@pytest.mark.long
def test_two_hundred_kills_lose_double_and_alter_nothing(tmp_path: Path) -> None:
    check(run(tmp_path, kills=200, seed=2))


@pytest.mark.timeout(300)
def test_the_harness_finds_the_loss_of_a_server_that_acknowledges_before_it_commits(tmp_path: Path) -> None:
    ending = run(tmp_path, kills=10, seed=3, lying=True, stop_at_loss=True)

    assert ending.lost != []


def test_a_killed_server_leaves_no_process_behind(tmp_path: Path) -> None:
    server = Server(tmp_path)
    server.start()
    workers = children(server.pid)
    assert workers

    server.kill()

    until = time.monotonic() + 10
    while (left := [pid for pid in workers if is_alive(pid)]) and time.monotonic() < until:
        time.sleep(0.05)
    assert left == []


def test_a_server_that_is_asked_to_stop_does_so_at_once_and_starts_again(tmp_path: Path) -> None:
    server = Server(tmp_path)
    server.start()

    began = time.monotonic()
    server.kill(signal.SIGTERM)

    assert time.monotonic() - began < 3
    assert server.start() < 10
    server.kill()
