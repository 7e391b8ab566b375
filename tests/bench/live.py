"""How live: a real server, real browsers, and the time from the start of an upload to its pixels on the page.

Writes docs/live.md. The sender, the server and every viewer share this machine's cores.
"""

from __future__ import annotations

import asyncio
import hashlib
import json
import os
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import httpx
import numpy as np
from playwright.async_api import Browser, Page, async_playwright

from pondwatch.basestation.bundle import Bundle, Row
from pondwatch.core.coverage import rods_in_view
from pondwatch.core.images import digest_of

from . import accounts, smooth
from .accounts import Spent
from .pages import number, table, write_page
from .sender import Item, Sent, send
from .simulated import simulated_bundles
from .stage import BROWSER_FLAGS, browser_path, server
from .stages import Stages, stages
from .watching import Moment, digests, moments, watching

LIVE_HZ, BACKLOG_HZ, BACKLOG = 20.0, 100.0, 2000
PATIENCE_S = 180.0
EXPLAINED = f"""\
*Painted* is the time from the start of an upload to the drawing of the frame that shows its pixels: sending,
storing, committing, correcting, assembling, encoding, the websocket, decoding and drawing. *Stored* is the time
to the answer 201; *told* to the arrival of the snapshot's pose in the browser. Live is {LIVE_HZ:.0f} snapshots a
second; the backlog {BACKLOG:,} snapshots at {BACKLOG_HZ:.0f} a second. A rod's *verdict* counts from the start of
the upload of the first snapshot that shows the whole rod. *The same picture* is when every viewer shows the
mosaic with the digest of the server's own, counted from the last acknowledgement. Times in milliseconds unless they
say otherwise.

Viewers are headless Chromium, drawing in software; they, the sender and the server share the cores. The sender's
requests are made beforehand and written as they are. *Others* is processor time that programs took which have
nothing to do with the measurement: figures made beside much of it are too high."""
GOALS = """\
The goals: painted 80 at the median and 200 at the 95th percentile; a verdict within 1,000; in the backlog stored
250 at the 95th percentile and the same picture within 5 s; 45 frames a second with 600 rods; the heap grows by less
than 20 MB, the server by less than 100 MB."""
LIVE_HEAD = (
    *("session", "viewers", "painted p50", "painted p95", "told p50", "told p95", "stored p50", "stored p95"),
    *("verdict p50", "verdict p95", "shown", "same digest"),
)
STAGE_HEAD = ("session", "viewers", "wait", "correct", "assemble", "commit", "tell", "draw")
SPENT_HEAD = ("session", "viewers", "server", "workers", "sender", "browsers", "others", "seconds", "server, MB")
BACKLOG_HEAD = (
    *("session", "viewers", "uploads a second", "acknowledged", "stored in the end"),
    *("stored p50", "stored p95", "same picture, s", "server grew, MB"),
)


@dataclass(frozen=True, slots=True)
class Run:
    """Rows of the tables that a run goes into."""

    live: tuple[str, ...]
    stages: tuple[str, ...]
    spent: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Cast:
    """The processes on the stage, by what they do."""

    server: int
    browser: int

    def spent(self) -> Spent:
        """Processor time of each so far. Workers are the server's children."""
        workers = {f"worker {pid}": pid for pid in accounts.children(self.server)}
        return accounts.spent({"server": self.server, "browsers": self.browser, "sender": os.getpid(), **workers})


def run(bundles: Path | None) -> None:
    """Measure and write down."""
    with tempfile.TemporaryDirectory() as folder:
        found = sorted(p.parent for p in bundles.glob("*/session.json")) if bundles else []
        found += simulated_bundles(Path(folder), () if found else ("simulated",))
        parts = asyncio.run(_measure(found, Path(folder)))
    print("\n\n".join(parts), f"written to {write_page('live.md', 'How live it is', parts)}")


async def _measure(found: Sequence[Path], folder: Path) -> list[str]:
    first = next((b for b in found if b.name == "plain"), found[0])
    async with async_playwright() as play:
        browser = await play.chromium.launch(executable_path=browser_path(), args=BROWSER_FLAGS)
        runs = []
        for bundle, viewers in [*((b, 1) for b in found), (first, 4)]:
            with server(folder / f"live-{bundle.name}-{viewers}") as url:
                runs.append(await _live(browser, url, bundle, viewers))
            print(*runs[-1].live, flush=True)
        with server(folder / "backlog") as url:
            backlog = await _backlog(browser, url, first, 4)
        print(*backlog, flush=True)
        frames = await smooth.frames(browser)
        heap = await smooth.heap(browser)
        await browser.close()
    return [
        EXPLAINED,
        GOALS,
        "## Live",
        table(LIVE_HEAD, [r.live for r in runs]),
        "Where it goes, mean of each stage; *draw* is from the word of it to the frame that shows it:",
        table(STAGE_HEAD, [r.stages for r in runs]),
        "Processor seconds of each, in the time that the run took, and the server's memory at its end:",
        table(SPENT_HEAD, [r.spent for r in runs]),
        "## A backlog",
        table(BACKLOG_HEAD, [backlog]),
        "## Smooth",
        smooth.EXPLAINED,
        table(smooth.FRAMES_HEAD, frames),
        table(smooth.HEAP_HEAD, [heap]),
    ]


async def _live(browser: Browser, url: str, bundle: Path, viewers: int) -> Run:
    with Bundle(bundle) as opened:
        items = [item_of(opened, row) for row in opened.rows]
        session, inspection = await _open_session(url, opened), opened.inspection
    cast = Cast(accounts.find("--port", url.rsplit(":", 1)[1]), accounts.find("chrom", "--headless"))
    async with watching(browser, url, session, viewers) as pages:
        before, began = cast.spent(), time.monotonic()
        sent = await send(url, session, items, LIVE_HZ)
        names = [i.key for i in items] + [f"rod {rod.id}" for rod in inspection.pond.rods]
        seen = [await moments(page, names, [i.key for i in items]) for page in pages]
        spent, seconds = cast.spent().since(before), time.monotonic() - began
        same = await _same_picture(url, session, pages, time.monotonic())
        memory = accounts.memory_mb(cast.server)
    first_ms = await _first_looks(url, session, sent, inspection)
    verdicts = _waits(seen, {f"rod {rod}": at for rod, at in first_ms.items()}, "painted_ms")
    painted = _waits(seen, sent.began_ms, "painted_ms")
    told = _waits(seen, sent.began_ms, "told_ms")
    figures = [*_percentiles(painted), *_percentiles(told), *_percentiles(np.array(sent.stored_ms))]
    shown = f"{np.isfinite(painted).sum()} of {painted.size}"
    head = bundle.name, str(viewers)
    means: Stages = await stages(url)
    drawn = float(np.nanmean(painted - told))
    return Run(
        (*head, *figures, *_percentiles(verdicts), shown, "yes" if same is not None else "no"),
        (*head, *(number(1000 * means[stage]) for stage in STAGE_HEAD[2:-1]), number(drawn)),
        (*head, *_shares(spent), number(seconds), number(memory)),
    )


async def _backlog(browser: Browser, url: str, bundle: Path, viewers: int) -> tuple[str, ...]:
    """The bundle again and again, as if its robots had restarted, until there are enough."""
    with Bundle(bundle) as opened:
        items = [item_of(opened, row, boot) for boot in range(-(-BACKLOG // len(opened.rows))) for row in opened.rows]
        session = await _open_session(url, opened)
    root = accounts.find("--port", url.rsplit(":", 1)[1])
    async with watching(browser, url, session, viewers) as pages:
        before_mb, began = accounts.memory_mb(root), time.monotonic()
        sent = await send(url, session, items[:BACKLOG], BACKLOG_HZ)
        rate, ended = BACKLOG / (time.monotonic() - began), time.monotonic()
        same = await _same_picture(url, session, pages, ended)
        grew_mb = accounts.memory_mb(root) - before_mb
    acknowledged = sum(status == 201 for status in sent.statuses)
    stored = str((await _facts(url, session))["counts"]["snapshots"])
    waits = _percentiles(np.array(sent.stored_ms))
    return bundle.name, str(viewers), number(rate), str(acknowledged), stored, *waits, number(same), number(grew_mb)


def item_of(bundle: Bundle, row: Row, boot: int = 0) -> Item:
    """A row of a bundle as it is sent, `boot` restarts of its robot later."""
    content = bundle.content(row)
    pose = {
        "sequence": row.key.sequence,
        "robot": row.key.robot,
        "boot": row.key.boot + boot,
        "captured_at": row.captured_at,
        **dict(zip(("x_m", "y_m", "theta_rad"), row.pose, strict=True)),
        "digest": digest_of(content),
    }
    return Item(f"{row.key.robot}/{row.key.boot + boot}/{row.key.sequence}", json.dumps(pose), content)


def _waits(seen: Sequence[dict[str, Moment]], began_ms: dict[str, float], what: str) -> np.ndarray[Any, Any]:
    """Milliseconds from when each thing began to when each page heard or drew it."""
    return np.array([getattr(page[name], what) - at for page in seen for name, at in began_ms.items()])


def _percentiles(waits: np.ndarray[Any, Any]) -> tuple[str, str]:
    known = waits[np.isfinite(waits)]
    p50, p95 = np.percentile(known, [50, 95]) if known.size else (None, None)
    return number(p50), number(p95)


def _shares(spent: Spent) -> list[str]:
    workers = sum(seconds for name, seconds in spent.by.items() if name.startswith("worker"))
    by = spent.by
    return [number(v) for v in (by["server"], workers, by["sender"], by["browsers"], spent.others)]


async def _first_looks(url: str, session: str, sent: Sent, inspection: Any) -> dict[str, float]:
    """When the upload began of the first snapshot that shows each rod whole, by its corrected pose."""
    async with httpx.AsyncClient(base_url=url, timeout=60) as client:
        rows = (await client.get(f"/api/sessions/{session}/poses")).json()["poses"]
    placed = [row for row in rows if row["status"] == "placed"]
    where = np.array([(row["x_m"], row["y_m"], row["theta_rad"]) for row in placed]).reshape(-1, 3)
    began = np.array([sent.began_ms[f"{row['robot']}/{row['boot']}/{row['sequence']}"] for row in placed])
    views = rods_in_view(where, inspection.pond, inspection.camera)
    rods = [rod.id for rod in inspection.pond.rods]
    return {rod: float(began[views[:, j]].min()) for j, rod in enumerate(rods) if views[:, j].any()}


async def _served(url: str, session: str) -> str:
    """The digest of the server's own mosaic, as a page makes it of its own: SHA-256 of RGBA, row by row."""
    async with httpx.AsyncClient(base_url=url, timeout=60) as client:
        content = (await client.get(f"/api/sessions/{session}/mosaic.png")).content
    pixels = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED)
    assert pixels is not None
    return hashlib.sha256(cv2.cvtColor(pixels, cv2.COLOR_BGRA2RGBA).tobytes()).hexdigest()


async def _facts(url: str, session: str) -> dict[str, Any]:
    async with httpx.AsyncClient(base_url=url, timeout=60) as client:
        found: dict[str, Any] = (await client.get(f"/api/sessions/{session}")).json()
        return found


async def _open_session(url: str, bundle: Bundle) -> str:
    async with httpx.AsyncClient(base_url=url, timeout=60) as client:
        answer = await client.post("/api/sessions", json=bundle.document)
        answer.raise_for_status()
        return str(answer.json()["id"])


async def _same_picture(url: str, session: str, pages: Sequence[Page], ended: float) -> float | None:
    """Seconds from `ended` until every page is at the server's revision with the same digest, all snapshots covered."""
    while time.monotonic() - ended < PATIENCE_S:
        facts = await _facts(url, session)
        if not facts["counts"]["pending"]:
            shown, seen_s = await digests(pages), time.monotonic() - ended
            if len(shown) == 1 and shown == {(facts["revision"], await _served(url, session))}:
                return seen_s
        await asyncio.sleep(0.25)
    return None
