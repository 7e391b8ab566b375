"""Everyone can use it: axe-core finds nothing to complain of, on every page, in both themes."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.fakes.alarms import every_state
from tests.fakes.server import FakeServer, serving

from .conftest import Desk

pytestmark = pytest.mark.browser
AXE = Path(__file__).parents[2] / "frontend/node_modules/axe-core/axe.min.js"
RULES = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa"]
ROWS = 6
PAGES = {
    "live": ("/?session=s1", ""),
    "layer": ("/?session=s1&show=raw,looks,grid,tracks", ""),
    "rod": ("/?session=s1&rod=R0100", ""),
    "tables": ("/?session=s1", "d"),
    "keys": ("/?session=s1", "?"),
    "alarms": ("/?session=s1", "a"),
    "comment": ("/?session=s1", "q"),
    "inspections": ("/?inspections", ""),
    "missing": ("/?session=nobody", ""),
}


@pytest.fixture(scope="module")
def still() -> Iterator[FakeServer]:
    with serving() as running:
        running.advance(60)
        running.source.ring(*every_state())
        yield running


def faults(desk: Desk) -> list[tuple[str, list[str]]]:
    """What axe complains of: the rule, and where."""
    options = {"runOnly": {"type": "tag", "values": RULES}}
    looked_at = {"exclude": [f"tbody tr:nth-child(n+{ROWS + 1})"]}  # one row of a table is as the next
    result = desk.page.evaluate("([where, options]) => axe.run(where, options)", [looked_at, options])
    return [(fault["id"], [str(node["target"]) for node in fault["nodes"]][:4]) for fault in result["violations"]]


@pytest.mark.parametrize("name", PAGES)
def test_axe_finds_nothing_in_either_theme(desk: Desk, still: FakeServer, name: str) -> None:
    query, key = PAGES[name]
    desk.open(still, query)
    if query.startswith("/?session=s1"):
        assert desk.shows(60)
    if key:
        desk.page.keyboard.press(key)
    desk.page.wait_for_timeout(300)
    desk.page.evaluate(AXE.read_text())

    for theme in ("light", "dark"):
        desk.page.evaluate(f"document.documentElement.dataset.theme = '{theme}'")
        assert faults(desk) == [], theme


def test_axe_would_find_a_fault(desk: Desk, still: FakeServer) -> None:
    desk.open(still, "/?inspections")
    assert desk.says("#home", "Pond 3")
    desk.page.evaluate(AXE.read_text())

    desk.page.evaluate("document.querySelector('h2').style.color = '#c4c5c3'")
    desk.page.evaluate("document.body.append(document.createElement('button'))")

    assert {rule for rule, _ in faults(desk)} == {"button-name", "color-contrast"}
