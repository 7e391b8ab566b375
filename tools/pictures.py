"""The pictures of the README and the guides: a demo server, a real browser, the mosaic part grown.

Writes docs/pictures/live.png (1440 x 900) and live-small.png (1024 x 768).
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

import httpx
from playwright.sync_api import Page, sync_playwright

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT))

from tests.bench.stage import BROWSER_FLAGS, browser_path, server  # noqa: E402

PICTURES = {"live.png": (1440, 900), "live-small.png": (1024, 768)}
PART_GROWN = 0.55  # of the pond's floor seen
PATIENCE_S = 180


def main() -> None:
    """Take them."""
    folder = ROOT / "docs" / "pictures"
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as data, server(Path(data) / "demo", "demo") as url, sync_playwright() as play:
        browser = play.chromium.launch(executable_path=browser_path(), args=BROWSER_FLAGS)
        page = browser.new_page(viewport={"width": 1440, "height": 900})
        page.goto(f"{url}/?session={first_session(url)}")
        wait_until_part_grown(page)
        for name, (width, height) in PICTURES.items():
            page.set_viewport_size({"width": width, "height": height})
            page.wait_for_timeout(1500)  # the map fits itself to its new size
            page.screenshot(path=folder / name)
            print(f"docs/pictures/{name}")
        browser.close()


def first_session(url: str) -> str:
    """The demo's, once it is open."""
    while not (sessions := httpx.get(f"{url}/api/sessions").json()["sessions"]):
        time.sleep(0.1)
    return str(sessions[0]["id"])


def wait_until_part_grown(page: Page) -> None:
    """Until the page holds a mosaic of at least `PART_GROWN` of the floor.

    Raises:
        TimeoutError: it never did.
    """
    deadline = time.monotonic() + PATIENCE_S
    while time.monotonic() < deadline:  # the page's policy forbids waiting inside it
        if page.evaluate("() => globalThis.pondwatch?.state?.facts?.coverage ?? 0") >= PART_GROWN:
            return
        time.sleep(0.25)
    raise TimeoutError(f"the mosaic did not grow to {PART_GROWN:.0%} within {PATIENCE_S} s")


if __name__ == "__main__":
    main()
