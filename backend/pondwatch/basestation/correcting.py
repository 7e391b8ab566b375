"""Correct a bundle without a server: the same core, the same result as an upload."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from pondwatch.core.consensus import Look
from pondwatch.core.corrector import hold
from pondwatch.core.errors import Invalid
from pondwatch.core.findings import Condition, find
from pondwatch.core.mosaic import Mosaic
from pondwatch.core.values import CorrectedPose, Image, Pond, Quality, RodReading, Snapshot, SnapshotKey, Status
from pondwatch.jobs import exports
from pondwatch.jobs.findingviews import document, findings_csv
from pondwatch.jobs.papernets import make_corrector
from pondwatch.jobs.spreading import beside, spread_out

from .bundle import Bundle, Row

_BATCH = 256  # snapshots handed to the corrector together


@dataclass(frozen=True, slots=True, eq=False)
class CorrectedBundle:
    """poses: in the bundle's order. rods: in the layout's. mosaic: (h, w, 4) BGRA. faults: why snapshots were
    rejected before any correction, a line each."""

    poses: tuple[CorrectedPose, ...]
    rods: tuple[RodReading, ...]
    mosaic: Image
    metres_per_pixel: float
    quality: Quality
    faults: tuple[str, ...]
    condition: Condition


def correct_bundle(
    bundle: Bundle, method: str = "auto", progress: Callable[[str, int, int], None] = lambda *_: None
) -> CorrectedBundle:
    """Correct every snapshot of a bundle, read its rods and assemble its mosaic.

    Args:
        progress: called with what is being done, how many snapshots are done, and how many there are.

    Raises:
        InvalidBundle: a picture that cannot be read. Invalid: there is no such method.
    """
    corrector = make_corrector(bundle.inspection, method, spread_out)
    rows = sorted(bundle.rows, key=lambda row: row.key)
    taken: dict[SnapshotKey, Snapshot] = {}
    faults: list[str] = []
    for first in range(0, len(rows), _BATCH):
        read = _read(bundle, rows[first : first + _BATCH])
        batch = [snapshot for snapshot in read if isinstance(snapshot, Snapshot)]
        faults += [fault.message for fault in read if isinstance(fault, Invalid)]
        taken.update((snapshot.key, snapshot) for snapshot in batch)
        hold(corrector, batch)
        progress("Correcting", first + len(read), len(rows))
    corrector.settle()
    poses = corrector.poses()
    looks, rods = sure_looks(taken, poses), corrector.rods()
    look_over = beside(lambda: find(looks, bundle.inspection.camera, bundle.inspection.pond, rods, spread_out))
    mosaic = _assemble(bundle, taken, poses.get, progress)
    unplaced = {row.key: CorrectedPose(row.key, None, None, Status.REJECTED) for row in rows}
    in_order = tuple(poses.get(row.key, unplaced[row.key]) for row in bundle.rows)
    quality, image = corrector.quality(), mosaic.bgra()
    progress("Looking over the floor", len(taken), len(taken))
    return CorrectedBundle(in_order, rods, image, mosaic.metres_per_pixel, quality, tuple(faults), look_over())


def _read(bundle: Bundle, rows: Sequence[Row]) -> list[Snapshot | Invalid]:
    """The snapshots of some rows: their bytes are read here, since an open file is for one process, and decoded on all
    cores."""
    contents = [(row, bundle.content(row)) for row in rows]
    return spread_out(lambda content: bundle.decoded(*content), contents, [row.key for row in rows])


def sure_looks(taken: Mapping[SnapshotKey, Snapshot], poses: Mapping[SnapshotKey, CorrectedPose]) -> list[Look]:
    """The snapshots that lie surely where they do, in the order of their keys."""
    placed = ((key, poses.get(key)) for key in sorted(taken))
    return [
        Look(taken[key].image, pose.pose_pond)
        for key, pose in placed
        if pose is not None and pose.status is Status.PLACED and pose.pose_pond is not None
    ]


def _assemble(
    bundle: Bundle,
    taken: dict[SnapshotKey, Snapshot],
    pose_of: Callable[[SnapshotKey], CorrectedPose | None],
    progress: Callable[[str, int, int], None],
) -> Mosaic:
    mosaic = Mosaic(bundle.inspection.camera, bundle.inspection.pond)
    for done, (key, snapshot) in enumerate(taken.items(), start=1):
        pose = pose_of(key)
        if pose is not None and pose.pose_pond is not None:
            mosaic.put(key, snapshot.image, pose.pose_pond, snapshot.captured_s)
        progress("Assembling", done, len(taken))
    return mosaic


def result_files(result: CorrectedBundle, pond: Pond) -> dict[str, bytes]:
    """The files of a result, by name."""
    condition = document(result.condition, pond)
    return {
        "poses.csv": exports.poses_csv(result.poses),
        "rods.csv": exports.rods_csv(result.rods),
        "findings.json": json.dumps(condition, indent=1).encode() + b"\n",
        "findings.csv": findings_csv(condition["findings"]),
        "mosaic.png": exports.mosaic_png(result.mosaic),
        "mosaic.pgw": exports.world_file(result.metres_per_pixel, pond.height_m),
        "mosaic.tif": exports.mosaic_tif(result.mosaic, result.metres_per_pixel, pond.height_m),
    }
