"""The socket, on a real server: origins, close codes, and viewers that stall."""

import asyncio
import json
import tracemalloc
from collections.abc import Iterator

import pytest
import websockets
from websockets.asyncio.client import ClientConnection, connect

from pondwatch.live.hub import Timing
from pondwatch.live.source import Patch
from tests.fakes.server import FakeServer, serving
from tests.fakes.viewer import Viewer


@pytest.fixture(scope="module")
def server() -> Iterator[FakeServer]:
    with serving(timing=Timing(stall_s=1.0)) as running:
        yield running


def address(server: FakeServer, session: str = "s1", query: str = "") -> str:
    return f"{server.url.replace('http', 'ws')}/api/sessions/{session}/live{query}"


async def read_until(link: ClientConnection, viewer: Viewer, revision: int) -> None:
    async with asyncio.timeout(10):
        while viewer.revision is None or viewer.revision < revision:
            viewer.take(await link.recv())


async def test_a_client_reads_the_state_and_then_what_changes(server: FakeServer) -> None:
    viewer = Viewer()
    async with connect(address(server)) as link:
        await read_until(link, viewer, server.source.revision)
        await read_until(link, viewer, server.advance())

    assert viewer.session["name"] == "Pond 3, north bay"
    assert len(viewer.pixels) >= 1


async def test_a_session_nobody_knows_closes_with_4404(server: FakeServer) -> None:
    async with connect(address(server, "nobody")) as link:
        with pytest.raises(websockets.ConnectionClosedError) as closed:
            await link.recv()

    assert closed.value.rcvd is not None
    assert (closed.value.rcvd.code, closed.value.rcvd.reason) == (4404, "There is no session 'nobody'.")


@pytest.mark.parametrize("origin", ["https://elsewhere.example", "null", "http://127.0.0.1:1"])
async def test_a_page_of_another_origin_is_refused(server: FakeServer, origin: str) -> None:
    with pytest.raises(websockets.InvalidStatus) as refused:
        await connect(address(server), additional_headers={"Origin": origin})

    assert refused.value.response.status_code == 403


async def test_the_servers_own_pages_may_watch(server: FakeServer) -> None:
    async with connect(address(server), additional_headers={"Origin": server.url}) as link:
        assert json.loads(await link.recv())["type"] == "hello"


async def test_a_since_that_is_no_number_is_refused(server: FakeServer) -> None:
    with pytest.raises(websockets.InvalidStatus):
        await connect(address(server, query="?since=yesterday"))


async def test_what_a_viewer_says_is_ignored(server: FakeServer) -> None:
    async with connect(address(server)) as link:
        await link.send("x" * 1000)
        await link.send(b"\0" * 1000)
        await read_until(link, Viewer(), server.source.revision)


async def test_three_viewers_that_read_nothing_stop_nobody_and_hold_no_memory(server: FakeServer) -> None:
    stalled = [await connect(address(server), max_queue=1) for _ in range(3)]
    for link in stalled:
        link.transport.pause_reading()
    viewer = Viewer()
    loop = asyncio.get_running_loop()
    async with connect(address(server)) as link:
        await read_until(link, viewer, server.source.revision)
        tracemalloc.start()
        slowest = 0.0
        for i in range(60):
            began = loop.time()
            patch = Patch("mosaic", 0, 0, 8, 8, server.source.revision + 1, "image/png", bytes([i]) * 1_000_000)
            revision = server.source.step([patch])
            server.bus.publish("s1", revision)
            await read_until(link, viewer, revision)
            slowest = max(slowest, loop.time() - began)
        held = tracemalloc.get_traced_memory()[0]
        tracemalloc.stop()

    assert slowest < 1.0, "no revision waited for a viewer that takes nothing"
    assert held < 25e6, "of 60 MB sent past them, the stalled ones hold a frame or two each"
    for link in stalled:
        link.transport.abort()
