"""Alarms in Chromium, on the whole server: rung, answered, set aside and reset, before two operators at once."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import Any

import httpx
import pytest

from pondwatch.core.values import RodReading, RodState
from tests.fakes.alarms import every_state
from tests.fakes.robot import Shot, document
from tests.fakes.server import FakeServer
from tests.fakes.whole import Whole, whole

from .conftest import SIZES, Desk, eventually

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def quick(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Whole]:
    """A server that calls a robot silent after less than a second."""
    with whole(tmp_path_factory.mktemp("quick"), alarm_silent_s=0.6, alarm_disk_bytes=0) as server:
        yield server


def opened(server: Whole, **changes: Any) -> str:
    return str(httpx.post(f"{server.url}/api/sessions", json=document(**changes)).json()["id"])


def send(server: Whole, session: str, sequence: int, robot: str = "bubble-1") -> None:
    answer = httpx.post(f"{server.url}/api/sessions/{session}/snapshots", files=Shot(sequence, robot).parts())
    assert answer.status_code == 201


def watching(desk: Desk, server: Whole, session: str) -> Desk:
    desk.page.goto(f"{server.url}/?session={session}")
    assert eventually(lambda: desk.figure("link") == "live")
    assert eventually(lambda: desk.page.locator("#alarm-list").count())
    return desk


def say(desk: Desk, comment: str, time_: str | None = None) -> None:
    """Fill in the dialog and send it."""
    form = desk.page.locator("#alarm-form")
    form.locator("[name=comment]").fill(comment)
    form.locator("[name=by]").fill("Ada")
    if time_ is not None:
        form.locator("[name=for_s]").select_option(time_)
    desk.page.locator("#alarm-send").click()
    assert eventually(lambda: not desk.page.locator("#alarm-dialog").is_visible())


def do(desk: Desk, tab: str, act: str, comment: str, time_: str | None = None) -> None:
    """Choose the one alarm that a tab of the list has, and do something to it."""
    page = desk.page
    if not page.locator("#alarm-list").is_visible():
        page.keyboard.press("a")
    page.locator(f"#alarm-list [data-tab={tab}]").click()
    page.locator("#alarm-list .choose").first.click()
    page.locator(f"#alarm-list [data-act={act}]").click()
    say(desk, comment, time_)


def test_an_alarm_is_taken_through_all_its_states_before_two_browsers(
    make_desk: Callable[..., Desk], quick: Whole
) -> None:
    session = opened(quick)
    one, two = (watching(make_desk(), quick, session) for _ in range(2))
    send(quick, session, 1)
    for desk in (one, two):
        assert desk.says("#alarms", "Robot silent · bubble-1")
        assert desk.says("#alarms", "active, not acknowledged")
        assert desk.says("#alarm-count", "M · 1 alarm")
        assert eventually(lambda d=desk: d.page.title() == "(1) Test pond · Pondwatch")

    one.page.locator("#alarms .ack").click()
    say(one, "battery being changed")
    assert two.says("#alarms", "active, acknowledged")
    assert two.says("#alarms", "Ada: battery being changed")
    assert eventually(lambda: two.page.title() == "Test pond · Pondwatch")

    do(two, "current", "shelve", "diver in the water", "1800")
    assert one.says("#alarm-more", "1 set aside")
    assert one.says("#alarms-title", "No alarms")
    do(one, "aside", "unshelve", "diver is out")
    assert two.says("#alarms", "Robot silent")
    for away, back in (("suppress", "unsuppress"), ("remove-from-service", "return-to-service")):
        do(two, "current", away, "mast down")
        assert one.says("#alarm-more", "1 set aside")
        do(one, "aside", back, "mast up")
        assert two.says("#alarms-title", "Alarms · 1")

    httpx.post(f"{quick.url}/api/sessions/{session}/finish")  # nobody is silent any more
    assert one.says("#alarms-title", "No alarms")
    assert two.says("#alarms-title", "No alarms")
    two.page.locator("#alarm-list [data-tab=history]").click()
    acts = ["raise", "acknowledge", "shelve", "unshelve", "suppress", "unsuppress"]
    acts += ["remove-from-service", "return-to-service", "clear"]
    told = two.page.locator("#alarm-list tbody td:nth-child(3)")
    assert eventually(lambda: told.all_inner_texts()[::-1][: len(acts)] == acts), told.all_inner_texts()
    assert (one.errors, two.errors) == ([], [])


def test_a_rod_that_changed_is_latched_until_somebody_resets_it(make_desk: Callable[..., Desk], quick: Whole) -> None:
    before = opened(quick, name="Last year")
    quick.read(before, *(RodReading(f"R{i}", RodState.FULL, 1.0, 0.99, 3) for i in range(6)))
    assert httpx.post(f"{quick.url}/api/sessions/{before}/finish", params={"wait": 10}).json()["state"] == "finished"
    quick.read(before, *(RodReading(f"R{i}", RodState.FULL, 1.0, 0.99, 3) for i in range(6)))
    session = opened(quick)
    one, two = (watching(make_desk(), quick, session) for _ in range(2))
    quick.read(session, RodReading("R2", RodState.EMPTY, 0.0, 0.99, 3))
    one.page.keyboard.press("a")
    assert eventually(lambda: one.page.locator("#baseline option").count() > 1)

    one.page.locator("#baseline").select_option(before)

    assert two.says("#alarms", "Rod R2 was full in the baseline, and reads empty.")
    assert two.says("#alarm-count", "H · 1 alarm")
    two.page.locator("#alarms .what button").click()
    assert two.says("#rod-panel", "Rod R2")
    two.page.keyboard.press("q")
    say(two, "moved on order 7")
    quick.read(session, RodReading("R2", RodState.FULL, 1.0, 0.99, 4))
    assert one.says("#alarms", "latched until it is reset")
    do(one, "current", "reset", "seen and moved back")
    assert two.says("#alarms-title", "No alarms")


def test_the_second_to_acknowledge_is_told_that_it_was_done(make_desk: Callable[..., Desk], quick: Whole) -> None:
    session = opened(quick)
    one, two = (watching(make_desk(), quick, session) for _ in range(2))
    send(quick, session, 1)
    assert one.says("#alarms", "Robot silent")
    assert two.says("#alarms", "Robot silent")
    two.page.locator("#alarms .ack").click()
    one.page.locator("#alarms .ack").click()
    say(one, "on it")

    form = two.page.locator("#alarm-form")
    form.locator("[name=comment]").fill("me too")
    form.locator("[name=by]").fill("Bo")
    two.page.locator("#alarm-send").click()

    assert two.says("#alarm-form", "acknowledged already")


def test_a_silent_robot_is_in_the_page_within_10_s(desk: Desk, tmp_path: Any) -> None:
    with whole(tmp_path / "data") as server:
        session = opened(server)
        watching(desk, server, session)
        send(server, session, 1)
        heard = time.monotonic()

        assert desk.says("#alarms", "Robot silent · bubble-1", 10.0)
        assert desk.says("[data-robot=bubble-1] .state", "SILENT", max(0.0, 10 - (time.monotonic() - heard)))


def test_an_alarm_that_is_over_asks_to_be_acknowledged_and_is_not_told_as_active(desk: Desk, quick: Whole) -> None:
    session = opened(quick)
    watching(desk, quick, session)
    send(quick, session, 1)
    assert desk.says("#alarm-count", "M · 1 alarm")
    httpx.post(f"{quick.url}/api/sessions/{session}/finish")  # nobody is silent any more

    assert desk.says("#alarms", "returned to normal, not acknowledged")
    assert desk.says("#alarms", "Was: Robot bubble-1 was last heard")
    assert desk.says("#alarms", "Over: acknowledge it.")
    assert desk.says("#alarm-count", "1 to acknowledge")
    assert desk.page.locator("#alarm-count[data-level]").count() == 0
    desk.page.locator("#alarms .ack").click()
    say(desk, "was the battery")
    assert desk.says("#alarms-title", "No alarms")
    assert desk.errors == []


def test_alarms_are_answered_by_keys_alone(desk: Desk, quick: Whole) -> None:
    session = opened(quick)
    watching(desk, quick, session)
    for robot in ("a", "b", "c"):
        send(quick, session, 1, robot)
    assert desk.says("#alarms-title", "Alarms · 3, 3 not acknowledged")
    page, keys = desk.page, desk.page.keyboard

    def comment(text: str, name: str = "") -> None:
        keys.type(text)
        for key in ("Tab", *(["Tab"] if page.locator("[name=for_s]").is_visible() else [])):
            keys.press(key)
        keys.type(name)
        keys.press("Enter")
        assert eventually(lambda: not page.locator("#alarm-dialog").is_visible())

    keys.press("a")
    keys.press("e")
    keys.press("q")
    comment("power cut", "Ada")
    assert desk.says("#alarms-title", "0 not acknowledged")
    keys.press("e")  # none
    keys.press("ArrowDown")
    keys.press("s")
    comment("known")
    assert desk.says("#alarm-more", "1 set aside")
    keys.press("Escape")
    assert not page.locator("#alarm-list").is_visible()
    keys.press("?")
    assert desk.says("#help", "Shelve: the alarms chosen in the list")


def test_many_of_a_kind_are_one_line_and_are_acknowledged_as_one(desk: Desk, quick: Whole) -> None:
    session = opened(quick)
    watching(desk, quick, session)
    for i in range(8):
        send(quick, session, i, f"bubble-{i}")
    assert desk.says("#alarms", "8 \u00d7 Robot silent")
    assert desk.page.locator("#alarm-lines li").count() == 1
    assert eventually(lambda: desk.page.title().startswith("(8)"))

    desk.page.locator("#alarms .ack").click()
    assert desk.says("#alarm-dialog", "Acknowledge: 8 alarms")
    say(desk, "the base station restarts")

    assert desk.says("#alarms", "0 not acknowledged")
    assert eventually(lambda: desk.page.title() == "Test pond · Pondwatch")


def test_a_page_that_comes_back_shows_the_alarms_as_they_are_by_then(desk: Desk, quick: Whole) -> None:
    session = opened(quick)
    watching(desk, quick, session)
    send(quick, session, 1)
    assert desk.says("#alarms", "Robot silent")
    desk.page.context.set_offline(True)
    desk.page.evaluate("pondwatch.link")
    number = httpx.get(f"{quick.url}/api/sessions/{session}/alarms").json()["alarms"][0]["id"]
    said = {"comment": "seen", "by": "Bo"}
    assert httpx.post(f"{quick.url}/api/sessions/{session}/alarms/{number}/acknowledge", json=said).status_code == 200

    desk.page.context.set_offline(False)

    assert desk.says("#alarms", "Bo: seen", 15)


@pytest.mark.parametrize("size", SIZES)
def test_alarms_fit_beside_what_is_there(make_desk: Callable[..., Desk], server: FakeServer, size: Any) -> None:
    desk = make_desk(*size)
    server.advance(40)
    server.source.ring(*every_state())
    desk.open(server, "/?session=s1")
    assert desk.says("#alarms", "12 \u00d7 Rod changed")

    for key in ("", "a", "q"):
        if key:
            desk.page.keyboard.press(key)
        wide = "[document.documentElement.scrollWidth, document.documentElement.scrollHeight]"
        assert tuple(desk.page.evaluate(wide)) <= size
        bars = "[...document.querySelectorAll('.topbar, .toolbar, .timebar, .side, #alarm-lines li')]"
        cut = f"{bars}.filter(e => e.scrollWidth > e.clientWidth + 1).map(e => e.className)"
        assert desk.page.evaluate(cut) == []
    assert desk.errors == []
