"""The watch over a session: what rings when, what is kept of it, and what survives a restart."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from pondwatch.core.alarmacts import Act
from pondwatch.core.errors import Conflict, Missing, StorageFull
from pondwatch.core.values import RodReading, RodState
from pondwatch.jobs import alarmfacts
from pondwatch.jobs.alarms import Deed
from pondwatch.store import alarms, judgements, sessions
from pondwatch.store.sessions import State
from tests.fakes.guarded import GIB, Guarded


@pytest.fixture
def guarded(tmp_path: Path) -> Iterator[Guarded]:
    made = Guarded(tmp_path)
    yield made
    made.house.store.close()


def rod(state: RodState, fill: float, views: int = 3, conflicting: bool = False) -> RodReading:
    return RodReading("R0", state, fill, 0.99, views, conflicting)


def test_a_robot_that_is_not_heard_rings_within_ten_seconds_and_is_over_once_it_speaks(guarded: Guarded) -> None:
    guarded.at(0)
    guarded.hear(1, 1.0)
    assert guarded.at(8.9) == {}
    assert guarded.at(9.0)["robot-silent/bubble-1"]["rings"], "8 s after it was heard: the page has 2 s left"

    guarded.hear(2, 20.0)
    guarded.at(20.5)
    over = guarded.at(22.6)["robot-silent/bubble-1"]

    assert (over["active"], over["retained"]) == (False, True)
    assert [act for act, _, _ in guarded.events("robot-silent/bubble-1")] == ["raise", "clear"]


def test_a_robot_is_not_called_silent_for_the_time_when_nobody_listened(guarded: Guarded) -> None:
    guarded.hear(1, -3600.0)

    assert guarded.at(0) == {}
    assert guarded.at(7.9) == {}
    assert "robot-silent/bubble-1" in guarded.at(8.1)


@pytest.mark.parametrize("state", [State.FINISHING, State.FINISHED, State.FAILED])
def test_once_an_inspection_ends_nobody_is_silent(guarded: Guarded, state: State) -> None:
    guarded.at(0)
    guarded.hear(1, 0.0)
    assert guarded.at(9)["robot-silent/bubble-1"]["active"]

    guarded.set_state(state)
    guarded.at(10)

    assert not guarded.at(13)["robot-silent/bubble-1"]["active"]
    assert guarded.rows()["robot-silent/bubble-1"]["retained"], "somebody still has to see that it was"


def test_a_finished_inspection_never_begins_to_ring_for_silence(guarded: Guarded) -> None:
    guarded.at(0)
    guarded.hear(1, 0.0)
    guarded.set_state(State.FINISHED)

    assert guarded.at(100) == {}


def test_a_rod_rings_only_once_its_looks_have_disagreed_for_a_while(guarded: Guarded) -> None:
    guarded.read(rod(RodState.FULL, 1.0, conflicting=True))
    guarded.at(0)
    assert guarded.at(4.9) == {}
    guarded.read(rod(RodState.FULL, 1.0))
    guarded.at(5)
    guarded.read(rod(RodState.FULL, 1.0, conflicting=True))
    guarded.at(6)
    assert guarded.at(10.9) == {}

    assert guarded.at(11)["rod-conflicting/R0"]["message"] == "Looks at rod R0 disagree."


def test_a_rod_that_somebody_judged_does_not_ring_for_its_looks(guarded: Guarded) -> None:
    guarded.read(rod(RodState.FULL, 1.0, conflicting=True))
    guarded.at(0)
    assert guarded.at(5)["rod-conflicting/R0"]["active"]
    said = judgements.NewJudgement("R0", "full", 1.0, "glare", "Ada")
    guarded.house.store.write(lambda c: judgements.add(c, guarded.house.session, said, 1))
    guarded.at(6)

    assert not guarded.at(11)["rod-conflicting/R0"]["active"]


def earlier(guarded: Guarded, *readings: RodReading) -> str:
    """A session that was before, with these rods, set as the baseline."""
    inspection = guarded.house.store.read(lambda c: sessions.get(c, guarded.house.session, with_rods=True)).inspection
    made = guarded.house.store.write(lambda c: sessions.create(c, inspection, "identity", 5))
    guarded.read(*readings, session=made)
    guarded.house.store.write(lambda c: alarms.set_baseline(c, guarded.house.session, made, 6))
    return made


def test_without_a_baseline_no_rod_has_changed(guarded: Guarded) -> None:
    guarded.read(rod(RodState.EMPTY, 0.0))
    guarded.at(0)

    assert guarded.at(60) == {}


def test_a_rod_that_is_otherwise_than_in_the_baseline_rings_and_stays_until_it_is_reset(guarded: Guarded) -> None:
    earlier(guarded, rod(RodState.FULL, 1.0))
    guarded.read(rod(RodState.EMPTY, 0.0, views=1))
    guarded.at(0)
    assert guarded.at(10) == {}, "one look is not enough"
    guarded.read(rod(RodState.EMPTY, 0.0, views=2))
    guarded.at(20)
    row = guarded.at(22)["rod-changed/R0"]
    assert row["message"] == "Rod R0 was full in the baseline, and reads empty."
    with pytest.raises(Conflict):
        raise guarded.act(Act.RESET, row)

    guarded.read(rod(RodState.FULL, 1.0))
    guarded.at(30)
    assert guarded.rows()["rod-changed/R0"]["latched"]
    guarded.act(Act.ACKNOWLEDGE, row)
    assert guarded.rows()["rod-changed/R0"]["retained"]
    guarded.act(Act.RESET, row)

    assert not guarded.rows()["rod-changed/R0"]["retained"]


def test_another_baseline_is_taken_up_at_once(guarded: Guarded) -> None:
    guarded.read(rod(RodState.EMPTY, 0.0))
    guarded.at(0)
    earlier(guarded, rod(RodState.FULL, 1.0))
    guarded.at(1)

    assert guarded.at(3)["rod-changed/R0"]["active"]
    guarded.house.store.write(lambda c: alarms.set_baseline(c, guarded.house.session, None, 7))
    assert not guarded.at(4)["rod-changed/R0"]["active"]


def test_poor_correction_rings_for_the_whole_inspection(guarded: Guarded) -> None:
    guarded.watch = guarded.fresh(least_snapshots=4, robot_silent_s=1e9)
    for i in range(4):
        guarded.hear(i, 0.0)
    guarded.house.drain()
    guarded.at(0)
    assert guarded.at(20) == {}  # the method identity calls all placed
    found = guarded.watch._watched[guarded.house.session].facts
    assert (found.snapshots, found.doubtful) == (4, 0)
    found.doubtful = 1

    guarded.at(30)
    assert guarded.at(40)["correction-poor"]["message"] == "About 25 % of the snapshots are not surely placed."


def test_coverage_is_stale_once_the_window_is_over_and_too_few_rods_were_seen_twice(
    guarded: Guarded, monkeypatch: Any
) -> None:
    guarded.watch = guarded.fresh(robot_silent_s=1e9, coverage_window_s=600.0)
    monkeypatch.setattr(alarmfacts, "COVERAGE_EVERY_S", 0.0)
    guarded.hear(1, 0.0)
    guarded.house.drain()
    guarded.at(0)
    assert guarded.at(599) == {}, "an inspection that has just begun has seen nothing yet"
    guarded.at(601)
    assert guarded.at(640)["coverage-stale"]["message"] == "About 0 % was seen twice in the last 10 minutes."

    for i in range(2, 60):
        guarded.hear(i, 650.0)
    guarded.house.drain()
    guarded.at(660)
    assert not guarded.at(691)["coverage-stale"]["active"]


def test_a_low_disk_rings_while_an_inspection_runs(guarded: Guarded) -> None:
    guarded.free = GIB
    assert guarded.at(0)["disk-low"]["severity"] == 700
    guarded.free = 3 * GIB
    guarded.at(1)

    assert not guarded.at(61)["disk-low"]["active"]


def test_everything_that_becomes_of_an_alarm_is_kept_with_who_and_why(guarded: Guarded) -> None:
    guarded.free = GIB
    row = guarded.at(0)["disk-low"]
    guarded.act(Act.ACKNOWLEDGE, row, "  order placed ")
    guarded.act(Act.SHELVE, row, "known", for_s=600.0)
    assert guarded.rows()["disk-low"]["quiet"]
    guarded.at(599)
    assert guarded.rows()["disk-low"]["quiet"]
    guarded.at(601)
    for act in (Act.SUPPRESS, Act.UNSUPPRESS, Act.REMOVE, Act.RETURN):
        guarded.act(act, row)

    assert guarded.events("disk-low") == [
        ("raise", None, "About 1.1 GB are free in the data folder."),
        ("acknowledge", "Ada", "order placed"),
        ("shelve", "Ada", "known"),
        ("unshelve", None, "Its time on the shelf is over."),
        ("suppress", "Ada", "why"),
        ("unsuppress", "Ada", "why"),
        ("remove-from-service", "Ada", "why"),
        ("return-to-service", "Ada", "why"),
    ]


def test_a_restart_forgets_nothing_that_rang(guarded: Guarded) -> None:
    guarded.free = GIB
    row = guarded.at(0)["disk-low"]
    guarded.act(Act.ACKNOWLEDGE, row, "seen")
    guarded.act(Act.SHELVE, row, "until it is over", for_s=None)
    before = guarded.rows()

    guarded.watch = guarded.fresh()

    assert guarded.rows() == before
    assert before["disk-low"]["shelved_until"] == "until-clear"
    assert guarded.house.store.read(alarms.to_watch) == [guarded.house.session]
    guarded.free = 100 * GIB
    guarded.at(1)
    assert not guarded.at(62)["disk-low"]["quiet"]


def test_of_two_who_acknowledge_one_is_told_that_it_was_done(guarded: Guarded) -> None:
    guarded.free = GIB
    row = guarded.at(0)["disk-low"]

    first, second = (guarded.act(Act.ACKNOWLEDGE, row) for _ in range(2))

    assert first["acknowledged"]
    assert isinstance(second, Conflict)


def test_of_a_group_each_alarm_is_answered_for_itself(guarded: Guarded) -> None:
    guarded.at(0)
    for robot in ("a", "b", "c"):
        guarded.hear(1, 0.0, robot)
    rows = list(guarded.at(10).values())
    guarded.act(Act.ACKNOWLEDGE, rows[1])

    numbers = [rows[0]["id"], rows[1]["id"], 999, rows[2]["id"]]
    done = guarded.watch.act(guarded.house.session, numbers, Deed(Act.ACKNOWLEDGE, "Bo", "power cut"))

    assert [type(result) for result in done] == [dict, Conflict, Missing, dict]
    assert not any(row["rings"] for row in guarded.rows().values())


def test_what_could_not_be_kept_was_not_done_and_is_not_told(guarded: Guarded, monkeypatch: Any) -> None:
    guarded.free = GIB
    row = guarded.at(0)["disk-low"]
    told = guarded.told

    def full(unit: Any) -> Any:
        raise StorageFull("There is no room left.")

    with monkeypatch.context() as patch:
        patch.setattr(guarded.house.store, "write", full)
        with pytest.raises(StorageFull):
            guarded.act(Act.ACKNOWLEDGE, row)
    assert guarded.rows()["disk-low"]["rings"]
    assert guarded.told == told

    assert guarded.act(Act.ACKNOWLEDGE, row)["acknowledged"]


def test_nothing_is_written_or_told_while_nothing_changes(guarded: Guarded, monkeypatch: Any) -> None:
    guarded.free = GIB
    guarded.at(0)
    version, told = guarded.watch.told(guarded.house.session).version, guarded.told

    monkeypatch.setattr(guarded.house.store, "write", None)
    for s in range(1, 50):
        guarded.at(s)

    assert (guarded.watch.told(guarded.house.session).version, guarded.told) == (version, told)


def test_a_session_that_is_not_there_is_missing(guarded: Guarded) -> None:
    for ask in (guarded.watch.told, guarded.watch.judge, guarded.watch.groups):
        with pytest.raises(Missing):
            ask("nobody")
