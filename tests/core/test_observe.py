"""Finding rods: on discs drawn by a formula, and on simulated snapshots whose true poses say where rods are."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from pondwatch.core.frames import pond_to_image
from pondwatch.core.observe import MIN_SUPPORT, RingBand, find_rods, response_field, sample
from pondwatch.simulator.spec import SimulationSpec
from tests.core.ponds import CAMERA, INNER_PX, OUTER_PX, draw_rods, inspected

BAND = RingBand.of(INNER_PX, OUTER_PX, CAMERA.width_px, CAMERA.height_px)
CENTRES = np.array([[40.3, 30.8], [92.0, 27.5], [65.6, 74.2], [118.4, 71.1]])
WITHOUT_SHRINKING = (Phase.explicit, Phase.generate)  # each example is a picture
FILLS = np.array([0.0, 1.0, 0.5, 0.25])


def _nearest(found, wanted):
    """(K,), px: how far the nearest rod found is from each one wanted."""
    return np.array([np.hypot(*(found.centres_px - w).T).min(initial=np.inf) for w in wanted])


@pytest.mark.parametrize("levels", [(90, 30, 190, 60), (190, 90, 60, 230), (120, 20, 120, 20), (60, 60, 180, 120)])
def test_rods_are_found_to_a_fraction_of_a_pixel_whatever_is_light_and_whatever_dark(levels):
    found = find_rods(draw_rods(CENTRES, FILLS, levels=levels), BAND)

    assert len(found.centres_px) == len(CENTRES)
    assert _nearest(found, CENTRES)[[0, 1]].max() < 0.5
    assert _nearest(found, CENTRES)[[2, 3]].max() < 1.5  # a wedge's edges draw the centre aside
    assert (found.support > 0.99).all()


def test_rods_that_differ_from_their_ground_in_hue_alone_are_found():
    grey = draw_rods(CENTRES, noise=0.0).astype(np.float32)[..., :1]
    share = (grey - grey.min()) / (grey.max() - grey.min())
    ground, rods = np.array([60.0, 134.0, 30.0]), np.array([60.0, 84.0, 128.0])  # of one luminance, within a level
    luma = np.array([0.114, 0.587, 0.299])
    image = np.round(ground + share * (rods - ground)).astype(np.uint8)

    found = find_rods(image, BAND)

    assert float(np.ptp(image @ luma)) < 2
    assert _nearest(found, CENTRES).max() < 0.6


@settings(max_examples=10, deadline=None, phases=WITHOUT_SHRINKING)
@given(gain=st.floats(0.4, 1.0), offset=st.floats(0, 60))
def test_darker_or_hazier_pictures_show_the_same_rods(gain, offset):
    image = draw_rods(CENTRES, FILLS)

    found = find_rods(np.round(gain * image + offset).clip(0, 255).astype(np.uint8), BAND)

    assert len(found.centres_px) == len(CENTRES)
    assert _nearest(found, find_rods(image, BAND).centres_px).max() < 0.3


def test_a_negative_shows_the_same_rods():
    image = draw_rods(CENTRES, FILLS)

    first, second = find_rods(image, BAND), find_rods(255 - image, BAND)

    np.testing.assert_allclose(second.centres_px, first.centres_px, atol=0.01)


def test_a_mirror_image_shows_mirrored_rods():
    image = draw_rods(CENTRES, FILLS)

    found, mirrored = find_rods(image, BAND), find_rods(np.ascontiguousarray(image[:, ::-1]), BAND)

    assert _nearest(mirrored, [CAMERA.width_px - 1, 0] + found.centres_px * [-1, 1]).max() < 0.01


def test_rods_cut_by_the_border_and_rods_just_outside_are_found_with_the_share_in_view():
    centres = np.array([[3.0, 50.0], [-3.0, 90.0], [80.0, 50.0], [157.0, 108.0]])

    found = find_rods(draw_rods(centres), BAND)

    assert _nearest(found, centres).max() < 2.5
    support = [found.support[np.argmin(np.hypot(*(found.centres_px - c).T))] for c in centres]
    assert support[2] > 0.99
    assert 0.5 < support[0] < 0.75
    assert MIN_SUPPORT < support[1] < 0.5
    assert MIN_SUPPORT < support[3] < 0.45


def test_a_picture_of_nothing_shows_no_rods():
    assert len(find_rods(np.full((110, 160, 3), 77, np.uint8), BAND).centres_px) == 0


def test_the_response_is_a_correlation():
    field = response_field(draw_rods(CENTRES, FILLS), BAND)

    assert field.shape == (CAMERA.height_px + 2 * BAND.pad, CAMERA.width_px + 2 * BAND.pad)
    assert 0.5 < field.max() <= 1 + 1e-6
    assert field[0, 0] == 0  # next to nothing of a rod centred there would be in view


@pytest.mark.parametrize(
    ("spec", "median_px", "share"),
    [(SimulationSpec(snapshots=20), 0.25, 0.99), (SimulationSpec(snapshots=20, water="murky"), 0.8, 0.9)],
    ids=["clear", "murky"],
)
def test_nearly_every_rod_wholly_in_view_of_a_simulated_snapshot_is_found(spec, median_px, share):
    pond = inspected(spec, 5)
    setting = pond.setting
    off = []
    for snapshot, pose, seen in zip(pond.snapshots, pond.truth, pond.views(), strict=True):
        wanted = pond_to_image(setting.layout.centres[seen], pose, setting.camera)
        off.append(_nearest(find_rods(snapshot.image, setting.band), wanted))

    apart = np.concatenate(off)

    assert len(apart) > 30
    assert (apart < 4).mean() >= share
    assert np.median(apart) < median_px


def test_sampling_between_pixels_weighs_the_four_around():
    image = np.array([[0, 10], [20, 50]], np.float32)

    values = sample(image, np.array([[0.0, 0.0], [0.5, 0.0], [0.25, 0.5], [1.0, 1.0]]))

    np.testing.assert_allclose(values, [0, 5, 0.75 * 10 + 0.25 * 30, 50], atol=0.3)


def test_sampling_beyond_the_border_gives_what_was_asked_for():
    image = np.full((4, 4), 9, np.float32)

    np.testing.assert_array_equal(sample(image, np.array([[-5.0, 0.0], [20.0, 1.0]]), outside=-1.0), [-1, -1])
    assert sample(image, np.array([-5.0, -3.0]), pad=5) == 9


def test_sampling_very_many_points_gives_what_sampling_few_does():
    image = cv2.GaussianBlur(np.random.default_rng(0).random((50, 60, 3)).astype(np.float32), (0, 0), 1)
    points = np.random.default_rng(1).uniform(0, 45, (40_000, 1, 2))

    many = sample(image, points)

    assert many.shape == (40_000, 1, 3)
    np.testing.assert_array_equal(many[-50:], sample(image, points[-50:]))
    assert sample(image[..., 0], np.zeros((0, 2))).shape == (0,)
