"""How fast: correcting a whole session, and adding one snapshot to a session of many; time and memory.

Writes docs/speed.md. Each size runs in a process of its own, so that its peak memory is its own.
"""

from __future__ import annotations

import json
import os
import resource
import statistics
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from pondwatch.basestation.bundle import Bundle
from pondwatch.basestation.correcting import correct_bundle
from pondwatch.core.corrector import make_corrector
from pondwatch.core.values import Snapshot

from .pages import number, table, write_page
from .simulated import simulated_bundles

SIZES = (221, 1000)
ADDED = 20
EXPLAINED = f"""\
*Corrected whole* is `pondwatch correct` without starting Python: reading, decoding, correcting, assembling.
*Add one* is what a corrector takes for one more snapshot when it holds so many already ({ADDED} times; median
and slowest), decoded and without assembling; *settle* decides all of them at once. Sizes above a session's own
repeat its snapshots as those of robots that restarted. Memory is the process's peak. One core."""


def run(bundles: Path | None, method: str) -> None:
    """Measure and write down."""
    with TemporaryDirectory() as folder:
        found = sorted(p.parent for p in bundles.glob("*/session.json")) if bundles else []
        found += simulated_bundles(Path(folder), ("simulated", "simulated-large"))
        whole = [_whole(bundle, method) for bundle in found]
        first = next((b for b in found if b.name == "plain"), found[0])
        grown = [_in_a_process(first, size, method) for size in SIZES]
    head = ("session", "snapshots", "corrected whole, s")
    more = ("session", "snapshots", "add one, ms", "slowest, ms", "settle, s", "memory, MB")
    parts = [EXPLAINED, "## A whole session", table(head, whole), "## One more snapshot", table(more, grown)]
    page = write_page("speed.md", "How fast it is", parts)
    print(f"{table(head, whole)}\n{table(more, grown)}\nwritten to {page}")


def _whole(bundle: Path, method: str) -> tuple[str, ...]:
    with Bundle(bundle) as opened:
        started = time.perf_counter()
        correct_bundle(opened, method)
        return bundle.name, str(len(opened.rows)), number(time.perf_counter() - started)


def _in_a_process(bundle: Path, size: int, method: str) -> tuple[str, ...]:
    command = [sys.executable, "-m", "tests.bench.speed", str(bundle), str(size), method]
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    told = json.loads(subprocess.run(command, check=True, env=environment, capture_output=True, text=True).stdout)
    return (
        bundle.name,
        str(size),
        *(number(told[name]) for name in ("median_ms", "slowest_ms", "settle_s", "memory_mb")),
    )


def grow(bundle: Path, size: int, method: str) -> dict[str, float]:
    """Fill a corrector with `size` snapshots, then add some more one by one."""
    with Bundle(bundle) as opened:
        snapshots = [s for _, s in opened.snapshots(opened.rows) if isinstance(s, Snapshot)]
        corrector = make_corrector(opened.inspection, method)
    many = [_again(snapshots[i % len(snapshots)], i // len(snapshots)) for i in range(size + ADDED)]
    for at in range(0, size, 64):
        corrector.add(many[at : min(at + 64, size)])
    times = []
    for snapshot in many[size:]:
        started = time.perf_counter()
        corrector.add([snapshot])
        times.append((time.perf_counter() - started) * 1000)
    started = time.perf_counter()
    corrector.settle()
    settle_s = time.perf_counter() - started
    memory_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return {
        "median_ms": statistics.median(times),
        "slowest_ms": max(times),
        "settle_s": settle_s,
        "memory_mb": memory_mb,
    }


def _again(snapshot: Snapshot, boot: int) -> Snapshot:
    return replace(snapshot, key=replace(snapshot.key, boot=snapshot.key.boot + boot), image=snapshot.image.copy())


if __name__ == "__main__":
    print(json.dumps(grow(Path(sys.argv[1]), int(sys.argv[2]), sys.argv[3])))
