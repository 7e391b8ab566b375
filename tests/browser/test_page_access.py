"""Everyone can use it: axe-core finds nothing to complain of, on every page, in both themes."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.fakes.alarms import every_state
from tests.fakes.server import FakeServer, serving

from .conftest import Desk, eventually

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
    "review": ("/?session=s1&show=tracks&at=2030-01-01T00:00:00.000Z", ""),
    "inspections": ("/?inspections", ""),
    "start": ("/?inspections", ">#start summary"),
    "finish": ("/?session=s1", ">#finish"),
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
    options = {"runOnly": {"type": "tag", "values": RULES}, "resultTypes": ["violations"]}  # in full
    looked_at = {"exclude": [f"tbody tr:nth-child(n+{ROWS + 1})"]}  # one row of a table is as the next
    look = "async ([where, options]) => (await axe.run(where, options)).violations"
    found = desk.page.evaluate(look, [looked_at, options])
    return [(fault["id"], [str(node["target"]) for node in fault["nodes"]][:4]) for fault in found]


@pytest.mark.parametrize("name", PAGES)
def test_axe_finds_nothing_in_either_theme(desk: Desk, still: FakeServer, name: str) -> None:
    query, key = PAGES[name]
    desk.open(still, query)
    if query.startswith("/?session=s1"):
        assert desk.shows(60)
    if key:
        desk.page.locator(key[1:]).click() if key.startswith(">") else desk.page.keyboard.press(key)
    desk.page.wait_for_timeout(300)
    desk.page.evaluate(AXE.read_text())

    assert in_both_themes(desk) == []


def test_axe_finds_nothing_where_there_is_no_inspection_and_where_the_server_is_gone(
    desk: Desk, server: FakeServer
) -> None:
    server.listening = False
    desk.open(server)
    assert desk.says("#home", "Start the demo inspection")
    desk.page.evaluate(AXE.read_text())
    assert in_both_themes(desk) == []
    server.listening = True
    assert eventually(lambda: desk.figure("link") == "live")
    desk.page.evaluate(AXE.read_text())

    server.stop()

    assert desk.says(".banner", "DISCONNECTED")
    assert in_both_themes(desk) == []
    server.start()


def in_both_themes(desk: Desk) -> list[tuple[str, list[str]]]:
    found = []
    for theme in ("light", "dark"):
        desk.page.evaluate(f"document.documentElement.dataset.theme = '{theme}'")
        found += faults(desk)
    return found


def test_axe_would_find_a_fault(desk: Desk, still: FakeServer) -> None:
    desk.open(still, "/?inspections")
    assert desk.says("#home", "Pond 3")
    desk.page.evaluate(AXE.read_text())

    desk.page.evaluate("document.querySelector('h2').style.color = '#c4c5c3'")
    desk.page.evaluate("document.body.append(document.createElement('button'))")

    assert {rule for rule, _ in faults(desk)} == {"button-name", "color-contrast"}
