"""How fast: correcting a whole session, and adding one snapshot to a session of many; time and memory.

Writes docs/speed.md. Each size runs in a process of its own, so that its peak memory is its own.
"""

from __future__ import annotations

import json
import os
import pickle
import resource
import statistics
import subprocess
import sys
import time
from collections.abc import Sequence
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from pondwatch.basestation.bundle import Bundle
from pondwatch.basestation.correcting import correct_bundle
from pondwatch.core.corrector import hold, make_corrector
from pondwatch.core.images import decode
from pondwatch.core.values import Snapshot
from pondwatch.simulator.simulation import Simulation
from pondwatch.simulator.spec import SimulationSpec

from .pages import number, table, write_page
from .ponds import CORE, SIMULATOR, Kept, Record
from .simulated import simulated_bundles

SIZES = (221, 1000, 5000)
QUICK = 1000  # snapshots, at most, where it must be quick
ADDED = 100
SEED = 1009
EXPLAINED = f"""\
*Mosaic and rods* is how long `pondwatch correct` takes, without starting Python, by the clock, until a session is
read, decoded, corrected and assembled and its rods are read (asked: 4 s for 221 snapshots; the aim is 1 s); *whole* is
until the floor was looked over too, which begins beside the assembling; *processor* is what its processes took
together. *Settle* decides all snapshots of a simulated session together. *Add one* is
what the corrector then takes for one more snapshot ({ADDED} times), decoded and without assembling; asked is a 95th
percentile of 50 ms at 221 held and at most twice that of 221 at 5,000. *State* is what the corrector holds between
two snapshots, pickled, the pictures among it; *peak* is the process's memory at most, the simulator's floor with it.
These are CPU times of one core: what else the machine did counts as far only as it shared caches and cores."""


def run(bundles: Path | None, method: str, quick: bool = False) -> None:
    """Measure what is not yet there, and write down."""
    kept = Kept("speed", code=(CORE, SIMULATOR))
    for size in SIZES:
        there = any((r.get("size"), r["method"]) == (size, method) for r in kept.records())
        if not there and (size <= QUICK or not quick):
            kept.add({"size": size, "method": method, **_in_a_process(size, method)})
    with TemporaryDirectory() as folder:
        found = sorted(p.parent for p in bundles.glob("*/session.json")) if bundles else []
        found += simulated_bundles(Path(folder), ("simulated", "simulated-large"))
        for bundle in found:
            if not any((r.get("session"), r["method"]) == (bundle.name, method) for r in kept.records()):
                kept.add({"session": bundle.name, "method": method, **_whole(bundle, method)})
    write([r for r in kept.records() if r["method"] == method])


def write(records: Sequence[Record]) -> None:
    """The page, of what is there."""
    whole = [
        (r["session"], str(r["snapshots"]), *(number(r[name]) for name in ("mosaic_s", "seconds", "processor_s")))
        for r in records
        if "session" in r
    ]
    names = ("median_ms", "p95_ms", "slowest_ms", "settle_s", "state_mb", "state_kb_each", "peak_mb")
    grown = [(str(r["size"]), *(number(r[name]) for name in names)) for r in records if "size" in r]
    head = ("session", "snapshots", "mosaic and rods, s", "whole, s", "processor, s")
    more = (
        "snapshots held",
        "add one, ms",
        "95 %, ms",
        "slowest, ms",
        "settle, s",
        "state, MB",
        "a snapshot, kB",
        "peak, MB",
    )
    parts = [EXPLAINED, _busy(), "## A whole session", table(head, whole), "## One more snapshot", table(more, grown)]
    page = write_page("speed.md", "How fast it is", parts)
    print(f"{table(head, whole)}\n{table(more, grown)}\nwritten to {page}")


def _busy() -> str:
    """How many processes shared the machine: with many of them CPU times grow too, up to threefold where seen."""
    return f"Processes that wanted to run at the end of this: {os.getloadavg()[2]:.1f} (mean of 15 minutes)."


def _whole(bundle: Path, method: str) -> Record:
    began: dict[str, float] = {}  # each part of the work, by what it is called

    def progress(what: str, _done: int, _total: int) -> None:
        began.setdefault(what, time.perf_counter())

    with Bundle(bundle) as opened:
        started, before = time.perf_counter(), _processor_s()
        correct_bundle(opened, method, progress)
        seconds = time.perf_counter() - started
        processor_s, mosaic_s = _processor_s() - before, began["Looking over the floor"] - started
        return {"snapshots": len(opened.rows), "mosaic_s": mosaic_s, "seconds": seconds, "processor_s": processor_s}


def _processor_s() -> float:
    """Of this process and its children that ended, so far."""
    used = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(u.ru_utime + u.ru_stime for u in used)


def _in_a_process(size: int, method: str) -> Record:
    command = [sys.executable, "-m", "tests.bench.speed", str(size), method]
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    told: Record = json.loads(subprocess.run(command, check=True, env=environment, stdout=subprocess.PIPE).stdout)
    return told


def grow(size: int, method: str, added: int = ADDED) -> dict[str, float]:
    """Let a corrector settle `size` snapshots, then add some more one by one."""
    simulation = Simulation(SimulationSpec(snapshots=size + added, margin_px=48.0), SEED)
    taken = (Snapshot(s.key, s.captured_s, s.pose_pond, decode(s.content, simulation.spec.camera)) for s in simulation)
    corrector = make_corrector(simulation.inspection, method)
    hold(corrector, list(islice(taken, size)))
    started = time.process_time()
    corrector.settle()
    settle_s = time.process_time() - started
    state = len(pickle.dumps(corrector))
    times = []
    for snapshot in taken:
        started = time.process_time()
        corrector.add([snapshot])
        times.append((time.process_time() - started) * 1000)
    return {
        "median_ms": statistics.median(times),
        "p95_ms": float(np.percentile(times, 95)),
        "slowest_ms": max(times),
        "settle_s": settle_s,
        "state_mb": state / 2**20,
        "state_kb_each": state / 1024 / size,
        "peak_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
    }


if __name__ == "__main__":
    print(json.dumps(grow(int(sys.argv[1]), sys.argv[2])))
