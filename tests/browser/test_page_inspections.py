"""The list of inspections in Chromium: searched, paged; an inspection started and finished."""

import json

import pytest

from tests.fakes.movie import CAMERA
from tests.fakes.server import FakeServer

from .conftest import Desk, eventually

pytestmark = pytest.mark.browser


def names(desk: Desk) -> list[str]:
    return list(desk.page.locator("#home tbody td:first-child a").all_inner_texts())


def start(desk: Desk, name: str, text: str) -> None:
    desk.page.locator("#start-name").fill(name)
    desk.page.locator("#start-file").set_input_files(
        {"name": "l.json", "mimeType": "application/json", "buffer": text.encode()}
    )
    desk.page.locator("#start-form button").click()


def test_inspections_are_searched_and_turned_page_by_page(desk: Desk, server: FakeServer) -> None:
    server.older = 30
    desk.open(server, "/?inspections")
    assert eventually(lambda: len(names(desk)) == 25)

    desk.page.locator("#older").click()
    assert eventually(lambda: names(desk) == [f"Old {i}" for i in range(24, 30)])
    desk.page.locator("#newer").click()
    assert eventually(lambda: len(names(desk)) == 25)
    desk.page.locator("#search").fill("old 7")
    assert eventually(lambda: names(desk) == ["Old 7"])
    desk.page.locator("#search").fill("nothing like it")
    assert desk.says("#home", "No inspection has such a name.")
    assert desk.errors == []


def test_an_inspection_starts_from_a_layout_with_the_camera_of_an_earlier_one(desk: Desk, server: FakeServer) -> None:
    layout = {"width_m": 1.0, "height_m": 0.7, "rods": []}
    desk.open(server, "/?inspections")
    assert desk.says("#home", "Pond 3")
    desk.page.locator("#start summary").click()
    start(desk, "Tuesday", json.dumps(layout))
    assert desk.says("#start-form", "nothing of the camera")

    desk.page.locator("#start-earlier").select_option("s1")
    desk.page.locator("#start-form button").click()

    desk.page.wait_for_url("**/?session=s1")
    camera = {name: getattr(CAMERA, name) for name in ("width_px", "height_px", "metres_per_pixel")}
    assert server.started == [{"format": "pond-session/1", "name": "Tuesday", "camera": camera, "pond": layout}]


def test_a_layout_that_cannot_be_used_is_said_with_what_is_wrong(desk: Desk, server: FakeServer) -> None:
    desk.open(server, "/?inspections")
    assert desk.says("#home", "Pond 3")
    desk.page.locator("#start summary").click()

    start(desk, "Tuesday", "{")
    assert desk.says("#start-form", "l.json is not JSON")
    start(desk, "Tuesday", json.dumps({"camera": {"width_px": 8}, "pond": {"width_m": 1}}))
    assert desk.says("#start-form", "pond.height_m is missing.")


def test_an_inspection_is_finished_after_a_question(desk: Desk, server: FakeServer) -> None:
    server.advance(3)
    desk.open(server, "/?session=s1")
    assert desk.shows(3)
    desk.page.locator("#finish").click()
    assert desk.says("#finish-dialog", "cannot be opened again")
    desk.page.locator("#finish-dialog button", has_text="Go on").click()
    assert desk.text(".badge") == "running"

    desk.page.locator("#finish").click()
    desk.page.locator("#finish-now").click()

    assert desk.says(".badge", "finished")
    assert eventually(lambda: not desk.page.locator("#finish").is_visible())


def test_where_nothing_is_the_demo_is_one_click_away(desk: Desk, server: FakeServer) -> None:
    server.listening, server.demo_runs = False, True
    desk.open(server, "/?inspections")
    assert desk.says("#home", "There is no inspection yet.")
    desk.page.locator("#start-demo").click()
    assert desk.says("#home", "The demo inspection runs already.")
    assert desk.page.locator("#start-demo").is_enabled()

    server.demo_runs = False
    desk.page.locator("#start-demo").click()

    assert desk.says("h1", "Pond 3"), "the page goes to it by itself"


def test_a_finished_inspection_reads_final_and_is_replayed_from_its_beginning(desk: Desk, server: FakeServer) -> None:
    server.advance(6)
    server.bus.publish("s1", server.source.step(state="finished", finished_at="2030-01-01T12:00:05.000Z"))
    desk.open(server, "/?session=s1")

    assert desk.says("#go-live", "Final")
    assert desk.says("#moment", "finished 2030-01-01 12:00:05 UTC")
    assert desk.says("#link-state", "Final")
    assert not desk.page.locator("#data-age").is_visible()
    desk.page.locator("#play").click()
    assert desk.says("#moment", "REVIEW")
    assert desk.says("#link-state", "Review "), "an older moment is not told as the end"
    assert desk.page.locator("#link-state").get_attribute("data-state") == "review"
    desk.page.locator("#go-live").click()
    assert desk.says("#moment", "finished")
    assert desk.says("#link-state", "Final")
    assert desk.errors == []


def test_back_in_time_a_rod_reads_as_it_did_then(desk: Desk, server: FakeServer) -> None:
    server.advance(20)
    rod = next(r for r in server.source.changes("s1", None).rods if r["state"] == "full" and not r.get("conflicting"))
    began = {"rod_id": rod["rod_id"], "at": "2000-01-01T00:00:00.000Z", "revision": 1, "state": "empty", "fill": 0.0}
    server.readings = [{**began, "confidence": 0.7, "views": 1, "conflicting": False}]
    desk.open(server, f"/?session=s1&rod={rod['rod_id']}")
    assert desk.says("#rod-verdict", "Full")

    desk.page.locator("#scrub").fill("2000")

    assert desk.says("#rod-verdict", "Empty")
    assert desk.says("#review-note", "rods as they read then")
    desk.page.keyboard.press("v")
    assert desk.says("#rod-verdict", "Full")
    assert desk.errors == []
