"""What counts as wrong: the limits, the band below them, and what a rod must show before anyone is told."""

from __future__ import annotations

import pytest

from pondwatch.core.alarms import AlarmKey, Kind
from pondwatch.core.conditions import Limits, changed, conflicting, low, poor, published, silent, stale
from pondwatch.core.values import RodReading, RodState

LIMITS = Limits()


def rod(
    state: RodState, fill: float | None, confidence: float = 0.99, views: int = 3, conflicting: bool = False
) -> RodReading:
    return RodReading("R1", state, fill, confidence, views, conflicting)


EMPTY, FULL = rod(RodState.EMPTY, 0.0), rod(RodState.FULL, 1.0)
HALF = rod(RodState.PARTIAL, 0.5)
UNSEEN = RodReading("R1", RodState.UNSEEN, None, 0.0, 0)


@pytest.mark.parametrize("before", [None, UNSEEN])
def test_a_first_reading_is_shown_at_once_however_unsure(before: RodReading | None) -> None:
    first = rod(RodState.FULL, 1.0, confidence=0.5, views=1)

    assert published(before, first, LIMITS) == first


@pytest.mark.parametrize(
    "now",
    [
        rod(RodState.FULL, 1.0, views=1),
        rod(RodState.FULL, 1.0, confidence=0.79),
        rod(RodState.FULL, 1.0, conflicting=True),
    ],
    ids=["one look", "unsure", "conflicting"],
)
def test_a_state_that_is_shown_stays_until_looks_agree_on_another(now: RodReading) -> None:
    shown = published(EMPTY, now, LIMITS)

    assert (shown.state, shown.fill) == (RodState.EMPTY, 0.0)
    assert (shown.views, shown.conflicting) == (now.views, now.conflicting)
    assert shown.confidence == pytest.approx(1 - now.confidence), "it says how little is left of its claim"


def test_looks_that_agree_change_what_is_shown() -> None:
    assert published(EMPTY, FULL, LIMITS) == FULL


def test_a_state_that_flickers_about_a_threshold_is_shown_as_one() -> None:
    shown = rod(RodState.PARTIAL, 0.94)
    states = []
    for i in range(20):
        now = rod(RodState.FULL if i % 2 else RodState.PARTIAL, 0.951 if i % 2 else 0.949, 0.55, views=4 + i)
        shown = published(shown, now, LIMITS)
        states.append(shown.state)

    assert set(states) == {RodState.PARTIAL}


def test_a_rod_that_no_look_shows_any_more_is_not_observed_at_once() -> None:
    assert published(FULL, UNSEEN, LIMITS) == UNSEEN


@pytest.mark.parametrize(
    ("before", "now", "rings"),
    [
        (FULL, EMPTY, True),
        (FULL, FULL, False),
        (FULL, UNSEEN, False),
        (UNSEEN, FULL, False),
        (FULL, rod(RodState.EMPTY, 0.0, views=1), False),
        (FULL, rod(RodState.EMPTY, 0.0, confidence=0.7), False),
        (rod(RodState.FULL, 1.0, confidence=0.7), EMPTY, False),
        (rod(RodState.FULL, 1.0, conflicting=True), EMPTY, False),
        (FULL, rod(RodState.EMPTY, 0.0, conflicting=True), False),
        (HALF, rod(RodState.PARTIAL, 0.71), True),
        (HALF, rod(RodState.PARTIAL, 0.69), False),
        (rod(RodState.PARTIAL, 0.94), rod(RodState.FULL, 0.96), False),
        (rod(RodState.EMPTY, 0.0), rod(RodState.PARTIAL, 0.1), True),
    ],
)
def test_a_rod_has_changed_where_both_readings_count_and_are_apart(
    before: RodReading, now: RodReading, rings: bool
) -> None:
    assert bool(changed([now], {"R1": before}, LIMITS)) is rings


def test_a_change_says_what_was_and_what_is() -> None:
    assert changed([EMPTY], {"R1": HALF}, LIMITS) == {
        AlarmKey(Kind.ROD_CHANGED, "R1"): "Rod R1 was partly filled (about 50 %) in the baseline, and reads empty."
    }
    assert changed([EMPTY], {}, LIMITS) == {}


def test_one_look_cannot_disagree_with_itself() -> None:
    looks = [rod(RodState.FULL, 1.0, views=n, conflicting=True) for n in (1, 2)]

    assert [bool(conflicting([reading], LIMITS)) for reading in looks] == [False, True]
    assert conflicting([FULL], LIMITS) == {}


def test_a_robot_is_silent_from_the_limit_on() -> None:
    heard = {"a": 1000.0, "b": 1000.1}

    assert list(silent(heard, 1008.0, LIMITS)) == [AlarmKey(Kind.ROBOT_SILENT, "a")]
    assert silent(heard, 1008.0, LIMITS) == {
        AlarmKey(Kind.ROBOT_SILENT, "a"): "Robot a was last heard at 00:16:40 UTC."
    }


@pytest.mark.parametrize(
    ("snapshots", "doubtful", "is_active", "rings"),
    [(49, 49, False, False), (50, 5, False, False), (50, 6, False, True), (50, 5, True, True), (50, 4, True, False)],
)
def test_the_correction_is_poor_above_its_share_and_better_only_well_below(
    snapshots: int, doubtful: int, is_active: bool, rings: bool
) -> None:
    assert bool(poor(snapshots, doubtful, LIMITS, is_active=is_active)) is rings


@pytest.mark.parametrize(
    ("seen", "is_active", "rings"),
    [(None, True, False), (0.5, False, False), (0.49, False, True), (0.6, True, True), (0.63, True, False)],
)
def test_coverage_is_stale_below_its_share_and_fresh_only_well_above(
    seen: float | None, is_active: bool, rings: bool
) -> None:
    assert bool(stale(seen, LIMITS, is_active=is_active)) is rings


@pytest.mark.parametrize(
    ("free", "is_active", "rings"),
    [(2 << 30, False, False), ((2 << 30) - 1, False, True), (5 << 29, True, False), (9 << 28, True, True)],
)
def test_the_disk_is_low_below_its_limit_and_not_before_there_is_well_more(
    free: int, is_active: bool, rings: bool
) -> None:
    assert bool(low(free, LIMITS, is_active=is_active)) is rings
