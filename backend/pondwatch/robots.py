"""The demo's robots: the simulator as a process of its own, a client of the server like any base station."""

from __future__ import annotations

import subprocess
import sys
import threading

SNAPSHOTS, RATE = 600, 10.0


class DemoRobots:
    """`api.services.Robots` as a child process, at most one at a time.

    Args:
        snapshots: of the demo inspection.
        rate: uploads a second.
    """

    def __init__(self, snapshots: int = SNAPSHOTS, rate: float = RATE) -> None:
        self._arguments = ["--snapshots", str(snapshots), "--rate", str(rate)]
        self._process: subprocess.Popen[bytes] | None = None
        self._lock = threading.Lock()

    def begin(self, url: str) -> bool:
        """Let them upload to the server at `url`; False where they do so already."""
        with self._lock:
            if self._process is not None and self._process.poll() is None:
                return False
            arguments = ["simulate", "--demo", "--url", url, *self._arguments]
            command = [sys.executable, "-c", "from pondwatch.cli import main; main()", *arguments]
            self._process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
            return True

    def end(self) -> None:
        """Stop them, and wait until they are gone."""
        with self._lock:
            if self._process is not None:
                self._process.terminate()
                self._process.wait()
