"""The live page in Chromium: what arrives is painted, and what stops arriving is said."""

import hashlib
import re
import time
from collections.abc import Callable

import cv2
import numpy as np
import pytest

from pondwatch.live.hub import Timing
from tests.fakes.movie import SCALE_M, Movie
from tests.fakes.server import FakeServer, serving

from .conftest import SIZES, Desk, eventually

pytestmark = pytest.mark.browser


def digest_of(movie: Movie, server: FakeServer, count: int = 10**9) -> str:
    """SHA-256 of the raster that a page should hold, built here from the floor and the first patches' places."""
    rgba = np.zeros((movie.raster.height_px, movie.raster.width_px, 4), np.uint8)
    for patch in server.source.changes("s1", None).patches[:count]:
        area = (slice(patch.y, patch.y + patch.height), slice(patch.x, patch.x + patch.width))
        rgba[area] = np.dstack([movie.floor[area][..., ::-1], np.full(movie.floor[area].shape[:2], 255, np.uint8)])
    return hashlib.sha256(rgba.tobytes()).hexdigest()


def holds_the_raster(desk: Desk, server: FakeServer) -> bool:
    assert server.movie
    return bool(desk.figure("rasterDigest()") == digest_of(server.movie, server))


def under_cursor(desk: Desk, last: tuple[float, float] | None) -> tuple[float, float] | None:
    """The place that the page names; None while that is still the last one."""
    found = re.match(r"x (-?[\d.]+) m\s+y (-?[\d.]+) m", desk.text(".cursor").replace("\u2212", "-"))
    place = (float(found[1]), float(found[2])) if found else None
    return None if place == last else place


def place_at(desk: Desk, x: float, y: float, last: tuple[float, float] | None) -> tuple[float, float] | None:
    """What the page names with the mouse there; None while it has not seen it come."""
    desk.page.mouse.move(x + 1, y)
    desk.page.mouse.move(x, y)
    desk.page.wait_for_timeout(80)
    return under_cursor(desk, last)


def on_screen(desk: Desk, server: FakeServer, x_m: float, y_m: float) -> tuple[float, float]:
    """Page pixel of a place in the pond, by what the page says under its cursor at two points."""
    box = desk.page.locator("#map").bounding_box()
    assert box
    at = []
    for dx in (100, 400):
        last = at[-1][1:] if at else None
        place = eventually(lambda x=box["x"] + dx, y=box["y"] + 300, last=last: place_at(desk, x, y, last))
        assert place, "the place under the cursor is told"
        at.append((dx, *place))
    scale = (at[1][0] - at[0][0]) / (at[1][1] - at[0][1])
    return box["x"] + 100 + (x_m - at[0][1]) * scale, box["y"] + 300 - (y_m - at[0][2]) * scale


def test_a_patch_arrives_and_paints(desk: Desk, server: FakeServer) -> None:
    desk.open(server)
    assert eventually(lambda: desk.figure("link") == "live")
    before = desk.page.locator("#map canvas").first.screenshot()

    revision = server.advance(20)

    assert desk.shows(revision)
    assert holds_the_raster(desk, server)
    assert desk.page.locator("#map canvas").first.screenshot() != before
    assert desk.errors == []


def test_a_page_that_comes_late_holds_the_same_raster(make_desk: Callable[..., Desk], server: FakeServer) -> None:
    early, late = make_desk(), make_desk()
    early.open(server)
    revision = server.advance(40)
    late.open(server)

    assert early.shows(revision)
    assert late.shows(revision)
    assert holds_the_raster(early, server)
    assert holds_the_raster(late, server)


def test_a_rod_lights_up_when_it_is_read_and_opens_on_a_click(desk: Desk, server: FakeServer) -> None:
    desk.open(server)
    assert desk.says("#rods-unseen", "176")
    revision = server.advance(30)
    assert desk.shows(revision)
    rows = server.source.changes("s1", None).rods
    assert desk.says("#count-seen", str(len(rows)))
    assert server.movie
    full = next(row["rod_id"] for row in rows if row["state"] == "full")
    rod = next(rod for rod in server.movie.pond.rods if rod.id == full)

    desk.page.mouse.click(*on_screen(desk, server, rod.x_m, rod.y_m))

    assert desk.says("#rod-panel .panel-head", f"Rod {full}")
    assert desk.text("#rod-verdict") == "Full"
    assert eventually(lambda: desk.page.locator(".evidence img").count())
    desk.page.locator(".evidence button").first.click()
    assert desk.page.locator(".evidence button[aria-pressed=true]").count() == 1
    assert eventually(lambda: f"rod={full}" in desk.page.evaluate("location.search"))
    assert desk.errors == []


def test_a_killed_server_is_said_within_3_s_and_the_page_resumes_with_nothing_missing(desk: Desk) -> None:
    with serving() as server:
        desk.open(server)
        assert desk.shows(server.advance(10))
        server.stop()

        assert desk.says("#link-state", "DISCONNECTED", 3.0)
        assert desk.says(".banner", "DISCONNECTED")
        assert "old" in desk.text(".banner")

        server.advance(15)
        server.start()
        assert desk.shows(server.source.revision)
        assert desk.says("#link-state", "Live")
        assert not desk.page.locator(".banner").is_visible()
        full_readings = [since for since, _ in server.source.reads if since is None]
        assert len(full_readings) == 1, "it went on from its revision, without loading all again"
        assert holds_the_raster(desk, server)


def test_a_link_that_is_open_but_dead_is_said_within_3_s(desk: Desk) -> None:
    with serving(timing=Timing(beat_s=600, recheck_s=600)) as mute:
        desk.open(mute)
        assert desk.shows(mute.advance(1))

        assert desk.says("#link-state", "DISCONNECTED", 3.0)


def test_a_robot_that_falls_silent_is_shown(desk: Desk, server: FakeServer) -> None:
    assert server.movie
    server.advance(7)
    lost, heard = server.source.changes("s1", None).poses[:2]
    lost |= {"received_at": "2020-01-01T00:00:00.000Z"}
    heard |= {"received_at": "2200-01-01T00:00:00.000Z"}  # however long the page takes to load
    server.source.step(poses=[lost, heard])

    desk.open(server)

    assert desk.says("[data-robot=bubble-1] .state", "SILENT")
    assert "SILENT" not in desk.text("[data-robot=bubble-2] .state")


def test_a_running_inspection_opens_by_itself(desk: Desk, server: FakeServer) -> None:
    desk.open(server)

    assert eventually(lambda: desk.page.evaluate("location.search") == "?session=s1")
    assert desk.says("h1", "Pond 3, north bay")


def test_where_there_is_no_inspection_the_page_says_how_to_begin(desk: Desk, server: FakeServer) -> None:
    server.listening = False

    desk.open(server)

    assert desk.says("#home", "Start the demo inspection")


def test_the_first_inspection_opens_as_soon_as_it_begins(desk: Desk, server: FakeServer) -> None:
    server.listening = False
    desk.open(server)
    assert desk.says("#home", "no inspection yet")

    server.listening = True

    assert eventually(lambda: desk.figure("link") == "live")


def test_the_list_of_inspections_stays_when_it_was_asked_for(desk: Desk, server: FakeServer) -> None:
    desk.open(server, "/?inspections")
    assert desk.says("#home", "Pond 3")

    desk.page.wait_for_timeout(2000)

    assert desk.page.locator("#home").is_visible()


def test_an_inspection_that_is_not_there_is_said(desk: Desk, server: FakeServer) -> None:
    desk.open(server, "/?session=nobody")

    assert desk.says("[role=alert]", "There is no session 'nobody'.")


def test_names_with_markup_are_only_text(desk: Desk, server: FakeServer) -> None:
    evil = "<img src=x onerror=\"document.title='owned'\"><script>document.title='owned'</script>"
    server.source.session["name"] = evil
    server.source.session["quality"] = {"sentence": evil}
    server.source.step(
        poses=[{"robot": evil, "sequence": 1, "x_m": 0.2, "y_m": 0.2, "theta_rad": 0, "status": "placed"}]
    )

    desk.open(server)

    assert desk.says("h1", "<img")
    assert desk.says("#robots", "<img")
    assert "owned" not in desk.page.title().replace(evil, "")
    assert desk.page.locator("img[src=x]").count() == 0


def test_a_page_that_comes_late_says_how_old_the_picture_is(desk: Desk, server: FakeServer) -> None:
    revision = server.advance(5)
    time.sleep(2)
    desk.open(server)
    assert desk.shows(revision)

    assert eventually(lambda: desk.text("#data-age").endswith(" s"))
    assert float(desk.text("#data-age").split()[0]) >= 2


def test_the_page_speaks_to_no_other_host(desk: Desk, server: FakeServer) -> None:
    desk.open(server)
    assert desk.shows(server.advance(5))
    desk.page.locator("#theme").click()
    desk.open(server, "/?inspections")
    assert desk.says("#home", "Pond 3")

    assert desk.strangers == []
    assert desk.errors == []


def test_a_page_that_spoke_to_another_host_would_be_noticed(desk: Desk, server: FakeServer) -> None:
    desk.open(server, "/api/version")
    desk.page.evaluate("void fetch('http://elsewhere.example/').catch(() => 0)")

    assert eventually(lambda: desk.address == "/api/version" and desk.strangers == ["http://elsewhere.example/"])


@pytest.mark.parametrize("size", SIZES)
def test_nothing_overflows(make_desk: Callable[..., Desk], server: FakeServer, size: tuple[int, int]) -> None:
    desk = make_desk(*size)
    server.advance(60)
    desk.open(server)
    assert desk.shows(60)

    views = ("", "/?session=s1&rod=R0100", "/?session=s1&show=age,raw&at=2030-01-01T00:00:00.000Z", "/?inspections")
    for query in views:
        desk.open(server, query)
        assert desk.says("#home", "Pond 3") if "inspections" in query else desk.shows(60)
        width, height = desk.page.evaluate(
            "[document.documentElement.scrollWidth, document.documentElement.scrollHeight]"
        )
        assert (width, height) <= size, query
        bars = "[...document.querySelectorAll('.topbar, .toolbar, .timebar, .side, .map-notes, .layer-legend, .robot')]"
        cut = f"{bars}.filter(e => e.scrollWidth > e.clientWidth).map(e => e.className)"
        assert desk.page.evaluate(cut) == [], query


def test_a_pixel_of_the_mosaic_is_on_the_screen_where_it_lies_in_the_pond(desk: Desk, server: FakeServer) -> None:
    desk.open(server)
    assert desk.shows(server.advance(7))
    desk.page.locator("#layer-rods").click()
    desk.page.locator("#layer-robots").click()
    assert server.movie
    patch = server.source.changes("s1", None).patches[3]
    u, v = patch.x + 80, patch.y + 55
    x_m, y_m = (u + 0.5) * SCALE_M, (server.movie.raster.height_px - v - 0.5) * SCALE_M
    x, y = on_screen(desk, server, x_m, y_m)

    shot = desk.page.screenshot(clip={"x": round(x) - 2, "y": round(y) - 2, "width": 5, "height": 5})

    seen = cv2.imdecode(np.frombuffer(shot, np.uint8), cv2.IMREAD_COLOR)
    assert seen is not None
    floor = server.movie.floor[v - 3 : v + 4, u - 3 : u + 4].reshape(-1, 3).astype(float)
    np.testing.assert_allclose(seen.reshape(-1, 3).mean(0), floor.mean(0), atol=25)
