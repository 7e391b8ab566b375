"""The mosaic against an analytic floor, and its laws: no order, no trace of what moved or went."""

from __future__ import annotations

import numpy as np
import pytest

from pondwatch.core.errors import Invalid, InvalidImage, InvalidPose
from pondwatch.core.frames import image_to_pond, raster_to_pond
from pondwatch.core.mosaic import MAX_RASTER_PX, Mosaic, default_metres_per_pixel
from pondwatch.core.values import Camera, Pond, Rect, SnapshotKey

CAMERA = Camera(80, 60, metres_per_pixel=0.001)
POND = Pond(0.3, 0.2)


def key(n: int) -> SnapshotKey:
    return SnapshotKey("bubble-1", 0, n)


def floor(points_pond):
    """A smooth pattern over the pond, (..., 3): waves of 25 to 40 raster pixels, a different one a channel."""
    x, y = points_pond[..., 0], points_pond[..., 1]
    waves = [np.sin(2 * np.pi * (x * a + y * b)) for a, b in ((40, 7), (-9, 30), (25, 20))]
    return 128 + 100 * np.stack(waves, axis=-1)


def photograph(pose):
    v, u = np.mgrid[: CAMERA.height_px, : CAMERA.width_px]
    return np.round(floor(image_to_pond(np.stack([u, v], axis=-1), np.array(pose), CAMERA))).astype(np.uint8)


def random_poses(n, seed=0):
    rng = np.random.default_rng(seed)
    return np.column_stack([rng.uniform(0, 0.3, n), rng.uniform(0, 0.2, n), rng.uniform(-np.pi, np.pi, n)])


def filled(poses, order=None, captured=None):
    mosaic = Mosaic(CAMERA, POND)
    for n in range(len(poses)) if order is None else order:
        mosaic.put(key(n), photograph(poses[n]), poses[n], 0.0 if captured is None else captured[n])
    return mosaic


def test_a_mosaic_shows_the_floor_where_the_frames_say_to_a_fraction_of_a_pixel():
    mosaic = filled(random_poses(60))
    v, u = np.mgrid[:200, :300]
    truth = floor(raster_to_pond(np.stack([u, v], axis=-1), POND, 0.001))
    seen = mosaic.bgra()[..., 3] > 0

    error = mosaic.bgra()[..., :3].astype(float) - truth
    slope = np.stack(np.gradient(truth, axis=(0, 1)), axis=-1)
    shift_px = np.linalg.lstsq(slope[seen].reshape(-1, 2), error[seen].reshape(-1), rcond=None)[0]

    assert seen.mean() > 0.9
    assert np.abs(shift_px).max() < 0.01
    assert np.sqrt((error[seen] ** 2).mean()) < 2.0


def test_an_unturned_snapshot_on_the_pixel_grid_comes_back_pixel_for_pixel():
    image = np.random.default_rng(1).integers(0, 256, (60, 80, 3), dtype=np.uint8)
    mosaic = Mosaic(CAMERA, POND)

    changed = mosaic.put(key(0), image, np.array([0.1, 0.1, 0.0]))

    assert changed == [Rect(60, 70, 80, 60)]
    np.testing.assert_array_equal(mosaic.bgra(changed[0])[..., :3], image)
    assert mosaic.looks().sum() == 80 * 60
    assert (mosaic.bgra()[mosaic.looks() == 0] == 0).all()


def test_the_order_of_the_snapshots_leaves_no_trace():
    poses = random_poses(25)

    one, other = filled(poses), filled(poses, order=np.random.default_rng(2).permutation(25))

    np.testing.assert_array_equal(one.bgra(), other.bgra())
    np.testing.assert_array_equal(one.looks(), other.looks())


def test_a_snapshot_that_moves_leaves_no_trace_where_it_was():
    poses = random_poses(20)
    wrong = filled(poses + np.array([0.013, -0.008, 0.3]))

    for n, pose in enumerate(poses):
        wrong.put(key(n), photograph(poses[n] + np.array([0.013, -0.008, 0.3])), pose)
    for n, pose in enumerate(poses):
        wrong.put(key(n), photograph(pose), pose)

    np.testing.assert_array_equal(wrong.bgra(), filled(poses).bgra())


def test_dropping_every_snapshot_leaves_an_empty_mosaic():
    mosaic = filled(random_poses(10))

    for n in range(10):
        assert mosaic.drop(key(n))

    assert not mosaic.bgra().any()
    assert not mosaic.looks().any()
    assert mosaic.drop(key(0)) == []


def test_the_rectangles_returned_hold_every_pixel_that_changed():
    mosaic, rng = Mosaic(CAMERA, POND), np.random.default_rng(3)
    for n, pose in enumerate(random_poses(40, seed=4)):
        before = mosaic.bgra()
        rects = mosaic.put(key(int(rng.integers(8))), photograph(pose), pose, float(n))
        differs = (mosaic.bgra() != before).any(axis=-1)
        for r in rects:
            assert 0 <= r.x < r.x + r.width <= 300
            assert 0 <= r.y < r.y + r.height <= 200
            differs[r.y : r.y + r.height, r.x : r.x + r.width] = False
        assert not differs.any()


def test_the_same_again_changes_nothing():
    mosaic, image, pose = Mosaic(CAMERA, POND), photograph([0.1, 0.1, 0.4]), np.array([0.1, 0.1, 0.4])
    mosaic.put(key(0), image, pose)

    assert mosaic.put(key(0), image, pose) == []


def test_a_snapshot_off_the_pond_changes_nothing():
    mosaic = Mosaic(CAMERA, POND)

    assert mosaic.put(key(0), photograph([0.1, 0.1, 0.0]), np.array([5.0, 0.1, 0.2])) == []
    assert mosaic.drop(key(0)) == []


def test_looks_count_the_snapshots_whose_footprint_holds_the_pixel():
    poses = random_poses(30)
    v, u = np.mgrid[:200, :300]
    points = raster_to_pond(np.stack([u, v], axis=-1), POND, 0.001)
    expected = np.zeros((200, 300), int)
    for x, y, theta in poses:
        d = (points - (x, y)) @ np.array([[np.cos(theta), -np.sin(theta)], [np.sin(theta), np.cos(theta)]])
        expected += (np.abs(d[..., 0]) < 0.04) & (np.abs(d[..., 1]) < 0.03)

    difference = np.count_nonzero(filled(poses).looks() != expected)

    assert difference <= 3  # pixel centres within a rounding error of an edge


def test_last_seen_is_the_newest_look_whatever_the_order_and_forgets_what_was_dropped():
    poses, times = random_poses(12), np.random.default_rng(5).uniform(1e9, 1e9 + 1000, 12)
    mosaic = filled(poses, captured=times)
    newest = int(np.argmax(times))
    x, y = round(poses[newest, 0] * 1000), round((0.2 - poses[newest, 1]) * 1000)

    seen = mosaic.last_seen_s()
    mosaic.drop(key(newest))

    assert seen[y, x] == times[newest]
    assert np.array_equal(np.isnan(seen), filled(poses).looks() == 0)
    assert not (mosaic.last_seen_s() == times[newest]).any()


def test_a_rectangle_of_the_mosaic_is_a_part_of_the_whole():
    mosaic, part = filled(random_poses(9), captured=np.arange(9.0)), Rect(31, 40, 90, 70)

    np.testing.assert_array_equal(mosaic.bgra(part), mosaic.bgra()[40:110, 31:121])
    np.testing.assert_array_equal(mosaic.looks(part), mosaic.looks()[40:110, 31:121])
    np.testing.assert_array_equal(mosaic.last_seen_s(part), mosaic.last_seen_s()[40:110, 31:121])


def test_a_coarse_raster_averages_instead_of_aliasing():
    stripes = np.zeros((60, 80, 3), np.uint8)
    stripes[:, ::2] = 255
    mosaic = Mosaic(CAMERA, POND, metres_per_pixel=0.004)

    mosaic.put(key(0), stripes, np.array([0.15, 0.1, 0.0]))
    inner = mosaic.bgra()[20:30, 32:43, :3]

    assert np.abs(inner.astype(int) - 127).max() < 12


def test_a_vast_pond_gets_a_raster_within_bounds():
    vast = Pond(40.0, 20.0)
    mosaic = Mosaic(CAMERA, vast)

    assert mosaic.size_px[0] * mosaic.size_px[1] <= MAX_RASTER_PX
    assert mosaic.metres_per_pixel == default_metres_per_pixel(CAMERA, vast) > 0.001
    with pytest.raises(Invalid):
        Mosaic(CAMERA, vast, metres_per_pixel=0.001)


def test_what_cannot_be_placed_is_refused_and_changes_nothing():
    mosaic = Mosaic(CAMERA, POND)

    with pytest.raises(InvalidPose):
        mosaic.put(key(0), photograph([0.1, 0.1, 0.0]), np.array([0.1, np.inf, 0.0]))
    with pytest.raises(InvalidImage):
        mosaic.put(key(0), np.zeros((60, 81, 3), np.uint8), np.array([0.1, 0.1, 0.0]))

    assert not mosaic.looks().any()
