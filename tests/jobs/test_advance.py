"""Steps of a session: one revision each, the same however they were cut off, and nothing stopped by a bad snapshot."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from pondwatch.core.errors import Unavailable
from pondwatch.core.values import Quality, RodReading, RodState
from pondwatch.jobs.advance import SOON, commit
from pondwatch.jobs.lanes import WorkerLost
from pondwatch.jobs.steps import STEP_LIMIT
from pondwatch.jobs.tasks import Outcome
from pondwatch.store import revisions
from tests.fakes.house import House
from tests.fakes.robot import Shot


@pytest.fixture
def house(tmp_path: Path) -> Iterator[House]:
    made = House(tmp_path)
    yield made
    made.store.close()


def test_many_uploads_become_one_revision(house: House) -> None:
    house.send(*(Shot(i) for i in range(5)))

    assert house.take() is False

    assert (house.found().revision, house.facts().placed, house.facts().pending) == (1, 5, 0)
    assert [step.covered for step in house.heard.steps] == [5]
    assert (house.job("advance")["state"], house.job("advance")["progress"]) == ("done", 1.0)


def test_a_backlog_is_taken_in_bounded_steps(house: House) -> None:
    house.send(*(Shot(i) for i in range(STEP_LIMIT + 3)))

    assert house.take() is True
    assert house.job("advance")["state"] == "running"
    assert house.take() is False

    assert [(s.covered, s.left) for s in house.heard.steps] == [(STEP_LIMIT, 3), (3, 0)]


def test_fewer_than_a_backlog_are_shown_a_few_at_a_time(house: House) -> None:
    house.send(*(Shot(i) for i in range(STEP_LIMIT - 1)))

    while house.take():
        pass

    assert {s.covered for s in house.heard.steps[:-1]} == {SOON}
    assert sum(s.covered for s in house.heard.steps) == STEP_LIMIT - 1


def test_a_step_without_work_writes_nothing(house: House) -> None:
    assert house.take() is False

    assert house.found().revision == 0


def test_a_worker_that_is_lost_between_steps_changes_nothing_of_the_result(house: House, tmp_path: Path) -> None:
    calm = House(tmp_path / "calm")
    for start in range(0, 12, 3):
        for each in (house, calm):
            each.send(*(Shot(i) for i in range(start, start + 3)))
            each.drain()
        house.lane.lose()

    assert house.lane.calls.count("load") == 4
    assert calm.lane.calls.count("load") == 1  # the first step of all
    assert house.result() == calm.result()
    house.finish()
    calm.finish()
    assert house.result() == calm.result()
    calm.store.close()


def test_a_step_whose_commit_failed_is_taken_again_to_the_same_end(house: House, monkeypatch: Any) -> None:
    house.send(Shot(0))
    house.drain()
    house.send(Shot(1))
    honest = house.store.write

    def full(unit: Any) -> Any:
        raise Unavailable("The disk is away.")

    monkeypatch.setattr(house.store, "write", full)
    with pytest.raises(Unavailable):
        house.take()
    monkeypatch.setattr(house.store, "write", honest)
    assert (house.found().revision, house.facts().pending) == (1, 1)

    house.drain()

    assert (house.found().revision, house.facts().placed) == (2, 2)
    corrected = [call for call in house.lane.calls if call != "draw"]
    assert corrected == ["advance", "load", "advance", "advance", "advance", "load", "advance"]


def test_the_final_result_does_not_depend_on_the_order_of_arrival(tmp_path: Path) -> None:
    shots = [Shot(i, f"bubble-{i % 3}") for i in range(20)]
    results = []
    for name, order in (("a", shots), ("b", shots[::-1]), ("c", shots[7:] + shots[:7])):
        each = House(tmp_path / name)
        for start in range(0, 20, 6):
            each.send(*order[start : start + 6])
            each.drain()
        each.finish()
        results.append(each.result())
        each.store.close()

    assert results[0] == results[1] == results[2]


def poison(sequence: int) -> Any:
    """A fault that kills the worker whenever it is shown this snapshot."""

    def fault(method: str, args: tuple[Any, ...]) -> None:
        if method == "advance" and any(ref.key.sequence == sequence for ref in args[2]):
            raise WorkerLost("The worker process was lost.")

    return fault


def test_a_snapshot_that_kills_three_workers_is_rejected_and_the_session_goes_on(house: House) -> None:
    house.lane.fault = poison(4)
    house.send(*(Shot(i) for i in range(10)))

    house.drain()

    facts = house.facts()
    assert (facts.placed, facts.rejected, facts.pending) == (9, 1, 0)
    assert [pose[1] for pose in house.poses() if pose[2] == "rejected"] == [4]
    rows = house.store.read(lambda c: revisions.pose_rows(c, house.session))
    assert [r["fault"] for r in rows if r["fault"]] == ["The worker process was lost."]
    house.lane.lose()  # it is not shown to the next worker either
    house.finish()
    assert house.found().state == "finished"
    assert house.facts().rejected == 1


def test_a_blob_that_was_damaged_on_the_disk_rejects_its_snapshot_alone(house: House) -> None:
    house.send(Shot(0), Shot(1))
    path = house.store.blobs.path(Shot(1).digest)
    path.write_bytes(path.read_bytes()[:-1] + b"\0")

    house.drain()

    assert [(p[1], p[2]) for p in house.poses()] == [(0, "placed"), (1, "rejected")]


def test_a_blob_that_is_damaged_later_is_rejected_when_it_is_read_again(house: House) -> None:
    house.send(Shot(0), Shot(1))
    house.drain()
    house.store.blobs.path(Shot(1).digest).write_bytes(b"")
    house.lane.lose()

    house.finish()

    assert [(p[1], p[2]) for p in house.poses()] == [(0, "placed"), (1, "rejected")]
    alone = House(house.store.blobs.path("00").parents[2] / "alone")
    alone.send(Shot(0))
    alone.finish()
    assert house.result()[1] == alone.result()[1]  # nothing of it is left in the mosaic
    alone.store.close()


def test_a_session_that_cannot_be_settled_says_so_and_may_be_finished_again(house: House) -> None:
    def fault(method: str, args: tuple[Any, ...]) -> None:
        if method == "settle":
            raise WorkerLost("The worker process was lost.")

    house.send(Shot(0))
    house.lane.fault = fault

    house.finish()

    assert house.found().state == "failed"
    job = house.job("finish")
    assert (job["state"], job["attempts"], job["error"]) == ("failed", 3, "The worker process was lost.")
    house.lane.fault = None
    house.finish()
    assert (house.found().state, house.job("finish")["state"]) == ("finished", "done")


def test_a_session_that_cannot_be_taken_up_keeps_its_snapshots_waiting(house: House) -> None:
    def fault(method: str, args: tuple[Any, ...]) -> None:
        if method == "load":
            raise WorkerLost("The worker process was lost.")

    house.lane.fault = fault
    house.send(Shot(0))

    house.drain()

    assert (house.facts().pending, house.facts().rejected) == (1, 0)
    assert house.job("advance")["state"] == "failed"


def test_the_same_snapshot_from_many_threads_is_stored_once(house: House) -> None:
    with ThreadPoolExecutor(8) as threads:
        list(threads.map(lambda _: house.send(Shot(7)), range(16)))

    assert house.facts().snapshots == 1


def test_a_state_that_is_shown_changes_in_the_store_only_where_looks_agree(house: House) -> None:
    def shown(now: RodReading) -> tuple[str, float]:
        session = house.found()
        outcome = Outcome((), (now,), Quality(0, 0, 0, 0), (), (), 0.0)
        commit(house.store, session, (), outcome, 1)
        row = house.store.read(lambda c: revisions.readings_of(c, session.id, ["R0"]))["R0"]
        return row["state"], row["confidence"]

    assert shown(RodReading("R0", RodState.EMPTY, 0.0, 0.9, 1)) == ("empty", 0.9)
    assert shown(RodReading("R0", RodState.FULL, 1.0, 0.7, 2)) == ("empty", pytest.approx(0.3))
    assert shown(RodReading("R0", RodState.FULL, 1.0, 0.8, 3)) == ("full", 0.8)
