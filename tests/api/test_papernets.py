"""The paper's networks over REST: a session of 221 snapshots is corrected, any other fails and says why."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pondwatch.basestation.bundle import Bundle
from pondwatch.basestation.correcting import correct_bundle
from pondwatch.simulator.bundle import write_bundle
from pondwatch.simulator.simulation import Simulation
from pondwatch.simulator.spec import SimulationSpec

from .conftest import Api

BATCH = 8  # as many as the test server takes at once


@pytest.fixture(scope="module")
def bundle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("papernets") / "pond"
    write_bundle(Simulation(SimulationSpec(image_kind="png"), 6), folder, truth=False)
    return folder


def send(api: Api, session: str, opened: Bundle, count: int) -> None:
    poses: list[dict[str, Any]] = []
    files: list[tuple[str, Any]] = []
    for n, row in enumerate(opened.rows[:count]):
        x, y, theta = row.pose
        key = {"robot": row.key.robot, "boot": row.key.boot, "sequence": row.key.sequence}
        poses.append(key | {"captured_at": row.captured_at, "x_m": x, "y_m": y, "theta_rad": theta, "image": f"i{n}"})
        files.append((f"i{n}", (f"i{n}.png", opened.content(row), "image/png")))
    for start in range(0, count, BATCH):
        part = [("poses", (None, json.dumps(poses[start : start + BATCH]))), *files[start : start + BATCH]]
        answer = api.http.post(f"/api/sessions/{session}/snapshots/batch", files=part)
        assert answer.status_code == 200, answer.text
        assert {item["status"] for item in answer.json()["results"]} == {201}


def test_a_network_corrects_a_session_as_it_does_a_bundle(api: Api, bundle: Path) -> None:
    with Bundle(bundle) as opened:
        direct = correct_bundle(opened, "paper-ours")
        session = api.open(**opened.document, method="paper-ours")
        send(api, session, opened, 221)

    view = api.finish(session)

    assert (view["state"], view["method"]) == ("finished", "paper-ours")
    poses = {p["sequence"]: p for p in api.get(session, "/poses").json()["poses"]}
    assert {p["status"] for p in poses.values()} == {"uncertain"}
    for pose in direct.poses:
        there = poses[pose.key.sequence]
        np.testing.assert_allclose([there["x_m"], there["y_m"], there["theta_rad"]], pose.pose_pond, atol=1e-6)


def test_a_session_of_another_number_of_snapshots_fails_and_says_why(api: Api, bundle: Path) -> None:
    with Bundle(bundle) as opened:
        session = api.open(**opened.document, method="paper-a")
        send(api, session, opened, 3)

    api.http.post(f"/api/sessions/{session}/finish", params={"wait": 0})
    view = api.until(session, lambda v: v["state"] == "failed")

    assert view["counts"]["snapshots"] == 3
    errors = [str(j["error"]) for j in api.http.get("/api/jobs").json()["jobs"] if j["session"] == session]
    assert any("exactly 221 snapshots; this session has 3" in e for e in errors)
