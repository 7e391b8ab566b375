"""Sub-pixel refinement on rods whose appearance is a formula: Jacobian, precision against its bound, honesty."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import erf

from pondwatch.core.appearance import FILLED, HOLLOW, OTHER, Profile, contrast_axis, cut, learn_profile
from pondwatch.core.refine import COLUMNS, design, fit
from tests.core.ponds import INNER_PX, OUTER_PX

SHAPE = (110, 160)
ABOUT = np.array([79.5, 54.5])
REACH_PX = 1.15 * OUTER_PX
GREY = np.full(3, 1 / np.sqrt(3))
NOISE = 2.0
_HEX = np.array([[0, 0], [48, 0], [-48, 0], [24, 41.57], [-24, 41.57], [24, -41.57], [-24, -41.57], [72, 41.57],
                 [-72, -41.57]])  # fmt: skip
CENTRES = ABOUT + _HEX @ np.array([[np.cos(0.3), np.sin(0.3)], [-np.sin(0.3), np.cos(0.3)]]) + [3.3, -1.7]
KINDS = np.array([HOLLOW, FILLED, FILLED, HOLLOW, HOLLOW, FILLED, HOLLOW, FILLED, HOLLOW])


def _shown(r_px, kind):
    """Grey at a distance from the centre of a hollow or filled rod: soft steps at the inner and the outer circle."""

    def step(at):
        return 0.5 * (1 + erf((r_px - at) / (np.sqrt(2) * 0.9)))

    inside = np.where(kind == FILLED, 60.0, 180.0)
    return inside + (180.0 - inside) * step(INNER_PX) - 140 * step(OUTER_PX - 2) + 70 * step(OUTER_PX)


def _moved(motion):
    """(K, 2), px: the rods' centres, by a turn from u towards v about the middle and a shift."""
    c, s = np.cos(motion[2]), np.sin(motion[2])
    return (CENTRES - ABOUT) @ np.array([[c, s], [-s, c]]) + ABOUT + motion[:2]


def _picture(motion=(0.0, 0.0, 0.0), rng=None, kinds=KINDS, noise=NOISE):
    """(110, 160): the rods moved by (du, dv, px) and turned about the middle by an angle from u towards v."""
    centres = _moved(motion)
    v, u = np.mgrid[: SHAPE[0], : SHAPE[1]]
    distance = np.hypot(u[..., None] - centres[:, 0], v[..., None] - centres[:, 1])
    nearest = distance.argmin(axis=-1)
    image = _shown(distance.min(axis=-1), kinds[nearest])
    return (image + noise * rng.standard_normal(SHAPE) if rng else image).astype(np.float32)


def _profile():
    """As if the appearance were known."""
    r = np.arange(int(2 * REACH_PX) + 4) / 2
    return Profile.of(np.stack([_shown(r, HOLLOW), _shown(r, FILLED)]), INNER_PX, REACH_PX, GREY)


def _fit(image, profile=None, kinds=KINDS, centres=CENTRES, iterations=5):
    patches = cut(image, centres, kinds, REACH_PX)
    return fit(patches, centres, ABOUT, profile or _profile(), iterations)


def _error_px(shift, motion):
    """Of the middle, and of a corner by the turn."""
    off = np.asarray(shift) - motion
    return max(float(np.hypot(*off[:2])), abs(float(off[2])) * 97)


def test_the_refinement_jacobian_matches_a_numerical_one():
    patches, profile, gain, h = cut(_picture(), CENTRES, KINDS, REACH_PX), _profile(), 0.7, 0.5

    def columns_at(motion):
        columns = np.empty((COLUMNS, len(patches.value)), np.float32)
        r = design(patches, _moved(motion), profile, columns)
        return gain * columns.astype(float), r

    def model(motion):
        return columns_at(motion)[0][0]

    columns, r = columns_at(np.zeros(3))
    across, down = columns[4], columns[5]
    arm = (CENTRES - ABOUT)[patches.rod]
    by_motion = np.stack([across, down, down * arm[:, 0] - across * arm[:, 1]])
    compared = (r > 1) & (r < REACH_PX - 1)
    for k, step in enumerate((h, h, h / 60)):
        motion = np.zeros(3)
        motion[k] = step
        numerical = (model(motion) - model(-motion)) / (2 * step)
        scale = np.abs(numerical[compared]).max()
        off = np.abs(by_motion[k] - numerical)[compared]
        assert off.max() < 0.1 * scale  # the profile is linear between its bins, its slope too
        assert off.mean() < 0.015 * scale


@pytest.mark.parametrize("motion", [(0.4, -0.3, 0.0), (0.0, 0.0, 0.01), (-1.1, 0.7, -0.015), (0.02, 0.01, 0.001)])
def test_a_known_motion_is_found_to_a_hundredth_of_a_pixel(motion):
    assert _error_px(_fit(_picture(motion, noise=0)).shift, motion) < 0.01


@pytest.mark.parametrize("light", ["gain", "offset", "slope", "each rod its own"])
def test_the_light_does_not_move_a_pose(light):
    image = _picture((0.4, -0.3, 0.005))
    v, u = np.mgrid[: SHAPE[0], : SHAPE[1]]
    lit = {
        "gain": 0.6 * image,
        "offset": image + 40,
        "slope": image + 0.4 * u - 0.3 * v,
        "each rod its own": image * (0.7 + 0.002 * u) + 0.1 * v,
    }[light]

    assert _error_px(_fit(lit.astype(np.float32)).shift, (0.4, -0.3, 0.005)) < 0.02


def test_the_profile_learned_from_pictures_is_the_appearance():
    rng = np.random.default_rng(0)
    taught = [(cut(_picture(rng=rng), CENTRES, KINDS, REACH_PX), CENTRES) for _ in range(6)]

    profile = learn_profile(taught, INNER_PX, REACH_PX, GREY)
    again = learn_profile(taught, INNER_PX, REACH_PX, GREY, profile)

    r = np.arange(4, int(2 * REACH_PX)) / 2
    for kind in (HOLLOW, FILLED):
        for found in (profile, again):
            off = found.value[kind][4 : int(2 * REACH_PX)] - _shown(r, kind)
            assert np.abs(off).mean() < 1.5  # of 140 grey levels; linear interpolation rounds the steps
    assert INNER_PX < profile.outside_px < OUTER_PX  # where hollow and filled rods begin to look the same


def _motions(rng, count):
    return rng.uniform([-0.5, -0.5, -0.004], [0.5, 0.5, 0.004], (count, 3))


def _trials(noise, count=80):
    """Errors (N, 3) of fits in white noise, their covariances (N, 3, 3), and how much their rods disagree (N,), by a
    profile learned from other pictures."""
    rng = np.random.default_rng(1)
    taught = [(_moved(m), cut(_picture(m, rng, noise=noise), _moved(m), KINDS, REACH_PX)) for m in _motions(rng, 24)]
    profile = learn_profile([(patches, centres) for centres, patches in taught], INNER_PX, REACH_PX, GREY)
    motions = _motions(rng, count)
    fits = [_fit(_picture(m, rng, noise=noise), profile, iterations=4) for m in motions]
    covariances = np.array([f.variance * np.linalg.inv(f.normal) for f in fits])
    return np.array([f.shift for f in fits]) - motions, covariances, np.array([f.disagreement for f in fits])


def _bound(noise):
    """(3, 3): the Cramér-Rao bound of the motion, of all pixels near a rod, the appearance and the light known."""
    steps = np.diag([0.05, 0.05, 0.001])
    columns = [(_picture(h, noise=0) - _picture(-h, noise=0)).astype(float) / (2 * h.sum()) for h in steps]
    v, u = np.mgrid[: SHAPE[0], : SHAPE[1]]
    near = np.hypot(u[..., None] - CENTRES[:, 0], v[..., None] - CENTRES[:, 1]).min(axis=-1) < REACH_PX
    jacobian = np.stack([c[near] for c in columns], axis=1)
    return noise**2 * np.linalg.inv(jacobian.T @ jacobian)


@pytest.fixture(scope="module")
def noisy():
    return _trials(6.0)


def test_the_stated_covariance_is_that_of_many_trials(noisy):
    errors, covariances, _ = noisy

    ratio = np.mean(errors**2, axis=0) / np.mean(covariances, axis=0).diagonal()

    assert ((ratio > 0.7) & (ratio < 1.5)).all(), ratio


@pytest.mark.parametrize(("noise", "limit"), [(6.0, 1.3), (2.0, 1.4)])
def test_the_error_comes_near_the_cramer_rao_bound(noise, limit, noisy, record_property):
    """The light and the appearance are learned beside the motion; the bound knows them."""
    errors = noisy[0] if noise == 6.0 else _trials(noise)[0]

    ratio = np.sqrt(np.mean(errors**2, axis=0) / _bound(noise).diagonal())

    record_property("error over bound: u, v, turn", ratio.round(2).tolist())
    assert (ratio > 0.85).all(), "better than possible: the bound or the noise is wrong"
    assert (ratio < limit).all(), ratio


def test_rods_of_one_snapshot_agree_in_white_noise_and_not_where_one_of_them_is_out_of_place(noisy):
    image = _picture(rng=np.random.default_rng(2))
    u, v = CENTRES[0].round().astype(int)
    window = (slice(v - 20, v + 21), slice(u - 20, u + 21))
    image[window] = np.roll(image[window], 1, axis=1)  # one rod a pixel to the right

    assert 0.5 < noisy[2].mean() < 1.2
    assert _fit(image).disagreement > 5


def test_partly_filled_rods_are_compared_by_their_outside_alone():
    motion = (0.3, 0.2, 0.002)
    image = _picture(motion, noise=0)
    v, u = np.mgrid[: SHAPE[0], : SHAPE[1]]
    wedges = (np.hypot(u[..., None] - CENTRES[:3, 0], v[..., None] - CENTRES[:3, 1]).min(axis=-1) < 9) & (u % 7 < 4)
    kinds = np.where(np.arange(len(KINDS)) < 3, OTHER, KINDS)

    assert _error_px(_fit(np.where(wedges, 60, image).astype(np.float32), kinds=kinds).shift, motion) < 0.01


def test_a_particle_in_view_hardly_moves_a_pose():
    image = _picture((0.2, -0.4, 0.0), np.random.default_rng(3))
    v, u = np.mgrid[: SHAPE[0], : SHAPE[1]]
    spot = 120 * np.exp(-((u - CENTRES[0, 0] - 10) ** 2 + (v - CENTRES[0, 1]) ** 2) / 8)

    moved = _fit((image + spot).astype(np.float32)).shift - _fit(image).shift

    assert _error_px(moved, np.zeros(3)) < 0.03


def test_rods_that_are_not_there_are_counted_as_absent():
    whole = _picture(rng=np.random.default_rng(4))
    bare = whole.copy()
    v, u = np.mgrid[: SHAPE[0], : SHAPE[1]]
    gone = np.hypot(u - CENTRES[0, 0], v - CENTRES[0, 1]) < OUTER_PX + 3
    bare[gone] = 110 + NOISE * np.random.default_rng(5).standard_normal(int(gone.sum()))

    assert _fit(whole).absent < 0.1
    assert _fit(bare).absent > 0.6


def test_where_no_rod_is_in_view_nothing_moves_and_next_to_nothing_is_known():
    nowhere = np.zeros((0, 2))

    found = fit(cut(_picture(), nowhere, KINDS[:0], REACH_PX), nowhere, ABOUT, _profile())

    np.testing.assert_array_equal(found.shift, np.zeros(3))
    assert found.normal.max() < 1e-5
    assert found.absent == 0


def test_out_of_focus_a_fit_reaches_further():
    motion = (4.5, -3.0, 0.0)
    image = _picture(motion, noise=0)

    near = _fit(image, _profile().blurred(2.0), iterations=12).shift

    assert _error_px(near, motion) < 1.5


def test_the_weights_of_the_colours_are_those_in_which_rings_differ_and_flicker_does_not():
    rng = np.random.default_rng(6)
    r = rng.uniform(0, REACH_PX, 20_000)
    hue = np.array([1.0, -1.0, 0.0]) / np.sqrt(2)
    flicker = 30 * rng.standard_normal((20_000, 1)) * np.ones(3) / np.sqrt(3)
    pixels = 10 * np.sin(r / 3)[:, None] * hue + flicker + rng.standard_normal((20_000, 3))

    axis = contrast_axis([(pixels, r)])

    assert np.linalg.norm(axis) == pytest.approx(1)
    assert abs(axis @ np.ones(3) / np.sqrt(3)) < 0.1
    assert abs(axis @ hue) > 0.95
