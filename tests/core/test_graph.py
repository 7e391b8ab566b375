"""The method `graph` on floors drawn for it: no jump that is called placed, sub-pixel poses, honest when unsure."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pondwatch.core.atlas import Atlas
from pondwatch.core.graph import GraphCorrector
from pondwatch.core.registration import make_view
from pondwatch.core.values import Inspection, Rod, RodState, Snapshot, Status
from tests.core.floors import SCALE, aligned_errors_px, inspect

GROSS_PX = 5.0


def _settled(swarm, snapshots=None):
    """What is settled does not depend on what was placed before it, so nothing is."""
    corrector = GraphCorrector(swarm.inspection)
    corrector.hold(swarm.snapshots if snapshots is None else snapshots)
    corrector.settle()
    return corrector


def _figures(corrector, swarm):
    """Errors (N,) px after alignment of the placed ones, and who is placed."""
    poses = [corrector.poses()[s.key] for s in swarm.snapshots]
    placed = np.array([p.status is Status.PLACED for p in poses])
    found = np.array([p.pose_pond for p in poses])
    return aligned_errors_px(found[placed], swarm.truth[placed]), placed


def _long(*values):
    return pytest.param(*values, marks=[pytest.mark.long])


@pytest.mark.parametrize(
    ("kind", "seed", "options", "median_px"),
    [
        ("rows", 2, {}, 0.05),
        ("mud", 3, {}, 0.3),
        ("gravel", 4, {"murk": 0.6, "noise": 4.0}, 0.1),
        ("gravel", 5, {"sigma_px": 38.0, "sigma_rad": 0.15, "claimed": 0.3}, 0.05),
        _long("gravel", 1, {}, 0.05),
        _long("gravel", 6, {"claimed": 0.3}, 0.05),
        _long("rows", 7, {"claimed": None}, 0.05),
    ],
)
def test_snapshots_of_an_unmapped_floor_fit_together_to_a_fraction_of_a_pixel(kind, seed, options, median_px):
    swarm = inspect(kind, seed, 24, pond_px=(300, 220), **options)

    corrector = _settled(swarm)

    error, placed = _figures(corrector, swarm)
    assert placed.mean() >= 0.95
    assert (error > GROSS_PX).sum() == 0
    assert np.median(error) < median_px
    assert "repeats itself" not in corrector.quality().sentence
    facts = corrector.quality().facts
    assert facts["cycles"] > 20
    assert facts["cycle_sum_largest_px"] < 1


@pytest.mark.parametrize(("kind", "seed"), [("rods", 8), _long("tiles", 9)])
def test_on_a_floor_that_repeats_no_jump_is_called_placed_and_the_operator_is_told(kind, seed):
    swarm = inspect(kind, seed, 16, pond_px=(260, 200))

    corrector = _settled(swarm)

    error, placed = _figures(corrector, swarm)
    assert placed.sum() < 3 or (error > GROSS_PX).sum() == 0
    assert "repeats itself" in corrector.quality().sentence


def test_a_floor_without_any_texture_is_said_to_be_unsolved():
    swarm = inspect("gravel", 10, 12)
    blank = [dataclasses.replace(s, image=np.full_like(s.image, 90)) for s in swarm.snapshots]

    corrector = _settled(swarm, blank)

    assert {p.status for p in corrector.poses().values()} == {Status.UNCERTAIN}
    for snapshot in blank:
        np.testing.assert_allclose(corrector.poses()[snapshot.key].pose_pond, snapshot.pose_pond, atol=1e-9)


def test_errors_lie_within_three_sigma_of_what_is_reported_frame_included():
    inside = []
    for seed in range(3):
        swarm = inspect("gravel", 20 + seed, 16, pond_px=(260, 200))
        poses = _settled(swarm).poses()
        for snapshot, truth in zip(swarm.snapshots, swarm.truth, strict=True):
            pose = poses[snapshot.key]
            inside.append(np.hypot(*(pose.pose_pond - truth)[:2]) <= 3 * np.sqrt(2) * pose.sigma_xy_m)

    assert np.mean(inside) >= 0.98


def test_settling_forgets_the_order_of_arrival_and_what_was_placed_before():
    swarm = inspect("rows", 11, 14, pond_px=(240, 190))
    there = _settled(swarm)
    back = GraphCorrector(swarm.inspection)
    for snapshot in swarm.snapshots[::-1]:
        back.add([snapshot])
    back.settle()

    for key, pose in there.poses().items():
        np.testing.assert_array_equal(pose.pose_pond, back.poses()[key].pose_pond)
        np.testing.assert_array_equal(pose.covariance, back.poses()[key].covariance)


def test_snapshots_added_one_by_one_are_placed_at_once_and_every_move_is_told():
    swarm = inspect("gravel", 12, 30, pond_px=(300, 220))
    corrector = GraphCorrector(swarm.inspection)
    heard = {}
    for snapshot in swarm.snapshots:
        heard |= {p.key: p for p in corrector.add([snapshot]).poses}

    error, placed = _figures(corrector, swarm)
    assert placed.mean() > 0.85
    assert (error > GROSS_PX).sum() == 0
    assert heard == dict(corrector.poses())


@pytest.mark.parametrize(("off_px", "moves"), [(5.4, False), (5.6, True)])
def test_live_a_group_is_laid_anew_only_where_the_noisy_poses_ask_for_a_good_share_of_what_they_know(off_px, moves):
    atlas = Atlas((160, 110), np.array([20.0, 20.0, 0.1]))
    for x, y in ((100, 0), (-100, 0), (0, 100), (0, -100)):
        atlas.take(make_view(np.zeros((110, 160, 3), np.uint8)), np.array([x, y, 0.0]))
    atlas.group[:] = 0
    atlas.poses[:, 0] += off_px
    before = atlas.poses.copy()
    # the middle is known to 20 / sqrt(4) = 10 px; the heading to 1 / sqrt(4 / 0.1^2 + 4 x 100^2 / 20^2) = 0.0447 rad,
    # 4.47 px at 100 px; together 10.95 px, half of which is 5.48
    atlas.frame_slack_sigmas = 0.5

    atlas.realign(0)

    assert (atlas.poses != before).any() == moves


def test_a_grossly_wrong_noisy_pose_is_not_called_placed_where_it_came():
    swarm = inspect("gravel", 13, 30, pond_px=(300, 220))
    lost = swarm.snapshots[4]
    strayed = dataclasses.replace(lost, pose_pond=lost.pose_pond + [1000 * SCALE, 0, 0])
    snapshots = [strayed if s is lost else s for s in swarm.snapshots]

    corrector = _settled(swarm, snapshots)

    assert corrector.poses()[lost.key].status is Status.UNCERTAIN
    assert corrector.quality().placed == 29


def test_what_cannot_be_used_is_rejected_and_the_rest_goes_on():
    swarm = inspect("gravel", 14, 20, pond_px=(260, 200))
    small = dataclasses.replace(swarm.snapshots[3], image=np.zeros((20, 20, 3), np.uint8))
    nowhere = dataclasses.replace(swarm.snapshots[5], pose_pond=np.array([np.nan, 0, 0]))
    snapshots = [{3: small, 5: nowhere}.get(n, s) for n, s in enumerate(swarm.snapshots)]

    corrector = _settled(swarm, snapshots)

    rejected = {k for k, p in corrector.poses().items() if p.status is Status.REJECTED}
    assert rejected == {small.key, nowhere.key}
    assert all(corrector.poses()[k].pose_pond is None for k in rejected)
    assert "2 could not be used" in corrector.quality().sentence


def test_two_groups_that_share_nothing_are_not_both_placed():
    near, far = inspect("gravel", 15, 16, pond_px=(260, 200)), inspect("gravel", 16, 8, pond_px=(240, 190))
    moved = [
        Snapshot(dataclasses.replace(s.key, robot="far"), s.captured_s, s.pose_pond + [3.0, 0, 0], s.image)
        for s in far.snapshots
    ]

    corrector = _settled(near, [*near.snapshots, *moved])

    assert {corrector.poses()[s.key].status for s in moved} == {Status.UNCERTAIN}
    assert {corrector.poses()[s.key].status for s in near.snapshots} == {Status.PLACED}
    assert corrector.quality().facts["groups"] == 2


def test_the_noise_is_estimated_though_the_claim_is_wrong():
    swarm = inspect("gravel", 17, 20, pond_px=(260, 200), claimed=3.0)

    quality = _settled(swarm).quality()

    assert quality.sigma_xy_m == pytest.approx(19 * SCALE, rel=0.6)
    assert quality.sigma_xy_m < 2 * 19 * SCALE


def test_drifting_robots_count_as_fewer_independent_poses():
    swarm = inspect("gravel", 18, 30, pond_px=(260, 200), sigma_px=1.0)
    walk = np.cumsum(np.random.default_rng(0).normal(0, 4, (10, 2)), axis=0) * SCALE
    drifting = [
        dataclasses.replace(s, pose_pond=s.pose_pond + np.append(walk[s.key.sequence], 0)) for s in swarm.snapshots
    ]
    inspection = dataclasses.replace(swarm.inspection, pose_noise=None)

    def inflation(snapshots):
        corrector = GraphCorrector(inspection)
        corrector.hold(snapshots)
        corrector.settle()
        return corrector.quality().facts["poses_per_independent_error"]

    assert inflation(drifting) > 3
    assert inflation(swarm.snapshots) < 3


def test_rods_of_a_layout_stay_unseen():
    swarm = inspect("gravel", 1, 4)
    rod = Rod("R0", 0.1, 0.1, 0.01, 0.006)
    inspection: Inspection = dataclasses.replace(
        swarm.inspection, pond=dataclasses.replace(swarm.inspection.pond, rods=(rod,))
    )

    (reading,) = GraphCorrector(inspection).rods()

    assert (reading.rod_id, reading.state, reading.fill) == ("R0", RodState.UNSEEN, None)


def test_an_empty_session_settles_to_nothing():
    corrector = GraphCorrector(inspect("gravel", 1, 1).inspection)

    assert corrector.settle().poses == ()
    assert corrector.quality().sentence == "No snapshots yet."
