"""The pictures of the README and the guides: each view of the console, from demo inspections on a real server.

Writes docs/pictures: what is mostly text as PNG of 256 colours, what is mostly mosaic as JPEG; each under `MOST_BYTES`.
"""

from __future__ import annotations

import io
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
from PIL import Image
from playwright.sync_api import Browser, Page, sync_playwright

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT))

from tests.bench.stage import BROWSER_FLAGS, browser_path, server  # noqa: E402

FOLDER = ROOT / "docs" / "pictures"
PART_GROWN, CUT_SHORT = 0.55, 0.25  # of the pond's floor seen
PATIENCE_S = 600
SNAPSHOTS, RATE = 320, 3.0  # a second: what the correction keeps up with beside a browser, on two cores
MOST_BYTES = 250_000


@dataclass(frozen=True, slots=True)
class Shot:
    """One picture. show: what of the address follows the session. keys: pressed in order; after `>` what is clicked."""

    name: str
    show: str = ""
    keys: tuple[str, ...] = ()
    size: tuple[int, int] = (1440, 900)
    theme: str = "light"


GROWING = (
    Shot("live.jpg"),
    Shot("live-small.jpg", size=(1024, 768)),
    Shot("live-dark.jpg", theme="dark"),
)
DONE = (
    Shot("layer-looks.jpg", "&show=looks,-robots"),
    Shot("layer-age.jpg", "&show=age,-robots"),
    Shot("layer-uncertainty.jpg", "&show=uncertainty,-robots"),
    Shot("tracks-and-grid.jpg", "&show=tracks,grid,rods30"),
    Shot("raw.jpg", "&show=raw,-rods,-robots"),
    Shot("rod.jpg", "&rod=R0130&view=0.42,0.40,0.00035&show=-robots", (">.evidence button",)),
    Shot("review.jpg", keys=(">#play", ",", ",", ",", ",", ",", ",")),
    Shot("tables.png", keys=("d", ">.sort >> nth=2")),
    Shot("keys.png", keys=("?",)),
)
ALARMS = (Shot("alarms.png", keys=("a",)), Shot("alarms-dark.png", keys=("a", "ArrowDown", " "), theme="dark"))


def main() -> None:
    """Take them."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as data, server(Path(data) / "demo") as url, sync_playwright() as play:
        browser = play.chromium.launch(executable_path=browser_path(), args=BROWSER_FLAGS)
        with simulating(url):
            session = newest(url)
            until(lambda: facts(url, session)["coverage"] >= PART_GROWN)
            take(browser, url, session, GROWING)
            until(lambda: facts(url, session)["state"] == "finished")
        take(browser, url, session, DONE)
        with simulating(url):
            until(lambda: newest(url) != session)
            until(lambda: facts(url, newest(url))["coverage"] >= CUT_SHORT)
        answer_alarms(url, newest(url))  # nobody sends any more: the robots fall silent
        take(browser, url, newest(url), ALARMS)
        shoot(browser, f"{url}/?inspections", Shot("inspections.png", keys=(">summary",)))
        browser.close()


@contextmanager
def simulating(url: str) -> Iterator[None]:
    """Another demo inspection uploads meanwhile."""
    command = [str(Path(sys.executable).parent / "pondwatch"), "simulate", "--demo", "--url", url, "--rate", str(RATE)]
    command += ["--snapshots", str(SNAPSHOTS)]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        until(lambda: httpx.get(f"{url}/api/sessions").json()["sessions"])
        yield
    finally:
        process.terminate()
        process.wait(20)


def newest(url: str) -> str:
    """The inspection that began last."""
    return str(httpx.get(f"{url}/api/sessions").json()["sessions"][0]["id"])


def facts(url: str, session: str) -> dict[str, Any]:
    """What the server says of an inspection."""
    answer: dict[str, Any] = httpx.get(f"{url}/api/sessions/{session}", timeout=60).json()
    return answer


def answer_alarms(url: str, session: str) -> None:
    """Wait for silent robots, and answer two of the alarms."""
    path = f"{url}/api/sessions/{session}/alarms"

    def silent() -> list[int]:
        rung = httpx.get(path, timeout=60).json()["alarms"]
        return [alarm["id"] for alarm in rung if alarm["kind"] == "robot-silent" and alarm["active"]]

    until(lambda: len(silent()) >= 7)
    said = {"by": "A. Lindqvist", "comment": "Battery is being changed, back at noon."}
    httpx.post(f"{path}/acknowledge", json={"alarms": silent()[:2], **said})
    httpx.post(f"{path}/shelve", json={"alarms": silent()[2:3], "for_s": 1800, **said})


def take(browser: Browser, url: str, session: str, shots: tuple[Shot, ...]) -> None:
    """Pictures of one inspection."""
    for shot in shots:
        shoot(browser, f"{url}/?session={session}{shot.show}", shot)


def shoot(browser: Browser, address: str, shot: Shot) -> None:
    """One picture into the folder."""
    page = browser.new_page(viewport={"width": shot.size[0], "height": shot.size[1]})
    page.add_init_script(f"localStorage.setItem('pondwatch-theme', '{shot.theme}')")
    page.goto(address)
    if "session=" in address:
        until(lambda: page.evaluate("() => globalThis.pondwatch?.paintedAt(pondwatch.revision) ?? null"))
    for key in shot.keys:
        page.locator(key[1:]).first.click() if key.startswith(">") else page.keyboard.press(key)
        page.wait_for_timeout(400)
    settle(page)
    content = encoded(page.screenshot(), Path(shot.name).suffix)
    (FOLDER / shot.name).write_bytes(content)
    print(f"docs/pictures/{shot.name} {len(content) / 1000:.0f} kB", flush=True)
    page.close()


def settle(page: Page) -> None:
    """Until pictures that the page loads by itself are in (a mosaic made of snapshots says how far it is)."""
    page.wait_for_timeout(1200)
    drawing = "() => / of \\d+ snapshots/.test(document.querySelector('.map-notes')?.innerText ?? '')"
    until(lambda: not page.evaluate(drawing))


def encoded(screenshot: bytes, suffix: str) -> bytes:
    """As a file: the first of falling quality that is small enough."""
    image = Image.open(io.BytesIO(screenshot)).convert("RGB")
    if suffix == ".png":
        forms: Iterable[bytes] = [written(image.quantize(256, dither=Image.Dither.NONE), "PNG")]
    else:
        forms = (written(image, "JPEG", quality) for quality in range(92, 40, -4))
    return next(content for content in forms if len(content) < MOST_BYTES)


def written(image: Image.Image, form: str, quality: int = 92) -> bytes:
    """The picture as a file."""
    out = io.BytesIO()
    image.save(out, form, optimize=True, quality=quality)
    return out.getvalue()


def until(look: Callable[[], object]) -> None:
    """Ask again and again. The page's policy forbids waiting inside it.

    Raises:
        TimeoutError: it never was so.
    """
    deadline = time.monotonic() + PATIENCE_S
    while not look():
        if time.monotonic() > deadline:
            raise TimeoutError(f"not within {PATIENCE_S} s")
        time.sleep(0.25)


if __name__ == "__main__":
    main()
