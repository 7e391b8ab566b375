"""How smoothly the page moves, and what it keeps: frames a second under the hand, and the heap after many patches.

Over a scripted feed: nothing of the server's own work is in these figures.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager

from playwright.async_api import Browser, CDPSession, Page

from tests.fakes.movie import Movie
from tests.fakes.server import FakeServer, serving

from .pages import number

PONDS = ((30, 20), (100, 50))  # columns and rows of rods
FEED_HZ, HAND_S = 20.0, 8.0
PATCHES, AT_ONCE = 100_000, 200
EXPLAINED = f"""\
Panning by the mouse and zooming by the wheel for {HAND_S:.0f} s while {FEED_HZ:.0f} snapshots a second arrive from
a scripted feed: frames that the page drew a second, and the 5 % longest waits for one. Then {PATCHES:,} patches into
one page: the browser's heap after a collection, before and at the end."""
FRAMES_HEAD = ("rods", "frames a second", "frame p95, ms")
HEAP_HEAD = ("patches", "heap before, MB", "heap at the end, MB", "grew, MB")
COUNT = """
  globalThis.drawn = [];
  const count = (at) => { globalThis.drawn.push(at); requestAnimationFrame(count); };
  requestAnimationFrame(count);
"""


async def frames(browser: Browser) -> list[tuple[str, ...]]:
    """A row for each size of pond."""
    return [await _under_the_hand(browser, columns, rows) for columns, rows in PONDS]


async def _under_the_hand(browser: Browser, columns: int, rows: int) -> tuple[str, ...]:
    movie = Movie(columns, rows)
    with serving(movie) as fake:
        fake.advance(200)
        async with _page(browser, fake) as page:
            feeding = asyncio.create_task(_feed(fake))
            await page.evaluate(COUNT)
            await _hand(page)
            feeding.cancel()
            gaps = await page.evaluate("() => drawn.slice(1).map((at, i) => at - drawn[i])")
    rate, gaps = 1000 * len(gaps) / sum(gaps), sorted(gaps)
    return str(len(movie.pond.rods)), number(rate), number(gaps[int(0.95 * len(gaps))])


async def _feed(fake: FakeServer) -> None:
    while True:
        await asyncio.to_thread(fake.advance)
        await asyncio.sleep(1 / FEED_HZ)


async def _hand(page: Page) -> None:
    """Drag to and fro; zoom in and out between."""
    loop = asyncio.get_running_loop()
    ends = loop.time() + HAND_S
    await page.mouse.move(450, 400)
    turn = 0
    while loop.time() < ends:
        await page.mouse.down()
        for step in range(20):
            await page.mouse.move(450 + (-1) ** turn * 8 * step, 400 + 3 * step)
            await asyncio.sleep(1 / 60)
        await page.mouse.up()
        for _ in range(5):
            await page.mouse.wheel(0, -120 * (-1) ** turn)
            await asyncio.sleep(1 / 30)
        turn += 1


async def heap(browser: Browser) -> tuple[str, ...]:
    """The row of the heap's growth."""
    movie = Movie()
    with serving(movie) as fake:
        fake.advance(100)
        async with _page(browser, fake) as page:
            tool = await page.context.new_cdp_session(page)
            before = await _heap_mb(tool)
            for patches in _rounds(PATCHES, AT_ONCE):
                revision = _told(fake, patches)
                while await page.evaluate("() => pondwatch.revision") < revision:
                    await asyncio.sleep(0.005)
            after = await _heap_mb(tool)
    return f"{PATCHES:,}", number(before), number(after), number(after - before)


def _rounds(total: int, at_once: int) -> Iterator[range]:
    for start in range(0, total, at_once):
        yield range(start, min(total, start + at_once))


def _told(fake: FakeServer, numbers: range) -> int:
    """One revision with so many small patches, all over the pond; the revision."""
    movie = fake.movie
    assert movie is not None
    across, down = movie.raster.width_px // 48, movie.raster.height_px // 32
    places = [(n * 7 % across * 48, n * 7 // across % down * 32) for n in numbers]
    patches = [movie.patch(x, y, 48, 32, fake.source.revision + 1) for x, y in places]
    revision = fake.source.step(patches)
    fake.bus.publish("s1", revision)
    return revision


async def _heap_mb(tool: CDPSession) -> float:
    await tool.send("HeapProfiler.collectGarbage")
    return float((await tool.send("Runtime.getHeapUsage"))["usedSize"]) / 1e6


@asynccontextmanager
async def _page(browser: Browser, fake: FakeServer) -> AsyncIterator[Page]:
    """A page on the fake server's session, live; closed at the end."""
    context = await browser.new_context(viewport={"width": 1440, "height": 900})
    page = await context.new_page()
    await page.goto(f"{fake.url}/?session=s1")
    while await page.evaluate("() => globalThis.pondwatch?.revision ?? -1") < fake.source.revision:
        await asyncio.sleep(0.1)
    yield page
    await context.close()
