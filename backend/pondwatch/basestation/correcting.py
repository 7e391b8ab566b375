"""Correct a bundle without a server: the same core, the same result as an upload."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from pondwatch.core.corrector import hold
from pondwatch.core.errors import Invalid
from pondwatch.core.mosaic import Mosaic
from pondwatch.core.values import CorrectedPose, Image, Quality, RodReading, Snapshot, SnapshotKey, Status
from pondwatch.jobs.papernets import make_corrector

from .bundle import Bundle

_BATCH = 64  # snapshots handed to the corrector together


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


def correct_bundle(
    bundle: Bundle, method: str = "auto", progress: Callable[[str, int, int], None] = lambda *_: None
) -> CorrectedBundle:
    """Correct every snapshot of a bundle, read its rods and assemble its mosaic.

    Args:
        progress: called with what is being done, how many snapshots are done, and how many there are.

    Raises:
        InvalidBundle: a picture that cannot be read. Invalid: there is no such method.
    """
    corrector = make_corrector(bundle.inspection, method)
    rows = sorted(bundle.rows, key=lambda row: row.key)
    taken: dict[SnapshotKey, Snapshot] = {}
    faults: list[str] = []
    batch: list[Snapshot] = []
    for done, (_, snapshot) in enumerate(bundle.snapshots(rows), start=1):
        if isinstance(snapshot, Invalid):
            faults.append(snapshot.message)
        else:
            taken[snapshot.key] = snapshot
            batch.append(snapshot)
        if len(batch) == _BATCH or done == len(rows):
            hold(corrector, batch)
            batch = []
        progress("Correcting", done, len(rows))
    corrector.settle()
    poses = corrector.poses()
    mosaic = _assemble(bundle, taken, poses.get, progress)
    unplaced = {row.key: CorrectedPose(row.key, None, None, Status.REJECTED) for row in rows}
    in_order = tuple(poses.get(row.key, unplaced[row.key]) for row in bundle.rows)
    quality = corrector.quality()
    return CorrectedBundle(in_order, corrector.rods(), mosaic.bgra(), mosaic.metres_per_pixel, quality, tuple(faults))


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
