"""A bundle uploaded over REST, in any order, comes to what the core makes of it without a server."""

from __future__ import annotations

import json
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest

from pondwatch.basestation.bundle import Bundle
from pondwatch.basestation.correcting import CorrectedBundle, correct_bundle
from pondwatch.simulator.bundle import write_bundle
from pondwatch.simulator.simulation import Simulation
from pondwatch.simulator.spec import SimulationSpec

from .conftest import Api


@pytest.fixture(scope="module")
def bundle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("bundle") / "pond"
    write_bundle(Simulation(SimulationSpec(snapshots=48, coverage=5.0, image_kind="png"), 5), folder, truth=False)
    return folder


@pytest.mark.parametrize(("method", "seed"), [("identity", 1), ("identity", 2), ("lattice", 3)])
def test_the_order_of_arrival_leaves_no_trace(api: Api, bundle: Path, method: str, seed: int) -> None:
    with Bundle(bundle) as opened:
        direct = correct_bundle(opened, method)
        session, order = api.open(**json.loads((bundle / "session.json").read_text()), method=method), list(opened.rows)
        Random(seed).shuffle(order)
        for row in order:
            pose = {
                "robot": row.key.robot,
                "boot": row.key.boot,
                "sequence": row.key.sequence,
                "captured_at": row.captured_at,
                **dict(zip(("x_m", "y_m", "theta_rad"), row.pose, strict=True)),
            }
            files: dict[str, Any] = {"image": ("a", opened.content(row)), "pose": (None, json.dumps(pose))}
            assert api.http.post(f"/api/sessions/{session}/snapshots", files=files).status_code == 201
        scale_m = opened.inspection.camera.metres_per_pixel
    api.finish(session)

    check_same(api, session, direct, scale_m, method)


def check_same(api: Api, session: str, direct: CorrectedBundle, scale_m: float, method: str) -> None:
    served = {(p["robot"], p["boot"], p["sequence"]): p for p in api.get(session, "/poses").json()["poses"]}
    assert len(served) == len(direct.poses)
    for expected in direct.poses:
        pose = served[expected.key.robot, expected.key.boot, expected.key.sequence]
        assert pose["status"] == expected.status
        assert expected.pose_pond is not None
        np.testing.assert_allclose([pose["x_m"], pose["y_m"]], expected.pose_pond[:2], atol=0.01 * scale_m)
        np.testing.assert_allclose(pose["theta_rad"], expected.pose_pond[2], atol=1e-4)
    rods = [(r["rod_id"], r["state"], r["views"]) for r in api.get(session, "/rods").json()["rods"]]
    assert rods == [(r.rod_id, r.state, r.views) for r in direct.rods]
    assert any(r.views for r in direct.rods) == (method == "lattice")
