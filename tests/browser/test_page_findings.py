"""Findings in Chromium: what the finished inspection found, listed with its picture; a click leads there."""

import pytest

from tests.fakes.server import FakeServer

from .conftest import Desk, eventually

pytestmark = pytest.mark.browser
OBJECT = {
    "number": 1, "kind": "foreign-object", "x_m": 0.8, "y_m": 0.1, "size_mm": 4.2, "confidence": 0.83,
    "significance": 31.0, "looks": 5, "agreeing": 4, "rod_id": "R0012",
}  # fmt: skip


def test_a_finding_is_listed_with_its_picture_and_leads_to_its_place(desk: Desk, server: FakeServer) -> None:
    server.findings.append(OBJECT)
    server.source.session["state"] = "finished"
    server.advance(3)
    desk.open(server, "/?session=s1")

    assert desk.says("#findings-title", "Findings: 1")
    assert desk.says("#findings-list", "Foreign object")
    words = " ".join(desk.text("#findings-list").split())
    assert "4.2 mm, near R0012, 4 of 5 looks; x 0.800 m, y 0.100 m; confidence 83 %" in words
    loaded = "document.querySelector('#findings-list img').naturalWidth"
    assert eventually(lambda: desk.page.evaluate(loaded) == 64)
    desk.page.locator("#findings-list button").click()

    assert eventually(lambda: "view=0.8" in desk.page.evaluate("location.search"))
    metres_a_pixel = float(desk.page.evaluate("location.search").rpartition(",")[2].partition("&")[0])
    assert 4.2e-3 / metres_a_pixel > 39  # it is seen
    assert desk.errors == []


def test_a_running_inspection_has_no_findings_yet(desk: Desk, server: FakeServer) -> None:
    server.findings.append(OBJECT)
    server.advance(3)
    desk.open(server, "/?session=s1")

    assert desk.shows(3)
    assert not desk.page.locator("#findings").is_visible()
