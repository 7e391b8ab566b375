"""Alarms: what rings, what stays, and what people may do about it."""

import math

import pytest
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from pondwatch.core.alarmacts import MOST_SHELVED_S, Act, perform, possible
from pondwatch.core.alarms import FLOOD, POLICIES, Alarm, AlarmKey, Board, Kind, grouped, observe
from pondwatch.core.errors import Conflict, Invalid, Missing

SILENT = AlarmKey(Kind.ROBOT_SILENT, "bubble-3")
CHANGED = AlarmKey(Kind.ROD_CHANGED, "R0012")
CONFLICTING = AlarmKey(Kind.ROD_CONFLICTING, "R0001")


def acknowledge(alarm: Alarm, by: str, text: str, at_s: float) -> Alarm:
    return perform(alarm, Act.ACKNOWLEDGE, by, text, at_s)


def shelve(alarm: Alarm, by: str, text: str, at_s: float, for_s: float | None) -> Alarm:
    return perform(alarm, Act.SHELVE, by, text, at_s, for_s)


def reset(alarm: Alarm, by: str, text: str, at_s: float) -> Alarm:
    return perform(alarm, Act.RESET, by, text, at_s)


def active(key: AlarmKey = SILENT, at_s: float = 100.0) -> Alarm:
    alarm = observe(observe(Alarm(key), True, at_s), True, at_s + POLICIES[key.kind].on_s)
    assert alarm.active
    return alarm


def test_every_kind_says_what_to_do() -> None:
    assert set(POLICIES) == set(Kind)
    assert all(policy.advice.endswith(".") and 1 <= policy.severity <= 1000 for policy in POLICIES.values())


def test_a_condition_that_holds_rings_until_somebody_acknowledges() -> None:
    alarm = active()
    assert alarm.rings

    seen = acknowledge(alarm, "Ada", "Battery being changed", 110.0)

    assert (seen.active, seen.rings, seen.retained) == (True, False, True)
    assert [(c.by, c.act, c.text) for c in seen.comments] == [("Ada", "acknowledge", "Battery being changed")]


def test_a_condition_that_flickers_about_its_limit_never_rings() -> None:
    alarm = Alarm(CONFLICTING)
    for i in range(100):
        alarm = observe(alarm, i % 2 == 0, 100.0 + i)
    assert (alarm.active, alarm.occurrences) == (False, 0)


def test_a_condition_must_hold_for_its_time_before_it_rings() -> None:
    alarm = observe(Alarm(CONFLICTING), True, 100.0)
    assert not observe(alarm, True, 104.9).active
    assert observe(alarm, True, 105.0).active


def test_a_condition_must_be_gone_for_its_time_before_the_alarm_is_inactive() -> None:
    alarm = observe(active(CONFLICTING), False, 200.0)
    assert observe(alarm, False, 204.9).active
    assert not observe(alarm, False, 205.0).active


def test_what_nobody_acknowledged_stays_though_it_is_over() -> None:
    alarm = observe(observe(active(), False, 200.0), False, 202.0)
    assert (alarm.active, alarm.retained, alarm.rings) == (False, True, True)
    assert not acknowledge(alarm, "Ada", "was out of reach", 203.0).retained


def test_a_new_occurrence_asks_for_a_new_acknowledgement() -> None:
    alarm = acknowledge(active(), "Ada", "known", 110.0)
    alarm = observe(observe(alarm, False, 200.0), False, 202.0)

    again = observe(alarm, True, 300.0)

    assert (again.acknowledged, again.occurrences) == (False, 2)


def test_a_latched_alarm_stays_until_it_is_reset_and_that_only_once_it_is_over_and_seen() -> None:
    alarm = active(CHANGED)
    with pytest.raises(Conflict):
        reset(acknowledge(alarm, "Ada", "seen", 110.0), "Ada", "done", 111.0)
    alarm = observe(alarm, False, 200.0)
    with pytest.raises(Conflict):
        reset(alarm, "Ada", "done", 201.0)
    alarm = acknowledge(alarm, "Ada", "seen", 202.0)
    assert alarm.retained

    assert not reset(alarm, "Ada", "assembly was moved on order 7", 203.0).retained


def test_a_shelf_for_a_time_ends_by_itself() -> None:
    alarm = shelve(active(), "Ada", "diver in the water", 110.0, for_s=600.0)
    assert not alarm.rings
    assert not observe(alarm, True, 709.9).rings
    assert observe(alarm, True, 710.0).rings


def test_a_shelf_until_the_next_ends_when_the_alarm_is_over() -> None:
    alarm = shelve(active(), "Ada", "known", 110.0, for_s=None)
    assert not observe(alarm, True, 1e9).rings
    over = observe(observe(alarm, False, 200.0), False, 202.0)
    assert over.shelved_until_s is None


@pytest.mark.parametrize("for_s", [0.0, -1.0, MOST_SHELVED_S + 1, math.nan, math.inf])
def test_a_shelf_has_an_end(for_s: float) -> None:
    with pytest.raises(Invalid):
        shelve(active(), "Ada", "why", 110.0, for_s)


@pytest.mark.parametrize("text", ["", "  \n"])
def test_every_act_says_why(text: str) -> None:
    with pytest.raises(Invalid, match="comment"):
        acknowledge(active(), "Ada", text, 110.0)


def test_acts_that_make_no_sense_are_refused() -> None:
    alarm = active()
    seen = acknowledge(alarm, "Ada", "seen", 110.0)
    shelved = shelve(alarm, "Ada", "why", 110.0, 60.0)
    senseless = (
        (seen, Act.ACKNOWLEDGE),
        (shelved, Act.SHELVE),
        (Alarm(SILENT), Act.SHELVE),
        (alarm, Act.UNSHELVE),
        (alarm, Act.UNSUPPRESS),
        (alarm, Act.RETURN),
        (seen, Act.RESET),
    )
    for before, act in senseless:
        with pytest.raises(Conflict):
            perform(before, act, "Bo", "why not", 111.0)


def test_only_shelving_takes_a_time() -> None:
    with pytest.raises(Invalid):
        perform(active(), Act.ACKNOWLEDGE, "Ada", "seen", 110.0, for_s=60.0)


def test_suppressed_and_out_of_service_are_quiet_and_come_back() -> None:
    for away, back in ((Act.SUPPRESS, Act.UNSUPPRESS), (Act.REMOVE, Act.RETURN)):
        out = perform(active(), away, "Ada", "radio mast down", 110.0)
        assert not out.rings
        assert back in possible(out)
        assert away not in possible(out)
        assert perform(out, back, "Ada", "mast is up", 500.0).rings


def test_a_board_takes_what_holds_and_remembers_what_rang() -> None:
    board = Board({}).observe({SILENT: "last heard 12 s ago"}, 100.0)
    assert board.get(SILENT).detail == "last heard 12 s ago"
    board = board.put(acknowledge(board.get(SILENT), "Ada", "seen", 101.0))
    board = board.observe({}, 200.0).observe({}, 202.0)
    assert not board.get(SILENT).retained

    board = board.observe({SILENT: "again"}, 300.0)
    assert board.get(SILENT).occurrences == 2
    with pytest.raises(Missing):
        board.get(CHANGED)


def test_a_condition_that_never_rang_leaves_nothing_behind() -> None:
    board = Board({}).observe({CONFLICTING: "4 looks"}, 100.0)
    assert set(board.alarms) == {CONFLICTING}

    assert board.observe({}, 101.0).alarms == {}


def test_a_flood_is_told_as_one_and_the_worst_kind_first() -> None:
    rods = [active(AlarmKey(Kind.ROD_CHANGED, f"R{i:04d}"), 100.0 + i) for i in range(FLOOD + 1)]
    groups = grouped([active(SILENT), *rods, shelve(active(CONFLICTING), "Ada", "known", 110.0, 60.0)])

    assert [(group.kind, group.is_flood) for group in groups] == [(Kind.ROD_CHANGED, True), (Kind.ROBOT_SILENT, False)]
    assert groups[0].alarms[0].key.subject == f"R{FLOOD:04d}", "the newest first"


class AlarmLaws(RuleBasedStateMachine):
    """Whatever is done in whatever order, what must be seen is seen."""

    def __init__(self) -> None:
        super().__init__()
        self.alarm, self.at_s = Alarm(CHANGED), 0.0
        self.raised = self.acknowledged = 0

    @rule(holds=st.booleans(), pass_s=st.floats(0, 100))
    def time_passes(self, holds: bool, pass_s: float) -> None:
        self.at_s += pass_s
        before = self.alarm
        self.alarm = observe(before, holds, self.at_s)
        self.raised += self.alarm.active and not before.active

    @precondition(lambda self: not self.alarm.acknowledged)
    @rule()
    def somebody_acknowledges(self) -> None:
        self.alarm = acknowledge(self.alarm, "Ada", "seen", self.at_s)
        self.acknowledged += 1

    @precondition(lambda self: self.alarm.retained and self.alarm.shelved_until_s is None)
    @rule(for_s=st.one_of(st.none(), st.floats(1, 500)))
    def somebody_shelves(self, for_s: float | None) -> None:
        self.alarm = shelve(self.alarm, "Ada", "busy", self.at_s, for_s)

    @precondition(lambda self: self.alarm.latched and not self.alarm.active and self.alarm.acknowledged)
    @rule()
    def somebody_resets(self) -> None:
        self.alarm = reset(self.alarm, "Ada", "done", self.at_s)

    @invariant()
    def an_occurrence_is_never_forgotten_unseen(self) -> None:
        if self.raised and not self.acknowledged:
            assert self.alarm.retained
        assert not (self.alarm.active and not self.alarm.latched)
        assert self.alarm.occurrences == self.raised
        assert len([c for c in self.alarm.comments if c.act == "acknowledge"]) == self.acknowledged


TestAlarmLaws = AlarmLaws.TestCase
