"""Worker processes: they answer, and are replaced when they die, hang or err."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Iterator
from typing import Any

import pytest

from pondwatch.jobs import lanes
from pondwatch.jobs.lanes import ProcessLane, TaskFailed, WorkerLost, lane_of


@pytest.fixture
def lane() -> Iterator[ProcessLane]:
    made = ProcessLane(timeout_s=30)
    yield made
    made.close()


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
    first = lane.worker
    os.kill(first, signal.SIGKILL)

    with pytest.raises(WorkerLost):
        call_often(lane)

    assert lane.call("forget", "s1") is None
    assert lane.worker != first


def test_a_lane_that_found_no_room_for_a_new_worker_tries_again(lane: ProcessLane, monkeypatch: Any) -> None:
    def refuse() -> None:
        raise OSError("no room for a process")

    os.kill(lane.worker, signal.SIGKILL)
    with monkeypatch.context() as patched:
        patched.setattr(lanes, "context", refuse)
        with pytest.raises(OSError, match="no room"):
            call_often(lane)

    with pytest.raises(WorkerLost):
        lane.call("forget", "s1")
    assert lane.call("forget", "s1") is None


@pytest.mark.parametrize("said", [b"", b"more than a pipe holds" * 100_000])
def test_a_worker_that_does_not_answer_or_listen_is_replaced(said: bytes) -> None:
    lane = ProcessLane(timeout_s=2.0)
    first = lane.worker
    assert lane.call("forget", "s1") is None
    os.kill(first, signal.SIGSTOP)

    began_s = time.monotonic()
    with pytest.raises(WorkerLost, match="in time"):
        lane.call("forget", said)

    assert time.monotonic() - began_s < 10.0
    assert lane.worker != first
    assert lane.call("forget", "s1") is None
    lane.close()


def test_a_lane_that_is_closed_lets_go_of_whoever_waits_for_it(lane: ProcessLane) -> None:
    os.kill(lane.worker, signal.SIGSTOP)
    closing = threading.Timer(0.2, lane.close)
    closing.start()

    with pytest.raises(WorkerLost):
        lane.call("forget", "s1")

    closing.join()
    with pytest.raises(WorkerLost):
        lane.call("forget", "s1")


def test_a_worker_does_not_hear_the_interrupt_that_stops_the_server(lane: ProcessLane) -> None:
    assert lane.call("forget", "s1") is None  # it is up
    os.kill(lane.worker, signal.SIGINT)

    assert lane.call("forget", "s1") is None


def test_a_session_keeps_to_its_lane() -> None:
    lanes = [lane_of(f"session-{i}", 4) for i in range(200)]

    assert set(lanes) == {0, 1, 2, 3}
    assert lanes == [lane_of(f"session-{i}", 4) for i in range(200)]
