"""The websocket of the live feed: `/api/sessions/{id}/live?since=R`. A thin shell around the hub.

Close codes: 1008 (403 before the handshake) a page of another origin; 1013 too many viewers or a viewer that took
nothing for too long; 4404 no such session; 1011 a fault here, logged with the id that the reason carries.
"""

from __future__ import annotations

import asyncio
import contextlib
import uuid
from collections.abc import Collection
from urllib.parse import urlsplit

import structlog
from fastapi import APIRouter, WebSocket, WebSocketDisconnect
from starlette.responses import PlainTextResponse

from pondwatch.core.errors import Missing

from .hub import Hub, StalledError
from .protocol import Frame

MAX_VIEWERS = 256
_CLOSE_S = 1.0


def live_router(hub: Hub, allowed_origins: Collection[str] = ()) -> APIRouter:
    """The route of the live feed. allowed_origins: those beside the server's own, as `https://host:port`."""
    router = APIRouter()

    @router.websocket("/api/sessions/{session}/live")
    async def live(websocket: WebSocket, session: str, since: int | None = None) -> None:
        """Revisions as they are written: `since` the one that is held, or everything where it is absent or too old."""
        if not _is_welcome(websocket, allowed_origins):
            await websocket.send_denial_response(PlainTextResponse("This origin may not watch.", status_code=403))
            return
        await websocket.accept()
        code, reason = await _watch(hub, websocket, session, since)
        with contextlib.suppress(RuntimeError, TimeoutError, WebSocketDisconnect):
            async with asyncio.timeout(_CLOSE_S):
                await websocket.close(code, reason)

    return router


def _is_welcome(websocket: WebSocket, allowed_origins: Collection[str]) -> bool:
    """A browser always says its origin; who says none is a program, which no page can make act for it."""
    origin = websocket.headers.get("origin")
    if origin is None or origin in allowed_origins:
        return True
    return urlsplit(origin).netloc == websocket.headers.get("host", "")


async def _watch(hub: Hub, websocket: WebSocket, session: str, since: int | None) -> tuple[int, str]:
    """Serve until either side ends; returns how to close."""
    if hub.viewers >= MAX_VIEWERS:
        return 1013, "Too many viewers; try again later."
    serving = asyncio.create_task(hub.serve(session, since, lambda frame: _send(websocket, frame)))
    leaving = asyncio.create_task(_until_left(websocket))
    try:
        await asyncio.wait((serving, leaving), return_when=asyncio.FIRST_COMPLETED)
        if leaving.done():
            return 1000, ""
        await serving
    except Missing as error:
        return 4404, error.message[:100]
    except StalledError:
        return 1013, "Took nothing for too long; reconnect with the last revision."
    except (WebSocketDisconnect, RuntimeError):
        return 1000, ""
    except Exception:
        fault = uuid.uuid4().hex
        structlog.get_logger().exception("live_feed_failed", session=session, fault=fault)
        return 1011, f"A fault here, logged as {fault}."
    finally:
        for task in (serving, leaving):
            task.cancel()
        await asyncio.gather(serving, leaving, return_exceptions=True)
    return 1000, ""


async def _send(websocket: WebSocket, frame: Frame) -> None:
    if isinstance(frame, bytes):
        await websocket.send_bytes(frame)
    else:
        await websocket.send_text(frame)


async def _until_left(websocket: WebSocket) -> None:
    """Viewers have nothing to say; what they send is read and dropped, so that their leaving is heard."""
    while (await websocket.receive())["type"] != "websocket.disconnect":
        pass
