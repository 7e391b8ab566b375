"""The method `identity`: the poses as they came, bit by bit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pondwatch.core.identity import IdentityCorrector
from pondwatch.core.values import Inspection, PoseNoise, RodState, Snapshot, SnapshotKey, Status
from tests.core.ponds import CAMERA, METRES, hexagonal, pond_of

INSPECTION = Inspection("", CAMERA, pond_of(hexagonal(3, 3, 48 * METRES)), PoseNoise(0.01, 0.2))
BLANK = np.zeros((110, 160, 3), np.uint8)
SNAPSHOTS = [Snapshot(SnapshotKey("bubble-1", 0, n), 0.0, np.array([0.1 * n, 0.2, -3.0]), BLANK) for n in range(4)]


def test_every_pose_is_the_one_that_came_and_as_sure_as_the_localisation_claims():
    corrector = IdentityCorrector(INSPECTION)

    said = corrector.add(SNAPSHOTS)

    assert [p.key for p in said.poses] == [s.key for s in SNAPSHOTS]
    for pose, snapshot in zip(said.poses, SNAPSHOTS, strict=True):
        np.testing.assert_array_equal(pose.pose_pond, snapshot.pose_pond)
        assert pose.status is Status.PLACED
        np.testing.assert_allclose([pose.sigma_xy_m, pose.sigma_theta_rad], [0.01, 0.2])


def test_where_the_localisation_claims_nothing_no_spread_is_made_up():
    corrector = IdentityCorrector(replace(INSPECTION, pose_noise=None))

    (pose,) = corrector.add(SNAPSHOTS[:1]).poses

    assert pose.sigma_xy_m == 0


def test_settling_moves_nothing():
    corrector = IdentityCorrector(INSPECTION)
    corrector.add(SNAPSHOTS[:2])
    corrector.add(SNAPSHOTS[2:])

    said = corrector.settle()

    assert (said.poses, said.rods) == ((), ())
    assert set(corrector.poses()) == {s.key for s in SNAPSHOTS}
    assert (said.quality.snapshots, said.quality.placed, said.quality.uncertain) == (4, 4, 0)
    assert "nothing was corrected" in said.quality.sentence


def test_no_rod_is_read():
    corrector = IdentityCorrector(INSPECTION)
    corrector.add(SNAPSHOTS)

    assert [r.rod_id for r in corrector.rods()] == [r.id for r in INSPECTION.pond.rods]
    assert {r.state for r in corrector.rods()} == {RodState.UNSEEN}
