"""Sends snapshots at a rate, at little cost: requests are made beforehand and written as they are.

A client in Python that builds each request costs more processor time than the server that it measures.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Sequence
from dataclasses import dataclass
from urllib.parse import urlsplit

CONNECTIONS = 32
_BOUNDARY = b"pondwatch-bench"


@dataclass(frozen=True, slots=True)
class Item:
    """One upload to come: its key as the page knows it, its pose as JSON, and its bytes."""

    key: str
    pose: str
    content: bytes


@dataclass(slots=True)
class Sent:
    """What was sent: when each upload began (epoch ms), how long its answer took (ms), and every answer's status."""

    began_ms: dict[str, float]
    stored_ms: list[float]
    statuses: list[int]


def request(host: str, session: str, item: Item) -> bytes:
    """A snapshot as an HTTP request."""
    parts = (
        b'--%s\r\nContent-Disposition: form-data; name="pose"\r\n\r\n%s\r\n' % (_BOUNDARY, item.pose.encode()),
        b'--%s\r\nContent-Disposition: form-data; name="image"; filename="s"\r\n\r\n' % _BOUNDARY,
        item.content,
        b"\r\n--%s--\r\n" % _BOUNDARY,
    )
    head = (
        f"POST /api/sessions/{session}/snapshots HTTP/1.1\r\nHost: {host}\r\n"
        f"Content-Type: multipart/form-data; boundary={_BOUNDARY.decode()}\r\n"
        f"Content-Length: {sum(map(len, parts))}\r\n\r\n"
    )
    return head.encode() + b"".join(parts)


async def send(url: str, session: str, items: Sequence[Item], rate_hz: float) -> Sent:
    """One upload each 1 / rate seconds by the clock, however long earlier ones take."""
    host = urlsplit(url).netloc
    requests = [request(host, session, item) for item in items]
    idle: asyncio.LifoQueue[_Connection] = asyncio.LifoQueue()
    for _ in range(CONNECTIONS):
        idle.put_nowait(await _Connection.open(host))
    sent = Sent({}, [], [])

    async def upload(key: str, content: bytes) -> None:
        began, sent.began_ms[key] = time.perf_counter(), time.time() * 1000
        connection = await idle.get()
        if connection.is_ended:  # it was idle for so long that the server let it go
            connection = await _Connection.open(host)
        sent.statuses.append(await connection.ask(content))
        sent.stored_ms.append((time.perf_counter() - began) * 1000)
        idle.put_nowait(connection)

    start = time.monotonic()
    async with asyncio.TaskGroup() as uploads:
        for i, (item, content) in enumerate(zip(items, requests, strict=True)):
            await asyncio.sleep(max(0.0, start + i / rate_hz - time.monotonic()))
            uploads.create_task(upload(item.key, content))
    while not idle.empty():
        await idle.get_nowait().close()
    return sent


class _Connection:
    """One kept open, for one request at a time."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._reader, self._writer = reader, writer

    @classmethod
    async def open(cls, host: str) -> _Connection:
        name, port = host.rsplit(":", 1)
        return cls(*await asyncio.open_connection(name, int(port)))

    @property
    def is_ended(self) -> bool:
        """Whether the server has closed it."""
        return self._reader.at_eof()

    async def ask(self, content: bytes) -> int:
        """The status of the answer, its body read and dropped."""
        self._writer.write(content)
        head = (await self._reader.readuntil(b"\r\n\r\n")).lower()
        length = head.split(b"content-length:", 1)[1].split(b"\r\n", 1)[0]
        await self._reader.readexactly(int(length))
        return int(head.split(b" ", 2)[1])

    async def close(self) -> None:
        self._writer.close()
        await self._writer.wait_closed()
