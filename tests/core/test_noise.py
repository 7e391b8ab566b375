"""The noise of the poses: what is learned from errors of known spread, and probabilities that must sum to one."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pondwatch.core.noise import GROSS_SHARE, NoiseModel
from pondwatch.core.values import PoseNoise

PITCH = 0.03
NOBODY = np.zeros(0, dtype=np.int64)


def _learned(stated, errors, trust=None, first=NOBODY, second=NOBODY):
    """From decided snapshots, each with one place."""
    square = (errors[:, :2] ** 2).sum(axis=1), errors[:, 2] ** 2
    trust = np.ones(len(errors)) if trust is None else trust
    return stated.learned(errors, trust, first, second, (*square, np.ones(len(errors))))


def _errors(rng, count, sigma_xy=0.01, sigma_theta=0.1):
    return rng.standard_normal((count, 3)) * [sigma_xy, sigma_xy, sigma_theta]


@pytest.mark.parametrize("wrong", [0.4, 1.0, 2.5])
def test_the_noise_is_learned_whatever_was_stated(wrong):
    stated = NoiseModel.stated(PoseNoise(0.01 * wrong, 0.1 * wrong), PITCH)

    noise = _learned(stated, _errors(np.random.default_rng(0), 200))

    assert noise.sigma_xy_m == pytest.approx(0.01, rel=0.2)
    assert noise.sigma_theta_rad == pytest.approx(0.1, rel=0.2)


def test_poses_anywhere_in_the_pond_do_not_widen_the_noise_and_are_counted():
    rng = np.random.default_rng(1)
    errors = _errors(rng, 300)
    errors[:30, :2] = rng.uniform(0.1, 0.3, (30, 2))

    noise = _learned(NoiseModel(0.01, 0.1), errors)

    assert noise.sigma_xy_m == pytest.approx(0.01, rel=0.2)
    assert noise.gross == pytest.approx(0.1, abs=0.03)


def test_without_gross_errors_their_share_is_small_but_never_nothing():
    noise = _learned(NoiseModel(0.01, 0.1), _errors(np.random.default_rng(2), 300))

    assert 0 < noise.gross < GROSS_SHARE


@pytest.mark.parametrize(("keep", "low", "high"), [(0.95, 0.85, 0.99), (0.0, 0.0, 0.0), (0.2, 0.0, 0.0)])
def test_robots_that_drift_are_told_from_those_whose_errors_are_fresh(keep, low, high):
    rng = np.random.default_rng(3)
    errors = np.empty((240, 3))
    for robot in range(4):
        e = _errors(rng, 60)
        for n in range(1, 60):
            e[n] = keep * e[n - 1] + np.sqrt(1 - keep**2) * e[n]
        errors[60 * robot : 60 * (robot + 1)] = e
    first = np.array([n for n in range(239) if n % 60 != 59])

    noise = _learned(NoiseModel(0.01, 0.1), errors, None, first, first + 1)

    assert low <= noise.correlation <= high


def test_doubtful_snapshots_count_by_all_their_places():
    rng = np.random.default_rng(4)
    errors = _errors(rng, 100)
    square = (errors[:, :2] ** 2).sum(axis=1)
    near, far = np.full(100, 0.5), np.full(100, 0.5)
    spread = np.concatenate([square, 9 * square]), np.concatenate([errors[:, 2] ** 2] * 2), np.concatenate([near, far])

    noise = NoiseModel(0.01, 0.1).learned(errors, np.full(100, 0.5), NOBODY, NOBODY, spread)

    assert noise.sigma_xy_m == pytest.approx(0.01 * np.sqrt(5), rel=0.25)


@pytest.mark.parametrize("count", [0, 3])
def test_few_snapshots_teach_nothing(count):
    stated = NoiseModel(0.01, 0.1)

    assert _learned(stated, _errors(np.random.default_rng(5), count)) == stated


def test_where_nothing_is_stated_half_a_pitch_is_assumed():
    assert NoiseModel.stated(None, PITCH).sigma_xy_m == pytest.approx(PITCH / 2)


def test_a_localisation_that_claims_to_be_exact_is_not_believed():
    noise = NoiseModel.stated(PoseNoise(0.0, 0.0), PITCH)

    assert noise.sigma_xy_m > 0
    assert noise.sigma_theta_rad > 0


@given(sigma_xy=st.floats(1e-4, 0.05), sigma_theta=st.floats(0.001, 4))
def test_places_are_looked_for_out_to_four_sigma_and_at_least_to_the_next_rod(sigma_xy, sigma_theta):
    reach = NoiseModel(sigma_xy, sigma_theta).reach(PITCH)

    assert reach.xy_m >= max(4 * sigma_xy, 0.5 * PITCH)
    assert min(4 * sigma_theta, np.pi / 2) <= reach.theta_rad <= np.pi


def test_a_heading_that_says_nothing_is_looked_for_all_round():
    assert NoiseModel(0.01, np.pi / np.sqrt(3)).reach(PITCH).theta_rad == pytest.approx(np.pi)


@pytest.mark.parametrize("sigma_theta", [0.1, np.pi / np.sqrt(3)])
@pytest.mark.parametrize("sigma_pitch", [0.5, 1.0, 2.0])
def test_the_prior_of_all_places_of_the_pond_sums_to_one(sigma_pitch, sigma_theta):
    """A square lattice of 41 by 41 rods, four headings each; the noisy pose is near the middle of the pond."""
    sites = np.stack(np.meshgrid(np.arange(-20, 21), np.arange(-20, 21)), axis=-1).reshape(-1, 2) * PITCH
    poses = np.concatenate([np.column_stack([sites, np.full(len(sites), k * np.pi / 2)]) for k in range(4)])
    noise = NoiseModel(sigma_pitch * PITCH, sigma_theta, gross=0.05)

    log_prior = noise.log_prior(poses, np.array([0.3 * PITCH, 0.1 * PITCH, 0.0]), PITCH**2, (41 * PITCH) ** 2, 4)

    assert np.exp(log_prior).sum() == pytest.approx(1, abs=0.02)


@given(far=st.floats(1, 50))
def test_no_place_is_ruled_out_by_its_noisy_pose_alone(far):
    noise = NoiseModel(PITCH, 0.1, gross=0.02)

    (near, away) = noise.log_prior(np.array([[0, 0, 0], [far, 0, 1.0]]), np.zeros(3), PITCH**2, 1.0, 6)

    assert near > away
    assert away >= np.log(0.02 * PITCH**2 / 6) - 1e-6
    assert noise.log_density(np.array([far, 0, 1.0]), np.zeros(3)) > -20
