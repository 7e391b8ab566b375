"""What the live bench measures with: requests as a client would send them, and honest accounts."""

from __future__ import annotations

import asyncio
import json
import math
import os
import subprocess
import sys
from email.message import Message
from email.parser import BytesParser
from pathlib import Path

import pytest

from pondwatch.basestation.bundle import Bundle
from pondwatch.simulator.bundle import write_bundle
from pondwatch.simulator.simulation import Simulation
from pondwatch.simulator.spec import SimulationSpec
from pondwatch.telemetry import Telemetry

from . import accounts
from .live import item_of
from .sender import CONNECTIONS, Item, send
from .stages import means

BUSY = "import time\nwhile time.process_time() < 0.3: pass\nprint('done', flush=True)\ninput()"


async def served(items: list[Item], rate_hz: float) -> tuple[list[bytes], list[int]]:
    """The requests that reached a server which answers 201 to all, and the statuses that the sender saw."""
    heard: list[bytes] = []

    async def answer(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        while head := await _until_blank(reader):
            length = int(head.lower().split(b"content-length:")[1].split(b"\r\n")[0])
            heard.append(head + await reader.readexactly(length))
            writer.write(b"HTTP/1.1 201 Created\r\nContent-Length: 2\r\n\r\n{}")
        writer.close()
        await writer.wait_closed()
        ended.release()

    ended = asyncio.Semaphore(0)
    server = await asyncio.start_server(answer, "127.0.0.1", 0)
    port = server.sockets[0].getsockname()[1]
    sent = await send(f"http://127.0.0.1:{port}", "s1", items, rate_hz)
    server.close()
    for _ in range(CONNECTIONS):
        await ended.acquire()
    assert set(sent.began_ms) == {item.key for item in items}
    assert len(sent.stored_ms) == len(items)
    return heard, sent.statuses


async def _until_blank(reader: asyncio.StreamReader) -> bytes:
    try:
        return await reader.readuntil(b"\r\n\r\n")
    except asyncio.IncompleteReadError:
        return b""


def parts_of(request: bytes) -> dict[str, bytes]:
    """The parts of a form, read as mail."""
    _, rest = request.split(b"\r\n", 1)
    message = BytesParser().parsebytes(rest)
    found: dict[str, bytes] = {}
    for part in message.get_payload():
        assert isinstance(part, Message)
        content = part.get_payload(decode=True)
        assert isinstance(content, bytes)
        found[str(part.get_param("name", header="content-disposition"))] = content
    return found


def test_requests_made_beforehand_carry_the_pose_and_the_picture(tmp_path: Path) -> None:
    write_bundle(Simulation(SimulationSpec(snapshots=3), seed=3), tmp_path / "small")

    with Bundle(tmp_path / "small") as bundle:
        items = [item_of(bundle, row, boot=2) for row in bundle.rows]

    heard, statuses = asyncio.run(served(items, rate_hz=200))

    assert statuses == [201] * 3
    for item, request in zip(
        items, sorted(heard, key=lambda r: json.loads(parts_of(r)["pose"])["sequence"]), strict=True
    ):
        assert request.startswith(b"POST /api/sessions/s1/snapshots HTTP/1.1\r\n")
        assert parts_of(request) == {"pose": item.pose.encode(), "image": item.content}
        assert json.loads(item.pose)["boot"] == 2


def test_processor_time_is_put_down_to_who_took_it() -> None:
    with subprocess.Popen([sys.executable, "-c", BUSY], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as busy:
        before = accounts.spent({"busy": busy.pid, "me": os.getpid()})
        assert busy.stdout
        busy.stdout.readline()
        spent = accounts.spent({"busy": busy.pid, "me": os.getpid()}).since(before)

        assert busy.pid in accounts.children(os.getpid())
        assert accounts.find("time.process_time() < 0.3") == busy.pid
        assert 1 < accounts.memory_mb(busy.pid) < 100
        busy.communicate(b"\n")
    assert 0.15 < spent.by["busy"] < 0.6
    assert spent.others >= 0


def test_the_mean_of_a_stage_is_its_sum_over_its_count() -> None:
    telemetry = Telemetry()
    telemetry.spent(wait=0.5, tell=0.25)
    telemetry.spent(wait=1.5)

    found = means(telemetry.text().decode())

    assert found == {"wait": 1.0, "tell": 0.25}
    assert math.isnan(
        means('pondwatch_stage_seconds_sum{stage="x"} 0\npondwatch_stage_seconds_count{stage="x"} 0')["x"]
    )


@pytest.mark.parametrize("words", [("no such words",), ("python", "no such words")])
def test_a_process_that_there_is_not_is_not_found(words: tuple[str, ...]) -> None:
    with pytest.raises(LookupError):
        accounts.find(*words)
