"""From a place to a pose: refinement of simulated snapshots against their truth, and what its status may be."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pondwatch.core.appearance import FILLED, HOLLOW, OTHER
from pondwatch.core.decision import Vocabulary
from pondwatch.core.evidence import gather
from pondwatch.core.frames import image_to_pond, pond_to_image
from pondwatch.core.hypotheses import Reach, explained, one_rod
from pondwatch.core.noise import NoiseModel
from pondwatch.core.observe import RodsFound
from pondwatch.core.placement import Placing, doubted, starts
from pondwatch.core.values import Status
from pondwatch.simulator.spec import SimulationSpec
from tests.core.ponds import CAMERA, inspected

NOISE = NoiseModel(0.01, 0.1)


@pytest.fixture(scope="module")
def pond():
    return inspected(SimulationSpec(snapshots=60), 4)


@pytest.fixture(scope="module")
def evidence(pond):
    pitch = pond.setting.layout.pitch
    return [gather(s, Reach(0.6 * pitch, 0.3), pond.setting) for s in pond.snapshots]


@pytest.fixture(scope="module")
def kinds(pond):
    return np.select([pond.fills == 0, pond.fills == 1], [HOLLOW, FILLED], OTHER)


@pytest.fixture(scope="module")
def profile(pond, evidence, kinds):
    return Placing(pond.setting).teaching.learn(evidence, list(_off(pond)), np.ones(len(evidence)), kinds, None)


def _off(pond, seed=0):
    """(N, 3): the true poses, off by half a pixel or so."""
    rng = np.random.default_rng(seed)
    m = pond.inspection.camera.metres_per_pixel
    return pond.truth + rng.uniform(-1, 1, pond.truth.shape) * [0.6 * m, 0.6 * m, 0.006]


@pytest.fixture(scope="module")
def placed(pond, evidence, kinds, profile):
    """Those that show two rods or more, refined from poses that are off by half a pixel."""
    placing = Placing(pond.setting)
    return {
        i: placing.place(evidence[i], pose, 0.999, kinds, profile, NOISE)
        for i, pose in enumerate(_off(pond, 1))
        if pond.views()[i].sum() >= 2
    }


def test_a_place_is_refined_to_a_hundredth_of_a_pixel(pond, placed):
    m = pond.inspection.camera.metres_per_pixel

    error = [np.hypot(*(p.pose - pond.truth[i])[:2]) / m for i, p in placed.items()]

    assert len(error) > 15
    assert np.median(error) < 0.012
    assert max(error) < 0.1
    assert all(p.fitted and p.trust == 0.999 for p in placed.values())


def test_refined_poses_lie_within_three_of_their_sigmas(pond, placed):
    off = np.array([p.pose - pond.truth[i] for i, p in placed.items()])
    covariance = np.array([p.covariance for p in placed.values()])

    sigma = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))

    assert (np.abs(off) < 3 * sigma).mean() > 0.98
    assert (np.linalg.eigvalsh(covariance / covariance.max()) > 0).all()
    np.testing.assert_allclose(covariance, covariance.transpose(0, 2, 1), atol=1e-15)


def test_what_is_read_at_a_refined_pose_is_of_the_rods_wholly_in_view(pond, placed):
    surely, perhaps = pond.views(margin_px=0.5), pond.views(margin_px=-0.5)

    for i, p in placed.items():
        assert set(np.flatnonzero(surely[i])) <= set(p.rods) <= set(np.flatnonzero(perhaps[i]))
        assert len(p.ratio) == len(p.rods)


def test_a_pose_that_lies_a_third_of_a_pitch_off_is_not_borne_out(pond, evidence, kinds, profile):
    placing, pitch = Placing(pond.setting), pond.setting.layout.pitch
    some = [i for i, seen in enumerate(pond.views()) if seen.sum() >= 2][:6]

    wrong = [placing.place(evidence[i], pond.truth[i] + [pitch / 3, 0, 0], 0.999, kinds, profile, NOISE) for i in some]

    assert sum(p.trust < 0.99 or p.residual > 2 * 8 for p in wrong) >= len(wrong) - 1


def test_where_one_round_rod_is_all_that_is_seen_the_heading_stays_as_unsure_as_it_came(pond, evidence, kinds, profile):
    views, near = pond.views(), pond.views(margin_px=-25)
    lone = [i for i in range(len(views)) if views[i].sum() == 1 and near[i].sum() == 1]
    placing = Placing(pond.setting)

    assert lone
    for i in lone:
        p = placing.place(evidence[i], pond.truth[i], 0.999, kinds, profile, NOISE)

        assert p.trust < 0.99
        assert 0.03 < np.sqrt(p.covariance[2, 2]) < 0.2


def test_without_a_place_there_is_no_pose(pond, evidence, kinds, profile):
    nowhere = Placing(pond.setting).place(evidence[0], None, 0.4, kinds, profile, NOISE)

    assert nowhere.pose is None
    assert len(nowhere.rods) == 0


def test_a_pose_is_placed_above_the_threshold_and_uncertain_below_it(pond, placed):
    placing, sure = Placing(pond.setting), next(iter(placed.values()))

    high = placing.corrected(replace(sure, trust=0.999), 0.99, NOISE)
    low = placing.corrected(replace(sure, trust=0.7), 0.99, NOISE)

    assert (high.status, low.status) == (Status.PLACED, Status.UNCERTAIN)
    assert high.log_odds == pytest.approx(np.log(0.999 / 0.001))
    np.testing.assert_array_equal(high.pose_pond, sure.pose)
    np.testing.assert_array_equal(low.pose_pond, sure.pose)
    assert low.sigma_xy_m == pytest.approx(np.sqrt(0.3) * NOISE.sigma_xy_m, rel=0.05)  # it may lie elsewhere


def test_without_a_place_the_noisy_pose_stands_as_unsure_as_it_came(pond, evidence, kinds, profile):
    placing = Placing(pond.setting)

    said = placing.corrected(placing.place(evidence[0], None, 0.4, kinds, profile, NOISE), 0.99, NOISE)

    assert said.status is Status.UNCERTAIN
    np.testing.assert_array_equal(said.pose_pond, pond.snapshots[0].pose_pond)
    assert (said.sigma_xy_m, said.sigma_theta_rad) == pytest.approx((NOISE.sigma_xy_m, NOISE.sigma_theta_rad))


def test_pixels_that_misfit_lower_the_trust_and_never_raise_it(placed):
    good = next(iter(placed.values()))

    assert doubted(good, good.residual * 1.1).trust == good.trust
    assert doubted(good, good.residual * 0.9).trust <= 0.9
    assert doubted(replace(good, trust=0.3), good.residual * 0.9).trust == 0.3


def test_hollow_and_filled_rods_look_alike_outside_and_differ_inside(pond, profile):
    inner, outer = pond.setting.band.inner_px, pond.setting.band.outer_px
    contrast = np.ptp(profile.value)

    hollow, filled = profile.value[:, : int(2 * 0.6 * inner)]
    assert np.abs(hollow - filled).min() > 0.25 * contrast
    beyond = profile.value[:, int(2 * (profile.outside_px + 1)) : int(2 * profile.reach_px)]
    assert np.abs(beyond[0] - beyond[1]).max() < 0.15 * contrast
    assert inner < profile.outside_px < outer + 3


def test_which_profile_a_rod_follows_is_what_its_state_is_sure_to_be(pond, evidence):
    vocabulary = Vocabulary.learn(evidence, pond.setting)
    count = len(vocabulary.states)
    state = np.full((4, count), 0.01)
    state[0, 0] = state[1, 1] = state[2, 2] = 0.97
    state[3] = 1 / count

    assert Placing(pond.setting).kinds(vocabulary, state).tolist() == [HOLLOW, FILLED, OTHER, OTHER]


def _found(*support):
    """Rods found beside each other, with such a share in view."""
    centres = np.array([[50.0 + 20 * n, 40.0] for n in range(len(support))])
    support = np.array(support)
    return RodsFound(centres, np.full(len(support), 0.9), support, np.zeros((1, 1), np.float32), 20, 0.9)


def test_two_rods_in_full_view_fix_the_heading_so_there_is_one_start():
    pose = np.array([0.2, 0.3, 0.5])

    (start,) = starts(pose, pose, _found(1.0, 1.0), CAMERA, NOISE)

    np.testing.assert_array_equal(start, pose)


def test_in_haste_one_rod_alone_leaves_the_place_in_doubt_and_two_do_not(pond, evidence, kinds, profile):
    placing = Placing(pond.setting)
    hasty = [placing.place(e, t, 0.999, kinds, profile, NOISE, True) for e, t in zip(evidence, pond.truth, strict=True)]
    alone = [
        one_rod(explained(e.found, t, pond.setting.layout, CAMERA)) for e, t in zip(evidence, pond.truth, strict=True)
    ]

    assert any(alone)
    assert all(p.trust <= 0.9 for p, one in zip(hasty, alone, strict=True) if one)
    assert np.mean([p.trust == 0.999 for p, one in zip(hasty, alone, strict=True) if not one]) > 0.9
    assert all(p.hasty for p in hasty)


def test_a_ring_where_the_layout_has_no_rod_fixes_no_heading(pond):
    layout, camera = pond.setting.layout, pond.setting.camera
    pose = np.array([*layout.centres[0], 0.3])
    rod, other = pond_to_image(layout.centres[[0, 1]], pose, camera)
    seen = replace(_found(1.0, 1.0), centres_px=np.array([rod, rod + (other - rod) / 2]))

    assert not one_rod(seen)
    assert one_rod(explained(seen, pose, layout, camera))
    np.testing.assert_array_equal(explained(seen, pose, layout, camera).centres_px, [rod])
    assert len(starts(pose, pose, explained(seen, pose, layout, camera), camera, NOISE)) > 1


def test_about_one_rod_alone_every_heading_that_the_noisy_one_allows_is_a_start():
    pose, prior, found = np.array([0.2, 0.3, 0.5]), np.array([0.2, 0.3, 0.45]), _found(1.0, 0.35)

    several = starts(pose, prior, found, CAMERA, NOISE)

    headings = sorted(s[2] for s in several)
    assert headings[0] == pytest.approx(0.45 - 0.3)
    assert headings[-1] == pytest.approx(0.45 + 0.3)
    assert np.diff(headings).max() < 0.06
    there = image_to_pond(found.centres_px[0], pose, CAMERA)
    for s in several:
        np.testing.assert_allclose(image_to_pond(found.centres_px[0], s, CAMERA), there, atol=1e-12)
