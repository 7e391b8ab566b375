"""A joint decision that was made beside is taken over a little at a time."""

from __future__ import annotations

import numpy as np

from pondwatch.core.lattice import LatticeCorrector
from pondwatch.simulator.spec import SimulationSpec
from tests.core.ponds import inspected

SMALL = SimulationSpec(snapshots=44)
SEED = 5


def test_after_a_decision_beside_what_came_since_and_the_rods_follow_to_where_they_had_come_at_once():
    pond = inspected(SMALL, SEED)
    slow, quick = LatticeCorrector(pond.inspection), LatticeCorrector(pond.inspection)
    for corrector in (slow, quick):
        corrector.beside()
        corrector.add(pond.snapshots[:20])
        thought = corrector.deliberate()
        corrector.add(pond.snapshots[20:30])
        corrector.adopt(thought)
    before, steps = slow.rods(), 0

    quick.catch_up(1000)
    while slow.behind:
        slow.catch_up(3)
        steps += 1

    assert not quick.behind
    assert steps >= 4
    assert slow.rods() == quick.rods() != before
    for key, pose in quick.poses().items():
        np.testing.assert_array_equal(slow.poses()[key].pose_pond, pose.pose_pond)
        assert slow.poses()[key].status == pose.status
