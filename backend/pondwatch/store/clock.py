"""Times as they are kept (whole milliseconds since the epoch) and as they are told (RFC 3339, UTC, ending in Z)."""

from __future__ import annotations

import time
from datetime import UTC, datetime


class SystemClock:
    """The machine's clock."""

    def now_s(self) -> float:
        """Seconds since the epoch, UTC."""
        return time.time()


def rfc3339(ms: int | None) -> str | None:
    """`2026-01-01T08:00:00.000Z`; None stays None."""
    if ms is None:
        return None
    text = datetime.fromtimestamp(ms // 1000, UTC).isoformat()
    return f"{text[:19]}.{ms % 1000:03d}Z"
