"""A joint decision in a forked child is the one that a thread would make, and costs its worker nothing."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest

from pondwatch.core.corrector import Deliberates
from pondwatch.core.images import decode
from pondwatch.core.lattice import LatticeCorrector
from pondwatch.core.values import Snapshot
from pondwatch.jobs.thought import ForkThought, ThreadThought, dumps, loads
from pondwatch.simulator.simulation import Simulation
from pondwatch.simulator.spec import SimulationSpec

WAIT_S = 60


class Mind:
    """Decides what it is told to. `open_files` counts what its process keeps open."""

    def __init__(self, decide: Callable[[], Any]) -> None:
        self._decide, self.kept = decide, [np.arange(3)]

    def beside(self) -> None:
        """Decisions are made beside in any case."""

    def due(self) -> bool:
        return True

    def held(self) -> Sequence[object]:
        return self.kept

    def deliberate(self) -> Any:
        return self._decide()

    def adopt(self, deliberation: Any, /) -> Any:
        return deliberation

    @property
    def behind(self) -> bool:
        return False

    def catch_up(self, most: int) -> Any:
        raise AssertionError("there is nothing to catch up with")


def decided(mind: Deliberates) -> Any:
    return ForkThought(mind).result()


def test_a_child_decides_as_a_thread_does_to_the_last_digit() -> None:
    simulation = Simulation(SimulationSpec(snapshots=30), seed=5)
    camera = simulation.inspection.camera
    snapshots = [Snapshot(s.key, s.captured_s, s.pose_pond, decode(s.content, camera)) for s in simulation]
    beside, forked = (LatticeCorrector(simulation.inspection) for _ in range(2))
    for corrector, begin in ((beside, ThreadThought), (forked, ForkThought)):
        corrector.add(snapshots[:20])
        corrector.add(snapshots[20:])
        corrector.adopt(begin(corrector).result())

    for key, pose in beside.poses().items():
        other = forked.poses()[key]
        assert (pose.status, pose.log_odds) == (other.status, other.log_odds)
        np.testing.assert_array_equal(pose.pose_pond, other.pose_pond)
    assert beside.rods() == forked.rods()


def test_a_decision_in_a_child_is_made_in_another_process() -> None:
    assert decided(Mind(os.getpid)) != os.getpid()


def test_what_the_worker_holds_is_named_and_not_sent() -> None:
    mind = Mind(lambda: mind.kept[0])

    assert decided(mind) is mind.kept[0]

    large = np.zeros(1 << 20)
    content = dumps({"picture": large}, [large])
    assert len(content) < 200
    assert loads(content, [large])["picture"] is large


def test_a_child_that_fails_or_dies_decides_nothing() -> None:
    def fail() -> None:
        raise ArithmeticError("the decision failed")

    assert decided(Mind(fail)) is None
    assert decided(Mind(lambda: os._exit(1))) is None


def test_a_child_keeps_nothing_open_by_which_the_worker_would_seem_alive() -> None:
    source, sink = os.pipe()
    thought = ForkThought(Mind(lambda: time.sleep(WAIT_S)))

    os.close(sink)

    assert os.read(source, 1) == b""  # the end of the file: nobody else holds the other end
    os.close(source)
    thought.drop()


def test_a_decision_that_nobody_waits_for_is_ended() -> None:
    began = time.monotonic()
    thought = ForkThought(Mind(lambda: time.sleep(WAIT_S)))

    thought.drop()

    assert thought.result() is None
    assert time.monotonic() - began < WAIT_S / 2


@pytest.mark.parametrize("size", [10, 1 << 22])
def test_an_answer_of_any_size_arrives_whole(size: int) -> None:
    assert decided(Mind(lambda: np.arange(size).sum())) == size * (size - 1) // 2
    assert (decided(Mind(lambda: np.arange(size))) == np.arange(size)).all()
