"""Figures find their place, and nothing else is touched."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.bench.pages import number, percent, replace_block, spread, table


def test_a_block_is_replaced_between_its_markers_alone(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("before\n<!-- a:begin -->\nold\n<!-- a:end -->\n<!-- b:begin -->\nstays\n<!-- b:end -->\n")

    replace_block(page, "a", r"\1 new" + "\n")

    assert page.read_text() == (
        "before\n<!-- a:begin -->\n\\1 new\n<!-- a:end -->\n<!-- b:begin -->\nstays\n<!-- b:end -->\n"
    )


def test_a_page_without_the_markers_is_refused(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("nothing\n")

    with pytest.raises(ValueError, match="no markers for a"):
        replace_block(page, "a", "new")


def test_a_table_has_a_line_a_row() -> None:
    assert table(("x", "y"), [("1", "2")]) == "| x | y |\n| --- | ---: |\n| 1 | 2 |\n"


@pytest.mark.parametrize(
    ("value", "text"), [(None, "-"), (float("nan"), "-"), (0.04567, "0.0457"), (1234.5, "1234"), (12.34, "12.3")]
)
def test_a_number_keeps_three_digits(value: float | None, text: str) -> None:
    assert number(value) == text


def test_a_share_is_told_in_percent() -> None:
    assert (percent(0.0123), percent(None)) == ("1.2 %", "-")


def test_several_values_are_told_by_the_median_the_worst_and_what_is_asked() -> None:
    assert spread([0.1, 0.3, 0.2], max, percent, 0.25) == "20.0 % (30.0 %) / 25.0 %"
    assert spread([0.1], max, percent) == "10.0 %"
    assert spread([], max, percent, 0.25) == "-"
