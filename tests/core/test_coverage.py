"""Coverage: shares by hand, and rods in view against circles that are walked around point by point."""

from __future__ import annotations

import numpy as np

from pondwatch.core.coverage import Coverage, coverage, rod_views, rods_in_view
from pondwatch.core.frames import pond_to_image
from pondwatch.core.values import Camera, Pond, Rod

CAMERA = Camera(160, 110, 0.001)


def pond_of(*centres, radius=0.01):
    return Pond(0.5, 0.4, tuple(Rod(f"R{n}", x, y, radius, radius / 2) for n, (x, y) in enumerate(centres)))


def test_shares_count_what_was_seen_once_and_twice():
    looks = np.array([[0, 1, 2, 3], [0, 0, 0, 5]], np.uint16)

    assert coverage(looks, np.array([0, 1, 2, 2])) == Coverage(floor=0.5, floor_twice=0.375, rods=0.75, rods_twice=0.5)


def test_without_rods_their_shares_are_zero():
    assert coverage(np.ones((2, 2), np.uint16), np.zeros(0, np.int64)) == Coverage(1.0, 0.0, 0.0, 0.0)


def test_a_rod_is_in_view_only_where_its_whole_outer_circle_is():
    pond, pose = pond_of((0.2695, 0.2), (0.2705, 0.2), (0.2, 0.2445), (0.2, 0.2455)), np.array([[0.2, 0.2, 0.0]])

    assert rods_in_view(pose, pond, CAMERA).tolist() == [[True, False, True, False]]


def test_a_quarter_turn_swaps_the_sides():
    pond, pose = pond_of((0.26, 0.2), (0.2, 0.26)), np.array([[0.2, 0.2, np.pi / 2]])

    assert rods_in_view(pose, pond, CAMERA).tolist() == [[False, True]]


def test_views_agree_with_circles_walked_around_in_the_picture():
    rng = np.random.default_rng(0)
    centres = rng.uniform(0, 0.4, (40, 2))
    pond, poses = pond_of(*centres), rng.uniform((0, 0, -np.pi), (0.5, 0.4, np.pi), (50, 3))
    angles = np.linspace(0, 2 * np.pi, 720)
    circle = 0.01 * np.column_stack([np.cos(angles), np.sin(angles)])
    expected = np.zeros((50, 40), bool)
    for n, pose in enumerate(poses):
        points = pond_to_image(centres[:, None] + circle, pose, CAMERA)
        expected[n] = ((points > -0.5) & (points < np.array([159.5, 109.5]))).all(axis=(1, 2))

    np.testing.assert_array_equal(rods_in_view(poses, pond, CAMERA), expected)
    np.testing.assert_array_equal(rod_views(poses, pond, CAMERA), expected.sum(axis=0))


def test_a_pose_that_is_not_finite_sees_nothing():
    assert not rods_in_view(np.array([[np.nan, 0.2, 0.0]]), pond_of((0.2, 0.2)), CAMERA).any()


def test_many_poses_are_looked_at_in_parts_that_add_up():
    poses = np.tile([[0.2, 0.2, 0.3], [9.0, 9.0, 0.0]], (1500, 1))

    assert rod_views(poses, pond_of((0.2, 0.2)), CAMERA).tolist() == [1500]
