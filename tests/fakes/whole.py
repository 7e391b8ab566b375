"""The whole server on a real socket, its workers in the same process."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
import uvicorn

from pondwatch.api.services import Robots, Services
from pondwatch.app import create_app
from pondwatch.config import Settings
from pondwatch.core.values import RodReading
from pondwatch.store import revisions, sessions
from pondwatch.store.revisions import NewRevision

from .lane import InlineLane


@dataclass(frozen=True, slots=True)
class Whole:
    """A server at `url`, and what its routes work with."""

    url: str
    services: Services

    def read(self, session_id: str, *readings: RodReading) -> None:
        """Write a revision in which rods read so, and say it to all who listen."""
        found = self.services.store.read(lambda c: sessions.get(c, session_id))
        new = NewRevision(session_id, found.revision, found.covered_through, self.services.now_ms(), rods=readings)
        revision = self.services.store.write(lambda c: revisions.write(c, new))
        self.services.observer.changed(session_id, revision)


@contextlib.contextmanager
def whole(data: Path, robots: Robots | None = None, **settings: Any) -> Iterator[Whole]:
    """Run it; stopped at the end."""
    app = create_app(Settings(data=data, workers=1, **settings), lambda _timeout_s: InlineLane(), robots)
    server = uvicorn.Server(uvicorn.Config(app, "127.0.0.1", 0, log_level="error", timeout_graceful_shutdown=1))
    thread = threading.Thread(target=server.run, daemon=True)
    thread.start()
    while not server.started:
        time.sleep(0.01)
    url = f"http://127.0.0.1:{server.servers[0].sockets[0].getsockname()[1]}"
    assert httpx.get(f"{url}/readyz").status_code == 200
    try:
        yield Whole(url, app.state.services)
    finally:
        server.should_exit = True
        thread.join(10)
