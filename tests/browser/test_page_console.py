"""The console in Chromium: layers, raw and corrected, evidence, tables, keys."""

import time
from collections.abc import Callable, Iterator

import pytest

from tests.fakes.movie import SCALE_M, Movie
from tests.fakes.server import FakeServer, serving, shows

from .conftest import PATIENCE_S, Desk, eventually
from .test_page_live import digest_of, on_screen

pytestmark = pytest.mark.browser
COUNT = 35
AFTER_TWO_FRAMES = """() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(
    () => done(document.querySelector('.pond-canvas').toDataURL()))))"""


@pytest.fixture(scope="module")
def still() -> Iterator[FakeServer]:
    """A server that the tests here only look at: 35 snapshots, all placed, poses that came in right."""
    with serving(Movie(drift_m=0.0)) as running:
        running.source.session["state"] = "finished"  # no robot falls silent meanwhile
        running.advance(COUNT)
        yield running


@pytest.fixture
def console(desk: Desk, still: FakeServer) -> Iterator[Desk]:
    desk.open(still, "/?session=s1")
    assert desk.shows(COUNT)
    desk.page.locator("[data-robot]").first.wait_for()  # the strip below the map is filled
    yield desk
    assert desk.errors == []
    assert desk.strangers == []


def resting(look: Callable[[], str], rest_s: float = 0.5) -> str:
    """What a look sees once it stays so for a while: the map glides to where it was told to go."""
    seen, since = look(), time.monotonic()
    end = since + PATIENCE_S
    while time.monotonic() < min(since + rest_s, end):
        time.sleep(0.05)
        if (now := look()) != seen:
            seen, since = now, time.monotonic()
    return seen


def picture(desk: Desk) -> str:
    """The map as it is drawn, once it rests: equal in frames drawn one after another, however slowly they come."""
    return resting(lambda: str(desk.page.evaluate(AFTER_TWO_FRAMES)), 0.2)


@pytest.mark.parametrize(
    ("layer", "words"), [("looks", "never seen"), ("age", "older: stale"), ("uncertainty", "no sure look")]
)
def test_each_layer_is_drawn_with_its_legend(console: Desk, layer: str, words: str) -> None:
    before = picture(console)

    console.page.locator("#layer").select_option(layer)

    assert console.says(".layer-legend", words)
    assert eventually(lambda: picture(console) != before)
    assert eventually(lambda: f"show={layer}" in console.page.evaluate("location.search"))


@pytest.mark.parametrize("mark", ["rods", "robots", "tracks", "grid"])
def test_each_mark_can_be_shown_and_hidden(console: Desk, mark: str) -> None:
    before = picture(console)

    console.page.locator(f"#layer-{mark}").click()
    assert eventually(lambda: picture(console) != before)
    console.page.locator(f"#layer-{mark}").click()

    assert eventually(lambda: picture(console) == before)


def test_raw_poses_are_one_key_away_unmistakable_and_drawn_where_the_robots_said(
    console: Desk, still: FakeServer
) -> None:
    console.page.keyboard.press("c")

    assert console.says("#raw-note", "RAW POSES")
    assert still.movie
    expected = digest_of(still.movie, still)
    assert eventually(lambda: console.figure("rawDigest()") == expected), "poses that came in right need no correction"

    console.page.keyboard.press("c")
    assert not console.page.locator("#raw-note").is_visible()


def test_the_past_is_shown_as_such_and_only_what_was_seen_by_then(console: Desk, still: FakeServer) -> None:
    assert still.movie
    page = console.page
    page.locator("#scrub").fill("0")

    assert console.says("#moment", "REVIEW")
    assert page.locator("#review-note").is_visible()
    assert console.says("#count-snapshots", "1")
    first = digest_of(still.movie, still, 1)
    assert eventually(lambda: console.figure("pastDigest()") == first)
    page.locator("#scrub").fill("2000")
    everything = digest_of(still.movie, still)
    assert eventually(lambda: console.figure("pastDigest()") == everything)
    page.locator("#scrub").fill("0")
    assert eventually(lambda: console.figure("pastDigest()") == first)

    page.keyboard.press("v")
    assert console.says("#moment", "finished")
    assert console.says("#count-snapshots", str(COUNT))
    assert not page.locator("#review-note").is_visible()


def test_news_that_comes_during_a_review_is_there_on_the_way_back(desk: Desk) -> None:
    with serving() as running:
        running.advance(10)
        desk.open(running)
        assert desk.shows(10)
        desk.page.keyboard.press(" ")
        assert desk.says("#moment", "REVIEW")
        running.advance(5)
        assert desk.shows(15)
        assert desk.says("#count-snapshots", "10")

        desk.page.locator("#go-live").click()

        assert desk.says("#count-snapshots", "15")


def test_a_rod_leads_to_the_snapshots_that_show_it_in_two_clicks(console: Desk, still: FakeServer) -> None:
    rod = next(row["rod_id"] for row in still.source.changes("s1", None).rods)
    console.page.locator("#find").fill(rod)
    console.page.locator("#find").press("Enter")
    before = picture(console)

    console.page.locator(".evidence button").first.click()

    assert eventually(lambda: picture(console) != before), "its raw and its corrected outline are on the map"
    loaded = "document.querySelector('.evidence img').naturalWidth"
    assert eventually(lambda: console.page.evaluate(loaded)) == 160


def test_a_rod_that_is_not_there_is_said_and_nothing_else_happens(console: Desk) -> None:
    console.page.locator("#find").fill("R9999")
    console.page.locator("#find").press("Enter")

    assert console.page.evaluate("document.getElementById('find').validationMessage") == "There is no such rod."
    assert not console.page.locator("#rod-panel").is_visible()


def test_a_rod_never_seen_is_not_observed_in_every_place(console: Desk, still: FakeServer) -> None:
    assert still.movie
    seen = {row["rod_id"] for row in still.source.changes("s1", None).rods}
    unseen = next(rod.id for rod in still.movie.pond.rods if rod.id not in seen)

    console.open(still, f"/?session=s1&rod={unseen}")
    assert console.says("#rod-verdict", "Not observed")
    console.page.locator("#table-button").click()

    row = console.page.locator("#tables tr", has_text=unseen)
    assert "Not observed" in row.inner_text()
    assert "never" in row.inner_text()


def test_tables_say_what_the_map_shows(console: Desk, still: FakeServer) -> None:
    rows = still.source.changes("s1", None).rods
    full = [row["rod_id"] for row in rows if row["state"] == "full" and not row.get("conflicting")]

    console.page.keyboard.press("d")
    console.page.locator("#tables select").select_option("full")
    listed = console.page.locator("#tables tbody th").all_inner_texts()
    assert sorted(listed) == sorted(full)

    console.page.locator("#tables [data-tab=robots]").click()
    assert console.page.locator("#tables tbody tr").count() == 7
    console.page.locator("#tables [data-tab=snapshots]").click()
    assert console.page.locator("#tables tbody tr").count() == COUNT


def test_the_health_of_the_picture_is_told_with_where_to_look_next(console: Desk) -> None:
    assert console.says("#health-twice", "%")
    assert console.says("#look-next", "rods")
    before = picture(console)

    console.page.keyboard.press("n")

    assert eventually(lambda: picture(console) != before)


def test_the_map_is_dragged_and_zoomed_by_the_mouse_without_a_click_before(console: Desk) -> None:
    whole = picture(console)
    mouse = console.page.mouse
    mouse.move(500, 400)
    mouse.down()
    mouse.move(560, 430, steps=4)
    mouse.up()
    dragged = picture(console)
    assert dragged != whole

    mouse.wheel(0, -300)
    assert eventually(lambda: picture(console) != dragged)
    console.page.keyboard.press("0")
    assert eventually(lambda: picture(console) == whole)


def test_a_distance_is_measured_by_mouse_and_by_keys(console: Desk, still: FakeServer) -> None:
    page = console.page
    (x0, y0), (x1, y1) = (on_screen(console, still, x, 0.2) for x in (0.2, 0.5))
    page.keyboard.press("m")
    page.mouse.click(x0, y0)
    page.wait_for_timeout(400)  # two quick clicks would zoom
    page.mouse.click(x1, y1)

    assert console.says(".cursor", "Distance 30.")
    assert not page.locator("#rod-panel").is_visible()
    page.keyboard.press("m")
    page.keyboard.press("m")
    page.keyboard.press("p")
    page.keyboard.press("p")
    assert console.says(".cursor", "Distance 0.00 mm")


def test_a_view_is_the_same_from_its_address(console: Desk, make_desk: Callable[..., Desk], still: FakeServer) -> None:
    seen = still.source.changes("s1", None).rods[3]["rod_id"]
    for key in ("l", "g", "r", "[", "+"):
        console.page.keyboard.press(key)
    console.page.locator("#find").fill(seen)
    console.page.locator("#find").press("Enter")
    console.page.locator("#scrub").fill("1000")
    assert eventually(lambda: all(word in console.address for word in ("view=", "at=", "rod=", "layer65")))
    address = resting(lambda: console.address)
    other = make_desk()

    other.open(still, address)
    assert other.shows(COUNT)

    assert other.page.locator("#layer").input_value() == "looks"
    assert other.page.locator("#layer-grid").get_attribute("aria-pressed") == "true"
    assert other.page.locator("#layer-rods").get_attribute("aria-pressed") == "false"
    assert other.says("#rod-panel", f"Rod {seen}")
    assert eventually(lambda: other.text("#moment") == console.text("#moment") != "finished")
    assert eventually(lambda: other.address == console.address == address)


def test_what_is_seen_through_is_fainter_and_the_address_tells_how_much(console: Desk) -> None:
    console.page.locator("#layer").select_option("looks")
    before = picture(console)

    console.page.locator("#opacity-layer").fill("0.2")
    assert eventually(lambda: picture(console) != before)
    fainter = picture(console)
    console.page.locator("#opacity-rods").fill("0.3")

    assert eventually(lambda: picture(console) != fainter)
    assert eventually(lambda: "rods30,layer20" in console.address)


def test_a_table_is_ordered_by_a_column_and_the_other_way_round(console: Desk) -> None:
    console.page.keyboard.press("d")
    head = console.page.locator("#tables .sort", has_text="Rod")
    names = console.page.locator("#tables tbody th")

    head.click()
    rising = names.all_inner_texts()
    head.click()

    assert rising == sorted(rising)
    assert names.all_inner_texts() == rising[::-1]
    assert console.page.locator("#tables th[aria-sort=descending]").inner_text().startswith("Rod")


def test_the_rod_is_ringed_in_the_snapshots_that_show_it(console: Desk, still: FakeServer) -> None:
    rod_id = next(row["rod_id"] for row in still.source.changes("s1", None).rods)
    console.open(still, f"/?session=s1&rod={rod_id}")
    assert eventually(lambda: console.page.locator(".ring.corrected").count())

    box = console.page.locator(".evidence .picture").first.bounding_box()
    ring = console.page.locator(".ring.corrected").first.bounding_box()

    assert box
    assert ring
    pose = next(p for p in still.source.changes("s1", None).poses if shows(still, rod_id, p))
    rod = next(rod for rod in still.movie.pond.rods if rod.id == rod_id) if still.movie else None
    assert rod
    along = (ring["x"] + ring["width"] / 2 - box["x"]) / box["width"] - 0.5  # the movie's pictures are not turned
    assert along == pytest.approx((rod.x_m - pose["x_m"]) / (160 * SCALE_M), abs=0.02)
