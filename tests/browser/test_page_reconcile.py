"""Declared against observed in Chromium, on a whole server: import, refusal, lines, evidence, keys."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import httpx
import pytest

from pondwatch.core.values import RodReading, RodState
from tests.fakes.robot import Shot, document
from tests.fakes.whole import Whole, whole

from .conftest import SIZES, Desk, eventually
from .test_page_access import AXE, faults

pytestmark = pytest.mark.browser
HEAD = "item,position,state,date\n"
GOOD = HEAD + "".join(
    f"FA-{i},R{i},{state},2026-01-31\n" for i, state in enumerate(("full", "empty", "empty", "full", "partial"))
)


@dataclass(frozen=True, slots=True)
class Pool:
    """A server with one inspection that has snapshots: R0 full, R1 full, R2 empty but not sure, R3 not observed, R4
    half full, R5 empty."""

    server: Whole
    session: str

    @property
    def page(self) -> str:
        return f"{self.server.url}/?reconcile={self.session}"


@pytest.fixture(scope="module")
def pool(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Pool]:
    with whole(tmp_path_factory.mktemp("reconcile") / "data") as server:
        session = str(httpx.post(f"{server.url}/api/sessions", json=document()).json()["id"])
        for sequence in range(6):  # right over each of the rods
            place = (("x_m", 0.03 + 0.03 * sequence), ("y_m", 0.06), ("theta_rad", 0.0))
            parts = Shot(sequence, changes=place).parts()
            httpx.post(f"{server.url}/api/sessions/{session}/snapshots", files=parts)
        assert httpx.post(f"{server.url}/api/sessions/{session}/finish?wait=30", timeout=40).status_code == 200
        full, half, empty = (RodState.FULL, 1.0), (RodState.PARTIAL, 0.5), (RodState.EMPTY, 0.0)
        read = {
            "R0": (*full, 0.99),
            "R1": (*full, 0.99),
            "R2": (*empty, 0.6),
            "R4": (*half, 0.99),
            "R5": (*empty, 0.99),
        }
        server.read(session, *(RodReading(rod, state, fill, sure, 3) for rod, (state, fill, sure) in read.items()))
        yield Pool(server, session)


def choose(desk: Desk, name: str, text: str) -> None:
    if not desk.page.locator("#inventory-file").is_visible():
        desk.page.locator("#import summary").press("Enter")
    desk.page.locator("#inventory-file").set_input_files(
        {"name": name, "mimeType": "text/csv", "buffer": text.encode()}
    )
    desk.page.locator("#inventory-form button").press("Enter")


def items(desk: Desk) -> list[str]:
    return list(desk.page.locator("#reconciled tbody th").all_inner_texts())


def test_a_faulty_file_is_refused_line_by_line_and_a_good_one_is_reconciled(desk: Desk, pool: Pool) -> None:
    desk.page.goto(pool.page)
    assert desk.says("#sum", "No inventory was imported for this pond yet.")
    choose(desk, "bad.csv", HEAD + "A,R0,full,2026-01-31\nB,R99,full,2026-01-31\nC,R1,brim,2026-01-31\n")
    assert desk.says("#inventory-form [role=alert]", "bad.csv is refused: 2 faulty lines. Nothing was imported.")
    told = desk.page.locator(".fault-lines li").all_inner_texts()
    assert [line.split(" ")[:2] for line in told] == [["Line", "3"], ["Line", "4"]]
    assert "no position 'R99'" in told[0]
    assert not desk.page.locator("#reconciled").count()

    choose(desk, "January.csv", GOOD)

    assert desk.says("#sum", "5 lines = 1 discrepancy + 1 ambiguous + 1 not observed + 2 agree.")
    assert items(desk) == ["FA-1", "FA-2", "FA-3", "FA-0", "FA-4"]
    assert "empty" in desk.text("#reconciled tbody tr:first-child")
    assert "Discrepancy" in desk.text("#reconciled tbody tr:first-child")
    assert desk.says("#undeclared", "1 position that no line names")
    refused = "Failed to load resource: the server responded with a status of 422"
    assert [line for line in desk.errors if refused not in line] == []


def test_a_discrepancy_opens_its_snapshots_in_two_clicks(desk: Desk, pool: Pool) -> None:
    declare(pool)
    desk.page.goto(pool.page)

    desk.page.locator("#reconciled button", has_text="FA-1").click()
    assert desk.says("#line-title", "FA-1 · Discrepancy")
    pictures = desk.page.locator("#line-panel figure", has_text="bubble-1").locator("a")
    assert eventually(lambda: pictures.count() > 0)
    assert eventually(lambda: desk.page.locator("#line-panel .past li").count() == 1)
    rings = desk.page.locator("#line-panel .picture .ring")
    assert rings.count() == pictures.count()  # which of the rods in a snapshot it is
    with desk.page.context.expect_page() as tab:
        pictures.first.click()

    assert "/snapshots/bubble-1/" in tab.value.url
    assert "Empty, on 2026-01-31 (line 3)" in desk.text("#line-panel")


def declare(pool: Pool) -> None:
    pond = httpx.get(f"{pool.server.url}/api/sessions/{pool.session}").json()["pond"]["id"]
    headers = {"content-type": "text/csv"}
    path = f"{pool.server.url}/api/ponds/{pond}/inventories"
    assert httpx.post(path, content=GOOD, params={"name": "January.csv"}, headers=headers).status_code == 201


def test_the_keys_go_through_the_lines_and_the_address_brings_them_back(desk: Desk, pool: Pool) -> None:
    declare(pool)
    desk.page.goto(pool.page)
    assert eventually(lambda: len(items(desk)) == 5)

    desk.page.keyboard.press("4")  # agree: left out
    assert items(desk) == ["FA-1", "FA-2", "FA-3"]
    for _ in range(2):
        desk.page.keyboard.press("n")
    assert desk.says("#line-title", "FA-2 · Ambiguous")
    assert "only=disagree,ambiguous,not_observed&line=4" in desk.page.url
    with desk.page.expect_download() as waiting:
        desk.page.keyboard.press("e")
    assert len(waiting.value.path().read_text().splitlines()) == 6  # the file has every line

    desk.page.goto(desk.page.url)
    assert desk.says("#line-title", "FA-2 · Ambiguous")
    assert items(desk) == ["FA-1", "FA-2", "FA-3"]


@pytest.mark.parametrize("size", [pytest.param(SIZES[0], marks=pytest.mark.long), SIZES[1]])
def test_it_fits_and_axe_finds_nothing(make_desk: Callable[..., Desk], pool: Pool, size: tuple[int, int]) -> None:
    declare(pool)
    desk = make_desk(*size)
    desk.page.goto(f"{pool.page}&line=3")
    assert eventually(lambda: desk.page.locator("#line-panel figure").count() > 1)

    assert desk.page.evaluate("document.documentElement.scrollWidth") <= size[0]
    assert desk.page.locator(".side").evaluate("e => e.scrollWidth - e.clientWidth") == 0
    desk.page.evaluate(AXE.read_text())
    desk.page.evaluate(f"document.documentElement.dataset.theme = '{'dark' if size[0] < 1200 else 'light'}'")
    assert faults(desk) == []
