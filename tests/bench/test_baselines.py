"""The baselines do what they are said to do where that can be done: a floor on which every place looks like itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import approx_fprime

from pondwatch.core.frames import image_to_pond
from pondwatch.simulator.simulation import Simulation
from pondwatch.simulator.spec import SimulationSpec
from tests.bench.baseline import siftgraph
from tests.bench.baseline.siftgraph import Edges, sift_graph
from tests.bench.baseline.stitcher import stitched
from tests.bench.ponds import Inspected, simulated
from tests.bench.score import Result, score

TEXTURED = SimulationSpec(mapped=False, snapshots=12, image_kind="png", noise_pitch=0.2)


@pytest.fixture(scope="module")
def floor() -> Inspected:
    return simulated(Simulation(TEXTURED, seed=6))


def test_sift_and_a_pose_graph_place_a_textured_floor_to_a_fraction_of_a_pixel(floor: Inspected) -> None:
    poses, tied = sift_graph(floor.truth.inspection, [s.image for s in floor.snapshots], floor.truth.noisy)

    figures = score(floor.truth, Result(poses, np.full(12, np.nan), ("placed",) * 12, {}))
    assert tied.all()
    assert figures["median_px_aligned"] < 0.5
    assert figures["gross_aligned"] == 0.0


def test_a_snapshot_without_a_pair_keeps_its_noisy_pose(floor: Inspected) -> None:
    images = [s.image for s in floor.snapshots]
    images[3] = np.full_like(images[3], 90)

    poses, tied = sift_graph(floor.truth.inspection, images, floor.truth.noisy)

    assert not tied[3]
    np.testing.assert_array_equal(poses[3], floor.truth.noisy[3])


def test_a_pair_says_where_the_second_lies_in_the_first(floor: Inspected) -> None:
    camera, truth = floor.truth.inspection.camera, floor.truth.poses
    edges = siftgraph._edges(camera, [s.image for s in floor.snapshots], truth, np.array([10.0, 0.1]))

    m = camera.metres_per_pixel
    i, j = edges.first[0], edges.second[0]
    right_up_px = edges.motion[0, :2] * [1, -1] + [79.5, 54.5]  # from the middle of the first: as a pixel of it
    assert len(edges.first) > 10
    np.testing.assert_allclose(image_to_pond(right_up_px, truth[i], camera), truth[j, :2], atol=0.5 * m)
    assert edges.motion[0, 2] == pytest.approx(truth[j, 2] - truth[i, 2], abs=0.01)


def test_the_jacobian_of_the_pose_graph_matches_a_numerical_one() -> None:
    rng = np.random.default_rng(2)
    edges = Edges(np.array([0, 1, 0]), np.array([1, 2, 2]), rng.normal(size=(3, 3)))
    poses, weight, sigma = rng.normal(size=(3, 3)), np.array([2.0, 2.0, 9.0]), np.array([3.0, 3.0, 0.2])

    def residuals(flat: np.ndarray) -> np.ndarray:
        p = flat.reshape(3, 3)
        between = siftgraph._between(p[edges.first], p[edges.second])
        return np.concatenate([((between - edges.motion) * weight).ravel(), (p / sigma).ravel()])

    exact = siftgraph._jacobian(edges, poses, weight, sigma).toarray()
    np.testing.assert_allclose(exact, approx_fprime(poses.ravel(), residuals, 1e-7), atol=1e-5)


def test_what_the_stitcher_refuses_keeps_its_noisy_pose(floor: Inspected) -> None:
    blank = [np.full_like(s.image, 90) for s in floor.snapshots[:4]]
    inspection = replace(floor.truth.inspection, name="blank")

    poses, given = stitched(inspection, blank, floor.truth.noisy[:4])

    assert not given.any()
    np.testing.assert_array_equal(poses, floor.truth.noisy[:4])
