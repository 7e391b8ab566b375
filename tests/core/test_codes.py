"""What the inside of a rod shows: on rods drawn by a formula, in every polarity, and with one level alone."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pondwatch.core.codes import SECTORS, learn_palette, read_codes
from tests.core.ponds import CAMERA, INNER_PX, OUTER_PX, draw_rods

CENTRES = np.array([[30.0, 28.0], [80.0, 28.0], [130.0, 28.0], [30.0, 80.0], [80.0, 80.0], [130.0, 80.0]])
FILLS = np.array([0.0, 1.0, 0.0, 1.0, 0.5, 0.25])
ANGLES = 2 * np.pi * np.arange(SECTORS) / SECTORS
LEVELS = {  # floor, line, ring, filling
    "dark filling": (90.0, 30.0, 190.0, 60.0),
    "bright filling": (90.0, 30.0, 60.0, 190.0),
    "filling like the line": (120.0, 30.0, 190.0, 30.0),
    "filling like the floor": (190.0, 20.0, 80.0, 190.0),
    "weak": (100.0, 60.0, 120.0, 95.0),
}


def _read(levels, fills=FILLS, starts=None):
    image = draw_rods(CENTRES, fills, starts, levels=levels)
    return read_codes(image, CENTRES, INNER_PX, OUTER_PX, CAMERA)


def _clusters(hollow, filled, rng, count=600, noise=0.05):
    """(2 count, 3): log ratios to the ring, as many hollow as filled."""
    return np.concatenate([hollow + noise * rng.standard_normal((count, 3)),
                           filled + noise * rng.standard_normal((count, 3))])  # fmt: skip


@pytest.mark.parametrize("levels", LEVELS.values(), ids=LEVELS.keys())
def test_hollow_rods_are_those_that_look_like_their_own_ring(levels):
    codes = _read(levels)

    palette = learn_palette(codes.ratio.reshape(-1, 3))

    assert palette.two_levels
    share = palette.share(codes.ratio)
    np.testing.assert_allclose(share[[0, 2]], 0, atol=0.2)
    np.testing.assert_allclose(share[[1, 3]], 1, atol=0.2)


@pytest.mark.parametrize("line_px", [2.0, 3.5])
def test_a_thick_line_around_a_rod_is_not_taken_for_its_ring(line_px):
    image = draw_rods(CENTRES, np.zeros(6), levels=(90, 30, 190, 60))
    v, u = np.mgrid[: CAMERA.height_px, : CAMERA.width_px]
    for cu, cv in CENTRES:
        r = np.hypot(u - cu, v - cv)
        image[(r < OUTER_PX) & (r > OUTER_PX - line_px)] = 30

    ratio = read_codes(image, CENTRES, INNER_PX, OUTER_PX, CAMERA).ratio

    np.testing.assert_allclose(ratio, 0, atol=0.15)


def test_sectors_run_counter_clockwise_from_the_images_right():
    codes = _read(LEVELS["dark filling"], np.full(6, 0.5), np.zeros(6))  # from 0 to 180 degrees: the upper half

    palette = learn_palette(codes.ratio.reshape(-1, 3))

    share = palette.share(codes.ratio)
    inside, outside = (np.sin(ANGLES) > 0.3), (np.sin(ANGLES) < -0.3)
    assert (share[:, inside] > 0.8).all()
    assert (share[:, outside] < 0.2).all()


@pytest.mark.parametrize("gain", [0.5, 0.8])
def test_a_change_of_light_changes_what_is_read_by_little(gain):
    image = draw_rods(CENTRES, FILLS, noise=0.0)

    bright = read_codes(image, CENTRES, INNER_PX, OUTER_PX, CAMERA).ratio
    dark = read_codes(np.round(image * gain).astype(np.uint8), CENTRES, INNER_PX, OUTER_PX, CAMERA).ratio

    np.testing.assert_allclose(dark, bright, atol=0.12)  # of a step of one


def test_sectors_out_of_view_are_told_so():
    centres = np.array([[1.0, 55.0], [80.0, 109.0], [80.0, 55.0], [-30.0, 55.0]])

    valid = read_codes(draw_rods(centres), centres, INNER_PX, OUTER_PX, CAMERA).valid

    np.testing.assert_array_equal(valid[0], np.cos(ANGLES) > -0.01)
    np.testing.assert_array_equal(valid[1], np.sin(ANGLES) > -0.01)
    assert valid[2].all()
    assert not valid[3].any()


def test_no_sites_have_no_codes():
    codes = read_codes(draw_rods(CENTRES), np.zeros((0, 2)), INNER_PX, OUTER_PX, CAMERA)

    assert (codes.ratio.shape, codes.valid.shape) == ((0, SECTORS, 3), (0, SECTORS))


@settings(deadline=None)
@given(direction=st.tuples(*[st.floats(-1, 1)] * 3), size=st.floats(0.4, 2.0), seed=st.integers(0, 50))
def test_filled_is_the_cluster_further_from_the_ring_in_whichever_direction_of_colour(direction, size, seed):
    unit = np.array(direction) / max(np.linalg.norm(direction), 1e-9)
    if np.linalg.norm(unit) < 0.5:
        return
    palette = learn_palette(_clusters(np.zeros(3), size * unit, np.random.default_rng(seed)))

    assert palette.two_levels
    np.testing.assert_allclose(palette.share(np.array([np.zeros(3), size * unit])), [0, 1], atol=0.05)


def test_a_pond_of_hollow_rods_has_one_level_and_it_is_empty():
    codes = _read(LEVELS["dark filling"], np.zeros(6))

    palette = learn_palette(codes.ratio.reshape(-1, 3))

    assert not palette.two_levels
    np.testing.assert_allclose(palette.share(codes.ratio), 0, atol=0.25)


def test_before_anything_was_looked_at_it_is_open_which_level_is_which():
    palette = learn_palette(np.zeros((0, 3)))

    assert palette.taught == 0
    assert palette.certainty == 0.5


@pytest.mark.parametrize("levels", ["dark filling", "bright filling"])
def test_a_rod_unlike_all_rods_seen_so_far_is_strange_whichever_way_it_differs(levels):
    palette = learn_palette(_read(LEVELS[levels], np.zeros(6)).ratio.reshape(-1, 3))

    strange = palette.strange(_read(LEVELS[levels], np.array([0.0, 1.0, 0.0, 1.0, 0.0, 1.0])).ratio)

    assert strange[::2].max() < 0.05
    assert strange[1::2].min() > 0.9
    assert palette.taught == 6


@pytest.mark.parametrize("levels", ["dark filling", "bright filling"])
def test_a_pond_of_filled_rods_has_one_level_and_it_is_full(levels):
    codes = _read(LEVELS[levels], np.ones(6))

    palette = learn_palette(codes.ratio.reshape(-1, 3))

    assert not palette.two_levels
    np.testing.assert_allclose(palette.share(codes.ratio), 1, atol=0.25)


@pytest.mark.parametrize("fill", [0.0, 1.0])
def test_a_level_is_read_the_other_way_round_where_evidence_outweighs_its_colour(fill):
    ratio = _read(LEVELS["dark filling"], np.full(6, fill)).ratio.reshape(-1, 3)
    palette = learn_palette(ratio)

    kept, turned = palette.judged(2.0), palette.judged(-20.0)

    np.testing.assert_allclose(kept.share(ratio), fill, atol=0.25)
    np.testing.assert_allclose(np.median(turned.share(ratio)), 1 - fill, atol=0.05)
    assert kept.certainty > palette.certainty > 0.5
    assert turned.nats == pytest.approx(20 - palette.nats)


def test_two_levels_change_places_where_evidence_says_so():
    ratio = _read(LEVELS["dark filling"]).ratio.reshape(-1, 3)
    palette = learn_palette(ratio)

    np.testing.assert_allclose(palette.judged(-9.0).share(ratio), 1 - palette.share(ratio), atol=1e-9)


def test_a_few_stray_sectors_do_not_make_a_second_level():
    rng = np.random.default_rng(2)
    ratio = 0.03 * rng.standard_normal((3000, 3))
    ratio[:4] = 1.5

    palette = learn_palette(ratio)

    assert not palette.two_levels
    np.testing.assert_allclose(palette.share(np.median(ratio, axis=0)), 0, atol=0.05)


def test_one_filled_rod_among_many_hollow_ones_is_a_second_level():
    rng = np.random.default_rng(3)
    ratio = np.concatenate([0.04 * rng.standard_normal((40 * SECTORS, 3)),
                            -0.8 + 0.04 * rng.standard_normal((SECTORS, 3))])  # fmt: skip

    palette = learn_palette(ratio)

    assert palette.two_levels
    np.testing.assert_allclose(palette.share(np.array([[0, 0, 0], [-0.8, -0.8, -0.8]])), [0, 1], atol=0.1)


def test_too_few_sectors_teach_nothing():
    assert not learn_palette(np.zeros((3, 3))).two_levels
    assert np.isfinite(learn_palette(np.zeros((0, 3))).share(np.zeros((2, 3)))).all()


def test_a_filling_of_another_hue_is_told_apart_though_the_light_wanders_more():
    rng = np.random.default_rng(5)
    light = 0.15 * rng.standard_normal((1200, 1))  # moves all channels alike, further than the filling does
    looks = _clusters(np.zeros(3), np.array([0.2, -0.1, 0.05]), rng, noise=0.03) + light

    palette = learn_palette(looks)

    assert palette.two_levels
    share = palette.share(looks)
    assert (share[:600] < 0.5).mean() > 0.99
    assert (share[600:] > 0.5).mean() > 0.99


def test_light_that_wanders_over_hollow_rods_makes_no_second_level():
    rng = np.random.default_rng(6)
    looks = 0.03 * rng.standard_normal((2000, 3)) + 0.3 * rng.standard_normal((2000, 1))

    assert not learn_palette(looks).two_levels


def test_a_few_sectors_under_a_thing_of_another_colour_are_not_taken_for_the_filling():
    """Half of the rods are filled; one, under something green that no rod holds, lies four times as far from all."""
    rng = np.random.default_rng(11)
    levels = np.repeat(rng.integers(0, 2, 100), SECTORS)[:, None] * np.array([-0.3, -0.3, -0.3])
    ratio = levels + rng.normal(0, 0.04, (len(levels), 3))
    ratio[:SECTORS] = [0.8, -1.6, 0.8] + rng.normal(0, 0.01, (SECTORS, 3))

    palette = learn_palette(ratio)

    assert abs(palette.axis @ np.full(3, 1 / np.sqrt(3))) > 0.98
    filled = levels[SECTORS:, 0] < 0
    assert ((palette.share(ratio[SECTORS:]) > 0.5) == filled).mean() > 0.99
