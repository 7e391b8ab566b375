"""Search and pairwise refinement, against pictures drawn at poses that are known."""

from __future__ import annotations

import numpy as np
import pytest

from pondwatch.core import posegraph as se2
from pondwatch.core.agreement import Agreement
from pondwatch.core.pairfit import refine
from pondwatch.core.registration import Whitener, draw_map, make_view, search, turned_half
from tests.core.floors import SCALE, draw_floor, photograph

SIGMAS = np.array([27.0, 27.0, 0.14])
SIZE = 192


def _pair(kind, seed, apart=(45.0, -20.0, 0.3)):
    """Two views of a floor and their true map poses."""
    rng = np.random.default_rng(seed)
    floor = draw_floor(kind, (420, 300), seed)
    poses = np.array([[180.0, 150.0, 0.2], [180 + apart[0], 150 + apart[1], 0.2 + apart[2]]]) * [SCALE, SCALE, 1]
    images = [photograph(floor, p, 2.0, rng).clip(0, 255).round().astype(np.uint8) for p in poses]
    return [make_view(i) for i in images], se2.pond_to_map(poses, SCALE)


def _search(views, poses, guess):
    whitener = Whitener(SIZE)
    for view, pose in zip(views, poses, strict=True):
        whitener.learn(view, pose[2])
    local = draw_map(views[:1], poses[:1], guess[:2], SIZE)
    return search(views[1], local, whitener.gain(), guess, SIGMAS, 80.0, 0.45)


@pytest.mark.parametrize("kind", ["gravel", "rows", "tiles", "mud"])
def test_the_best_place_of_a_textured_pair_is_the_true_one(kind):
    views, poses = _pair(kind, 3)

    places = _search(views, poses, poses[1] + [30, -25, 0.12])

    error = places[0].pose - poses[1]
    assert np.hypot(*error[:2]) < 3
    assert abs(error[2]) < 0.04


def test_a_view_turned_by_half_a_turn_fits_nowhere():
    views, poses = _pair("rows", 4)
    true = _search(views, poses, poses[1])[0]

    wrong = _search([views[0], turned_half(views[1])], poses, poses[1])

    assert max(p.nats for p in wrong) < true.nats / 3


def test_a_map_that_shows_nothing_there_offers_no_place():
    views, poses = _pair("gravel", 5)

    assert _search(views, poses, poses[1] + [2000, 0, 0]) == []


@pytest.mark.parametrize(("kind", "within_px"), [("gravel", 0.02), ("rows", 0.02), ("tiles", 0.03), ("mud", 0.5)])
def test_refinement_finds_the_relative_pose_to_a_fraction_of_a_pixel(kind, within_px):
    errors = []
    for seed in range(6):
        views, poses = _pair(kind, seed)
        true = se2.between(*poses)
        fit = refine(*views, true + [1.2, -0.8, 0.01])
        assert fit is not None
        errors.append(np.hypot(*(fit.relative - true)[:2]))

    assert np.median(errors) < within_px


def test_the_information_of_a_fit_covers_its_error():
    squared = []
    for seed in range(20):
        views, poses = _pair("gravel", seed, (30.0 + seed, 15.0, 0.1))
        true = se2.between(*poses)
        fit = refine(*views, true)
        squared.append((fit.relative - true) @ fit.information @ (fit.relative - true))

    assert np.mean(np.array(squared) < 16.3) >= 0.9  # the 99.9th percentile of chi-square, 3 degrees of freedom


def test_views_that_share_nothing_are_not_refined():
    views, _ = _pair("gravel", 6)

    assert refine(*views, np.array([150.0, 100.0, 0.0])) is None


def test_a_flat_picture_gives_no_fit():
    views, _ = _pair("gravel", 7)
    flat = make_view(np.full((110, 160), 90, np.uint8))

    assert flat.texture == 0
    assert refine(views[0], flat, np.zeros(3)) is None


def _told(wrong_z):
    agreement = Agreement()
    rng = np.random.default_rng(0)
    for _ in range(20):
        agreement.tell_wrong(14.0, [(float(z), 0.5) for z in rng.normal(wrong_z, 0.2, 4)])
    for z in rng.normal(2.5, 0.05, 20):
        agreement.tell_right(float(z))
    return agreement


def test_an_agreement_like_that_of_true_pairs_speaks_for_a_place_the_less_the_nearer_wrong_ones_come():
    assert _told(0.5).log_ratio(2.5, 0.5) > 5
    assert 0 < _told(2.2).log_ratio(2.5, 0.5) < _told(1.0).log_ratio(2.5, 0.5)


def test_an_agreement_like_that_of_wrong_pairs_speaks_against_a_place():
    assert _told(0.5).log_ratio(0.6, 0.5) < -2


def test_nothing_is_claimed_before_enough_is_known():
    assert Agreement().log_ratio(2.5, 0.5) == 0
    assert Agreement().true_fits() is None
