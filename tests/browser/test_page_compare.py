"""Two inspections beside each other in Chromium, on a whole server: pictures, changed rods, keys, address, refusals."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import cv2
import httpx
import numpy as np
import pytest

from pondwatch.core.layouts import lattice
from pondwatch.core.values import RodReading, RodState
from pondwatch.jobs.provenance import method_digest
from tests.fakes.inspections import finished, floor
from tests.fakes.robot import document
from tests.fakes.whole import Whole, whole

from .conftest import SIZES, Desk, eventually
from .test_page_access import AXE, faults

pytestmark = pytest.mark.browser
POND = lattice("square", 0.05, columns=5, rows=4, outer_m=0.018, inner_m=0.012)
BEFORE = "EEEEEFFFFFPPPPPEFEF?"
AFTER = "EEFEEFFEFFPPPPEEFE?F"
CHANGED = ["R0002", "R0007", "R0014"]


@dataclass(frozen=True, slots=True)
class Surveys:
    """A server with three inspections of a pond; the last lies 3.4 px aside, over the limit of 3 px. running: one of
    another pond."""

    server: Whole
    before: str
    after: str
    aside: str
    running: str

    def pair(self, more: str = "") -> str:
        return f"{self.server.url}/?compare={self.before},{self.after}{more}"


@pytest.fixture(scope="module")
def surveys(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Surveys]:
    with whole(tmp_path_factory.mktemp("compare") / "data") as server:
        store = server.services.store
        before = finished(store, POND, BEFORE, 1_000, name="January")
        after = finished(store, POND, AFTER, 2_000_000, name="July")
        aside = finished(store, POND, AFTER, 3_000_000, name="Aside", image=floor(POND, AFTER, shift_px=(3.4, 0.0)))
        running = str(httpx.post(f"{server.url}/api/sessions", json=document()).json()["id"])
        yield Surveys(server, before, after, aside, running)


def opened(desk: Desk, address: str) -> Desk:
    desk.page.goto(address)
    assert eventually(lambda: desk.figure("completeAt"), 15)
    return desk


def listed(desk: Desk) -> list[str]:
    return [text.split(" ·")[0] for text in desk.page.locator("#changes strong").all_inner_texts()]


def brightness(desk: Desk, rod: int, half: str = "#map-first") -> float:
    """Of the picture at a rod's middle, the whole pond being shown; marks and symbols are not."""
    box = desk.page.locator(half).bounding_box()
    assert box is not None
    scale = min((box["width"] - 64) / POND.width_m, (box["height"] - 58) / POND.height_m)
    middle_x, middle_y = box["x"] + 40 + (box["width"] - 64) / 2, box["y"] + 14 + (box["height"] - 58) / 2
    x = middle_x + (POND.rods[rod].x_m - POND.width_m / 2) * scale
    y = middle_y - (POND.rods[rod].y_m - POND.height_m / 2) * scale
    clip = {"x": x - 3, "y": y + 5, "width": 6, "height": 6}
    image = cv2.imdecode(np.frombuffer(desk.page.screenshot(clip=clip), np.uint8), cv2.IMREAD_GRAYSCALE)  # type: ignore[arg-type]
    assert image is not None
    return float(image.mean())


def test_the_last_inspection_is_one_click_away_and_the_changed_rods_are_told(desk: Desk, surveys: Surveys) -> None:
    desk.page.goto(f"{surveys.server.url}/?inspections")
    desk.page.locator("tr", has_text="July").get_by_text("Compare").click()
    assert eventually(lambda: desk.figure("completeAt"), 15)

    assert f"?compare={surveys.before},{surveys.after}" in desk.page.url  # no `last`: a colleague sees the same two
    assert listed(desk) == ["R0002", "R0007", "R0014", "R0018", "R0019"]
    assert "empty → full" in desk.text("#changes li:nth-child(1)")
    assert "may have moved from R0007" in desk.text("#changes li:nth-child(1)")
    assert "not observed after" in desk.text("#changes li:nth-child(4)")
    assert "within the limit" in desk.text("#residual")
    assert desk.text("#residual tbody tr:nth-child(4)").split() == ["Limit", "3.00", "px", "3.000", "mm"]
    assert "coverage 100 %" in desk.text(".pair-side.after")
    assert desk.errors == []
    assert desk.strangers == []


def test_a_rod_tells_by_what_it_was_read(desk: Desk, surveys: Surveys) -> None:
    desk.page.goto(f"{surveys.server.url}/?session={surveys.after}&rod=R0002")

    assert desk.says("#rod-panel", "Method digest")
    assert desk.says("#rod-panel", f"sha256:{method_digest()[:12]}")
    assert desk.errors == []


def test_each_place_is_asked_for_at_one_scale_and_complete_means_painted(desk: Desk, surveys: Surveys) -> None:
    """A map as wide as both, if only for a moment, needs tiles of level 3; half as wide, of level 2."""
    store, fine = surveys.server.services.store, 0.00025  # m a pixel: levels 0 to 3
    pond = lattice("square", 0.05, columns=5, rows=4, outer_m=0.019, inner_m=0.012)
    pair = [finished(store, pond, letters, 5_000_000, scale_m=fine) for letters in (BEFORE, AFTER)]
    asked = list[str]()
    desk.page.on("request", lambda request: asked.append(request.url) if "/tiles/" in request.url else None)

    opened(desk, f"{surveys.server.url}/?compare={','.join(pair)}")

    by_then = len(asked)
    levels = [url.split("/tiles/mosaic/")[1].split("/")[0] for url in asked]
    assert sorted(levels) == ["0"] * 2 + ["2"] * 12
    desk.page.wait_for_timeout(300)
    assert len(asked) == by_then


def becomes(desk: Desk, rod: int, expected: float, within: float, half: str = "#map-first") -> bool:
    """Whether the rod's middle is as bright as expected before patience ends: the map draws a frame after the key."""
    return bool(eventually(lambda: abs(brightness(desk, rod, half) - expected) <= within))


def test_every_way_of_showing_the_two_shows_what_it_says(desk: Desk, surveys: Surveys) -> None:
    """R0002 was empty (bright) and is full (dark)."""
    opened(desk, surveys.pair("&mode=blink&front=base&show=-changes"))
    assert eventually(lambda: brightness(desk, 2) > 200)
    bright = brightness(desk, 2)
    desk.page.keyboard.press("x")
    assert eventually(lambda: brightness(desk, 2) < 100)
    dark = brightness(desk, 2)

    desk.page.keyboard.press("1")
    assert becomes(desk, 2, bright, 12)
    assert becomes(desk, 2, dark, 12, "#map-second")
    opened(desk, surveys.pair("&mode=swipe&at=1&show=-changes"))
    assert becomes(desk, 2, bright, 8)
    opened(desk, surveys.pair("&mode=swipe&at=0&show=-changes"))
    assert becomes(desk, 2, dark, 8)
    opened(desk, surveys.pair("&mode=opacity&at=0.5&show=-changes"))
    assert becomes(desk, 2, (bright + dark) / 2, 12)
    opened(desk, surveys.pair("&mode=difference&show=-changes"))
    assert becomes(desk, 2, 255 - (bright - dark), 12)
    assert becomes(desk, 3, 255, 3)
    assert becomes(desk, 19, 190, 12)  # seen in one only: the floor, no made-up difference


def test_both_maps_show_the_same_place(desk: Desk, surveys: Surveys) -> None:
    opened(desk, surveys.pair())
    scales = desk.page.locator(".ol-scale-line-inner")
    before = scales.all_inner_texts()

    desk.page.locator("#map-second").focus()
    for _ in range(4):
        desk.page.keyboard.press("+")
        desk.page.wait_for_timeout(180)

    after = eventually(lambda: scales.all_inner_texts() if scales.all_inner_texts() != before else None)
    assert len(after) == 2
    assert after[0] == after[1] != before[0]
    assert eventually(lambda: "view=" in desk.page.url)


def test_the_keys_alone_do_everything_and_the_address_brings_it_back(desk: Desk, surveys: Surveys) -> None:
    opened(desk, surveys.pair())
    for key in ("2", "]", "]", "n", "n"):
        desk.page.keyboard.press(key)
    assert desk.says("#rod-title", "R0007 · Emptied")
    assert eventually(lambda: desk.page.locator(".before-after img").count() == 2)
    assert desk.page.locator("#changes [aria-pressed=true]").get_attribute("data-rod") == "R0007"
    assert "may have moved to R0002" in desk.text("#rod-panel")
    cells = desk.page.locator("#rod-past li")
    assert eventually(lambda: cells.count() == 3)
    assert "January, " in str(cells.first.locator("a").get_attribute("aria-label"))
    desk.page.locator("#only-not_comparable").press("Enter")
    desk.page.locator("#sort").select_option("rod")
    desk.page.locator("#order").press("Enter")
    assert listed(desk) == CHANGED[::-1]
    assert eventually(lambda: "view=" in desk.page.url)
    address, words = desk.page.url, desk.text("#changes")
    parts = ("mode=swipe", "at=0.6", "rod=R0007", "only=filled,emptied,partly", "order=desc")
    assert [part for part in parts if part not in address] == []

    opened(desk, address)
    assert desk.text("#changes") == words
    assert desk.says("#rod-title", "R0007 · Emptied")
    assert desk.page.locator("#at").input_value() == "0.6"
    assert desk.page.url == address
    desk.page.keyboard.press("Escape")
    assert eventually(lambda: not desk.page.locator("#rod-panel").is_visible())


def test_the_table_has_all_rods_and_the_file_too(desk: Desk, surveys: Surveys) -> None:
    opened(desk, surveys.pair("&only=filled,emptied,partly"))
    desk.page.keyboard.press("d")
    rows = desk.page.locator("#tables tbody tr")
    assert rows.count() == 3
    assert "added; may have moved from R0007" in rows.first.inner_text()
    desk.page.keyboard.press("Enter")  # the way back has the focus
    assert not desk.page.locator("#tables").is_visible()

    with desk.page.expect_download() as waiting:
        desk.page.keyboard.press("e")
    content = waiting.value.path().read_text().splitlines()
    assert content[0].startswith("rod_id,change,word,reason,confidence")
    assert [line.split(",")[0] for line in content[1:]] == [*CHANGED, "R0018", "R0019"]


def test_mosaics_that_do_not_coincide_are_refused_and_say_why(desk: Desk, surveys: Surveys) -> None:
    opened(desk, f"{surveys.server.url}/?compare={surveys.before},{surveys.aside}&mode=difference")

    assert desk.says("#sentence", "NOT COMPARABLE: no difference is claimed")
    assert desk.says("#sentence", "do not lie on each other")
    assert "OVER THE LIMIT" in desk.text("#residual")
    assert desk.page.locator("#show-difference").is_disabled()
    assert desk.figure("mode") == "side"
    desk.page.keyboard.press("5")
    assert desk.figure("mode") == "side"
    assert set(desk.page.locator("#changes button").evaluate_all("all => all.map((one) => one.dataset.change)")) == {
        "not_comparable"
    }


def test_other_ponds_have_nothing_to_compare_and_a_first_inspection_none_before(desk: Desk, surveys: Surveys) -> None:
    opened(desk, f"{surveys.server.url}/?compare={surveys.before},{surveys.running}")
    assert desk.says("#sentence", "no rod in common")

    desk.page.goto(f"{surveys.server.url}/?compare=last,{surveys.before}")
    assert desk.says("#fault", "no finished inspection of this pond before it")


def test_an_inspection_that_runs_says_so_and_that_it_has_gone_on(desk: Desk, surveys: Surveys) -> None:
    other = str(httpx.post(f"{surveys.server.url}/api/sessions", json=document()).json()["id"])
    opened(desk, f"{surveys.server.url}/?compare={other},{surveys.running}")
    assert desk.says(".pair-side.after .badge.running", "RUNNING")

    surveys.server.read(surveys.running, RodReading("R0", RodState.FULL, 1.0, 0.999, 4))

    assert desk.says("#news", "Test pond has gone on: revision 1, and this page shows 0.")
    desk.page.get_by_text("Compare again").click()
    assert desk.says(".pair-side.after .badge.running", "as of revision 1")


def addresses(surveys: Surveys) -> dict[str, str]:
    """Of the page as it is with a rod, with its table, and refused; the key pressed there."""
    refused = f"{surveys.server.url}/?compare={surveys.before},{surveys.aside}"
    return {surveys.pair("&mode=swipe&rod=R0007"): "", surveys.pair(): "d", refused: ""}


@pytest.mark.parametrize("theme", ["dark", pytest.param("light", marks=pytest.mark.long)])
def test_axe_finds_nothing(desk: Desk, surveys: Surveys, theme: str) -> None:
    for address, key in addresses(surveys).items():
        opened(desk, address)
        if key:
            desk.page.keyboard.press(key)
        desk.page.evaluate(AXE.read_text())
        desk.page.evaluate(f"document.documentElement.dataset.theme = '{theme}'")
        assert faults(desk) == [], address


@pytest.mark.parametrize("size", [pytest.param(SIZES[0], marks=pytest.mark.long), SIZES[1]])
def test_nothing_overflows(make_desk: Callable[..., Desk], surveys: Surveys, size: tuple[int, int]) -> None:
    desk = opened(make_desk(*size), next(iter(addresses(surveys))))

    assert eventually(lambda: desk.page.locator(".before-after img").count() == 2)
    assert desk.page.evaluate("document.documentElement.scrollWidth") <= size[0]
    assert desk.page.locator(".side").evaluate("e => e.scrollWidth - e.clientWidth") == 0
