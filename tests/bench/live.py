"""How live: a real server, real browsers, and the time from the start of an upload to its pixels on the page.

Writes docs/live.md. The sender, the server and every viewer share this machine's cores.
"""

from __future__ import annotations

import asyncio
import json
import tempfile
import time
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path

import httpx
import numpy as np
from playwright.async_api import Browser, Page, async_playwright

from pondwatch.basestation.bundle import Bundle, Row
from pondwatch.core.images import digest_of

from .pages import number, table, write_page
from .simulated import simulated_bundles
from .stage import BROWSER_FLAGS, browser_path, server

LIVE_HZ, BACKLOG_HZ, BACKLOG = 20.0, 100.0, 2000
SETTLE_S = 60.0
# Remembers, for each snapshot, the first revision by which this page was told of it.
TOLD = """
  globalThis.toldAt = {};
  const Native = globalThis.WebSocket;
  globalThis.WebSocket = class extends Native {
    constructor(...given) {
      super(...given);
      this.addEventListener('message', ({ data }) => {
        if (typeof data !== 'string' || !data.includes('"poses"')) return;
        const news = JSON.parse(data);
        if (news.type !== 'poses') return;
        for (const { robot, sequence } of news.poses) globalThis.toldAt[`${robot}/${sequence}`] ??= news.revision;
      });
    }
  };
"""
PAINTED = """
  (keys) => keys.map((key) => (key in toldAt ? pondwatch.paintedAt(toldAt[key]) : null))
"""
EXPLAINED = f"""\
*Painted* is the time from the start of an upload to the drawing of the frame that shows its pixels: sending,
storing, committing, correcting, assembling, encoding, the websocket, decoding and drawing. *Stored* is the time
to the answer 201. Live is {LIVE_HZ:.0f} snapshots a second; the backlog {BACKLOG:,} snapshots at
{BACKLOG_HZ:.0f} a second; *the same picture* is when every viewer shows the mosaic with the same digest, after
the last upload was acknowledged. Times in milliseconds unless they say otherwise. Viewers are headless
Chromium, drawing in software; they, the sender and the server share the cores."""


@dataclass(frozen=True, slots=True)
class Item:
    """One upload to come: its key as the page knows it, its pose as JSON, and its bytes."""

    key: str
    pose: str
    content: bytes


@dataclass(slots=True)
class Sent:
    """What was sent: when each upload began (epoch ms), how long its answer took (ms), and every answer's status."""

    began_ms: dict[str, float]
    stored_ms: list[float]
    statuses: list[int]


def run(bundles: Path | None) -> None:
    """Measure and write down."""
    with tempfile.TemporaryDirectory() as folder:
        found = sorted(p.parent for p in bundles.glob("*/session.json")) if bundles else []
        found += simulated_bundles(Path(folder), () if found else ("simulated",))
        live, backlog = asyncio.run(_measure(found, Path(folder)))
    head = ("session", "viewers", "painted p50", "painted p95", "stored p50", "stored p95", "shown")
    told = (
        "session",
        "viewers",
        "uploads a second",
        "acknowledged",
        "stored in the end",
        "stored p95",
        "same picture, s",
    )
    parts = [EXPLAINED, "## Live", table(head, live), "## A backlog", table(told, backlog)]
    print(
        "\n".join((table(head, live), table(told, backlog))),
        f"written to {write_page('live.md', 'How live it is', parts)}",
    )


async def _measure(found: Sequence[Path], folder: Path) -> tuple[list[tuple[str, ...]], list[tuple[str, ...]]]:
    first = next((b for b in found if b.name == "plain"), found[0])
    async with async_playwright() as play:
        browser = await play.chromium.launch(executable_path=browser_path(), args=BROWSER_FLAGS)
        rows = []
        for bundle, viewers in [*((b, 1) for b in found), (first, 4)]:
            with server(folder / f"live-{bundle.name}-{viewers}") as url:
                rows.append(await _live(browser, url, bundle, viewers))
            print(*rows[-1], flush=True)
        with server(folder / "backlog") as url:
            backlog = await _backlog(browser, url, first, 4)
        await browser.close()
    return rows, [backlog]


async def _live(browser: Browser, url: str, bundle: Path, viewers: int) -> tuple[str, ...]:
    with Bundle(bundle) as opened:
        items = [_item(opened, row) for row in opened.rows]
        session = await _open_session(url, opened)
    async with _watching(browser, url, session, viewers) as pages:
        sent = await _send(url, session, items, LIVE_HZ)
        painted = [np.array(await _painted(page, items)) for page in pages]
    began = np.array([sent.began_ms[item.key] for item in items])
    waits = np.concatenate([times - began for times in painted])
    shown = np.isfinite(waits)
    p50, p95 = np.percentile(waits[shown], [50, 95]) if shown.any() else (np.nan, np.nan)
    stored = np.percentile(sent.stored_ms, [50, 95])
    figures = (number(v) for v in (p50, p95, *stored))
    return bundle.name, str(viewers), *figures, f"{shown.sum()} of {shown.size}"


async def _backlog(browser: Browser, url: str, bundle: Path, viewers: int) -> tuple[str, ...]:
    """The bundle again and again, as if its robots had restarted, until there are enough."""
    with Bundle(bundle) as opened:
        items = [_item(opened, row, boot) for boot in range(-(-BACKLOG // len(opened.rows))) for row in opened.rows]
        session = await _open_session(url, opened)
    async with _watching(browser, url, session, viewers) as pages:
        began = time.monotonic()
        sent = await _send(url, session, items[:BACKLOG], BACKLOG_HZ)
        rate, ended = BACKLOG / (time.monotonic() - began), time.monotonic()
        same = await _same_picture(url, session, pages, ended)
    acknowledged = sum(status == 201 for status in sent.statuses)
    async with httpx.AsyncClient(base_url=url, timeout=60) as client:
        facts = (await client.get(f"/api/sessions/{session}")).json()
    stored = str(facts["counts"]["snapshots"])
    p95 = number(float(np.percentile(sent.stored_ms, 95)))
    return bundle.name, str(viewers), number(rate), str(acknowledged), stored, p95, number(same)


def _item(bundle: Bundle, row: Row, boot: int = 0) -> Item:
    content = bundle.content(row)
    pose = {
        "sequence": row.key.sequence,
        "robot": row.key.robot,
        "boot": row.key.boot + boot,
        "captured_at": row.captured_at,
        **dict(zip(("x_m", "y_m", "theta_rad"), row.pose, strict=True)),
        "digest": digest_of(content),
    }
    return Item(f"{row.key.robot}/{row.key.sequence}", json.dumps(pose), content)


async def _open_session(url: str, bundle: Bundle) -> str:
    async with httpx.AsyncClient(base_url=url, timeout=60) as client:
        answer = await client.post("/api/sessions", json=bundle.document)
        answer.raise_for_status()
        return str(answer.json()["id"])


@asynccontextmanager
async def _watching(browser: Browser, url: str, session: str, viewers: int) -> AsyncIterator[list[Page]]:
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


async def _send(url: str, session: str, items: Sequence[Item], rate_hz: float) -> Sent:
    """One upload each 1 / rate seconds by the clock, however long earlier ones take."""
    sent = Sent({}, [], [])
    limits = httpx.Limits(max_connections=64)
    async with httpx.AsyncClient(base_url=url, timeout=60, limits=limits) as client, asyncio.TaskGroup() as uploads:
        start = time.monotonic()
        for i, item in enumerate(items):
            await asyncio.sleep(max(0.0, start + i / rate_hz - time.monotonic()))
            uploads.create_task(_upload(client, session, item, sent))
    return sent


async def _upload(client: httpx.AsyncClient, session: str, item: Item, sent: Sent) -> None:
    sent.began_ms[item.key] = time.time() * 1000
    began = time.perf_counter()
    answer = await client.post(
        f"/api/sessions/{session}/snapshots", files={"image": item.content}, data={"pose": item.pose}
    )
    sent.stored_ms.append((time.perf_counter() - began) * 1000)
    sent.statuses.append(answer.status_code)


async def _painted(page: Page, items: Sequence[Item]) -> list[float]:
    """When each was drawn (epoch ms), NaN where it was not within `SETTLE_S`."""
    keys = [item.key for item in items]
    deadline = time.monotonic() + SETTLE_S
    while True:
        times = await page.evaluate(PAINTED, keys)
        if None not in times or time.monotonic() > deadline:
            return [float("nan") if at is None else float(at) for at in times]
        await asyncio.sleep(0.25)


async def _same_picture(url: str, session: str, pages: Sequence[Page], ended: float) -> float | None:
    """Seconds from `ended` until every page is at the server's revision with the same digest, the jobs done."""
    async with httpx.AsyncClient(base_url=url, timeout=60) as client:
        while time.monotonic() - ended < SETTLE_S * 3:
            facts = (await client.get(f"/api/sessions/{session}")).json()
            states = await asyncio.gather(
                *(page.evaluate("async () => [pondwatch.revision, await pondwatch.rasterDigest()]") for page in pages)
            )
            counts = facts["counts"]
            settled = counts["snapshots"] == counts["placed"] + counts["uncertain"] + counts["rejected"]
            if settled and len({tuple(state) for state in states}) == 1 and states[0][0] == facts["revision"]:
                return time.monotonic() - ended
            await asyncio.sleep(0.25)
    return None
