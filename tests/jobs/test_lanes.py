"""Worker processes: they answer, and are replaced when they die, hang or err."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator

import pytest

from pondwatch.jobs.lanes import ProcessLane, TaskFailed, WorkerLost, lane_of


@pytest.fixture
def lane() -> Iterator[ProcessLane]:
    made = ProcessLane(timeout_s=30)
    yield made
    made.close()


def worker_of(lane: ProcessLane) -> int:
    return lane._started.result(30)


def call_often(lane: ProcessLane) -> None:
    """A signal takes a moment."""
    for _ in range(100):
        lane.call("forget", "s1")


def test_a_worker_answers_and_says_what_went_wrong(lane: ProcessLane) -> None:
    assert lane.call("advance", "s1", 0, ()) is None  # it holds no such session
    with pytest.raises(TaskFailed, match="AttributeError"):
        lane.call("nosuch")
    assert lane.call("forget", "s1") is None


def test_a_worker_that_died_is_replaced(lane: ProcessLane) -> None:
    first = worker_of(lane)
    os.kill(first, signal.SIGKILL)

    with pytest.raises(WorkerLost):
        call_often(lane)

    assert lane.call("forget", "s1") is None
    assert worker_of(lane) != first


def test_a_worker_that_does_not_answer_is_replaced() -> None:
    lane = ProcessLane(timeout_s=30)
    first = worker_of(lane)
    os.kill(first, signal.SIGSTOP)
    lane._timeout_s = 0.2

    with pytest.raises(WorkerLost):
        lane.call("forget", "s1")

    lane._timeout_s = 30
    assert lane.call("forget", "s1") is None
    lane.close()


def test_a_worker_does_not_hear_the_interrupt_that_stops_the_server(lane: ProcessLane) -> None:
    os.kill(worker_of(lane), signal.SIGINT)

    assert lane.call("forget", "s1") is None


def test_a_session_keeps_to_its_lane() -> None:
    lanes = [lane_of(f"session-{i}", 4) for i in range(200)]

    assert set(lanes) == {0, 1, 2, 3}
    assert lanes == [lane_of(f"session-{i}", 4) for i in range(200)]
