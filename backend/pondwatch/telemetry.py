"""Metrics (Prometheus) and logs (JSON lines). One registry an application: nothing is global."""

from __future__ import annotations

import logging
import sys
from collections.abc import Callable

import structlog
from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram, generate_latest

_SECONDS = (0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0)


class Telemetry:
    """What is counted."""

    def __init__(self) -> None:
        self._registry = CollectorRegistry()
        self.uploads = Counter(
            "pondwatch_uploads", "Snapshots that arrived, by HTTP status.", ["status"], registry=self._registry
        )
        self.upload_bytes = Counter(
            "pondwatch_upload_bytes", "Bytes of pictures that were stored.", registry=self._registry
        )
        self.upload_seconds = Histogram(
            "pondwatch_upload_seconds",
            "From a parsed upload to its acknowledgement.",
            buckets=_SECONDS,
            registry=self._registry,
        )
        self.step_seconds = Histogram(
            "pondwatch_step_seconds",
            "From taking up a session to a committed revision.",
            buckets=_SECONDS,
            registry=self._registry,
        )
        self.stage_seconds = Histogram(
            "pondwatch_stage_seconds",
            "Stages from a stored snapshot to its viewers: wait, correct, assemble, commit, tell.",
            ["stage"],
            buckets=_SECONDS,
            registry=self._registry,
        )
        self.covered = Counter(
            "pondwatch_snapshots_covered", "Snapshots that a revision came to cover.", registry=self._registry
        )

    def spent(self, **seconds: float) -> None:
        """How long stages took, each by its name."""
        for stage, s in seconds.items():
            self.stage_seconds.labels(stage).observe(s)

    def watch(self, name: str, help_text: str, value: Callable[[], float]) -> None:
        """A gauge that is read when asked for."""
        Gauge(name, help_text, registry=self._registry).set_function(value)

    def text(self) -> bytes:
        """All metrics in Prometheus' text format."""
        return generate_latest(self._registry)


def configure_logging(level: int = logging.INFO) -> None:
    """Log JSON lines to standard error."""
    structlog.configure(
        processors=[
            structlog.contextvars.merge_contextvars,
            structlog.processors.add_log_level,
            structlog.processors.TimeStamper(fmt="iso", utc=True),
            structlog.processors.format_exc_info,
            structlog.processors.JSONRenderer(),
        ],
        wrapper_class=structlog.make_filtering_bound_logger(level),
        logger_factory=structlog.PrintLoggerFactory(sys.stderr),
        cache_logger_on_first_use=False,
    )
