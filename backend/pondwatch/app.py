"""The composition root: here, and only here, the parts of the server are put together."""

from __future__ import annotations

import gc
import re
import shutil
import socket
import sys
import time
from collections.abc import AsyncIterator, Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager
from dataclasses import dataclass

import structlog
import uvicorn
from fastapi import FastAPI
from starlette.concurrency import run_in_threadpool

from . import __version__
from .api import (
    alarms,
    compare,
    corrections,
    demo,
    exports,
    findings,
    health,
    jobs,
    people,
    ponds,
    problems,
    results,
    sessions,
    snapshots,
)
from .api.limits import BodyLimit, Guard
from .api.pages import FrontEnd, SafeHeaders
from .api.services import Robots, Services
from .config import Settings
from .jobs import views
from .jobs.advance import Step
from .jobs.alarms import Watch
from .jobs.feed import Feed
from .jobs.ingest import Ingest
from .jobs.lanes import Lane, ProcessLane
from .jobs.queue import Queue
from .jobs.steps import Steps
from .live.bus import LocalBus
from .live.hub import Hub
from .live.socket import live_router
from .live.source import Alarms, Changes, Patch, Raster
from .resources import frontend_dir
from .robots import DemoRobots
from .store import sessions as session_rows
from .store.clock import SystemClock
from .store.engine import wal_is_sound
from .store.store import Store
from .telemetry import Telemetry, configure_logging

_OVERHEAD = 256 * 1024  # what parts add to a picture
_GRACE_S = 3
_SWITCH_S = 0.001  # the longest that a thread holds up the event loop at a time
INTAKE_THREADS = 16


class Live:
    """`live.source.Source` over the store. It is made before the store is opened, and set then."""

    def __init__(self, telemetry: Telemetry) -> None:
        self._telemetry = telemetry
        self.store: Store | None = None
        self.feed: Feed | None = None
        self.watch: Watch | None = None

    def raster(self, session: str) -> Raster:
        """The grid of a session's mosaic."""
        assert self.store
        found = self.store.read(lambda c: session_rows.get(c, session))
        return Raster(views.metres_per_pixel(found), *views.raster_size(found))

    def changes(self, session: str, since: int | None) -> Changes:
        """What changed after a revision."""
        assert self.feed
        assert self.watch
        began = time.perf_counter()
        told = self.watch.told(session)
        news = self.feed.news(session, since)
        patches = [
            Patch("mosaic", p.rect.x, p.rect.y, p.rect.width, p.rect.height, p.revision, "image/png", p.content)
            for p in news.pictures
        ]
        alarms = Alarms(told.version, told.rows)
        derived = news.poses, news.rods, patches
        self._telemetry.spent(tell=time.perf_counter() - began)
        return Changes(news.session, news.revision, news.full, *derived, news.jobs, news.notes, alarms)


@dataclass(frozen=True, slots=True)
class Told:
    """What hears of every commit: the feed's memory, the metrics, the alarms, and the bus."""

    feed: Feed
    telemetry: Telemetry
    watch: Watch
    bus: LocalBus

    def committed(self, session_id: str, step: Step, seconds: float) -> None:
        """A revision was written."""
        self.feed.remember(session_id, step)
        self.telemetry.step_seconds.observe(seconds)
        self.telemetry.covered.inc(step.covered)
        if (s := step.stages) is not None:
            self.telemetry.spent(wait=s.wait_s, correct=s.correct_s, assemble=s.assemble_s, commit=s.commit_s)
        self.watch.wake(session_id)
        self.bus.publish(session_id, step.revision)

    def changed(self, session_id: str, revision: int) -> None:
        """A job or a session's state is otherwise."""
        self.watch.wake(session_id)
        self.bus.publish(session_id, revision)


def create_app(
    settings: Settings, make_lane: Callable[[float], Lane] = ProcessLane, robots: Robots | None = None
) -> FastAPI:
    """The whole server. It opens its data folder when it starts, not before.

    Args:
        make_lane: gives a lane that waits so many seconds for an answer.
        robots: of the demo inspection.
    """
    bus, telemetry = LocalBus(), Telemetry()
    live = Live(telemetry)
    hub, swimming = Hub(live, bus), robots or DemoRobots()

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        services = _open(settings, live, bus, telemetry, make_lane, swimming)
        app.state.services = services
        hub.start()
        yield
        await run_in_threadpool(swimming.end)
        await hub.stop()
        services.queue.close()
        services.watch.close()
        services.intake.shutdown(wait=True)
        services.store.close()

    app = FastAPI(
        title="Pondwatch",
        version=__version__,
        lifespan=lifespan,
        docs_url=None,
        redoc_url=None,
        openapi_url="/api/openapi.json",
    )
    resources = (
        sessions, snapshots, results, findings, people, corrections, exports, alarms, jobs, compare, ponds, demo,
        health,
    )  # fmt: skip
    for module in resources:
        app.include_router(module.router)
    app.include_router(ponds.sessions_router)
    app.include_router(live_router(hub, settings.allowed_origins))
    app.mount("/", FrontEnd(frontend_dir()), name="front end")
    problems.install(app)
    app.add_middleware(
        Guard, limits=_limits(settings), timeout_s=settings.body_timeout_s, allowed_origins=settings.allowed_origins
    )
    app.add_middleware(SafeHeaders)
    telemetry.watch("pondwatch_viewers", "Viewers of live feeds.", lambda: hub.viewers)
    return app


def _open(
    settings: Settings,
    live: Live,
    bus: LocalBus,
    telemetry: Telemetry,
    make_lane: Callable[[float], Lane],
    robots: Robots,
) -> Services:
    store, clock = Store(settings.data, settings.url), SystemClock()
    if not wal_is_sound():
        structlog.get_logger().info("sqlite_wal", note="one connection writes and checkpoints; readers never do")
    feed = Feed(store, settings.feed_revisions, settings.feed_bytes)
    limits = settings.alarm_limits
    watch = Watch(store, clock, limits, lambda: shutil.disk_usage(settings.data).free, bus.publish)
    live.store, live.feed, live.watch = store, feed, watch
    told = Told(feed, telemetry, watch, bus)
    lanes = [make_lane(settings.job_timeout_s) for _ in range(settings.workers)]
    queue = Queue(store, Steps(store, clock, told, limits), lanes)
    telemetry.watch("pondwatch_sessions_waiting", "Sessions that wait for a worker.", lambda: queue.waiting)
    queue.start()
    watch.start()
    intake = ThreadPoolExecutor(INTAKE_THREADS, thread_name_prefix="intake")
    ingest = Ingest(store, clock, queue.wake)
    return Services(settings, store, clock, ingest, queue, watch, told, telemetry, intake, robots)


def _limits(settings: Settings) -> list[BodyLimit]:
    one_session = "/api/sessions/[^/]+"
    return [
        BodyLimit(re.compile("/api/sessions|/api/ponds(/[^/]+/(layouts|inventories))?"), settings.max_session_bytes),
        BodyLimit(re.compile(f"{one_session}/snapshots"), settings.max_image_bytes + _OVERHEAD),
        BodyLimit(re.compile(f"{one_session}/snapshots/batch"), settings.max_batch_bytes),
    ]


class _Announcing(uvicorn.Server):
    """Says where it listens, once it does, and that it stops, before requests are waited for."""

    def __init__(self, config: uvicorn.Config, announce: Callable[[str], None], stopping: Callable[[], None]) -> None:
        super().__init__(config)
        self._announce, self._stopping = announce, stopping

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Begin to listen."""
        await super().startup(sockets)
        gc.collect()
        gc.freeze()  # what is there now stays: looking through it for garbage holds up everybody
        if self.started and self.servers:
            host, port = self.servers[0].sockets[0].getsockname()[:2]
            self._announce(f"http://{f'[{host}]' if ':' in host else host}:{port}")

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Let who waits go, then stop."""
        self._stopping()
        await super().shutdown(sockets)


def serve(
    settings: Settings,
    announce: Callable[[str], None] = lambda url: print(f"Pondwatch is at {url}", flush=True),
    app: FastAPI | None = None,
) -> None:
    """Run the server until it is told to stop (SIGINT, SIGTERM). `announce` hears its address once it listens."""
    configure_logging()
    sys.setswitchinterval(_SWITCH_S)
    served = app or create_app(settings)
    config = uvicorn.Config(
        served,
        settings.host,
        settings.port,
        log_config=None,
        access_log=False,
        server_header=False,
        proxy_headers=False,
        timeout_graceful_shutdown=_GRACE_S,
        ws_per_message_deflate=False,  # patches are compressed already, and the event loop has other work
    )
    _Announcing(config, announce, lambda: served.state.services.stopping.set()).run()
