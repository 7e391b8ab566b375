"""A whole bundle corrected, on one core or on more."""

from __future__ import annotations

import numpy as np
import pytest

from pondwatch.basestation.bundle import Bundle
from pondwatch.basestation.correcting import correct_bundle
from pondwatch.jobs import spreading
from pondwatch.simulator.bundle import write_bundle
from pondwatch.simulator.simulation import Simulation
from pondwatch.simulator.spec import SimulationSpec


@pytest.fixture(scope="module")
def simulated(tmp_path_factory):
    """A simulated inspection, some poses grossly wrong, one picture cut short."""
    root = tmp_path_factory.mktemp("simulated") / "bundle"
    write_bundle(Simulation(SimulationSpec(snapshots=60, outliers=0.1), 3), root)
    broken = sorted(root.glob("snapshots/*"))[55]
    broken.write_bytes(broken.read_bytes()[:400])
    return root


def test_a_result_is_the_same_to_the_last_digit_on_one_core_and_on_more(simulated, monkeypatch):
    def corrected(cores):
        monkeypatch.setattr(spreading, "cores", lambda: cores)
        with Bundle(simulated) as bundle:
            return correct_bundle(bundle)

    one, three = corrected(1), corrected(3)

    assert [(p.key, p.status, p.log_odds) for p in one.poses] == [(p.key, p.status, p.log_odds) for p in three.poses]
    for a, b in zip(one.poses, three.poses, strict=True):
        np.testing.assert_array_equal(a.pose_pond, b.pose_pond)
        np.testing.assert_array_equal(a.covariance, b.covariance)
    assert one.rods == three.rods
    np.testing.assert_array_equal(one.mosaic, three.mosaic)
    assert one.faults == three.faults
    assert ["000055" in fault for fault in one.faults] == [True]
