"""Who watches which session, and what they are owed.

A viewer holds one number: the revision delivered to it in full. When a session moves on, each viewer that is ready
asks for what changed since its own number; viewers at the same or a newer number share one reading. A slow viewer
is given one larger step later, never a queue, and holds up nobody. Reading and encoding run in threads.

The bus may lose messages, so a feed with viewers is also read every few seconds without one.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from datetime import UTC, datetime

from . import protocol
from .bus import LocalBus
from .protocol import Bells, Delivery, Frame
from .source import Raster, Source

Send = Callable[[Frame], Awaitable[None]]


@dataclass(frozen=True, slots=True)
class Timing:
    """Seconds. beat_s: between signs of life. recheck_s: between readings without a message. stall_s: how long one
    frame may take to leave before the viewer is let go."""

    beat_s: float = 1.0
    recheck_s: float = 5.0
    stall_s: float = 10.0


class StalledError(Exception):
    """A viewer took no frame for too long."""


class Feed:
    """One session's news, for all its viewers. Used on the event loop only."""

    def __init__(self, session: str, source: Source, threads: ThreadPoolExecutor) -> None:
        self.session = session
        self.viewers = 0
        self.tick = 0
        self._source = source
        self._threads = threads
        self._moved = asyncio.Event()
        self._shared: dict[int | None, asyncio.Future[Delivery]] = {}
        self._bells: Bells | None = None

    def move(self) -> None:
        """There may be news: wake whoever waits, and let nobody have a reading from before."""
        self.tick += 1
        self._shared = {}
        self._moved.set()
        self._moved = asyncio.Event()

    async def news(self, seen_tick: int, timeout_s: float) -> bool:
        """Wait for a move after `seen_tick`; False where none came in time."""
        if self.tick != seen_tick:
            return True
        try:
            await asyncio.wait_for(self._moved.wait(), max(timeout_s, 0.0))
        except TimeoutError:
            return False
        return True

    async def since(self, revision: int | None) -> Delivery:
        """What takes a viewer from `revision` to the newest; one reading serves all who hold that much or more."""
        reading = self._shared.get(self._nearest(revision))
        if reading is None:
            reading = asyncio.get_running_loop().run_in_executor(self._threads, self._read, revision)
            self._shared[revision] = reading
        try:
            return await asyncio.shield(reading)
        except Exception:
            self._shared = {}  # the next to ask tries again
            raise

    async def raster(self) -> Raster:
        """The session's grid. Raises core.errors.Missing where there is no such session."""
        return await asyncio.get_running_loop().run_in_executor(self._threads, self._source.raster, self.session)

    def _nearest(self, revision: int | None) -> int | None:
        if revision is None:
            return None
        return max((key for key in self._shared if key is not None and key <= revision), default=revision)

    def _read(self, revision: int | None) -> Delivery:
        read = protocol.delivery(self._source.changes(self.session, revision), self._bells)
        self._bells = read.bells
        return read


class Hub:
    """The feeds that somebody watches. Make it, `start` it on the loop, `stop` it there."""

    def __init__(self, source: Source, bus: LocalBus, timing: Timing | None = None, threads: int = 4) -> None:
        self.timing = timing or Timing()
        self._source = source
        self._bus = bus
        self._threads = ThreadPoolExecutor(threads, thread_name_prefix="live")
        self._feeds: dict[str, Feed] = {}
        self._unsubscribe: Callable[[], None] | None = None
        self._rechecks: asyncio.Task[None] | None = None

    @property
    def viewers(self) -> int:
        """How many watch, over all sessions."""
        return sum(feed.viewers for feed in self._feeds.values())

    def start(self) -> None:
        """Listen to the bus, on the running loop."""
        loop = asyncio.get_running_loop()
        self._unsubscribe = self._bus.subscribe(self._heard)
        self._bus.attach(loop)
        self._rechecks = loop.create_task(self._recheck())

    async def stop(self) -> None:
        """Listen no more; readings under way end first."""
        self._bus.detach()
        if self._unsubscribe:
            self._unsubscribe()
        if self._rechecks:
            self._rechecks.cancel()
            await asyncio.gather(self._rechecks, return_exceptions=True)
        await asyncio.to_thread(self._threads.shutdown)

    async def serve(self, session: str, since: int | None, send: Send) -> None:
        """Keep one viewer at the newest revision until cancelled.

        Raises:
            core.errors.Missing: there is no such session.
            StalledError: a frame did not leave in time.
        """
        feed = self._feeds.setdefault(session, Feed(session, self._source, self._threads))
        feed.viewers += 1
        try:
            await _Viewer(feed, self.timing, send).watch(since)
        finally:
            feed.viewers -= 1
            if not feed.viewers:
                self._feeds.pop(session, None)

    def _heard(self, session: str, revision: int) -> None:
        feed = self._feeds.get(session)
        if feed:
            feed.move()

    async def _recheck(self) -> None:
        while True:
            await asyncio.sleep(self.timing.recheck_s)
            for feed in self._feeds.values():
                feed.move()


class _Viewer:
    """One client: the revision that it holds, and the texts last told (a job moves on without a revision, and so do
    alarms)."""

    def __init__(self, feed: Feed, timing: Timing, send: Send) -> None:
        self._feed = feed
        self._timing = timing
        self._send = send
        self._revision = -1
        self._told: frozenset[Frame] = frozenset()
        self._rung: dict[int, str] = {}
        self._version = -1

    async def watch(self, since: int | None) -> None:
        raster = await self._feed.raster()
        loop = asyncio.get_running_loop()
        tick, step = self._feed.tick, await self._feed.since(since)
        await self._greet(step, raster)
        await self._deliver(step)
        beat_at = loop.time()
        while True:
            if await self._feed.news(tick, beat_at - loop.time()):
                tick, step = self._feed.tick, await self._feed.since(self._revision)
                if step.full:
                    await self._greet(step, raster)
                await self._deliver(step)
            if loop.time() >= beat_at:
                await self._out(protocol.beat(self._revision, _now()))
                beat_at = loop.time() + self._timing.beat_s

    async def _greet(self, step: Delivery, raster: Raster) -> None:
        self._rung, self._version = {}, -1
        await self._out(protocol.hello(self._feed.session, step.revision, raster, full=step.full))

    async def _deliver(self, step: Delivery) -> None:
        await self._ring(step.bells)
        if step.revision < self._revision and not step.full:
            return  # a reading that began before the last one: a revision only grows
        moved = step.revision > self._revision or step.full
        texts = frozenset(frame for frame in (*step.frames, step.status) if isinstance(frame, str))
        for frame in (*step.frames, step.status):
            if moved or frame in texts - self._told:
                await self._out(frame)
        self._revision, self._told = step.revision, texts

    async def _ring(self, bells: Bells) -> None:
        """Tell every alarm that is otherwise; one that is over is told only to who was told of it."""
        if bells.version <= self._version:
            return
        for number, (text, is_kept) in bells.frames.items():
            if self._rung.get(number) != text and (is_kept or number in self._rung):
                await self._out(text)
                self._rung[number] = text
        self._version = bells.version

    async def _out(self, frame: Frame) -> None:
        try:
            async with asyncio.timeout(self._timing.stall_s):
                await self._send(frame)
        except TimeoutError as error:
            raise StalledError(f"No frame left for {self._timing.stall_s} s.") from error


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
