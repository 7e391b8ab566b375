"""An in-process bus: any thread says that a session is at a revision, the event loop hears of it.

Messages are merged: between two deliveries only the newest revision of each session is kept, so that a publisher is
never held up and memory never grows, however busy the loop is.
"""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable

Listener = Callable[[str, int], None]


class LocalBus:
    """`core.ports.Bus` for one process. Publish from any thread; listeners are called on the loop attached."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._pending: dict[str, int] = {}
        self._listeners: list[Listener] = []
        self._loop: asyncio.AbstractEventLoop | None = None

    def attach(self, loop: asyncio.AbstractEventLoop) -> None:
        """Deliver on this loop from now on; what was published before is delivered at once."""
        with self._lock:
            self._loop = loop
            waiting = bool(self._pending)
        if waiting:
            loop.call_soon_threadsafe(self._deliver)

    def detach(self) -> None:
        """Deliver no more. Messages published later wait for the next `attach`."""
        with self._lock:
            self._loop = None

    def subscribe(self, listener: Listener) -> Callable[[], None]:
        """Call `listener(session, revision)` on the loop after each publication; returns what ends it."""
        self._listeners.append(listener)
        return lambda: self._listeners.remove(listener)

    def publish(self, session: str, revision: int) -> None:
        """Say that `session` is at `revision`. Any thread; returns at once."""
        with self._lock:
            waiting = bool(self._pending)
            self._pending[session] = max(revision, self._pending.get(session, revision))
            loop = self._loop
        if loop is None or waiting:
            return
        try:
            loop.call_soon_threadsafe(self._deliver)
        except RuntimeError:  # the loop was closed between the look and the call: nobody listens any more
            self.detach()

    def _deliver(self) -> None:
        with self._lock:
            messages, self._pending = self._pending, {}
        for session, revision in messages.items():
            for listener in tuple(self._listeners):
                listener(session, revision)
