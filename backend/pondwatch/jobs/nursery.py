"""The process that workers are forked from.

It takes a second to load what they need, and whoever starts the first worker waits for it; so a server has it begin
before it loads what it needs itself.
"""

from __future__ import annotations

import multiprocessing
from multiprocessing import forkserver
from multiprocessing.context import ForkServerContext


def context() -> ForkServerContext:
    """Processes that are started in it have loaded what a worker needs."""
    found = multiprocessing.get_context("forkserver")
    found.set_forkserver_preload(["pondwatch.jobs.worker"])
    return found


def prepare() -> None:
    """Begin to load; returns at once."""
    context()
    forkserver.ensure_running()
