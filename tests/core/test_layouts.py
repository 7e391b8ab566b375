"""Layouts from files and lattices."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pondwatch.core.errors import InvalidLayout
from pondwatch.core.inspection import inspection_document
from pondwatch.core.layouts import csv_of, digest, document_of, from_csv, from_json, lattice
from pondwatch.core.values import Camera, Inspection, Pond

HEAD = "id,x_m,y_m,outer_radius_m,inner_radius_m\n"
GOOD = HEAD + "A,0.1,0.2,0.02,0.01\nB,0.3,0.2,0.02,0.01\n"


def refusal(text: str | bytes, width_m: float = 1.0) -> InvalidLayout:
    with pytest.raises(InvalidLayout) as caught:
        from_csv(text.encode() if isinstance(text, str) else text, width_m, 1.0)
    return caught.value


def test_a_csv_and_a_json_of_one_layout_are_the_same_layout() -> None:
    by_csv = from_csv(GOOD.encode(), 1.0, 0.5)

    assert [rod.id for rod in by_csv.rods] == ["A", "B"]
    assert from_json(json.dumps(document_of(by_csv)).encode()) == by_csv
    assert from_csv(csv_of(by_csv).encode(), 1.0, 0.5) == by_csv
    session = inspection_document(Inspection("x", Camera(160, 110, 0.001), by_csv))
    assert from_json(json.dumps(session).encode()) == by_csv


@pytest.mark.parametrize(
    ("text", "line", "word"),
    [
        (GOOD + "C,oops,0.2,0.02,0.01\n", 4, "x_m must be a number"),
        (GOOD + "A,0.5,0.2,0.02,0.01\n", 4, "was given before"),
        (GOOD + "C,0.5,0.2,0.01,0.02\n", 4, "more than the outer radius"),
        (GOOD + "C,0.5,0.2,0.02,0.01,7\n", 4, "more fields"),
        (GOOD + "C,0.5,nan,0.02,0.01\n", 4, "must be finite"),
        (GOOD + "C,0.5\n", 4, "y_m must be a number"),
        (GOOD + "\nC,0.1001,0.2,0.02,0.01\n", 5, "lies on"),
        ("id,x_m\nA,0.1\n", 1, "lacks y_m"),
        (HEAD, 1, "no rod"),
        (GOOD.encode() + b"\xff\xfe,1,1,1,1\n", 4, "UTF-8"),
    ],
)
def test_a_faulty_csv_is_refused_with_the_line(text: str, line: int, word: str) -> None:
    error = refusal(text)

    assert error.facts["line"] == line
    assert f"line {line}: " in error.message
    assert word in error.message


def test_a_faulty_rod_of_a_json_is_named_by_its_line() -> None:
    document = document_of(from_csv(GOOD.encode(), 1.0, 0.5))
    document["rods"][1]["outer_radius_m"] = -1
    text = json.dumps(document, indent=1)  # each field on a line of its own

    with pytest.raises(InvalidLayout) as caught:
        from_json(text.encode())

    line = next(n for n, words in enumerate(text.splitlines(), 1) if '"B"' in words) - 1  # where its brace opens
    assert caught.value.facts["line"] == line
    with pytest.raises(InvalidLayout, match="line 2: is not JSON"):
        from_json(b'{"width_m": 1,\n oops}')


@pytest.mark.parametrize(("kind", "neighbours"), [("hex", 6), ("square", 4)])
def test_in_the_middle_of_a_lattice_every_rod_has_its_neighbours_at_a_pitch(kind: str, neighbours: int) -> None:
    pond = lattice(kind, 0.05, columns=5, rows=5)

    places = np.array([(r.x_m, r.y_m) for r in pond.rods])
    distance = np.hypot(*(places[12] - places).T)
    assert np.isclose(np.sort(distance)[1 : neighbours + 1], 0.05, atol=1e-6).all()
    assert np.sort(distance)[neighbours + 1] > 0.06
    assert [rod.id for rod in pond.rods][:2] == ["R0000", "R0001"]
    assert pond.rods[0].y_m > pond.rods[-1].y_m  # from the upper left


@given(st.sampled_from(["hex", "square"]), st.floats(0.01, 1), st.integers(1, 12), st.integers(1, 12))
def test_every_lattice_lies_inside_its_pond_and_can_be_written_and_read(
    kind: str, pitch_m: float, columns: int, rows: int
) -> None:
    pond = lattice(kind, pitch_m, columns, rows)

    assert len(pond.rods) == columns * rows
    assert all(r.outer_radius_m < r.x_m < pond.width_m - r.outer_radius_m for r in pond.rods)
    assert all(r.outer_radius_m < r.y_m < pond.height_m - r.outer_radius_m for r in pond.rods)
    assert from_json(json.dumps(document_of(pond)).encode()) == pond


@pytest.mark.parametrize(
    "wrong", [{"kind": "round"}, {"pitch_m": 0}, {"columns": 0}, {"outer_m": 0.04}, {"margin_m": -1}, {"rows": 99_999}]
)
def test_a_lattice_that_cannot_be_is_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(InvalidLayout):
        lattice(**{"kind": "hex", "pitch_m": 0.05, "columns": 3, "rows": 3, **wrong})  # type: ignore[arg-type]


def test_a_digest_knows_a_layout_whatever_the_order_of_its_rods_and_no_other() -> None:
    pond = lattice("hex", 0.05, 3, 3)

    assert digest(pond) == digest(Pond(pond.width_m, pond.height_m, pond.rods[::-1]))
    assert digest(pond) == digest(pond, "any name")
    assert digest(pond) != digest(Pond(pond.width_m + 1e-9, pond.height_m, pond.rods))
    assert digest(Pond(1, 1), "A") != digest(Pond(1, 1), "B")
