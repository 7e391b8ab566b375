"""What is claimed of two inspections, and what is not."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pondwatch.core.compare import Change, Reason, Refusal, Seen, compare, probability_of_change
from pondwatch.core.values import RodReading, RodState

FILLS = {"E": 0.0, "F": 1.0, "P": 0.5, "p": 0.25, "?": None}
STATES = {"E": RodState.EMPTY, "F": RodState.FULL, "P": RodState.PARTIAL, "p": RodState.PARTIAL, "?": RodState.UNSEEN}
PITCH_M, INNER_M = 0.1, 0.02


def reading(letter: str, confidence: float = 0.999, conflicting: bool = False, rod_id: str = "R") -> RodReading:
    sure = 0.0 if letter == "?" else confidence
    return RodReading(rod_id, STATES[letter], FILLS[letter], sure, int(letter != "?"), conflicting)


def row(letters: str, confidence: float = 0.999, offset: tuple[float, float] | None = (0.0, 0.0)) -> dict[str, Seen]:
    """Rods R0, R1, … side by side."""
    return {
        f"R{i}": Seen(reading(letter, confidence, rod_id=f"R{i}"), (PITCH_M * i, 0.5), INNER_M, offset)
        for i, letter in enumerate(letters)
    }


def changes(base: str, with_: str) -> list[str]:
    return [rod.change.value for rod in compare(row(base), row(with_)).rods]


def test_every_pair_of_states_has_its_word() -> None:
    assert changes("EEEFFFPPPpP", "EFPEFPEFPPp") == [
        "same", "filled", "partly", "emptied", "same", "partly", "emptied", "filled", "same", "partly", "partly",
    ]  # fmt: skip


def test_a_rod_that_either_did_not_see_is_not_compared_and_says_which() -> None:
    found = compare(row("E?F?"), row("F?EF".replace("E", "?")))

    assert [rod.reason for rod in found.rods] == [
        None, Reason.NOT_OBSERVED, Reason.NOT_OBSERVED_WITH, Reason.NOT_OBSERVED_BASE,
    ]  # fmt: skip
    assert found.count(Change.FILLED) == 1
    assert found.count(Change.NOT_COMPARABLE) == 3


def test_a_confidence_is_that_of_both_readings_together() -> None:
    rod = compare(row("E", 0.96), row("F", 0.97)).rods[0]

    assert rod.confidence == pytest.approx(0.9312)
    # same state: both empty 0.96 x 0.015, both full 0.02 x 0.97, both partial 0.02 x 0.015
    assert rod.p_changed == pytest.approx(1 - (0.0144 + 0.0194 + 0.0003))


@pytest.mark.parametrize(("confidence", "change"), [(0.99, Change.FILLED), (0.6, Change.NOT_COMPARABLE)])
def test_a_difference_is_claimed_only_where_both_readings_are_sure(confidence: float, change: Change) -> None:
    assert compare(row("EE", confidence), row("FE", confidence)).rods[0].change is change


def test_two_partial_fills_differ_only_where_neither_reading_is_in_any_doubt() -> None:
    """One that may as well be empty has its fill from looks that disagree."""
    assert compare(row("P"), row("p", 0.96)).rods[0].reason is Reason.UNSURE
    assert compare(row("P"), row("p", 0.996)).rods[0].change is Change.PARTLY


def test_looks_that_contradict_each_other_claim_no_difference() -> None:
    base = row("E")
    doubtful = {"R0": Seen(reading("F", conflicting=True), (0.0, 0.5), INNER_M)}

    assert compare(base, doubtful).rods[0].reason is Reason.UNSURE


def test_a_rod_where_the_mosaics_lie_apart_is_not_compared() -> None:
    """The limit is a quarter of the inner radius: 5 mm."""
    base, with_ = row("EEEEEEE"), row("FFFEEEE", offset=(0.003, 0.0))
    with_["R1"] = Seen(with_["R1"].reading, with_["R1"].place, INNER_M, (0.003, 0.0045))

    found = compare(base, with_)

    assert [rod.reason for rod in found.rods] == [None, Reason.RESIDUAL, None, None, None, None, None]
    assert found.rods[1].residual_m == pytest.approx(np.hypot(0.003, 0.0045))
    assert found.registration.median_m == pytest.approx(0.003)
    assert found.registration.shift_m == pytest.approx((0.003, 0.0))
    assert found.registration.limit_m == pytest.approx(0.005)


def test_mosaics_that_lie_apart_as_a_whole_are_not_compared_at_all() -> None:
    found = compare(row("EEE"), row("FFF", offset=(0.0, 0.006)))

    assert found.refusal is Refusal.RESIDUAL
    assert [rod.change for rod in found.rods] == [Change.NOT_COMPARABLE] * 3
    assert found.registration.rods == 3


def test_a_rod_whose_ring_is_not_found_claims_no_difference() -> None:
    with_ = row("FEE")
    for i in ("R0", "R2"):
        with_[i] = Seen(with_[i].reading, with_[i].place, INNER_M)

    found = compare(row("EEE") | {"R3": row("EEEE")["R3"]}, with_ | {"R3": row("EEEE")["R3"]})

    assert [(rod.change.value, rod.reason) for rod in found.rods] == [
        ("not_comparable", Reason.UNMEASURED), ("same", None), ("same", None), ("same", None),
    ]  # fmt: skip
    assert (found.refusal, found.registration.rods) == (None, 2)


def test_mosaics_whose_rings_are_mostly_not_found_are_not_compared_at_all() -> None:
    """So far aside that no ring is near its place: no residual can say that it is over the limit."""
    found = compare(row("EEEE"), row("FEEE", offset=None) | {"R3": row("EEEE")["R3"]})

    assert found.refusal is Refusal.UNMEASURED
    assert [rod.change for rod in found.rods] == [Change.NOT_COMPARABLE] * 4


@pytest.mark.parametrize(
    ("base", "with_", "refusal"),
    [
        ({}, row("E"), Refusal.NO_LAYOUT),
        (row("E"), {}, Refusal.NO_LAYOUT),
        (row("E"), {"X": Seen(reading("E"), (0.0, 0.0), INNER_M)}, Refusal.OTHER_LAYOUT),
        (row("E"), {"R0": Seen(reading("E"), (0.05, 0.5), INNER_M)}, Refusal.OTHER_LAYOUT),
        (row("E?"), row("?E"), Refusal.NOTHING_SEEN),
    ],
)
def test_what_cannot_be_compared_says_why(base: dict[str, Seen], with_: dict[str, Seen], refusal: Refusal) -> None:
    assert compare(base, with_).refusal is refusal


def test_two_ponds_whose_rods_stand_at_one_place_by_chance_are_not_compared() -> None:
    other = row("FFFFFFFF")
    for i in range(3, 8):
        other[f"R{i}"] = Seen(other[f"R{i}"].reading, (0.1 * i, 0.8), INNER_M, (0.0, 0.0))

    found = compare(row("EEEEEEEE"), other)

    assert (found.refusal, found.count(Change.NOT_COMPARABLE)) == (Refusal.OTHER_LAYOUT, 8)


def test_a_rod_of_the_same_name_at_another_place_is_not_the_same_rod() -> None:
    with_ = row("FE")
    with_["R0"] = Seen(with_["R0"].reading, (0.03, 0.5), INNER_M)

    assert compare(row("EE"), with_).rods[0].reason is Reason.ELSEWHERE


def test_rods_of_one_layout_alone_are_told_apart() -> None:
    base, with_ = row("EE"), row("EE")
    base["old"], with_["new"] = base.pop("R0"), with_.pop("R0")

    found = compare(base, with_)

    assert (found.only_in_base, found.only_in_with, len(found.rods)) == (("old",), ("new",), 1)


def test_one_rod_that_lost_what_another_gained_may_have_moved() -> None:
    found = compare(row("FEEF"), row("EEFF"))

    assert [(rod.word, rod.counterpart) for rod in found.rods] == [
        ("moved", "R2"), (None, None), ("moved", "R0"), (None, None),
    ]  # fmt: skip


def test_where_two_may_have_moved_there_no_one_is_said_to() -> None:
    found = compare(row("FFE"), row("EEF"))

    assert [rod.word for rod in found.rods] == ["removed", "removed", "added"]


def test_a_pond_that_is_wholly_otherwise_pairs_nobody_and_takes_no_time() -> None:
    found = compare(row("F" * 400 + "E" * 400), row("E" * 400 + "F" * 400))

    assert (found.count(Change.EMPTIED), found.count(Change.FILLED)) == (400, 400)
    assert {rod.word for rod in found.rods} == {"removed", "added"}


@pytest.mark.parametrize(
    ("base", "with_", "word"), [("F", "E", "removed"), ("E", "P", "added"), ("P", "F", "replaced")]
)
def test_a_change_has_the_word_of_verification_practice(base: str, with_: str, word: str) -> None:
    assert compare(row(base), row(with_)).rods[0].word == word


def test_an_inspection_that_lies_one_step_off_is_refused_although_its_rings_coincide() -> None:
    letters = "".join(np.random.default_rng(4).choice(list("EFP"), 60))
    steps = np.array([[PITCH_M, 0.0], [-PITCH_M, 0.0]])

    assert compare(row(letters), row("E" + letters[:-1]), steps).refusal is Refusal.SHIFTED
    assert compare(row(letters), row(letters), steps).refusal is None


def test_a_row_emptied_at_the_edge_is_no_shift() -> None:
    """Moved by a step the edge has no partner, and what is left agrees in full: it did before."""
    steps = np.array([[0.0, PITCH_M], [0.0, -PITCH_M]])
    base = grid("F" * 10, "F" * 10, "F" * 10)
    found = compare(base, grid("E" * 10, "F" * 10, "F" * 10), steps)

    assert found.refusal is None
    assert found.count(Change.EMPTIED) == 10


def grid(*rows: str) -> dict[str, Seen]:
    return {
        f"R{y}-{x}": Seen(reading(letter), (x * PITCH_M, -y * PITCH_M), INNER_M, (0.0, 0.0))
        for y, letters in enumerate(rows)
        for x, letter in enumerate(letters)
    }


@given(st.text("EFPp?", min_size=1, max_size=30), st.text("EFPp?", min_size=1, max_size=30))
def test_the_other_way_round_filled_is_emptied_and_nothing_is_lost(base: str, with_: str) -> None:
    there, back = compare(row(base), row(with_)), compare(row(with_), row(base))

    assert len(there.rods) == min(len(base), len(with_)) == sum(there.count(change) for change in Change)
    assert there.refusal == back.refusal
    assert [r.change in (Change.SAME, Change.NOT_COMPARABLE) for r in there.rods] == [
        r.change in (Change.SAME, Change.NOT_COMPARABLE) for r in back.rods
    ]


@given(st.sampled_from("EFP"), st.sampled_from("EFP"), st.floats(0.34, 1), st.floats(0.34, 1))
def test_a_probability_of_change_is_what_drawing_from_both_posteriors_gives(
    a: str, b: str, sure_a: float, sure_b: float
) -> None:
    def posterior(letter: str, sure: float) -> Sequence[float]:
        return [sure if other == letter else (1 - sure) / 2 for other in "EPF"]

    table = np.outer(posterior(a, sure_a), posterior(b, sure_b))
    expected = table.sum() - np.trace(table)

    assert probability_of_change(reading(a, sure_a), reading(b, sure_b)) == pytest.approx(expected)
