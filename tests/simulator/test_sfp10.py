"""SFP10: bit for bit by seed, taken up where it was cut off, as the paper and the released scripts describe it."""

from __future__ import annotations

import json
import math
import shutil

import cv2
import numpy as np
import pytest

from pondwatch.core.errors import Invalid, InvalidBundle
from pondwatch.core.frames import wrap_angle
from pondwatch.core.paperinputs import CANVAS_PX, binarised, covered, stitched, tile_size
from pondwatch.simulator import sfp10_files
from pondwatch.simulator.sfp10 import (
    CAMERA,
    HEIGHT_PX,
    INNER_PX,
    METRES_PER_PIXEL,
    NOISES,
    WIDTH_PX,
    Sfp10Spec,
    draw,
    inspection_of,
    layout,
    make_pond,
    photograph,
)
from pondwatch.simulator.sfp10_files import damaged, load_pond, load_spec, write_dataset

TINY = Sfp10Spec(train=3, test=2, instances=2)


@pytest.fixture(scope="module")
def tiny(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sfp10") / "tiny"
    write_dataset(TINY, folder, workers=1)
    return folder


def test_a_set_is_made_again_bit_for_bit(tiny):
    held, again = load_pond(tiny, "train", 1), make_pond(load_spec(tiny), "train", 1)

    for name in ("raster", "snapshots", "truth", "noisy", "masks", "fills"):
        np.testing.assert_array_equal(getattr(held, name), getattr(again, name), err_msg=name)


def test_two_processes_make_the_same_bytes_as_one_and_go_on_where_they_were_cut_off(tiny, tmp_path):
    whole = json.loads((tiny / "manifest.json").read_text())
    folder = shutil.copytree(tiny, tmp_path / "again")
    for lost in ("manifest.json", "train/pond-0001.npz", "test/pond-0000.npz"):
        (folder / lost).unlink()
    kept = (folder / "train/pond-0000.npz").stat().st_mtime_ns

    told = []
    assert write_dataset(TINY, folder, workers=2, progress=lambda *how_far: told.append(how_far)) == whole
    assert told == [(1, 3), (2, 3), (3, 3)]
    assert (folder / "train/pond-0000.npz").stat().st_mtime_ns == kept


def test_snapshots_are_stored_once_a_pond_and_the_last_pond_gives_what_is_left(tiny):
    first, last = load_pond(tiny, "train", 0), load_pond(tiny, "train", 1)

    assert first.snapshots.shape == (221, 110, 160)
    assert (first.noisy.shape, last.noisy.shape) == ((2, 221, 3), (1, 221, 3))
    assert first.masks.shape == (2, CANVAS_PX, CANVAS_PX)
    assert first.raster.shape == (HEIGHT_PX, WIDTH_PX)


def test_a_changed_byte_is_found(tmp_path):
    write_dataset(Sfp10Spec(train=1, test=0, instances=1), tmp_path, workers=1)
    assert damaged(tmp_path) == []

    path = tmp_path / "train/pond-0000.npz"
    path.write_bytes(path.read_bytes()[:-1] + b"x")

    assert damaged(tmp_path) == ["train/pond-0000.npz"]


def test_a_folder_of_another_spec_is_refused(tiny, tmp_path):
    with pytest.raises(Invalid, match="another spec"):
        write_dataset(Sfp10Spec(train=3, test=2, instances=2, seed=9), tiny)
    (tmp_path / "mine.txt").write_text("x")
    with pytest.raises(Invalid, match="not empty"):
        write_dataset(TINY, tmp_path)


def test_an_unfinished_set_and_a_missing_pond_are_named(tiny, tmp_path):
    with pytest.raises(InvalidBundle, match="no finished SFP10"):
        load_spec(tmp_path)
    with pytest.raises(InvalidBundle, match=r"pond-0007\.npz"):
        load_pond(tiny, "train", 7)


@pytest.mark.parametrize("wrong", [{"split": "both"}, {"noise": "pink"}, {"train": -1}, {"train": 0, "test": 0}])
def test_a_spec_out_of_range_is_refused(wrong, tmp_path):
    with pytest.raises(Invalid):
        write_dataset(Sfp10Spec(**wrong), tmp_path / "x")


def test_only_the_shared_split_has_test_ponds_with_the_poses_of_training_ponds(monkeypatch):
    monkeypatch.setattr("pondwatch.simulator.sfp10.photograph", lambda *_: np.zeros((110, 160), np.uint8))
    shared, disjoint = Sfp10Spec(instances=1), Sfp10Spec(instances=1, split="disjoint")
    trained = make_pond(shared, "train", 0)
    same, other = make_pond(shared, "test", 0), make_pond(disjoint, "test", 0)

    np.testing.assert_array_equal(trained.truth, make_pond(disjoint, "train", 0).truth)
    np.testing.assert_array_equal(same.truth, trained.truth)
    assert np.abs(other.truth - trained.truth).min(axis=0).max() > 0
    assert (same.fills != trained.fills).any()
    assert (same.noisy != trained.noisy).all()


def test_the_noise_of_the_scripts_is_as_small_on_x_and_y_as_was_measured(monkeypatch):
    """Handing back the input has a MSE of 4.7e-6 and 9.4e-6, as their released scripts give it."""
    monkeypatch.setattr("pondwatch.simulator.sfp10.photograph", lambda *_: np.zeros((110, 160), np.uint8))
    sets = make_pond(Sfp10Spec(noise="scripts"), "train", 3)

    error = sets.noisy - sets.truth
    mse = (error[..., :2] ** 2).mean(axis=(0, 1)) / (layout().width_m ** 2, layout().height_m ** 2)
    np.testing.assert_allclose(mse, [4.7e-6, 9.4e-6], rtol=0.15)
    whole = error[..., :2] / METRES_PER_PIXEL
    np.testing.assert_allclose(whole, np.round(whole), atol=2e-3)
    assert error[..., 2].std() == pytest.approx(0.5 * math.sqrt(50.5), rel=0.1)
    assert np.abs(wrap_angle(error[..., 2])).mean() > 1.2  # next to nothing is left of the heading


def test_half_of_the_inner_circles_are_filled_and_a_session_claims_its_noise(monkeypatch):
    monkeypatch.setattr("pondwatch.simulator.sfp10.photograph", lambda *_: np.zeros((110, 160), np.uint8))
    fills = np.concatenate([make_pond(Sfp10Spec(instances=1), "train", n).fills for n in range(3)])

    assert np.mean(fills > 0) == pytest.approx(0.5, abs=0.05)
    assert set(fills) == {0.0, 0.25, 0.5, 0.75, 1.0}
    assert inspection_of("scripts", 3).pose_noise.sigma_theta_rad == pytest.approx(1.0)  # 0.5 * sqrt(4)
    assert inspection_of("paper", 3).pose_noise.sigma_theta_rad == NOISES["paper"].sigma_theta_rad


def test_a_snapshot_shows_a_rod_where_the_frames_say():
    """A camera 30 px left of a full rod and turned by a quarter: the rod lies below the centre."""
    pond = layout()
    rod = pond.rods[200]
    fills = np.zeros(len(pond.rods))
    fills[200] = 1.0
    pose = np.array([rod.x_m - 30 * METRES_PER_PIXEL, rod.y_m, math.pi / 2])

    seen = photograph(draw(pond, fills, fills), pose, pond)

    rows, columns = np.nonzero(cv2.erode((seen < 60).astype(np.uint8), np.ones((9, 9))))
    assert (columns.mean(), rows.mean()) == pytest.approx((79.5, 54.5 + 30), abs=0.3)
    dark = cv2.countNonZero((seen[66:104, 60:100] < 128).astype(np.uint8))
    assert dark > 0.8 * math.pi * INNER_PX**2


def test_a_mask_covers_a_snapshot_s_ground_and_no_more():
    pond = layout()
    middle = np.array([[pond.width_m / 2, pond.height_m / 2, 0.0]])

    area = covered(middle, CAMERA, pond, (WIDTH_PX, HEIGHT_PX)).sum()

    assert area == pytest.approx(160 * 110, rel=0.02)
    assert covered(middle, CAMERA, pond).mean() == pytest.approx(160 * 110 / (WIDTH_PX * HEIGHT_PX), rel=0.2)


def test_stitching_leaves_no_holes_and_lays_later_snapshots_on_top():
    pond = layout()
    poses = np.array([[pond.width_m / 2, pond.height_m / 2, 0.6]] * 2)
    tiles = binarised(np.stack([np.full((110, 160), g, np.uint8) for g in (0, 255)]), tile_size(CAMERA, pond))

    canvas = stitched(tiles, poses, CAMERA, pond)

    inner = cv2.erode(covered(poses, CAMERA, pond).astype(np.uint8), np.ones((3, 3)))
    assert canvas[inner > 0].min() > 0.999
    assert canvas.sum() < 1.3 * covered(poses, CAMERA, pond).sum()


def test_the_folder_s_layout_is_what_its_card_says(tiny):
    card = (tiny / "README.md").read_text()

    assert "--train 3 --test 2" in card
    assert json.loads((tiny / "manifest.json").read_text())["format"] == sfp10_files.FORMAT
    assert cv2.imread(str(tiny / "previews/train-0000.png")).shape[0] > 300
