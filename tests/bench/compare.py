"""How long it takes to compare two inspections, to look back at a rod, and to reconcile, with years of them stored.

Writes docs/compare.md. A real server in a process of its own, asked over one connection; and Chromium in front of it.
"""

from __future__ import annotations

import os
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import httpx
import numpy as np
from playwright.sync_api import Browser, sync_playwright

from pondwatch.core.inspection import parse_inspection
from pondwatch.core.layouts import document_of, lattice
from pondwatch.core.values import Image, Pond
from pondwatch.jobs import registering
from pondwatch.store import registrations
from pondwatch.store import sessions as session_store
from pondwatch.store.store import Store
from tests.fakes.inspections import floor, readings, stored

from . import accounts
from .pages import ROOT, number, table, write_page
from .stage import BROWSER_FLAGS, browser_path, server

SESSIONS = 500
POND = lattice("square", 0.05, columns=30, rows=20, outer_m=0.018, inner_m=0.012)
SCALE_M = 0.00035  # 12 megapixels of the pond above
CHANGED = 20
ASKED, OPENED = 40, 7
REST_S, REST_WITHIN_S, RESTING = 3.0, 400.0, 0.08  # of a processor, under which a server rests
WEEK_MS = 7 * 86_400_000
LIMITS = {"another": 50.0, "compare": 50.0, "history": 50.0, "reconcile": 3000.0, "page": 2000.0}
EXPLAINED = """\
A database of {sessions} finished inspections of one pond of {rods} rods, and the two newest with mosaics of
{megapixels} megapixels each, between which {changed} rods changed. Every request goes over one connection that is kept,
one after the other, and is timed by who asks, once the server rests that has sealed them all. *Page* is from the moment
that Chromium is told the address until the comparison, and every tile of both mosaics that the view needs, stand on the
screen; each time in a browser that has nothing kept. *Reconciled* is an import of a file of {rods} lines and the
reconciliation after it. Whether planted
changes are found is measured by {pairs}."""


@dataclass(frozen=True, slots=True)
class Stored:
    """What was put into the database: the pond's id, the two newest sessions of it, and all before them."""

    pond: str
    before: str
    after: str
    earlier: tuple[str, ...]


def run() -> None:
    """Measure and write down."""
    with TemporaryDirectory() as folder:
        data = Path(folder) / "data"
        kept = fill(data, POND, SESSIONS, SCALE_M)
        with server(data) as url, httpx.Client(base_url=url, timeout=60) as client:
            _rest(accounts.find("--port", url.rsplit(":", 1)[1]))
            times = asked(client, kept, POND, ASKED)
            times["page"] = opened(f"{url}/?compare={kept.before},{kept.after}", OPENED)
    text = rows_of(times)
    size = POND.width_m * POND.height_m / SCALE_M**2 / 1e6
    told = EXPLAINED.format(
        sessions=SESSIONS, rods=len(POND.rods), megapixels=f"{size:.1f}", changed=CHANGED, pairs=_pairs()
    )
    page = write_page("compare.md", "Comparing, looking back, reconciling", [told, text, _load()])
    print(f"{text}\nwritten to {page}")


def _rest(root: int) -> None:
    """Wait until a server has sealed what it found finished and not sealed: its processes take next to nothing.

    Raises:
        TimeoutError: that did not come.
    """
    end = time.monotonic() + REST_WITHIN_S
    while time.monotonic() < end:
        before = accounts.spent({"server": root})
        time.sleep(REST_S)
        if accounts.spent({"server": root}).since(before).by["server"] < RESTING * REST_S:
            return
    raise TimeoutError(f"the server was still at work after {REST_WITHIN_S:.0f} s")


def _load() -> str:
    load, cores = os.getloadavg()[1], os.cpu_count() or 1
    busy = " Other work kept the machine busy, and all of these times are longer for it." if load > 1.5 * cores else ""
    return f"The machine's load was {load:.1f} on {cores} cores in the last minutes of it.{busy}"


def _pairs() -> str:
    command = "`python -m tests.bench pairs`"
    return f"{command}: [pairs](pairs.md)" if (ROOT / "docs/pairs.md").exists() else command


def fill(data: Path, pond: Pond, sessions: int, scale_m: float, changed: int = CHANGED) -> Stored:
    """Put inspections into a data folder, a week apart; each saw most of the rods."""
    random = np.random.default_rng(7)
    letters = random.choice(list("EFP"), len(pond.rods), p=(0.3, 0.6, 0.1))
    earlier = list[str]()
    with Store(data, f"sqlite:///{data}/pondwatch.sqlite") as store:
        for week in range(sessions - 2):
            seen = np.where(random.random(len(letters)) < 0.05, "?", letters)
            earlier.append(_keep(store, pond, "".join(seen), week, scale_m, np.zeros((1, 1, 4), np.uint8)))
            _lies_where_it_should(store, earlier[-1], len(pond.rods))
        before = _keep(
            store, pond, "".join(letters), sessions - 2, scale_m, picture(pond, "".join(letters), scale_m, 1)
        )
        other = random.choice(len(letters), changed, replace=False)
        letters[other] = np.where(letters[other] == "F", "E", "F")
        after = _keep(store, pond, "".join(letters), sessions - 1, scale_m, picture(pond, "".join(letters), scale_m, 2))
        for session in (before, after):
            registering.prepare(store, session)  # as at the end of every inspection
        pond_id = store.read(lambda c: session_store.get(c, after)).pond_id
    assert pond_id
    return Stored(pond_id, before, after, tuple(earlier))


def _lies_where_it_should(store: Store, session: str, n_rods: int) -> None:
    """What the end of an inspection would have found out of its mosaic, had it one."""
    revision = store.read(lambda c: session_store.get(c, session)).revision
    store.write(lambda c: registrations.write(c, session, revision, np.zeros((n_rods, 3))))


def _keep(store: Store, pond: Pond, letters: str, week: int, scale_m: float, mosaic: Image) -> str:
    camera = {"width_px": 320, "height_px": 220, "metres_per_pixel": scale_m}
    document = {"format": "pond-session/1", "name": f"Week {week + 1}", "camera": camera, "pond": document_of(pond)}
    now_ms = 1_500_000_000_000 + week * WEEK_MS
    return stored(store, parse_inspection(document), readings(pond, letters), mosaic, now_ms)


def picture(pond: Pond, letters: str, scale_m: float, seed: int) -> Image:
    """A mosaic as a camera would give it: with noise, which is what makes tiles heavy."""
    image = floor(pond, letters, scale_m)
    noise = np.random.default_rng(seed).normal(0, 5, image.shape[:2]).astype(np.int16)[..., None]
    image[..., :3] = np.clip(image[..., :3] + noise, 0, 255).astype(np.uint8)
    return image


def asked(client: httpx.Client, kept: Stored, pond: Pond, times: int) -> dict[str, list[float]]:
    """Milliseconds of each request, by what is asked."""
    rod = pond.rods[len(pond.rods) // 2].id
    compare = {"base": kept.before, "with": kept.after}
    told = client.get("/api/compare", params=compare).json()
    assert told["comparable"], told["sentence"]
    inventory = inventory_of(pond)

    def reconcile() -> None:
        path, headers = f"/api/ponds/{kept.pond}/inventories", {"content-type": "text/csv"}
        made = client.post(path, content=inventory, headers=headers).raise_for_status().json()
        found = client.get(f"/api/sessions/{kept.after}/reconcile", params={"inventory": made["id"]}).json()
        assert sum(found["counts"].values()) == found["total"] == len(pond.rods)

    weeks = iter(zip(kept.earlier, kept.earlier[1:], strict=False))

    def another() -> None:
        base, with_ = next(weeks)
        told = client.get("/api/compare", params={"base": base, "with": with_}).raise_for_status().json()
        assert told["comparable"], told["sentence"]

    return {
        "another": _timed(another, min(times, len(kept.earlier) - 2)),
        "compare": _timed(lambda: client.get("/api/compare", params=compare).raise_for_status(), times),
        "history": _timed(lambda: client.get(f"/api/ponds/{kept.pond}/rods/{rod}/history").raise_for_status(), times),
        "trend": _timed(lambda: client.get(f"/api/ponds/{kept.pond}/trends").raise_for_status(), max(2, times // 8)),
        "reconcile": _timed(reconcile, max(3, times // 8)),
    }


def inventory_of(pond: Pond) -> str:
    """A file that declares every rod full."""
    lines = [f"FA-{i:04d},{rod.id},full,2026-01-31" for i, rod in enumerate(pond.rods)]
    return "\n".join(["item,position,state,date", *lines]) + "\n"


def _timed(ask: Callable[[], Any], times: int) -> list[float]:
    out = []
    ask()  # the first one opens files and connections
    for _ in range(times):
        started = time.perf_counter()
        ask()
        out.append((time.perf_counter() - started) * 1000)
    return out


def opened(address: str, times: int) -> list[float]:
    """Milliseconds until the page is complete."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=browser_path(), args=list(BROWSER_FLAGS))
        out = [_open(browser, address) for _ in range(times)]
        browser.close()
    return out


def _open(browser: Browser, address: str) -> float:
    context = browser.new_context(viewport={"width": 1440, "height": 900})
    page = context.new_page()
    page.goto(address, wait_until="commit")
    until = time.monotonic() + 60
    while time.monotonic() < until:
        found = page.evaluate("window.pondwatch?.completeAt ?? null")
        if found:
            break
        time.sleep(0.01)
    else:
        raise TimeoutError("the comparison was not complete within a minute")
    context.close()
    return float(found)


def rows_of(times: dict[str, list[float]]) -> str:
    """The table: median, 95 % and slowest, ms, beside what is allowed."""
    words = {
        "another": "`GET /api/compare`, weeks not asked for before",
        "compare": "`GET /api/compare`, the same two again",
        "history": "one rod through all inspections",
        "trend": "rods by state, the last hundred inspections",
        "reconcile": "reconciled",
        "page": "page",
    }
    rows = [
        (
            words[name],
            str(len(taken)),
            *(number(v) for v in (statistics.median(taken), float(np.percentile(taken, 95)), max(taken))),
            number(LIMITS.get(name)),
        )
        for name, taken in times.items()
    ]
    return table(("what", "times", "median, ms", "95 %, ms", "slowest, ms", "limit, ms"), rows)
