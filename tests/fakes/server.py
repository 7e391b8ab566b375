"""The live feed and the page over a scripted source: a server with no store, for tests in a browser."""

from __future__ import annotations

import contextlib
import json
import socket
import threading
import time
from collections.abc import AsyncIterator, Iterator
from pathlib import Path
from typing import Any

import uvicorn
from fastapi import FastAPI, Response
from fastapi.responses import FileResponse, JSONResponse

from pondwatch.live.bus import LocalBus
from pondwatch.live.hub import Hub, Timing
from pondwatch.live.socket import live_router

from .movie import SCALE_M, Movie, now
from .source import ScriptedSource

FRONTEND = Path(__file__).parents[2] / "frontend"
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; connect-src 'self'; "
    "font-src 'self'; base-uri 'none'; form-action 'self'; frame-ancestors 'none'"
)


def free_port() -> int:
    """A port that the system says is free."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


class FakeServer:
    """A server at `url`. `advance` makes news of the movie; `stop` and `start` again cut the link."""

    def __init__(self, source: ScriptedSource, movie: Movie | None = None, timing: Timing | None = None) -> None:
        self.source, self.movie, self.timing = source, movie, timing or Timing()
        self.bus = LocalBus()
        self.listening = True
        self.older = 0
        self.started: list[dict[str, Any]] = []
        self.said: dict[str, list[dict[str, Any]]] = {}
        self.notes: list[dict[str, Any]] = []
        self.findings: list[dict[str, Any]] = []
        self.readings: list[dict[str, Any]] = []
        self.demo_runs = False
        self.port = free_port()
        self.url = f"http://127.0.0.1:{self.port}"

    def start(self) -> None:
        config = uvicorn.Config(make_app(self), "127.0.0.1", self.port, log_level="error", timeout_graceful_shutdown=1)
        self._server = uvicorn.Server(config)
        self._thread = threading.Thread(target=self._server.run, daemon=True)
        self._thread.start()
        while not self._server.started:
            time.sleep(0.01)

    def stop(self) -> None:
        self._server.should_exit = True
        self._thread.join(10)

    def advance(self, count: int = 1) -> int:
        """Snapshots more, each a revision that is told of; returns the newest."""
        assert self.movie
        for _ in range(count):
            self.bus.publish("s1", self.movie.advance(self.source))
        return self.source.revision


@contextlib.contextmanager
def serving(movie: Movie | None = None, timing: Timing | None = None) -> Iterator[FakeServer]:
    """A server over a movie's pond, started; stopped at the end."""
    movie = movie or Movie()
    source = ScriptedSource(movie.raster)
    source.session.update(movie.session())
    server = FakeServer(source, movie, timing)
    server.start()
    try:
        yield server
    finally:
        server.stop()


def make_app(server: FakeServer) -> FastAPI:
    """The application, as the composition root would put it together."""
    source = server.source
    hub = Hub(source, server.bus, server.timing)

    @contextlib.asynccontextmanager
    async def life(_: FastAPI) -> AsyncIterator[None]:
        hub.start()
        yield
        await hub.stop()

    app = FastAPI(lifespan=life)
    app.include_router(live_router(hub))

    @app.get("/api/handover")
    def handover() -> Any:
        return {"notes": [], "judgements": []}

    @app.get("/healthz")
    def alive() -> Any:
        return {"status": "alive"}

    @app.get("/api/sessions")
    def sessions(q: str = "", before: str | None = None) -> Any:
        listed = [{**source.session, "revision": source.revision}] if server.listening else []
        older = [{"id": f"old-{i}", "name": f"Old {i}", "state": "finished"} for i in range(server.older)]
        found = [s for s in listed + older if q.lower() in s["name"].lower()]
        start = next((i for i, s in enumerate(found) if s["id"] == before), -1) + 1
        page = found[start : start + 25]
        return {"sessions": page, "next": page[-1]["id"] if len(found) > start + 25 else None}

    @app.post("/api/demo", status_code=202)
    def demo() -> Response:
        if server.demo_runs:
            return JSONResponse({"detail": "The demo inspection runs already."}, 409)
        server.listening = True
        return JSONResponse({"state": "started"}, 202)

    @app.get("/api/sessions/s1/readings")
    def readings() -> Any:
        return {"session": "s1", "revision": source.revision, "readings": server.readings}

    @app.post("/api/sessions", status_code=201)
    def start(document: dict[str, Any]) -> Response:
        server.started.append(document)
        if not document["pond"].get("height_m"):
            return JSONResponse({"detail": "pond.height_m is missing."}, 422)
        return JSONResponse({"id": "s1"}, 201)

    @app.post("/api/sessions/s1/finish")
    def finish() -> Any:
        server.bus.publish("s1", source.step(state="finished"))
        return source.session

    @app.get("/api/sessions/{session}")
    def session(session: str) -> Response:
        if session != "s1":
            return JSONResponse({"detail": f"There is no session {session!r}."}, 404)
        return JSONResponse({**source.session, "revision": source.revision})

    @app.get("/api/sessions/s1/alarms")
    def alarms() -> Any:
        return {"session": "s1", "alarms": source.alarms.rows, "limits": {"robot_silent_s": 8.0}}

    @app.get("/api/sessions/s1/alarms/events")
    def alarm_events() -> Any:
        names = ("kind", "subject", "title")
        told = [
            {name: row[name] for name in names} | {"id": row["id"], "at": row["since"]} for row in source.alarms.rows
        ]
        return {"events": [{**row, "act": "raise", "by": None, "text": "It began."} for row in told], "next": None}

    @app.get("/api/sessions/s1/findings")
    def findings() -> Any:
        done = source.session["state"] == "finished"
        return {"looked": done, "findings": server.findings if done else [], "examined": 0.93}

    @app.get("/api/sessions/s1/findings/{number}/picture.png")
    def finding_picture(number: int) -> Response:
        assert server.movie
        return Response(server.movie.patch(0, 0, 64, 64, 0).content, 200, media_type="image/png")

    @app.get("/api/sessions/s1/rods/{rod}")
    def rod(rod: str) -> Any:
        poses = [_evidence(pose) for pose in source.changes("s1", None).poses if shows(server, rod, pose)]
        return {"rod_id": rod, "method": "lattice", "views": len(poses), "snapshots": poses}

    @app.get("/api/sessions/s1/rods/{rod}/history")
    def history(rod: str) -> Any:
        row = _rod_row(server, rod)
        past = [{**row, "at": now()}] if row["views"] else []
        return {"rod_id": rod, "history": past, "by_hand": server.said.get(rod, []), "notes": server.notes}

    @app.post("/api/sessions/s1/rods/{rod}/judgement", status_code=201)
    def judge(rod: str, said: dict[str, Any]) -> Any:
        row = _rod_row(server, rod)
        judgement = {"fill": None, **said, "at": now(), "machine": row}
        server.said.setdefault(rod, []).append(judgement)
        server.bus.publish("s1", source.step(rods=[{**row, "by_hand": judgement if said["state"] else None}]))
        return judgement

    @app.post("/api/sessions/s1/notes", status_code=201)
    def note(said: dict[str, Any]) -> Any:
        server.notes.append({"closed_by": None, **said, "at": now()})
        return server.notes[-1]

    @app.get("/api/sessions/s1/snapshots/{robot}/{boot}/{sequence}/image")
    def image(robot: str, boot: int, sequence: int) -> Response:
        assert server.movie
        content = server.movie.snapshot(robot, sequence)
        return Response(content, media_type="image/png")

    vendor = json.loads((FRONTEND / "vendor.json").read_text())

    @app.get("/{path:path}")
    def page(path: str) -> Response:
        file = FRONTEND / vendor.get(f"/{path}", path or "index.html")
        headers = {"content-security-policy": POLICY, "cache-control": "no-cache"}
        return FileResponse(file, headers=headers) if file.is_file() else Response(status_code=404)

    return app


def _rod_row(server: FakeServer, rod_id: str) -> dict[str, Any]:
    rows = server.source.changes("s1", None).rods
    unread = {"rod_id": rod_id, "state": "unseen", "fill": None, "confidence": 0.0, "views": 0, "conflicting": False}
    return next((row for row in rows if row["rod_id"] == rod_id), unread)


def shows(server: FakeServer, rod_id: str, pose: dict[str, Any]) -> bool:
    """Whether the snapshot at a pose holds the whole rod."""
    assert server.movie
    rod = next(rod for rod in server.movie.pond.rods if rod.id == rod_id)
    return bool(abs(pose["x_m"] - rod.x_m) < 68 * SCALE_M and abs(pose["y_m"] - rod.y_m) < 43 * SCALE_M)


def _evidence(pose: dict[str, Any]) -> dict[str, Any]:
    axes = ("x_m", "y_m", "theta_rad")
    places = {"raw": {a: pose[f"raw_{a}"] for a in axes}, "corrected": {a: pose[a] for a in axes}}
    key = {name: pose[name] for name in ("robot", "boot", "sequence", "status")}
    return {**key, **places, "captured_at": now(), "fill": 0.41}
