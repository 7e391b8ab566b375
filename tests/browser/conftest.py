"""Chromium, and pages that may speak to their own server only."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any, TypeVar
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import Browser, Error, Page, Request, sync_playwright

from tests.bench.stage import BROWSER_FLAGS, browser_path
from tests.fakes.server import FakeServer, serving

ALONE = "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1"  # whoever else is asked does not answer
SIZES = ((1440, 900), (1024, 768))
PATIENCE_S = 20.0  # where nothing says how quick it must be: a busy machine is no fault of the page
T = TypeVar("T")


def eventually(look: Callable[[], T], timeout_s: float = PATIENCE_S) -> T:
    """The first truthy answer; the last answer where none came in time. The page's policy forbids waiting inside it.

    `look` must ask the browser: while nobody does, `page.url` stands still."""
    end = time.monotonic() + timeout_s
    while not (answer := look()) and time.monotonic() < end:
        time.sleep(0.02)
    return answer


@dataclass
class Desk:
    """A page as an operator has it, and what it did that it should not. errors: of scripts and of the policy."""

    page: Page
    errors: list[str] = field(default_factory=list)
    strangers: list[str] = field(default_factory=list)

    def open(self, server: FakeServer, query: str = "") -> Desk:
        self.page.goto(server.url + query)
        return self

    def figure(self, name: str) -> Any:
        """One of `window.pondwatch`; None before the page has it, or while it gives way to another."""
        try:
            return self.page.evaluate(f"window.pondwatch?.{name} ?? null")
        except Error as error:
            if "navigation" in str(error):
                return None
            raise

    @property
    def address(self) -> str:
        """What follows the host. Asked of the page: `page.url` is as old as the last call to the browser."""
        return str(self.page.evaluate("location.pathname + location.search"))

    def shows(self, revision: int) -> bool:
        """Whether the revision is painted, within some seconds."""
        return bool(eventually(lambda: self.figure(f"paintedAt({revision})")))

    def text(self, selector: str) -> str:
        """What is read there, figures and their units with ordinary spaces between them."""
        return self.page.locator(selector).inner_text().replace("\u00a0", " ")

    def says(self, selector: str, words: str, timeout_s: float = PATIENCE_S) -> bool:
        return eventually(lambda: words in self.text(selector), timeout_s)


@pytest.fixture(scope="package")
def chromium() -> Iterator[Browser]:
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=browser_path(), args=[*BROWSER_FLAGS, ALONE])
        yield browser
        browser.close()


@pytest.fixture
def make_desk(chromium: Browser) -> Iterator[Callable[..., Desk]]:
    contexts = []

    def make(width: int = 1440, height: int = 900) -> Desk:
        context = chromium.new_context(viewport={"width": width, "height": height})
        contexts.append(context)
        desk = Desk(context.new_page())

        def failed(request: Request) -> None:
            if urlsplit(request.url).hostname not in ("127.0.0.1", None):
                desk.strangers.append(request.url)

        desk.page.on("requestfailed", failed)
        desk.page.on("pageerror", lambda error: desk.errors.append(str(error)))
        desk.page.on("console", lambda line: desk.errors.append(line.text) if line.type == "error" else None)
        return desk

    yield make
    for context in contexts:
        context.close()


@pytest.fixture
def desk(make_desk: Callable[..., Desk]) -> Desk:
    return make_desk()


@pytest.fixture
def server() -> Iterator[FakeServer]:
    with serving() as running:
        yield running
