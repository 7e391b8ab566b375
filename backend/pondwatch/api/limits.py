"""What is refused before anything parses it: bodies that are too large or too slow, and pages of other origins."""

from __future__ import annotations

import asyncio
import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from urllib.parse import urlsplit

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from pondwatch.core.errors import PondwatchError, TooLarge

from . import problems
from .problems import Forbidden, TooSlow

SMALL_BODY = 64 * 1024
_DISCARD_BYTES = 1 << 28
_DISCARD_S = 15.0


@dataclass(frozen=True, slots=True)
class BodyLimit:
    """The largest body of the requests whose path matches."""

    path: re.Pattern[str]
    most_bytes: int


class Guard:
    """ASGI middleware. A body is counted while it arrives, whatever its `Content-Length` says."""

    def __init__(
        self, app: ASGIApp, limits: Sequence[BodyLimit], timeout_s: float, allowed_origins: Collection[str] = ()
    ) -> None:
        self._app, self._limits, self._timeout_s = app, limits, timeout_s
        self._allowed = allowed_origins

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or answer it here."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        most = next((limit.most_bytes for limit in self._limits if limit.path.fullmatch(scope["path"])), SMALL_BODY)
        refusal = self._refusal(scope, headers, most)
        if refusal is None:
            await self._app(scope, _Counted(receive, most, self._timeout_s), send)
            return
        if isinstance(refusal, TooLarge):
            await _discard(receive)
        await problems.answer(problems.document(refusal), {"Connection": "close"})(scope, receive, send)

    def _refusal(self, scope: Scope, headers: Headers, most: int) -> PondwatchError | None:
        declared = headers.get("content-length", "0")
        if declared.isdecimal() and int(declared[:20]) > most:
            return too_large(most)
        origin = headers.get("origin")
        if scope["method"] in ("GET", "HEAD") or origin is None or origin in self._allowed:
            return None
        if urlsplit(origin).netloc == headers.get("host", ""):
            return None
        return Forbidden("Pages of another origin may not change anything here.")


def too_large(most_bytes: int) -> TooLarge:
    """The error for a body over the limit."""
    return TooLarge(f"The body is larger than {most_bytes} bytes.", limit_bytes=most_bytes)


async def _discard(receive: Receive) -> None:
    """Let a sender finish, within bounds, so that it comes to read the answer."""
    left = _DISCARD_BYTES
    try:
        async with asyncio.timeout(_DISCARD_S):
            more = True
            while more and left > 0:
                message = await receive()
                left -= len(message.get("body", b""))
                more = message["type"] == "http.request" and message.get("more_body", False)
    except TimeoutError:
        pass


class _Counted:
    """A `receive` that raises where a body grows over the limit or takes too long."""

    def __init__(self, receive: Receive, most: int, timeout_s: float) -> None:
        self._receive, self._most, self._timeout_s = receive, most, timeout_s
        self._got = 0
        self._whole = False
        self._deadline: float | None = None

    async def __call__(self) -> Message:
        if self._whole:
            return await self._receive()
        if self._deadline is None:
            self._deadline = asyncio.get_running_loop().time() + self._timeout_s
        try:
            async with asyncio.timeout_at(self._deadline):
                message = await self._receive()
        except TimeoutError:
            raise TooSlow(f"The body did not arrive within {self._timeout_s:g} seconds.") from None
        self._got += len(message.get("body", b""))
        self._whole = not message.get("more_body", False)
        if self._got > self._most:
            if not self._whole:
                await _discard(self._receive)
            raise too_large(self._most)
        return message
