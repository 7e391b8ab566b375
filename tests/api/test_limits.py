"""Bodies that are too large or too slow, whatever they say of themselves."""

from __future__ import annotations

import asyncio
import re
from typing import Any

import pytest

from pondwatch.api.limits import BodyLimit, Guard
from pondwatch.core.errors import PondwatchError, TooLarge

LIMITS = [BodyLimit(re.compile("/large"), 1000)]


class Reader:
    """An application that reads its whole body."""

    def __init__(self) -> None:
        self.got = b""

    async def __call__(self, scope: Any, receive: Any, send: Any) -> None:
        more = True
        while more:
            message = await receive()
            self.got += message.get("body", b"")
            more = message.get("more_body", False)


async def post(chunks: list[bytes], declared: int | None = None, wait_s: float = 0.0) -> tuple[Reader, list[Any]]:
    """What the application read and what was answered for it."""
    headers = [] if declared is None else [(b"content-length", str(declared).encode())]
    scope = {"type": "http", "method": "POST", "path": "/large", "headers": headers}
    waiting, sent, reader = list(chunks), [], Reader()

    async def receive() -> dict[str, Any]:
        await asyncio.sleep(wait_s)
        body = waiting.pop(0)
        return {"type": "http.request", "body": body, "more_body": bool(waiting)}

    async def send(message: Any) -> None:
        sent.append(message)

    await Guard(reader, LIMITS, timeout_s=0.2)(scope, receive, send)
    return reader, sent


async def test_a_body_at_the_limit_passes() -> None:
    reader, sent = await post([b"x" * 600, b"x" * 400], 1000)

    assert (len(reader.got), sent) == (1000, [])


async def test_a_body_that_declares_too_much_never_reaches_the_application() -> None:
    reader, sent = await post([b"x" * 1001], 1001)

    assert (reader.got, sent[0]["status"]) == (b"", 413)


@pytest.mark.parametrize("declared", [None, 5])
async def test_a_body_that_grows_over_the_limit_is_cut_whatever_it_declared(declared: int | None) -> None:
    with pytest.raises(TooLarge):
        await post([b"x" * 600, b"x" * 401], declared)


async def test_a_sender_that_is_too_slow_is_cut() -> None:
    with pytest.raises(PondwatchError, match=r"within 0\.2 seconds"):
        await post([b"x"] * 10, 10, wait_s=0.05)
