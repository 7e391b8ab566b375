"""The paper's networks as methods: exactly 221 snapshots or a clear error, and each file answers as it was exported."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest

from pondwatch.basestation.bundle import Bundle
from pondwatch.basestation.correcting import correct_bundle
from pondwatch.core.errors import Invalid, Unavailable
from pondwatch.core.paperinputs import denormalised, normalised
from pondwatch.core.values import Camera, Inspection, Pond, PoseNoise, Snapshot, SnapshotKey, Status
from pondwatch.jobs.papernets import METHODS, PAPER_METHODS, OnnxNetwork, PaperCorrector, make_corrector
from pondwatch.resources import models_dir
from pondwatch.simulator.bundle import write_bundle
from pondwatch.simulator.simulation import Simulation
from pondwatch.simulator.spec import SimulationSpec

POND = Pond(0.8, 0.5)
INSPECTION = Inspection("x", Camera(160, 110, 0.0005), POND, PoseNoise(0.01, 0.1))
FOLDER = models_dir() / "paper"
EXPECTED = json.loads((FOLDER / "expected.json").read_text())


class Mirror:
    """A network that mirrors the pond and turns every snapshot by 4 rad."""

    contract = {"snapshot_px": [20, 14], "canvas": "mask", "canvas_px": 32, "rmse": [0.01, 0.02, 0.3]}  # noqa: RUF012

    def __init__(self, method="paper-ours"):
        self.inputs = None

    def __call__(self, inputs):
        self.inputs = inputs
        return ((1, 1, 4) - inputs["coordinates"]).astype(np.float32)


def snapshots(count):
    rng = np.random.default_rng(4)
    poses = rng.uniform((0, 0, 0), (0.8, 0.5, 2), (count, 3))
    shades = rng.integers(0, 2, count) * 255
    return [
        Snapshot(SnapshotKey(f"bubble-{n % 3}", 0, n), float(n), pose, np.full((110, 160, 3), shade, np.uint8))
        for n, (pose, shade) in enumerate(zip(poses, shades, strict=True))
    ]


def test_a_network_is_asked_once_all_221_are_there_and_its_word_is_uncertain():
    taken, network = snapshots(221), Mirror()
    corrector = PaperCorrector(INSPECTION, "paper-ours", lambda _: network)
    corrector.add(taken[100:])
    corrector.add(taken[:100])
    assert corrector.poses()[taken[7].key].pose_pond is taken[7].pose_pond

    correction = corrector.settle()

    pose = corrector.poses()[taken[7].key]
    x, y, theta = taken[7].pose_pond
    turned = 4 - theta if 4 - theta < np.pi else 4 - theta - 2 * np.pi
    np.testing.assert_allclose(pose.pose_pond, [0.8 - x, 0.5 - y, turned], atol=1e-6)
    np.testing.assert_allclose(np.sqrt(np.diag(pose.covariance)), [0.008, 0.01, 0.3])
    assert {p.status for p in correction.poses} == {Status.UNCERTAIN}
    assert (len(correction.poses), corrector.quality().placed) == (221, 0)


def test_a_network_sees_snapshots_in_the_order_of_their_sequence_whoever_took_them():
    taken, network = snapshots(221), Mirror()
    corrector = PaperCorrector(INSPECTION, "paper-ours", lambda _: network)
    corrector.add(taken[::-1])

    corrector.settle()

    noisy = normalised(np.stack([s.pose_pond for s in taken]), POND)
    np.testing.assert_allclose(network.inputs["coordinates"][0], noisy, atol=1e-6)
    shades = [s.image[0, 0, 0] / 255 for s in taken]
    np.testing.assert_array_equal(network.inputs["snapshots"][0, :, 5, 5], shades)
    assert network.inputs["snapshots"].shape == (1, 221, 14, 20)
    assert network.inputs["canvas"].shape == (1, 1, 32, 32)
    assert 0.5 < network.inputs["canvas"].mean() <= 1


@pytest.mark.parametrize("count", [0, 220, 222])
def test_another_number_of_snapshots_is_a_clear_error(count):
    corrector = PaperCorrector(INSPECTION, "paper-c", Mirror)
    corrector.add(snapshots(count))

    with pytest.raises(Invalid, match=rf"paper-c is built for exactly 221 snapshots; this session has {count} ") as no:
        corrector.settle()
    assert no.value.facts["snapshots"] == count


def test_another_camera_and_an_unknown_method_are_refused_at_once():
    wide = Inspection("x", Camera(320, 220, 0.0005), POND)

    with pytest.raises(Invalid, match="160 x 110 pixels; this camera takes 320 x 220"):
        make_corrector(wide, "paper-a")
    with pytest.raises(Invalid, match="paper-z"):
        PaperCorrector(INSPECTION, "paper-z")
    with pytest.raises(Invalid, match="paper-corrections"):
        make_corrector(INSPECTION, "magic")


def test_every_other_method_is_still_there():
    assert make_corrector(INSPECTION, "identity").method == "identity"
    assert set(METHODS) >= {"auto", "lattice", *PAPER_METHODS}


def test_a_missing_or_damaged_file_is_named(tmp_path):
    (tmp_path / "paper-b.onnx").write_bytes(b"not a network")

    for method in ("paper-a", "paper-b"):
        with pytest.raises(Unavailable, match=f"{method}.onnx"):
            OnnxNetwork.of(method, tmp_path)


def made_up(contract):
    """Inputs by seed, as the export makes them."""
    rng = np.random.default_rng(0)
    inputs = {"coordinates": rng.uniform(0, 1, (1, 221, 3)).astype(np.float32)}
    if contract["snapshot_px"] is not None:
        width, height = contract["snapshot_px"]
        inputs["snapshots"] = rng.integers(0, 2, (1, 221, height, width)).astype(np.float32)
    if contract["canvas"]:
        inputs["canvas"] = rng.integers(0, 2, (1, 1, *[contract["canvas_px"]] * 2)).astype(np.float32)
    return inputs


@pytest.mark.parametrize("method", PAPER_METHODS)
def test_onnxruntime_answers_as_it_did_when_the_network_was_exported(method):
    path = FOLDER / f"{method}.onnx"
    network = OnnxNetwork.of(method)

    values = network(made_up(network.contract)).reshape(-1)[::37]

    assert hashlib.sha256(path.read_bytes()).hexdigest() == EXPECTED[method]["sha256"]
    np.testing.assert_allclose(values, EXPECTED[method]["values"], atol=1e-4)
    assert path.stat().st_size < 2_000_000


@pytest.mark.parametrize("method", ["paper-a", "paper-c", "paper-corrections"])
def test_a_bundle_of_221_snapshots_is_corrected_by_a_network(method, tmp_path, bundle):
    with Bundle(bundle) as opened:
        result = correct_bundle(opened, method)
        wide, high = opened.inspection.pond.width_m, opened.inspection.pond.height_m

    assert len(result.poses) == 221
    poses = np.stack([p.pose_pond for p in result.poses])
    assert (np.abs(poses[:, :2] - (wide / 2, high / 2)) < (wide, high)).all()
    assert len({tuple(p) for p in poses.tolist()}) == 221
    assert method in result.quality.sentence


@pytest.fixture(scope="module")
def bundle(tmp_path_factory):
    folder: Path = tmp_path_factory.mktemp("papernets") / "bundle"
    write_bundle(Simulation(SimulationSpec(), 5), folder)
    return folder


def test_normalised_and_back():
    poses = np.array([[0.4, 0.1, -1.0]])

    np.testing.assert_allclose(normalised(poses, POND), [[0.5, 0.2, -1.0]])
    np.testing.assert_allclose(denormalised(normalised(poses, POND), POND), poses)
