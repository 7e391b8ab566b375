"""Viewers: real browsers on the live page, and when each thing was told to them and drawn."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Iterable, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass

from playwright.async_api import Browser, Page

SETTLE_S = 60.0
# Remembers, for each snapshot and each rod that is read, the first revision that told this page of it, and when.
TOLD = """
  globalThis.toldOf = {};
  const Native = globalThis.WebSocket;
  globalThis.WebSocket = class extends Native {
    constructor(...given) {
      super(...given);
      this.addEventListener('message', ({ data }) => {
        if (typeof data !== 'string') return;
        const head = data.slice(0, 24) + data.slice(-24);
        if (!head.includes('poses') && !head.includes('rods')) return;
        const { type, revision, poses = [], rods = [] } = JSON.parse(data);
        if (type !== 'poses' && type !== 'rods') return;
        const known = [revision, Date.now()];
        for (const { robot, boot, sequence } of poses) globalThis.toldOf[`${robot}/${boot ?? 0}/${sequence}`] ??= known;
        for (const { rod_id, state } of rods) if (state !== 'unseen') globalThis.toldOf[`rod ${rod_id}`] ??= known;
      });
    }
  };
"""
MOMENTS = """
  (names) => names.map((name) => {
    const known = toldOf[name];
    return known ? [known[1], pondwatch.paintedAt(known[0])] : [null, null];
  })
"""


@dataclass(frozen=True, slots=True)
class Moment:
    """When a page heard of something and drew it, epoch ms; NaN where it did not."""

    told_ms: float
    painted_ms: float


@asynccontextmanager
async def watching(browser: Browser, url: str, session: str, viewers: int) -> AsyncIterator[list[Page]]:
    """That many pages, each in a profile of its own, all live."""
    contexts = [await browser.new_context(viewport={"width": 1024, "height": 768}) for _ in range(viewers)]
    pages = []
    for context in contexts:
        page = await context.new_page()
        await page.add_init_script(TOLD)
        await page.goto(f"{url}/?session={session}")
        while await page.evaluate("() => globalThis.pondwatch?.link") != "live":
            await asyncio.sleep(0.1)  # the page's policy forbids waiting inside it
        pages.append(page)
    yield pages
    for context in contexts:
        await context.close()


async def moments(page: Page, names: Sequence[str], required: Iterable[str] = ()) -> dict[str, Moment]:
    """When each of some things was told and drawn; waits for those required, at most `SETTLE_S`."""
    deadline, needed = time.monotonic() + SETTLE_S, set(required)
    while True:
        found = dict(zip(names, await page.evaluate(MOMENTS, list(names)), strict=True))
        if all(None not in found[name] for name in needed) or time.monotonic() > deadline:
            nan = float("nan")
            return {name: Moment(*(nan if at is None else float(at) for at in both)) for name, both in found.items()}
        await asyncio.sleep(0.25)


async def digests(pages: Sequence[Page]) -> set[tuple[int, str]]:
    """The revision and the digest of the picture that each page shows."""
    shown = await asyncio.gather(
        *(page.evaluate("async () => [pondwatch.revision, await pondwatch.rasterDigest()]") for page in pages)
    )
    return {(int(revision), str(digest)) for revision, digest in shown}
