"""What libraries give for the same sessions, beside ours: SIFT with a robust pose graph, and OpenCV's stitcher.

Writes docs/baselines.md. Every session by every method is kept as it comes (`ponds.py`); `--quick` leaves the simulated
cases out.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from pondwatch.core.values import Bool, Float, Image, Inspection
from pondwatch.simulator.simulation import Simulation

from .baseline.siftgraph import sift_graph
from .baseline.stitcher import stitched
from .grid import CASES, FIRST_SEED, Case
from .pages import ROOT, number, percent, table, write_page
from .ponds import SIMULATOR, Inspected, Kept, Record, corrected, opened, simulated
from .score import Figures, Result, Truth, identity, score

Method = Callable[[Inspection, Sequence[Image], Float], tuple[Float, Bool]]
LIBRARIES: dict[str, Method] = {"sift-graph": sift_graph, "stitcher": stitched}
METHODS = ("identity", "auto", *LIBRARIES)
STITCHED = 60  # snapshots that the stitcher is given: it compares every pair, for minutes where there are 221
BASELINES = Path(__file__).parent / "baseline"
EXPLAINED = """\
The same sessions by what libraries offer. `identity`: the poses as they came. `auto`: ours. `sift-graph`: SIFT on
every snapshot, matches guided by the prior, similarities by RANSAC (`cv2.estimateAffinePartial2D`), and
`scipy.optimize.least_squares` with a robust loss over the pose graph, tied to the priors; *given* are the snapshots
that some pair holds. `stitcher`: `cv2.Stitcher` in its mode for scans, which takes pictures and no poses: *given* are
those it placed at all, brought into the pond by one similarity fitted to their noisy poses; it is given a session's
first {stitched} snapshots, for it compares every picture with every other, and is scored on these. What a method does
not give counts with its noisy pose. Neither baseline says when it is unsure, and neither reads a rod. Thresholds are
those of `tests/bench/baseline/`; the scales of the pose graph's losses were chosen on `plain` and `unmapped` with their
truth in sight, in the library's favour. Median and gross (over 5 px) of sessions marked °, which have no layout, are
those after one rigid motion of all poses."""


def run(bundles: Path | None, quick: bool = False) -> None:
    """Measure what is not yet there, and write down."""
    ours, theirs = Kept("baselines"), Kept("libraries", code=(SIMULATOR, BASELINES))
    sessions = dict(_sessions(bundles, quick))
    for method in METHODS:
        kept = theirs if method in LIBRARIES else ours
        for name in sessions:
            if not any((r["session"], r["method"]) == (name, method) for r in kept.records()):
                record = _measured(sessions[name](), method)
                kept.add({"session": name, **record})
                told = record["figures"]
                print(f"{name} {method}: {told['median_px']:.3f} px, gross {told['gross']:.3f}", flush=True)
    write([r for r in (*ours.records(), *theirs.records()) if r["session"] in sessions])


def _sessions(bundles: Path | None, quick: bool) -> Iterator[tuple[str, Callable[[], Inspected]]]:
    """Names, and how to get each: bundles, then a pond of every case of the grid."""
    for path in sorted(p.parent for p in bundles.glob("*/truth_poses.csv")) if bundles else []:
        yield path.name, partial(opened, path)
    for case in () if quick else CASES:
        yield f"grid: {case.name}", partial(_of_case, case)


def _of_case(case: Case) -> Inspected:
    return simulated(Simulation(case.spec, FIRST_SEED))


def _measured(session: Inspected, method: str) -> Record:
    if method == "stitcher":
        session = first(session, STITCHED)
    result, seconds = _result(session, method)
    figures = score(session.truth, result)
    mapped = bool(session.truth.inspection.pond.rods)
    return {"method": method, "mapped": mapped, "seconds": seconds, "figures": figures}


def _result(session: Inspected, method: str) -> tuple[Result, float | None]:
    """What a method says, and the CPU seconds that it took."""
    if method == "identity":
        return identity(session.truth), None
    if method == "auto":
        return corrected(session, "auto")
    images, started = [s.image for s in session.snapshots], time.process_time()
    poses, given = LIBRARIES[method](session.truth.inspection, images, session.truth.noisy)
    return _as_result(session.truth, poses, given), time.process_time() - started


def _as_result(truth: Truth, poses: Float, given: Bool) -> Result:
    """A baseline's poses; those not given have none."""
    n = len(truth.sequences)
    statuses = tuple("placed" if g else "rejected" for g in given)
    return Result(np.where(given[:, None], poses, np.nan), np.full(n, np.nan), statuses, {})


def first(session: Inspected, most: int) -> Inspected:
    """Its first snapshots, and what is true of them."""
    t = session.truth
    truth = replace(t, sequences=t.sequences[:most], poses=t.poses[:most], noisy=t.noisy[:most])
    return Inspected(session.snapshots[:most], truth)


def write(records: Sequence[Record]) -> None:
    """The page, of what is there."""
    names = list(dict.fromkeys(r["session"] for r in records))
    rank = {method: k for k, method in enumerate(METHODS)}
    rows = sorted(records, key=lambda r: (names.index(r["session"]), rank[r["method"]]))
    head = ("session", "method", "given", "median px", "p95 px", "gross", "theta, mrad", "footprint IoU", "CPU s")
    parts = [
        EXPLAINED.format(stitched=STITCHED),
        table(head, map(_line, rows)),
        "## Why\n\n" + WHY,
        "Made by `python -m tests.bench baselines --bundles FOLDER`; with `--quick` without the simulated cases.",
    ]
    page = write_page("baselines.md", "Beside what libraries offer", parts)
    print(f"written to {page.relative_to(ROOT)}")


WHY = """\
A lattice looks the same one pitch on. Matches guided by the prior are drawn to the nearest rod that fits, which at a
third of a pitch of noise is often the wrong one; such pairs agree among themselves, and no robust loss tells a
consistent group of them from the truth. What tells them apart is what the rods hold, read over all snapshots at once,
which is what `lattice` does ([how](method.md)). On a floor that is textured, where every place looks like itself
only, the same pairs are right. The published networks are compared on data of their own geometry, in their own
figures: [the paper](paper.md)."""


def _line(record: Record) -> tuple[str, ...]:
    figures: Figures = record["figures"]
    frame = "" if record["mapped"] else "_aligned"
    return (
        record["session"] + ("" if record["mapped"] else "°"),
        f"`{record['method']}`",
        percent(figures["placed"]) if record["method"] != "identity" else "-",
        number(figures[f"median_px{frame}"]),
        number(figures["p95_px"]),
        percent(figures[f"gross{frame}"]),
        number(1000 * figures["theta_median_rad"]),
        f"{figures['iou_footprint']:.3f}",
        number(record["seconds"], 2),
    )
