"""The states of a rod as codes of sectors: against areas, turns and counts worked out another way."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pondwatch.core.codes import SECTORS
from pondwatch.core.states import COUNT, EMPTY, FULL, SLIP_NATS, fills, log_likelihood, prior_from, templates

ALL_IN_VIEW = np.ones((1, SECTORS), dtype=bool)
IMAGE_ANGLES = 2 * np.pi * np.arange(SECTORS) / SECTORS


def _wedge(fill, middle_rad, theta_rad):
    """(1, SECTORS): what a wedge about a pond angle shows in an image at a heading: how much of each sector."""
    fine = (np.arange(40) - 19.5) / 40 * 2 * np.pi / SECTORS
    off = np.angle(np.exp(1j * (IMAGE_ANGLES[:, None] + fine + theta_rad - middle_rad)))
    return (np.abs(off) < np.pi * fill).mean(axis=1)[None]


def test_a_state_shows_as_much_as_it_is_filled():
    shown = templates(2 * np.pi * np.arange(360) / 360).mean(axis=1)

    assert len(shown) == COUNT
    np.testing.assert_allclose(shown, fills(), atol=0.005)


@given(fill=st.sampled_from([0.25, 0.5, 0.75]), middle_rad=st.floats(-np.pi, np.pi), theta_rad=st.floats(-np.pi, np.pi))
def test_the_likeliest_state_of_a_wedge_has_its_fill_and_its_pond_angle_at_any_heading(fill, middle_rad, theta_rad):
    like = log_likelihood(_wedge(fill, middle_rad, theta_rad), ALL_IN_VIEW, np.array([theta_rad]))[0]

    best = int(np.argmax(like))
    shown = templates(2 * np.pi * np.arange(360) / 360)[best]
    angle = np.angle((shown * np.exp(2j * np.pi * np.arange(360) / 360)).sum())
    assert fills()[best] == pytest.approx(fill, abs=0.13)
    assert abs(np.angle(np.exp(1j * (angle - middle_rad)))) < 2 * np.pi / SECTORS


@given(theta_rad=st.floats(-10, 10))
def test_hollow_and_filled_rods_look_the_same_at_any_heading(theta_rad):
    theta = np.array([theta_rad])

    assert np.argmax(log_likelihood(np.zeros((1, SECTORS)), ALL_IN_VIEW, theta)) == EMPTY
    assert np.argmax(log_likelihood(np.ones((1, SECTORS)), ALL_IN_VIEW, theta)) == FULL


def test_sectors_out_of_view_say_nothing():
    valid = ALL_IN_VIEW.copy()
    valid[0, 6:] = False
    share = np.zeros((2, SECTORS))
    share[1, 6:] = 1

    first, second = log_likelihood(share, np.repeat(valid, 2, axis=0), np.zeros(2))

    np.testing.assert_array_equal(first, second)
    assert first[EMPTY] - first[FULL] > 1


@given(seed=st.integers(0, 1000))
def test_a_look_costs_no_state_more_than_a_slip(seed):
    share = np.random.default_rng(seed).uniform(-3, 4, (5, SECTORS))

    like = log_likelihood(share, np.repeat(ALL_IN_VIEW, 5, axis=0), np.zeros(5))

    assert (like >= -SLIP_NATS - 1e-9).all()
    assert (like <= 0.1).all()


def test_how_frequent_states_are_is_learned_from_looks():
    rng = np.random.default_rng(4)
    kinds = rng.choice([0.0, 1.0, 0.5], 400, p=[0.5, 0.3, 0.2])
    looks = np.concatenate([_wedge(k, 0.0, 0.0) for k in kinds]) + 0.1 * rng.standard_normal((400, SECTORS))
    valid = np.ones(looks.shape, dtype=bool)

    kept, prior = prior_from(log_likelihood(looks, valid, np.zeros(400)), valid)

    assert prior.sum() == pytest.approx(1)
    by_fill = {f: prior[fills()[kept] == f].sum() for f in (0.0, 1.0)}
    assert by_fill[0.0] == pytest.approx((kinds == 0).mean(), abs=0.05)
    assert by_fill[1.0] == pytest.approx((kinds == 1).mean(), abs=0.05)
    partly = prior[(fills()[kept] > 0.3) & (fills()[kept] < 0.7)].sum()
    assert partly == pytest.approx((kinds == 0.5).mean(), abs=0.05)


@pytest.mark.parametrize("looks", [np.zeros((0, SECTORS)), np.zeros((30, SECTORS)), np.ones((30, SECTORS))])
def test_empty_and_full_are_always_among_the_states_in_use(looks):
    valid = np.ones(looks.shape, dtype=bool)

    kept, prior = prior_from(log_likelihood(looks, valid, np.zeros(len(looks))), valid)

    assert kept[:2].tolist() == [EMPTY, FULL]
    assert (prior > 0).all()


def test_no_more_states_are_kept_than_asked_for():
    share = np.concatenate([_wedge(f, a, 0.0) for f in (0.25, 0.5, 0.75) for a in IMAGE_ANGLES])
    valid = np.ones(share.shape, dtype=bool)

    kept, _ = prior_from(log_likelihood(share, valid, np.zeros(len(share))), valid, most=10)

    assert len(kept) == len(set(kept.tolist())) <= 10


def test_some_states_are_as_likely_as_among_all():
    rng = np.random.default_rng(5)
    share, valid, theta = rng.uniform(-0.3, 1.3, (9, SECTORS)), rng.random((9, SECTORS)) > 0.2, rng.uniform(-4, 4, 9)
    kept = np.array([EMPTY, FULL, 17, 90])

    some = log_likelihood(share, valid, theta, kept=kept)

    np.testing.assert_array_equal(some, log_likelihood(share, valid, theta)[:, kept])
