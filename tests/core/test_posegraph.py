"""The pose graph: motions, the analytic Jacobian, and how far what it reports can be believed."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pondwatch.core import posegraph as se2
from pondwatch.core.frames import image_to_pond
from pondwatch.core.values import Camera

NUMBER = st.floats(-200, 200)
POSE = st.tuples(NUMBER, NUMBER, st.floats(-3, 3)).map(np.array)


@given(POSE, POSE)
def test_between_undoes_compose(a, b):
    np.testing.assert_allclose(se2.between(a, se2.compose(a, b)), b, atol=1e-9)


@given(POSE, st.floats(-80, 80), st.floats(-60, 60))
def test_the_map_frame_shows_a_pixel_where_the_pond_frame_does(pose, u, v):
    camera = Camera(161, 121, 0.002)
    pose_pond = pose * [0.01, 0.01, 1]

    x, y, phi = se2.pond_to_map(pose_pond, camera.metres_per_pixel)
    on_map = [x, y] + cv2.transform(
        np.array([[[u, v]]]), np.array([[np.cos(phi), -np.sin(phi)], [np.sin(phi), np.cos(phi)]])
    )[0, 0]

    in_pond = image_to_pond(np.array([80 + u, 60 + v]), pose_pond, camera)
    np.testing.assert_allclose(on_map * [0.002, -0.002], in_pond, atol=1e-9)


def _chain(rng, count=12):
    truth = np.column_stack([np.arange(count) * 30.0, rng.normal(0, 30, count), rng.uniform(-1, 1, count)])
    pairs = np.array([(i, j) for i in range(count) for j in range(i + 1, min(i + 3, count))])
    sigma = np.array([0.05, 0.05, 0.001])
    relative = se2.between(truth[pairs[:, 0]], truth[pairs[:, 1]]) + rng.normal(0, sigma, (len(pairs), 3))
    information = np.broadcast_to(np.diag(1 / sigma**2), (len(pairs), 3, 3))
    return truth, se2.Edges(pairs[:, 0], pairs[:, 1], relative, information)


def test_the_edge_jacobian_matches_a_numerical_one():
    rng = np.random.default_rng(0)
    truth, edges = _chain(rng)
    poses = truth + rng.normal(0, [2, 2, 0.1], truth.shape)
    tails, heads = se2.edge_jacobians(poses, edges)

    for e in range(len(edges.tail)):
        for node, analytic in ((edges.tail[e], tails[e]), (edges.head[e], heads[e])):
            for k in range(3):
                up, down = poses.copy(), poses.copy()
                up[node, k] += 1e-5
                down[node, k] -= 1e-5
                numeric = (se2.edge_residuals(up, edges)[e] - se2.edge_residuals(down, edges)[e]) / 2e-5
                np.testing.assert_allclose(analytic[:, k], numeric, atol=1e-5)


def test_errors_of_solved_poses_have_the_covariance_reported():
    """Normalised squared errors of 3 degrees of freedom have the mean 3, over 60 noisy graphs."""
    sigmas = np.array([19.0, 19.0, 0.1])
    squared = []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        truth, edges = _chain(rng)
        priors = truth + rng.normal(0, sigmas, truth.shape)
        solved = se2.solve(priors, edges, priors, sigmas, iterations=20)
        error = solved.poses - truth
        squared.append(np.einsum("ni,nij,nj->n", error, np.linalg.inv(solved.covariances), error).mean())

    assert 2.3 < np.mean(squared) < 4.2


def test_a_grossly_wrong_noisy_pose_does_not_pull_the_frame():
    rng = np.random.default_rng(1)
    truth, edges = _chain(rng)
    sigmas = np.array([5.0, 5.0, 0.05])
    priors = truth + rng.normal(0, sigmas, truth.shape)
    plain = se2.solve(truth, edges, priors, sigmas, iterations=20)
    priors[5, :2] += [3000, -2000]

    pulled = se2.solve(truth, edges, priors, sigmas, iterations=20)

    assert np.abs(pulled.poses - plain.poses)[:, :2].max() < 3
    assert pulled.prior_weight[5] < 0.01


@pytest.mark.parametrize("heading_sigma", [0.01, 10.0])
def test_a_rigid_group_is_laid_on_its_noisy_poses(heading_sigma):
    rng = np.random.default_rng(2)
    poses = rng.uniform(-300, 300, (20, 3)) * [1, 1, 0.003]
    motion = np.array([40.0, -25.0, 0.3])

    found = se2.align(poses, se2.compose(motion, poses), np.array([19, 19, heading_sigma]), np.ones(20))

    np.testing.assert_allclose(found, motion, atol=1e-9)


def test_covariances_of_a_great_graph_are_near_those_of_the_whole_inverse(monkeypatch):
    rng = np.random.default_rng(3)
    truth, edges = _chain(rng)
    sigmas = np.array([19.0, 19.0, 0.1])
    exact = se2.solve(truth, edges, truth, sigmas).covariances
    monkeypatch.setattr(se2, "DENSE_NODES", 1)

    quick = se2.solve(truth, edges, truth, sigmas).covariances

    ratio = np.sqrt(np.trace(quick[:, :2, :2], axis1=1, axis2=2) / np.trace(exact[:, :2, :2], axis1=1, axis2=2))
    assert ratio.min() > 0.8
    assert ratio.max() < 1.25
