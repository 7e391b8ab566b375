"""Starts the real server on a data folder, as `pondwatch serve` does; with `--acknowledge-early`, one that lies.

The lie: an upload is acknowledged a moment before it is committed. It exists here alone, so that the harness can be
shown to notice. Nothing is imported before it is needed: a worker process begins by importing what its server ran.
"""

from __future__ import annotations

import sys
import threading
from concurrent.futures import Future
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pondwatch.jobs.ingest import Ingest, Receipt
    from pondwatch.store.snapshots import NewSnapshot

LATE_S = 0.1


def acknowledge_early() -> None:
    """Make every later server of this process answer before it commits."""
    from pondwatch.jobs.ingest import Ingest, Receipt
    from pondwatch.store.snapshots import StoredSnapshot

    honest = Ingest._commit

    def lying(self: Ingest, session_id: str, new: NewSnapshot) -> Future[Receipt]:
        threading.Timer(LATE_S, lambda: honest(self, session_id, new)).start()
        answer: Future[Receipt] = Future()
        answer.set_result(Receipt(session_id, StoredSnapshot(0, 0, new), is_new=True))
        return answer

    Ingest._commit = lying  # type: ignore[method-assign]


def main() -> None:
    """Serve until killed."""
    from pondwatch.jobs.nursery import prepare

    prepare()
    from pondwatch.app import serve
    from pondwatch.config import Settings

    if "--acknowledge-early" in sys.argv:
        acknowledge_early()
    serve(Settings(data=Path(sys.argv[1]), port=0, workers=1))


if __name__ == "__main__":
    main()
