"""Declared inventories: checked whole, and held against what was observed."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pondwatch.core.errors import InvalidInventory
from pondwatch.core.inventory import Declared, Outcome, parse_inventory, reconcile
from pondwatch.core.values import RodReading, RodState

HEAD = "item,position,state,date\n"
POSITIONS = {f"R{i}" for i in range(10)}
GOOD = HEAD + "FA-001,R0,full,2026-01-31\nFA-002,R1,empty,2026-01-31\n"


def refusal(text: str | bytes) -> InvalidInventory:
    with pytest.raises(InvalidInventory) as caught:
        parse_inventory(text.encode() if isinstance(text, str) else text, POSITIONS)
    return caught.value


def test_a_file_gives_its_lines_whatever_the_order_of_its_columns() -> None:
    expected = (
        Declared(2, "FA-001", "R0", RodState.FULL, "2026-01-31"),
        Declared(3, "FA-002", "R1", RodState.EMPTY, "2026-01-31"),
    )

    assert parse_inventory(GOOD.encode(), POSITIONS) == expected
    lines = [
        "\ufeffdate,Declared_State,item,position,remark",
        "2026-01-31, Full ,FA-001,R0,x",
        "2026-01-31,EMPTY,FA-002,R1,",
    ]
    other = "\r\n".join(lines)
    assert parse_inventory(other.encode(), POSITIONS) == expected


@pytest.mark.parametrize(
    ("text", "line", "word"),
    [
        (GOOD + "FA-003,R99,full,2026-01-31\n", 4, "no position 'R99'"),
        (GOOD + "FA-003,R2,half,2026-01-31\n", 4, "state must be one of"),
        (GOOD + "FA-003,R2,full,31.01.2026\n", 4, "date must be a day"),
        (GOOD + "FA-003,R2,full,2026-02-30\n", 4, "date must be a day"),
        (GOOD + "FA-001,R2,full,2026-01-31\n", 4, "item 'FA-001' was given before, in line 2"),
        (GOOD + "FA-003,R1,full,2026-01-31\n", 4, "position 'R1' was given before, in line 3"),
        (GOOD + "FA-003,,full,2026-01-31\n", 4, "position is missing"),
        (GOOD + "FA-003,R2,full,2026-01-31,more\n", 4, "more fields"),
        (GOOD + '"FA-003,R2,full,2026-01-31\n', 4, "not CSV"),
        ("item,position,date\nFA-001,R0,2026-01-31\n", 1, "lacks state"),
        (HEAD, 1, "no line"),
        ("", 1, "lacks item"),
        (GOOD.encode() + b"\xe9,R2,full,2026-01-31\n", 4, "UTF-8"),
        (b"PK\x03\x04\x00\x00binary", 1, "no CSV file"),
        ("item,position,state,declared_state,date\n", 1, "column twice"),
    ],
)
def test_a_faulty_file_is_refused_with_the_line(text: str, line: int, word: str) -> None:
    error = refusal(text)

    assert (error.facts["line"], error.facts["faults"]) == (line, 1)
    assert f"line {line}: " in error.message
    assert word in error.message
    assert error.message.endswith("Nothing was imported.")


def test_every_fault_of_a_file_is_told_at_once() -> None:
    error = refusal(HEAD + "A,R0,full,never\nB,R1,full,2026-01-31\nC,R77,full,2026-01-31\nA,R2,x,2026-01-31\n")

    assert (error.facts["lines"], error.facts["faults"]) == ("2, 4, 5", 3)


def test_of_many_faults_the_first_are_spelled_out_and_the_rest_counted() -> None:
    error = refusal(HEAD + "".join(f"I{i},R0,full,never\n" for i in range(50)))

    assert error.message.count("line ") == 20
    assert "and 30 more" in error.message


def rod(state: RodState, confidence: float = 0.99, conflicting: bool = False) -> RodReading:
    return RodReading("R0", state, 0.5, confidence, 3, conflicting)


def declared(state: RodState) -> Declared:
    return Declared(2, "FA", "R0", state, "2026-01-31")


@pytest.mark.parametrize(
    ("reading", "outcome", "confidence"),
    [
        (rod(RodState.FULL), Outcome.AGREE, 0.99),
        (rod(RodState.EMPTY), Outcome.DISAGREE, 0.005),
        (rod(RodState.PARTIAL), Outcome.DISAGREE, 0.005),
        (rod(RodState.UNSEEN, 0.0), Outcome.NOT_OBSERVED, None),
        (None, Outcome.NOT_OBSERVED, None),
        (rod(RodState.EMPTY, 0.6), Outcome.AMBIGUOUS, 0.2),
        (rod(RodState.FULL, 0.6), Outcome.AMBIGUOUS, 0.6),
        (rod(RodState.FULL, conflicting=True), Outcome.AMBIGUOUS, 0.99),
    ],
)
def test_a_line_declared_full_has_one_outcome(
    reading: RodReading | None, outcome: Outcome, confidence: float | None
) -> None:
    line = reconcile([declared(RodState.FULL)], {} if reading is None else {"R0": reading}).lines[0]

    assert line.outcome is outcome
    assert line.confidence == pytest.approx(confidence)


SEEN = st.builds(
    RodReading, st.just("R"), st.sampled_from(list(RodState)), st.just(0.5), st.floats(0, 1), st.just(2), st.booleans()
)


@given(
    st.dictionaries(st.sampled_from(sorted(POSITIONS)), SEEN),
    st.lists(st.tuples(st.sampled_from(sorted(POSITIONS)), st.sampled_from(list(RodState)[:3])), max_size=20),
)
def test_the_counts_add_up_to_the_list_and_every_reading_is_declared_or_not(
    readings: dict[str, RodReading], lines: list[tuple[str, RodState]]
) -> None:
    told = [Declared(n, f"I{n}", where, state, "2026-01-31") for n, (where, state) in enumerate(lines, 2)]

    found = reconcile(told, readings)

    assert sum(found.counts().values()) == len(lines)
    assert len(found.undeclared) == len(set(readings) - {where for where, _ in lines})
