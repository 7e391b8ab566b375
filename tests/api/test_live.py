"""The live feed of the whole server: whenever a viewer joins or leaves, it ends with the mosaic that is served."""

from __future__ import annotations

import json
from typing import Any

import cv2
import numpy as np
from websockets.sync.client import ClientConnection, connect

from tests.fakes.robot import Shot

from .conftest import Api


class Screen:
    """What a viewer has painted and been told."""

    def __init__(self) -> None:
        self.canvas = np.zeros((120, 200, 4), np.uint8)
        self.poses: set[int] = set()
        self.revision = -1
        self.state = ""

    def watch(self, connection: ClientConnection, revision: int, state: str = "open") -> None:
        """Take frames until this revision is complete."""
        while (self.revision, self.state) != (revision, state):
            frame = connection.recv(timeout=20)
            if isinstance(frame, str):
                self._told(json.loads(frame))
            else:
                self._painted(frame)

    def _told(self, message: dict[str, Any]) -> None:
        if message["type"] == "poses":
            self.poses |= {pose["sequence"] for pose in message["poses"]}
        elif message["type"] == "session":
            self.revision, self.state = message["revision"], message["state"]

    def _painted(self, frame: bytes) -> None:
        length = int.from_bytes(frame[:4], "big")
        header = json.loads(frame[4 : 4 + length])
        image = cv2.imdecode(np.frombuffer(frame[4 + length :], np.uint8), cv2.IMREAD_UNCHANGED)
        assert image is not None
        x, y, width, height = (header[name] for name in ("x", "y", "width", "height"))
        self.canvas[y : y + height, x : x + width] = image


def feed(api: Api, session: str, since: int | None = None) -> ClientConnection:
    query = "" if since is None else f"?since={since}"
    url = f"ws://{api.http.base_url.host}:{api.http.base_url.port}/api/sessions/{session}/live{query}"
    return connect(url, max_size=1 << 24)


def served(api: Api, session: str) -> np.ndarray[Any, Any]:
    image = cv2.imdecode(np.frombuffer(api.get(session, "/mosaic.png").content, np.uint8), cv2.IMREAD_UNCHANGED)
    assert image is not None
    return np.asarray(image)


def covered(api: Api, session: str, count: int) -> int:
    revision: int = api.until(session, lambda v: v["counts"]["placed"] == count)["revision"]
    return revision


def test_a_viewer_sees_every_snapshot_arrive_and_the_session_finish(api: Api) -> None:
    session, screen = api.open(), Screen()
    with feed(api, session) as connection:
        for i in range(5):
            api.send(session, Shot(i))
            screen.watch(connection, covered(api, session, i + 1))
            np.testing.assert_array_equal(screen.canvas, served(api, session))
        revision = api.finish(session)["revision"]
        screen.watch(connection, revision, "finished")

    assert screen.poses == set(range(5))
    np.testing.assert_array_equal(screen.canvas, served(api, session))


def test_a_viewer_that_missed_revisions_comes_back_to_the_same_state(api: Api) -> None:
    session, screen = api.open(), Screen()
    api.send(session, Shot(0))
    with feed(api, session) as connection:
        screen.watch(connection, covered(api, session, 1))
    for i in range(1, 4):
        api.send(session, Shot(i))
        covered(api, session, i + 1)

    with feed(api, session, screen.revision) as connection:
        screen.watch(connection, covered(api, session, 4))

    assert screen.poses == set(range(4))
    np.testing.assert_array_equal(screen.canvas, served(api, session))
