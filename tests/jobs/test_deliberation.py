"""Joint decisions are made beside the uploads: shown when they are ready, and none costs a snapshot."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest

from pondwatch.core.identity import IdentityCorrector
from pondwatch.core.values import CorrectedPose, Correction, Inspection, RodReading, RodState, SnapshotKey
from pondwatch.jobs import finish, held
from pondwatch.jobs.queue import Queue
from pondwatch.store import revisions
from pondwatch.store.sessions import State
from tests.fakes.house import House
from tests.fakes.robot import Shot

DECIDED_M, SETTLED_M = 0.001, 0.002  # how far x moves by a joint decision, and when all is settled
DUE = 3
WAIT_S = 30


@dataclass
class Mind:
    """How joint decisions go. begun: of how many snapshots each was. open: they may end. fails: they raise. follow: how
    often it takes to catch up with one; caught: how many snapshots each time may decide again."""

    begun: list[int] = field(default_factory=list)
    open: threading.Event = field(default_factory=threading.Event)
    fails: bool = False
    follow: int = 0
    caught: list[int] = field(default_factory=list)


class Ponderer(IdentityCorrector):
    """Moves all by DECIDED_M once there are DUE snapshots more than in the last joint decision, and reads one rod."""

    def __init__(self, inspection: Inspection, mind: Mind) -> None:
        super().__init__(inspection)
        self._mind, self._decided, self._is_read, self._left = mind, 0, False, 0

    def beside(self) -> None:
        """Decisions are made beside in any case."""

    def due(self) -> bool:
        return len(self._poses) >= self._decided + DUE

    def deliberate(self) -> list[SnapshotKey]:
        keys = list(self._poses)
        self._mind.begun.append(len(keys))
        assert self._mind.open.wait(WAIT_S)
        if self._mind.fails:
            raise ArithmeticError("the decision failed")
        return keys

    def held(self) -> list[object]:
        return []

    def adopt(self, deliberation: Sequence[SnapshotKey], /) -> Correction:
        self._decided, self._left, self._is_read = len(deliberation), self._mind.follow, not self._mind.follow
        return Correction(self._moved(deliberation, DECIDED_M), self.rods(), self.quality())

    @property
    def behind(self) -> bool:
        return self._left > 0

    def catch_up(self, most: int) -> Correction:
        self._left, self._is_read = self._left - 1, self._left == 1
        self._mind.caught.append(most)
        later = list(self._poses)[self._decided :][: 0 if self.behind else None]
        return Correction(self._moved(later, DECIDED_M), self.rods(), self.quality())

    def settle(self) -> Correction:
        return Correction(self._moved(list(self._poses), SETTLED_M), self.rods(), self.quality())

    def rods(self) -> tuple[RodReading, ...]:
        first, *others = super().rods()
        return (RodReading(first.rod_id, RodState.FULL, 1.0, 0.9, 1) if self._is_read else first, *others)

    def _moved(self, keys: Sequence[SnapshotKey], by_m: float) -> tuple[CorrectedPose, ...]:
        for key in keys:
            pose = self._poses[key].pose_pond
            assert pose is not None
            self._poses[key] = replace(self._poses[key], pose_pond=pose + np.array([by_m, 0, 0]))
        return tuple(self._poses[key] for key in keys)


@pytest.fixture
def mind() -> Iterator[Mind]:
    made = Mind()
    yield made
    made.open.set()


@pytest.fixture
def house(tmp_path: Path, mind: Mind, monkeypatch: pytest.MonkeyPatch) -> Iterator[House]:
    monkeypatch.setattr(held, "make_corrector", lambda inspection, *_: Ponderer(inspection, mind))
    made = House(tmp_path)
    yield made
    made.store.close()


def eventually(holds: Callable[[], bool]) -> bool:
    until = time.monotonic() + WAIT_S
    while not holds() and time.monotonic() < until:
        time.sleep(0.01)
    return holds()


def shifts(house: House) -> list[float]:
    """By how much each snapshot's x was corrected, m, in order of the sequence."""
    rows = house.store.read(lambda c: revisions.pose_rows(c, house.session))
    return [round(row["x_m"] - row["raw_x_m"], 6) for row in rows]


def states(house: House) -> dict[str, str]:
    rows = house.store.read(lambda c: revisions.rod_rows(c, house.session))
    return {row["rod_id"]: row["state"] for row in rows}


def until_quiet(house: House) -> None:
    """Look again until no decision is being made any more."""

    def is_quiet() -> bool:
        house.drain()
        return not house.steps.thinking(house.session)

    assert eventually(is_quiet)


def test_a_due_decision_is_begun_and_told_of_and_snapshots_are_shown_while_it_is_made(house: House, mind: Mind) -> None:
    house.send(*(Shot(i) for i in range(DUE)))
    house.drain()
    assert eventually(lambda: mind.begun == [DUE])
    assert house.steps.thinking(house.session)

    house.send(Shot(3), Shot(4))
    house.drain()

    assert (house.found().revision, house.facts().placed, mind.begun) == (2, 5, [DUE])  # none begun beside it
    assert shifts(house) == [0.0] * 5


def test_what_was_decided_is_a_later_revision_without_a_further_upload(house: House, mind: Mind) -> None:
    house.send(*(Shot(i) for i in range(DUE)))
    house.drain()
    house.send(Shot(3))
    house.drain()
    before = house.found()

    mind.open.set()
    until_quiet(house)

    assert house.found().revision == before.revision + 1
    assert house.heard.steps[-1].covered == 0
    assert len(house.heard.steps[-1].patches) > 0
    assert shifts(house) == [DECIDED_M] * DUE + [0.0]  # what came meanwhile was not in it
    assert states(house) == {"R0": "full"}


def test_what_came_meanwhile_follows_a_little_at_a_time_and_less_beside_new_snapshots(house: House, mind: Mind) -> None:
    mind.follow = 3
    house.send(*(Shot(i) for i in range(DUE)))
    house.drain()
    house.send(Shot(3))
    house.drain()
    mind.open.set()

    def is_taken_over() -> bool:
        if house.found().revision < 3:
            house.steps.take(house.lane, house.session)
        return house.found().revision == 3

    assert eventually(is_taken_over)
    assert states(house) == {}

    house.send(Shot(4))
    until_quiet(house)

    assert mind.caught == [held.AGAIN_BESIDE, held.AGAIN_AT_ONCE, held.AGAIN_AT_ONCE]
    assert shifts(house) == [DECIDED_M] * 5
    assert states(house) == {"R0": "full"}


def test_the_queue_looks_for_what_was_decided_by_itself(house: House, mind: Mind) -> None:
    queue = Queue(house.store, house.steps, [house.lane])
    house.send(*(Shot(i) for i in range(DUE)))
    queue.start()
    assert eventually(lambda: mind.begun == [DUE] and house.facts().placed == DUE)
    assert shifts(house) == [0.0] * DUE

    mind.open.set()

    assert eventually(lambda: shifts(house) == [DECIDED_M] * DUE)
    queue.close()
    assert house.found().revision == 2


def test_a_worker_lost_in_mid_decision_costs_no_snapshot_and_the_next_one_decides_anew(
    house: House, mind: Mind
) -> None:
    house.send(*(Shot(i) for i in range(DUE)))
    house.drain()

    house.lane.lose()
    house.drain()
    assert not house.steps.thinking(house.session)
    assert (house.found().revision, house.facts().placed) == (1, DUE)

    mind.open.set()
    house.send(Shot(3))
    house.drain()
    until_quiet(house)
    assert (house.facts().placed, house.facts().rejected, mind.begun) == (DUE + 1, 0, [DUE, DUE + 1])
    assert shifts(house) == [DECIDED_M] * (DUE + 1)


def test_a_decision_that_fails_costs_no_snapshot_and_is_not_tried_at_every_upload(house: House, mind: Mind) -> None:
    mind.fails = True
    mind.open.set()
    house.send(*(Shot(i) for i in range(DUE)))
    house.drain()
    until_quiet(house)
    house.send(*(Shot(i) for i in range(DUE, 3 * DUE)))
    house.drain()

    assert (house.facts().placed, house.facts().rejected, mind.begun) == (3 * DUE, 0, [DUE])
    assert shifts(house) == [0.0] * 3 * DUE
    house.finish()
    assert shifts(house) == [SETTLED_M] * 3 * DUE


def test_finishing_in_mid_decision_ends_with_what_is_settled_and_nothing_changes_it_later(
    house: House, mind: Mind
) -> None:
    house.send(*(Shot(i) for i in range(DUE)))
    house.drain()
    assert house.steps.thinking(house.session)

    finish.begin(house.store, house.session, 2_000)
    house.drain()

    ended = house.found()
    assert ended.state is State.FINISHED
    assert shifts(house) == [SETTLED_M] * DUE
    mind.open.set()
    until_quiet(house)
    assert (house.found().revision, shifts(house)) == (ended.revision, [SETTLED_M] * DUE)
    assert not house.steps.thinking(house.session)
