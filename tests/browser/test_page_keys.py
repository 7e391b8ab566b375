"""Twelve tasks of an operator in Chromium, each by the keyboard alone."""

from collections.abc import Callable, Iterator

import pytest

from tests.fakes.alarms import every_state
from tests.fakes.movie import Movie
from tests.fakes.server import FakeServer, serving

from .conftest import Desk, eventually
from .test_page_console import picture

pytestmark = pytest.mark.browser
COUNT = 30


@pytest.fixture(scope="module")
def still() -> Iterator[FakeServer]:
    with serving(Movie(drift_m=0.0)) as running:
        running.source.session["state"] = "finished"
        running.advance(COUNT)
        running.source.ring(*every_state())
        yield running


def press(desk: Desk, *keys: str) -> None:
    for key in keys:
        desk.page.keyboard.press(key)


def seen_rod(server: FakeServer) -> str:
    return str(server.source.changes("s1", None).rods[0]["rod_id"])


def find_a_rod(desk: Desk, server: FakeServer) -> None:
    press(desk, "/")
    desk.page.keyboard.type(seen_rod(server))
    press(desk, "Enter")
    assert desk.says("#rod-panel", f"Rod {seen_rod(server)}")


def see_why_it_reads_so(desk: Desk, server: FakeServer) -> None:
    find_a_rod(desk, server)
    assert eventually(lambda: desk.page.locator(".evidence button").count())
    desk.page.locator("#rod-panel button[aria-label=Close]").focus()
    press(desk, "Tab", "Enter")
    assert desk.page.locator(".evidence button[aria-pressed=true]").count() == 1
    press(desk, "Escape")
    assert not desk.page.locator("#rod-panel").is_visible()


def hold_raw_against_corrected(desk: Desk, _: FakeServer) -> None:
    press(desk, "c")
    assert desk.says("#raw-note", "RAW POSES")
    press(desk, "c")
    assert eventually(lambda: not desk.page.locator("#raw-note").is_visible())


def see_how_often_a_place_was_seen(desk: Desk, _: FakeServer) -> None:
    press(desk, "l", "[", "[")
    assert desk.says(".layer-legend", "8 times or more")
    assert eventually(lambda: "show=looks,layer55" in desk.address)


def find_where_to_look_next(desk: Desk, _: FakeServer) -> None:
    before = picture(desk)
    press(desk, "n")
    assert eventually(lambda: picture(desk) != before)


def zoom_and_pan(desk: Desk, _: FakeServer) -> None:
    press(desk, "+")
    assert eventually(lambda: "view=" in desk.address)
    near = desk.address
    desk.page.locator("#map").focus()
    press(desk, "ArrowRight")
    assert eventually(lambda: desk.address != near)
    press(desk, "0")
    assert eventually(lambda: "view=" not in desk.address)


def measure_a_distance(desk: Desk, _: FakeServer) -> None:
    desk.page.locator("#map").focus()
    press(desk, "m", "p")
    for _step in range(3):
        press(desk, "ArrowRight")
        desk.page.wait_for_timeout(150)
    press(desk, "p")
    assert desk.says(".cursor", "Distance")
    assert "0.00" not in desk.text(".cursor")


def go_back_in_time_and_return(desk: Desk, _: FakeServer) -> None:
    press(desk, ",")
    assert desk.says("#moment", "REVIEW")
    assert eventually(lambda: "at=" in desk.address)
    press(desk, "v")
    assert desk.says("#moment", "finished")
    assert eventually(lambda: "at=" not in desk.address)


def read_everything_as_a_table(desk: Desk, _: FakeServer) -> None:
    press(desk, "d")
    assert desk.says("#tables caption", "176 rods")
    press(desk, "Tab", "Enter")
    assert desk.says("#tables caption", "7 robots")
    press(desk, "Escape")
    assert not desk.page.locator("#tables").is_visible()


def answer_an_alarm(desk: Desk, _: FakeServer) -> None:
    press(desk, "a", "e", "q")
    assert desk.says("#alarm-dialog", "Acknowledge")
    desk.page.keyboard.type("seen")
    press(desk, "Tab")
    desk.page.keyboard.type("Ada")
    press(desk, "Escape")
    assert not desk.page.locator("#alarm-dialog").is_visible()
    press(desk, "Escape")
    assert not desk.page.locator("#alarm-list").is_visible()


def look_up_the_keys_and_change_the_theme(desk: Desk, _: FakeServer) -> None:
    press(desk, "?")
    assert desk.says("#help", "Where to look next")
    press(desk, "Escape", "t")
    assert desk.page.evaluate("document.documentElement.dataset.theme") == "dark"


def begin_another_inspection(desk: Desk, server: FakeServer) -> None:
    press(desk, "i")
    assert desk.says("#home", "Pond 3")
    desk.page.locator("#start summary").focus()
    press(desk, "Enter", "Tab")
    desk.page.keyboard.type("Tuesday")
    press(desk, "Tab", "Tab", "ArrowDown", "Tab", "Enter")
    desk.page.wait_for_url("**/?session=s1")
    assert [one["name"] for one in server.started] == ["Tuesday"]


TASKS = (
    find_a_rod,
    see_why_it_reads_so,
    hold_raw_against_corrected,
    see_how_often_a_place_was_seen,
    find_where_to_look_next,
    zoom_and_pan,
    measure_a_distance,
    go_back_in_time_and_return,
    read_everything_as_a_table,
    answer_an_alarm,
    look_up_the_keys_and_change_the_theme,
    begin_another_inspection,
)


def test_twelve_tasks_are_done_by_keys_alone(desk: Desk, still: FakeServer) -> None:
    assert len(TASKS) == 12
    for task in TASKS:
        do(task, desk, still)
    assert desk.errors == []


def do(task: Callable[[Desk, FakeServer], None], desk: Desk, server: FakeServer) -> None:
    """One task, on a page as it is opened. What it does to the mouse pointer: nothing."""
    desk.open(server, "/?session=s1")
    assert desk.shows(COUNT), task.__name__
    task(desk, server)
