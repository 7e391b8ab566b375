"""The link lost in Chromium: every page says so with the age of what it shows, and goes on without a reload."""

from collections.abc import Callable

import pytest

from tests.fakes.relay import relayed
from tests.fakes.server import FakeServer

from .conftest import Desk, eventually
from .test_page_live import holds_the_raster

pytestmark = pytest.mark.browser
MARK = "window.sameDocument = true"


def resumes_after(desk: Desk, server: FakeServer, cut_s: float) -> None:
    """Cut the wire under a page that watches, with news meanwhile; it holds everything in the same document."""
    with relayed(server.port) as wire:
        desk.page.goto(f"{wire.url}/?session=s1")
        assert desk.shows(server.advance(12))
        desk.page.evaluate(MARK)
        whole = whole_states(server)

        wire.cut()
        assert desk.says("#link-state", "DISCONNECTED", 3.0)
        server.advance(9)
        desk.page.wait_for_timeout(1000 * cut_s)
        assert desk.says(".banner", "The picture is")
        assert desk.figure("revision") == 12
        wire.mend()

        assert desk.says("#link-state", "Live", 10)
        assert desk.shows(21)
        assert whole_states(server) == whole, "only what was missing came"
        assert holds_the_raster(desk, server)
        assert desk.page.evaluate("window.sameDocument") is True


def whole_states(server: FakeServer) -> int:
    """How often everything was asked for."""
    return [since for since, _ in server.source.reads].count(None)


def test_a_cut_of_some_seconds_resumes_without_a_reload(desk: Desk, server: FakeServer) -> None:
    resumes_after(desk, server, 1.0)


@pytest.mark.long
def test_a_cut_of_a_minute_resumes_without_a_reload(desk: Desk, server: FakeServer) -> None:
    resumes_after(desk, server, 60.0)


@pytest.mark.parametrize(
    ("query", "said", "age"),
    [
        ("/?inspections", "#stale", "The list is"),
        ("/?session=s1", ".banner", "The picture is"),
        ("/?ponds", "#lost", "What is shown is"),
    ],
)
def test_every_page_says_within_3_s_that_the_server_is_gone(
    desk: Desk, server: FakeServer, query: str, said: str, age: str
) -> None:
    server.advance(3)
    desk.open(server, query)
    assert desk.says(".topbar", "Pond")
    if "session" in query:
        assert desk.shows(3)

    server.stop()

    assert desk.says(said, "DISCONNECTED", 3.0)
    assert age in desk.text(said)
    server.start()
    assert eventually(lambda: not desk.page.locator(said).is_visible())


def test_nothing_is_called_not_observed_before_the_state_has_come(
    make_desk: Callable[..., Desk], server: FakeServer
) -> None:
    server.advance(3)
    desk = make_desk()
    desk.page.route_web_socket("**/live*", lambda _: None)  # open, and mute

    desk.open(server, "/?session=s1")

    assert desk.says("#wait", "Waiting for the inspection")
    assert not desk.page.locator("#rods-unseen").is_visible()
    assert not desk.page.locator("#robots p").is_visible()
