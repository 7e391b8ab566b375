"""The whole server on a real socket, with its workers in the same process."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
import pytest
import uvicorn

from pondwatch.app import create_app
from pondwatch.config import Settings
from pondwatch.store.store import Store
from tests.fakes.lane import InlineLane
from tests.fakes.robot import Shot, document


@dataclass(frozen=True, slots=True)
class Api:
    """A client of the running server."""

    http: httpx.Client
    data: Path
    store: Store | None = None

    def open(self, **changes: Any) -> str:
        """A new session's id."""
        answer = self.http.post("/api/sessions", json=document(**changes))
        assert answer.status_code == 201, answer.text
        return str(answer.json()["id"])

    def send(self, session: str, shot: Shot) -> httpx.Response:
        """Upload a snapshot."""
        return self.http.post(f"/api/sessions/{session}/snapshots", files=shot.parts())

    def get(self, session: str, path: str = "", **query: Any) -> httpx.Response:
        """Something of a session."""
        return self.http.get(f"/api/sessions/{session}{path}", params=query)

    def finish(self, session: str) -> dict[str, Any]:
        """Finish and wait for it."""
        answer = self.http.post(f"/api/sessions/{session}/finish", params={"wait": 30})
        assert answer.status_code == 200, answer.text
        view: dict[str, Any] = answer.json()
        return view

    def until(self, session: str, holds: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
        """The session once something holds of it."""
        deadline = time.monotonic() + 20
        while not holds(view := self.get(session).json()):
            assert time.monotonic() < deadline, view
            time.sleep(0.02)
        found: dict[str, Any] = view
        return found


@pytest.fixture(scope="module")
def api(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Api]:
    data = tmp_path_factory.mktemp("data")
    settings = Settings(data=data, workers=2, max_image_bytes=1 << 20, max_batch_bytes=1 << 21, max_batch_items=8)
    app = create_app(settings, make_lane=lambda _timeout_s: InlineLane())
    server = uvicorn.Server(uvicorn.Config(app, "127.0.0.1", 0, log_level="error", timeout_graceful_shutdown=1))
    thread = threading.Thread(target=server.run, daemon=True)
    thread.start()
    while not server.started:
        time.sleep(0.01)
    port = server.servers[0].sockets[0].getsockname()[1]
    with httpx.Client(base_url=f"http://127.0.0.1:{port}", timeout=40) as http:
        yield Api(http, data, app.state.services.store)
    server.should_exit = True
    thread.join(10)
