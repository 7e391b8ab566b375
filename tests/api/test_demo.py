"""The demo inspection, started over REST."""

from __future__ import annotations

from pathlib import Path

import httpx

from tests.fakes.robots import StillRobots
from tests.fakes.whole import whole

from .test_upload import problem


def test_the_demo_uploads_to_this_server_and_is_refused_while_it_runs(tmp_path: Path) -> None:
    robots = StillRobots()
    with whole(tmp_path, robots) as server:
        first = httpx.post(f"{server.url}/api/demo", headers={"host": "pond.example"})
        second = httpx.post(f"{server.url}/api/demo")

        assert (first.status_code, first.json()) == (202, {"state": "started"})
        assert robots.urls == [server.url], "its own address, whatever name it was asked by"
        assert problem(second, 409, "conflict")["detail"] == "The demo inspection runs already."
        robots.end()
        assert httpx.post(f"{server.url}/api/demo").status_code == 202

    assert not robots.out, "they end with the server"
