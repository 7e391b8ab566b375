"""A rod's panel in Chromium: how its reading came to be, and what people say of it."""

from collections.abc import Callable

import pytest

from tests.fakes.server import FakeServer

from .conftest import Desk, eventually

pytestmark = pytest.mark.browser


def fill_in(desk: Desk, form: str, title: str, **fields: str) -> None:
    """Open a form of the panel, write into it and send it."""
    desk.page.locator("#rod-panel summary", has_text=title).click()
    for name, value in fields.items():
        field = desk.page.locator(f"#{form} [name={name}]")
        if field.evaluate("element => element.tagName") == "SELECT":
            field.select_option(value)
        else:
            field.fill(value)
    desk.page.locator(f"#{form} button").click()


def test_a_rod_corrected_by_hand_shows_both_verdicts_here_and_to_others(
    make_desk: Callable[..., Desk], server: FakeServer
) -> None:
    server.advance(20)
    rows = server.source.changes("s1", None).rods
    empty = next(row["rod_id"] for row in rows if row["state"] == "empty" and not row.get("conflicting"))
    desk, other = make_desk(), make_desk()
    for one in (desk, other):
        one.open(server, f"/?session=s1&rod={empty}")
        assert one.says("#rod-verdict", "Empty")
    assert desk.says("#rod-history", "Empty")

    words = {"reason": "Glare, <b>not</b> hollow", "by": "A. Person"}
    fill_in(desk, "judge-form", "Correct by hand", state="partial", fill="40", **words)

    for one in (desk, other):
        assert one.says("#rod-verdict", "Partial 40 % · by hand")
        assert one.says("#rod-reading", "Machine reads")
        assert one.says("#rod-said", "Glare, <b>not</b> hollow")
    assert desk.says("#rod-said", "machine then: Empty")

    fill_in(desk, "judge-form", "Correct by hand", state="", reason="It was right", by="A. Person")
    for one in (desk, other):
        assert eventually(lambda one=one: one.text("#rod-verdict") == "Empty")
        assert one.errors == []


def test_a_note_is_kept_with_its_rod_and_the_name_is_remembered(desk: Desk, server: FakeServer) -> None:
    server.advance(10)
    desk.open(server, "/?session=s1&rod=R0003")
    assert desk.says("#rod-panel", "Write a note")

    fill_in(desk, "note-form", "Write a note", text="Look again tomorrow", by="A. Person")

    assert desk.says("#rod-said", "Look again tomorrow")
    assert server.notes[0]["rod_id"] == "R0003"
    assert desk.page.locator("#note-form [name=by]").input_value() == "A. Person"
    assert desk.errors == []


def test_a_judgement_without_a_reason_is_not_sent(desk: Desk, server: FakeServer) -> None:
    server.advance(10)
    desk.open(server, "/?session=s1&rod=R0003")
    assert desk.says("#rod-panel", "Correct by hand")

    fill_in(desk, "judge-form", "Correct by hand", reason="", by="A. Person")

    desk.page.wait_for_timeout(300)
    assert server.said == {}


def test_behind_a_rod_stand_the_snapshots_of_the_moment_that_is_shown(desk: Desk, server: FakeServer) -> None:
    server.advance(10)
    rows = {row["rod_id"]: row["views"] for row in server.source.changes("s1", None).rods}
    rod = max(rows, key=lambda name: rows[name])
    desk.open(server, f"/?session=s1&rod={rod}")
    pictures = desk.page.locator(".evidence button")
    assert eventually(lambda: pictures.count() > 0)
    before = pictures.count()
    pictures.last.click()
    assert desk.says("#evidence-poses", "Pose that came")
    assert desk.says("#evidence-poses", "Corrected\nx ")

    desk.page.locator("#scrub").fill("0")
    assert desk.says("#rod-panel", "by then")
    assert eventually(lambda: pictures.count() < before)
    assert not desk.text("#evidence-poses"), "what had not come by then is not chosen either"
    assert desk.says("#health-title", "coverage then")
    desk.page.keyboard.press("v")
    assert eventually(lambda: pictures.count() == before)

    while {row["rod_id"]: row["views"] for row in server.source.changes("s1", None).rods}[rod] == rows[rod]:
        server.advance()
    assert eventually(lambda: pictures.count() > before), "what came since is listed without asking"
    assert desk.errors == []
