"""What the live page says of a picture that is old, ends, or is not decided yet."""

import pytest

from tests.fakes.server import FakeServer

from .conftest import Desk, eventually

pytestmark = pytest.mark.browser


def test_while_the_first_poses_are_being_decided_the_page_says_so_and_marks_nothing(
    desk: Desk, server: FakeServer
) -> None:
    server.advance(3)
    counts = {"snapshots": 60, "placed": 14, "uncertain": 26, "rejected": 0, "pending": 20}
    server.bus.publish("s1", server.source.step(counts=counts))
    desk.open(server, "/?session=s1")

    assert desk.says("#deciding", "Poses are still being decided: 26 of 40 are uncertain so far")
    assert not desk.page.locator("#quality").is_visible(), "what it judges is not decided"
    assert desk.page.locator("[data-figure=uncertain].attention").count() == 0

    server.bus.publish("s1", server.source.step(counts={**counts, "placed": 60, "uncertain": 0, "pending": 0}))
    assert eventually(lambda: desk.page.locator("#quality").is_visible())
    assert not desk.page.locator("#deciding").is_visible()
    assert desk.errors == []


def test_what_is_being_finished_is_not_told_as_live(desk: Desk, server: FakeServer) -> None:
    server.advance(3)
    server.bus.publish("s1", server.source.step(state="finishing"))
    desk.open(server, "/?session=s1")

    assert desk.says("#link-state", "Finishing")
    assert desk.says("#moment", "no more snapshots; the last correction is under way")
    assert desk.text("#go-live") == "Newest"


def test_data_that_grew_old_while_the_inspection_runs_is_marked(desk: Desk, server: FakeServer) -> None:
    desk.open(server, "/?session=s1")
    assert desk.shows(server.advance())
    assert desk.page.locator(".age[data-old]").count() == 0

    assert eventually(lambda: desk.page.locator(".age[data-old]").count() == 1)
