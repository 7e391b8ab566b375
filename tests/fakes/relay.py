"""A wire to a server that can be cut: bytes pass through, or stop without a word, as on a network that went away."""

from __future__ import annotations

import contextlib
import socket
import threading
from collections.abc import Iterator


class Relay:
    """Listens at `url` and passes everything to `port`. `cut` lets nothing through, either way, until `mend`."""

    def __init__(self, port: int) -> None:
        self._port = port
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.url = f"http://127.0.0.1:{self._listener.getsockname()[1]}"
        self._open = threading.Event()
        self._open.set()
        self._sockets: list[socket.socket] = []
        threading.Thread(target=self._accept, daemon=True).start()

    def cut(self) -> None:
        """Whoever is connected hears nothing more; whoever connects is not answered."""
        self._open.clear()

    def mend(self) -> None:
        """What was cut is gone, as after a router's restart; new connections pass."""
        gone, self._sockets = self._sockets, []
        for one in gone:
            _close(one)
        self._open.set()

    def close(self) -> None:
        """End it."""
        self.mend()
        _close(self._listener)

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                client, _ = self._listener.accept()
                server = socket.create_connection(("127.0.0.1", self._port))
                self._sockets += [client, server]
                for source, sink in ((client, server), (server, client)):
                    threading.Thread(target=self._pass, args=(source, sink), daemon=True).start()

    def _pass(self, source: socket.socket, sink: socket.socket) -> None:
        with contextlib.suppress(OSError):
            while content := source.recv(65536):
                self._open.wait()
                sink.sendall(content)
        _close(source)
        _close(sink)


def _close(one: socket.socket) -> None:
    with contextlib.suppress(OSError):
        one.shutdown(socket.SHUT_RDWR)
    one.close()


@contextlib.contextmanager
def relayed(port: int) -> Iterator[Relay]:
    """A wire to a port of this machine, closed at the end."""
    relay = Relay(port)
    try:
        yield relay
    finally:
        relay.close()
