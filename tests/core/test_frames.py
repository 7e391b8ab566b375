"""The three frames: against points worked out by hand, and laws."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pondwatch.core.errors import InvalidPose
from pondwatch.core.frames import (
    centre_px,
    footprint_pond,
    image_to_pond,
    image_to_raster_affine,
    pond_to_image,
    pond_to_raster,
    raster_size_px,
    raster_to_pond,
    wrap_angle,
)
from pondwatch.core.values import Camera, Pond

CAMERA = Camera(160, 110, metres_per_pixel=0.001)
POND = Pond(0.5, 0.3)
metres = st.floats(-10, 10)
poses = st.tuples(metres, metres, st.floats(-7, 7)).map(np.array)
points_px = st.lists(st.tuples(st.floats(-500, 500), st.floats(-500, 500)), min_size=1, max_size=9).map(np.array)


def test_the_centre_of_an_image_of_even_size_lies_between_pixels():
    np.testing.assert_array_equal(centre_px(CAMERA), [79.5, 54.5])


def test_a_point_right_of_the_centre_lies_above_it_after_a_quarter_turn():
    point = image_to_pond(centre_px(CAMERA) + np.array([[100, 0]]), np.array([1.0, 2.0, np.pi / 2]), CAMERA)

    np.testing.assert_allclose(point, [[1.0, 2.1]], atol=1e-12)


def test_a_point_below_the_centre_has_a_smaller_y_without_rotation():
    point = image_to_pond(centre_px(CAMERA) + np.array([[0, 20]]), np.array([1.0, 2.0, 0.0]), CAMERA)

    np.testing.assert_allclose(point, [[1.0, 1.98]], atol=1e-12)


def test_the_ponds_upper_left_corner_is_the_outer_corner_of_the_first_raster_pixel():
    np.testing.assert_allclose(pond_to_raster(np.array([0.0, 0.3]), POND, 0.001), [-0.5, -0.5])
    np.testing.assert_allclose(pond_to_raster(np.array([0.5, 0.0]), POND, 0.001), [499.5, 299.5])


def test_a_raster_covers_the_pond():
    assert raster_size_px(POND, 0.001) == (500, 300)


def test_a_footprint_starts_at_the_first_pixels_corner_and_goes_clockwise_in_the_image():
    corners = footprint_pond(np.array([1.0, 2.0, 0.0]), CAMERA)

    np.testing.assert_allclose(corners, [[0.92, 2.055], [1.08, 2.055], [1.08, 1.945], [0.92, 1.945]])


def test_a_pose_that_is_not_finite_is_refused():
    with pytest.raises(InvalidPose):
        image_to_pond(np.zeros((1, 2)), np.array([0.0, np.nan, 0.0]), CAMERA)


@given(poses, points_px)
def test_pond_to_image_undoes_image_to_pond(pose, points):
    np.testing.assert_allclose(pond_to_image(image_to_pond(points, pose, CAMERA), pose, CAMERA), points, atol=1e-7)


@given(points_px)
def test_raster_to_pond_undoes_pond_to_raster(points):
    np.testing.assert_allclose(pond_to_raster(raster_to_pond(points, POND, 0.002), POND, 0.002), points, atol=1e-9)


@given(poses, points_px)
def test_the_affine_map_takes_image_points_where_the_frames_take_them(pose, points):
    affine = image_to_raster_affine(pose, CAMERA, POND, 0.0007)

    through_pond = pond_to_raster(image_to_pond(points, pose, CAMERA), POND, 0.0007)

    np.testing.assert_allclose(points @ affine[:, :2].T + affine[:, 2], through_pond, atol=1e-6)


@given(st.floats(-50, 50))
def test_a_wrapped_angle_is_the_same_direction_within_half_a_turn(theta):
    wrapped = float(wrap_angle(theta))

    assert -np.pi <= wrapped < np.pi
    np.testing.assert_allclose([np.cos(wrapped), np.sin(wrapped)], [np.cos(theta), np.sin(theta)], atol=1e-9)
