"""The page on the real server: uploads in, pixels on the screen; killed, and back with nothing missing."""

import hashlib
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import cv2
import httpx
import numpy as np
import pytest

from tests.fakes.robot import Shot, document
from tests.fakes.server import free_port

from .conftest import Desk, eventually

pytestmark = pytest.mark.browser


class RealServer:
    """`pondwatch serve` in a process of its own, always at the same address."""

    def __init__(self, data: Path) -> None:
        self.port = free_port()
        self.url = f"http://127.0.0.1:{self.port}"
        self._command = [sys.executable, "-c", "from pondwatch.cli import main; main()", "serve"]
        self._command += ["--port", str(self.port), "--data", str(data)]

    def start(self) -> None:
        self._process = subprocess.Popen(self._command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        assert eventually(self._is_ready, 90), f"it did not get ready; its exit status is {self._process.poll()}"

    def kill(self) -> None:
        self._process.send_signal(signal.SIGKILL)
        self._process.wait(10)

    def stop(self) -> None:
        self._process.terminate()
        self._process.wait(60)

    def _is_ready(self) -> bool:
        try:
            return httpx.get(f"{self.url}/readyz", timeout=2).status_code == 200
        except httpx.TransportError:
            return False

    def open_session(self) -> str:
        return str(httpx.post(f"{self.url}/api/sessions", json=document()).json()["id"])

    def send(self, session: str, shots: range) -> None:
        for sequence in shots:
            answer = httpx.post(f"{self.url}/api/sessions/{session}/snapshots", files=Shot(sequence).parts())
            assert answer.status_code == 201, answer.text

    def mosaic_digest(self, session: str) -> str:
        """SHA-256 of the mosaic's pixels, RGBA, as the API gives it."""
        content = httpx.get(f"{self.url}/api/sessions/{session}/mosaic.png").content
        image = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED)
        assert image is not None
        return hashlib.sha256(cv2.cvtColor(image, cv2.COLOR_BGRA2RGBA).tobytes()).hexdigest()


@pytest.fixture
def server(tmp_path: Path) -> Iterator[RealServer]:
    running = RealServer(tmp_path / "data")
    try:
        running.start()
        yield running
    finally:
        running.kill()


def holds_all(desk: Desk, server: RealServer, session: str, count: int) -> bool:
    """Whether the page shows so many snapshots, and the server's own mosaic, pixel for pixel."""
    counted = desk.says("#count-snapshots", str(count), 15) and desk.says("#health-queue", "0", 15)
    return counted and eventually(lambda: desk.figure("rasterDigest()") == server.mosaic_digest(session), 10)


def test_what_is_uploaded_is_painted_as_the_server_has_it(desk: Desk, server: RealServer) -> None:
    session = server.open_session()
    desk.page.goto(server.url)
    assert desk.says("h1", "Test pond")
    assert eventually(lambda: desk.figure("link") == "live")

    server.send(session, range(12))

    assert holds_all(desk, server, session, 12)
    assert desk.text("#robots").count("bubble-1") == 1
    assert desk.errors == []
    assert desk.strangers == []


def test_the_demo_starts_by_one_click_on_an_empty_server_and_its_mosaic_grows(desk: Desk, server: RealServer) -> None:
    desk.page.goto(server.url)
    desk.page.locator("#start-demo").click()

    assert desk.says("h1", "Demo inspection 1", 60)
    first = eventually(lambda: desk.figure("rasterDigest()"), 60)
    assert eventually(lambda: desk.figure("rasterDigest()") not in (None, first), 60), "it grows"
    refused = httpx.post(f"{server.url}/api/demo")
    assert refused.status_code == 409
    assert desk.errors == []
    server.stop()  # and the robots with it


def test_a_server_killed_amid_uploads_is_said_and_its_return_brings_everything(desk: Desk, server: RealServer) -> None:
    session = server.open_session()
    desk.page.goto(f"{server.url}/?session={session}")
    server.send(session, range(6))
    assert holds_all(desk, server, session, 6)

    server.kill()
    assert desk.says("#link-state", "DISCONNECTED", 3)
    server.start()
    server.send(session, range(6, 12))

    assert desk.says("#link-state", "Live", 15)
    assert holds_all(desk, server, session, 12)


def test_the_first_page_is_under_750_kilobytes(desk: Desk, server: RealServer) -> None:
    sizes = []
    desk.page.on("requestfinished", lambda request: sizes.append(request.sizes()["responseBodySize"]))

    desk.page.goto(f"{server.url}/?inspections")
    assert desk.says("#home", "no inspection yet")
    desk.page.wait_for_timeout(300)

    assert 300_000 < sum(sizes) < 750_000
