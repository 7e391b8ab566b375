"""Hollow or filled, by whether the mouth shows the ring's material: on rods drawn by a formula, one kind at a time."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from pondwatch.core.mouths import Mouth, log_odds_hollow, look_into
from pondwatch.core.observe import RingBand, find_rods
from tests.core.ponds import CAMERA, INNER_PX, OUTER_PX, draw_rods

CENTRES = np.array([[30.0, 28.0], [80.0, 28.0], [130.0, 28.0], [30.0, 80.0], [80.0, 80.0], [130.0, 80.0]])
LEVELS = {  # floor, line, ring, filling
    "dark filling": (90.0, 30.0, 190.0, 60.0),
    "bright filling": (90.0, 30.0, 60.0, 190.0),
    "filling like the line": (120.0, 30.0, 190.0, 30.0),
    "filling like the floor": (190.0, 20.0, 80.0, 190.0),
}


def _mouth(levels, fill, line_px=0.0, blur_px=0.0) -> Mouth:
    """The mouths of six rods alike. line_px: width of a line around each hollow mouth, of the outline's level."""
    image = draw_rods(CENTRES, np.full(6, fill), levels=levels)
    v, u = np.mgrid[: CAMERA.height_px, : CAMERA.width_px]
    for cu, cv in CENTRES if line_px and not fill else ():
        r = np.hypot(u - cu, v - cv)
        image[(r < INNER_PX) & (r > INNER_PX - line_px)] = levels[1]
    image = cv2.GaussianBlur(image, (0, 0), blur_px) if blur_px else image
    band = RingBand.of(INNER_PX, OUTER_PX, CAMERA.width_px, CAMERA.height_px)
    return look_into(image, find_rods(image, band), band)


@pytest.mark.parametrize("levels", LEVELS.values(), ids=LEVELS.keys())
@pytest.mark.parametrize(("line_px", "blur_px"), [(0, 0), (2, 0), (2, 1.8), (2, 2.2)])
def test_hollow_and_filled_rods_are_told_apart_one_kind_alone(levels, line_px, blur_px):
    hollow = _mouth(levels, 0.0, line_px, blur_px)
    filled = _mouth(levels, 1.0, line_px, blur_px)

    assert log_odds_hollow(list(hollow.along), INNER_PX, OUTER_PX) > 1
    assert log_odds_hollow(list(filled.along), INNER_PX, OUTER_PX) < -1


def test_no_rods_say_nothing():
    assert log_odds_hollow([], INNER_PX, OUTER_PX) == 0


def test_rods_cut_by_the_border_are_not_looked_into():
    mouth = _mouth(LEVELS["dark filling"], 0.0)

    assert len(mouth.centres_px) == 6
    cut = CENTRES + [0.0, -18.0]  # the upper row leaves the picture in part
    image = draw_rods(cut, np.zeros(6))
    band = RingBand.of(INNER_PX, OUTER_PX, CAMERA.width_px, CAMERA.height_px)
    assert (look_into(image, find_rods(image, band), band).centres_px[:, 1] > OUTER_PX).all()


@pytest.mark.parametrize("gain", [0.4, 0.7])
def test_darker_light_gives_the_same_profile(gain):
    image = draw_rods(CENTRES, np.zeros(6), noise=0.0)
    band = RingBand.of(INNER_PX, OUTER_PX, CAMERA.width_px, CAMERA.height_px)
    found = find_rods(image, band)

    bright, dark = (look_into(i, found, band).along for i in (image, np.round(image * gain).astype(np.uint8)))

    np.testing.assert_allclose(dark, bright, atol=0.03)
