"""Looks, age and sigma, on footprints that can be counted by hand, and against the mosaic's own count."""

from __future__ import annotations

import numpy as np
import pytest

from pondwatch.core.layers import Sight, layers
from pondwatch.core.mosaic import Mosaic
from pondwatch.core.values import Camera, Pond, SnapshotKey

CAMERA, POND, SCALE = Camera(20, 10, 0.001), Pond(0.1, 0.05), 0.001


def sight(x, y, theta=0.0, at=0.0, sigma=None, turn=None):
    return Sight(np.array([x, y, theta]), at, sigma, turn)


def test_two_snapshots_that_overlap_are_counted_aged_and_the_surer_one_believed():
    found = layers(
        [sight(0.02, 0.025, at=100.0, sigma=0.002), sight(0.03, 0.025, at=104.0, sigma=0.001)], CAMERA, POND, SCALE
    )

    # rows 20 to 29; columns 10 to 29 and 20 to 39
    assert found.looks.shape == (50, 100)
    assert [int(found.looks[25, c]) for c in (9, 10, 20, 29, 30, 39, 40)] == [0, 1, 2, 2, 1, 1, 0]
    assert [found.looks[r, 15] for r in (19, 20, 29, 30)] == [0, 1, 1, 0]
    np.testing.assert_array_equal(found.age_s[25, [15, 25, 35]], [4, 0, 0])
    np.testing.assert_allclose(found.sigma_m[25, [15, 25, 35]], [0.002, 0.001, 0.001], rtol=1e-6)
    assert np.isnan(found.age_s[25, 45])
    assert np.isnan(found.sigma_m[25, 45])


def test_a_turn_in_doubt_counts_more_far_from_the_centre():
    found = layers([sight(0.0505, 0.0255, sigma=0.0003, turn=0.1)], CAMERA, POND, SCALE)

    assert found.sigma_m[24, 50] == pytest.approx(0.0003)
    assert found.sigma_m[24, 58] == pytest.approx(np.hypot(0.0003, 0.008 * 0.1))


def test_the_order_of_snapshots_does_not_matter_and_none_is_nothing():
    many = [sight(0.01 * i, 0.02, 0.3 * i, at=float(i % 3), sigma=0.001 * (i % 4 + 1)) for i in range(8)]

    there, back = layers(many, CAMERA, POND, SCALE), layers(many[::-1], CAMERA, POND, SCALE)

    for a, b in zip((there.looks, there.age_s, there.sigma_m), (back.looks, back.age_s, back.sigma_m), strict=True):
        np.testing.assert_array_equal(a, b)
    assert not layers([], CAMERA, POND, SCALE).looks.any()


def test_looks_are_those_of_the_mosaic():
    rng, mosaic, sights = np.random.default_rng(3), Mosaic(CAMERA, POND), []
    for i in range(30):
        pose = rng.uniform((-0.01, -0.01, -3), (0.11, 0.06, 3))
        mosaic.put(SnapshotKey("r", 0, i), np.zeros((10, 20, 3), np.uint8), pose)
        sights.append(Sight(pose, float(i)))

    np.testing.assert_array_equal(layers(sights, CAMERA, POND, mosaic.metres_per_pixel).looks, mosaic.looks())
