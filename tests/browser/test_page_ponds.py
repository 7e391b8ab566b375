"""Ponds in Chromium, on a whole server: layouts, the past, a start there, and a session by two methods."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import httpx
import pytest

from pondwatch.core.layouts import csv_of, lattice
from tests.fakes.inspections import finished
from tests.fakes.robot import Shot, document
from tests.fakes.whole import Whole, whole

from .conftest import SIZES, Desk, eventually
from .test_page_access import AXE, faults

pytestmark = pytest.mark.browser
POND = lattice("square", 0.05, columns=3, rows=2, outer_m=0.018, inner_m=0.012)


@dataclass(frozen=True, slots=True)
class Site:
    """A server with a pond of three inspections, and a session of another that has snapshots and is finished."""

    url: str
    pond: str
    sessions: list[str]
    corrected: str


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    with whole(tmp_path_factory.mktemp("ponds") / "data") as server:
        sessions = past(server)
        pond = httpx.get(f"{server.url}/api/sessions/{sessions[0]}").json()["pond"]["id"]
        corrected = str(httpx.post(f"{server.url}/api/sessions", json=document()).json()["id"])
        for sequence in range(4):
            httpx.post(f"{server.url}/api/sessions/{corrected}/snapshots", files=Shot(sequence).parts())
        assert httpx.post(f"{server.url}/api/sessions/{corrected}/finish?wait=30", timeout=40).status_code == 200
        yield Site(server.url, pond, sessions, corrected)


def past(server: Whole) -> list[str]:
    told = (("One", "EEFFPP"), ("Two", "EEFF?P"), ("Three", "FEFFPP"))
    return [finished(server.services.store, POND, x, 1_000_000 * (i + 1), name=n) for i, (n, x) in enumerate(told)]


def upload(desk: Desk, name: str, content: str) -> None:
    desk.page.locator("#layout summary").press("Enter")
    desk.page.locator("#layout-file").set_input_files(
        {"name": name, "mimeType": "text/csv", "buffer": content.encode()}
    )


def test_a_pond_is_made_of_a_csv_and_gets_a_further_version_of_its_layout(desk: Desk, site: Site) -> None:
    desk.page.goto(f"{site.url}/?inspections")
    desk.page.get_by_role("link", name="Ponds").click()
    upload(desk, "south.csv", csv_of(POND))
    desk.page.locator("#pond-name").fill("South")
    desk.page.locator("#layout-form button").press("Enter")
    assert desk.says("#layout-form", "width_m and height_m must be given")
    for side, value in (("width_m", "0.2"), ("height_m", "0.15")):
        desk.page.locator(f"[name={side}]").fill(value)
    desk.page.locator("#layout-form button").press("Enter")
    assert desk.says("h1", "South")

    upload(desk, "fewer.csv", "\n".join(csv_of(POND).splitlines()[:-1]) + "\n")
    desk.page.locator("#layout-form button").press("Enter")

    assert desk.says("main", "5 rods, version 2 of the layout")
    assert desk.page.locator("section[aria-label=Layout] tbody tr").count() == 2


def test_a_rods_past_is_a_strip_with_gaps_and_the_pond_has_its_trend(desk: Desk, site: Site) -> None:
    desk.page.goto(f"{site.url}/?pond={site.pond}&rod=R0004")
    cells = desk.page.locator("#past li")
    assert eventually(lambda: cells.count() == 3)

    assert [cell.get_attribute("class") for cell in cells.all()] == ["seen", "gap", "seen"]
    gap = str(cells.nth(1).locator("a").get_attribute("aria-label"))
    assert gap.startswith("Two, ")
    assert gap.endswith("not observed")
    bars = desk.page.locator(".pond-trend g title")
    assert [bar.text_content() or "" for bar in bars.all()][1].endswith("2 full, 1 partial, 2 empty, 1 not observed")
    assert desk.errors == []


def test_any_two_inspections_are_compared_and_another_is_started(desk: Desk, site: Site) -> None:
    desk.page.goto(f"{site.url}/?pond={site.pond}")
    desk.page.get_by_label("One: before").check()
    desk.page.locator("#pair-form button").press("Enter")
    desk.page.wait_for_url(f"**/?compare={site.sessions[0]},{site.sessions[2]}")

    desk.page.goto(f"{site.url}/?pond={site.pond}")
    desk.page.locator("#start summary").press("Enter")
    camera = desk.page.locator("[name=width_px]")
    assert eventually(lambda: camera.input_value() == "48")  # that of the last inspection
    desk.page.locator("#start-name").fill("Four")
    desk.page.locator("#start-form button").press("Enter")
    assert desk.says("h1", "Four")
    listed = httpx.get(f"{site.url}/api/ponds/{site.pond}").json()["inspections"]
    assert [i["name"] for i in listed] == ["Four", "Three", "Two", "One"]


def test_an_inspection_is_corrected_again_and_the_verdicts_that_differ_are_told(desk: Desk, site: Site) -> None:
    desk.page.goto(f"{site.url}/?methods={site.corrected}")
    desk.page.locator("#method").select_option("graph")
    desk.page.locator("#method-form button").press("Enter")

    assert desk.says("#verdicts", "identity against graph", 20)
    assert desk.says("#differing", "6 ")
    own, other = desk.page.locator("#methods tbody th").all_inner_texts()
    assert (own, other) == ("identity", "graph")


@pytest.mark.parametrize("size", [pytest.param(SIZES[0], marks=pytest.mark.long), SIZES[1]])
def test_they_fit_and_axe_finds_nothing(make_desk: Callable[..., Desk], site: Site, size: tuple[int, int]) -> None:
    desk = make_desk(*size)
    theme = "dark" if size[0] < 1200 else "light"
    for query, words in (
        ("?ponds", "Known since"),
        (f"?pond={site.pond}&rod=R0001", "Observed in 3"),
        (f"?methods={site.corrected}", "the inspection's own"),
    ):
        desk.page.goto(f"{site.url}/{query}")
        assert eventually(lambda words=words: words.lower() in desk.text("main").lower()), words
        for fold in desk.page.locator("details").all():
            fold.evaluate("one => { one.open = true; }")
        assert desk.page.evaluate("document.documentElement.scrollWidth") <= size[0]
        desk.page.evaluate(AXE.read_text())
        desk.page.evaluate(f"document.documentElement.dataset.theme = '{theme}'")
        assert faults(desk) == [], query
