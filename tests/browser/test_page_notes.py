"""Notes in Chromium, on the whole server: written by one, there for the other, dealt with, and handed over."""

from collections.abc import Callable, Iterator

import httpx
import pytest

from tests.fakes.robot import document
from tests.fakes.whole import Whole, whole

from .conftest import Desk, eventually

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Whole]:
    with whole(tmp_path_factory.mktemp("notes"), alarm_disk_bytes=0) as running:
        yield running


def watching(desk: Desk, server: Whole, session: str) -> Desk:
    desk.page.goto(f"{server.url}/?session={session}")
    assert eventually(lambda: desk.figure("link") == "live")
    assert eventually(lambda: desk.page.locator("#find").count())
    return desk


def test_a_note_of_a_place_is_there_for_the_next_shift_until_somebody_dealt_with_it(
    make_desk: Callable[..., Desk], server: Whole
) -> None:
    session = str(httpx.post(f"{server.url}/api/sessions", json=document(name="Night")).json()["id"])
    one, two = (watching(make_desk(), server, session) for _ in range(2))

    one.page.keyboard.press("h")
    one.page.keyboard.type("Bolt on the floor")
    one.page.locator("#write-form [name=about]").select_option("place")
    one.page.locator("#write-form [name=by]").fill("Ada")
    one.page.locator("#write-form button").click()

    assert two.says("#notes-panel", "Notes · 1 open")
    assert two.says("#notes", "Bolt on the floor")
    assert two.says("#notes", "0.10, 0.06 m"), "the middle of a pond of 0.2 x 0.12 m"
    two.page.locator("#notes button", has_text="Dealt with").click()
    assert two.says("#notes-panel", "Write your name below first")
    two.page.locator("#write-form [name=by]").fill("Bo")
    two.page.locator("#notes button", has_text="Dealt with").click()

    assert one.says("#notes", "closed by Bo")
    assert one.says("#notes-panel", "Notes · 0 open")
    one.page.goto(f"{server.url}/?inspections")
    assert one.says("#handover", "Bolt on the floor")
    assert one.says("#handover", "closed by Bo")
    one.page.locator("#handover a").click()
    assert one.says("h1", "Night")
    assert (one.errors, two.errors) == ([], [])
