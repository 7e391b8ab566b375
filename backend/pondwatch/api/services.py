"""What the routes work with; the composition root makes it and hands it to the application."""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import dataclass, field
from threading import Event
from typing import Annotated, Protocol

from fastapi import Depends, Request

from pondwatch.config import Settings
from pondwatch.core.ports import Clock
from pondwatch.jobs.alarms import Watch
from pondwatch.jobs.ingest import Ingest
from pondwatch.jobs.queue import Queue
from pondwatch.jobs.steps import Observer
from pondwatch.store.store import Store
from pondwatch.telemetry import Telemetry


class Robots(Protocol):
    """Simulated robots that upload a demo inspection."""

    def begin(self, url: str) -> bool:
        """Let them upload to the server at `url`; False where they do so already."""
        ...

    def end(self) -> None:
        """Stop them, and wait until they are gone."""
        ...


@dataclass(frozen=True, slots=True)
class Services:
    """Everything that a request may need. intake: threads that take snapshots in. stopping: set once the server is
    told to stop, so that no request waits on."""

    settings: Settings
    store: Store
    clock: Clock
    ingest: Ingest
    queue: Queue
    watch: Watch
    observer: Observer
    telemetry: Telemetry
    intake: Executor
    robots: Robots
    stopping: Event = field(default_factory=Event)

    def now_ms(self) -> int:
        """Milliseconds since the epoch."""
        return int(self.clock.now_s() * 1000)


async def _of(request: Request) -> Services:  # no thread is asked for it
    services = request.app.state.services
    assert isinstance(services, Services)
    return services


Here = Annotated[Services, Depends(_of)]
