"""A simulated inspection as a session bundle, with the truth beside it for scoring."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Iterable
from pathlib import Path

from pondwatch.core.errors import Invalid
from pondwatch.core.inspection import inspection_document

from .simulation import Simulation


def write_bundle(
    simulation: Simulation, folder: Path, truth: bool = True, progress: Callable[[int], None] = lambda _: None
) -> None:
    """Write a `pond-session/1` folder, and `truth_poses.csv` and `truth_rods.csv` where asked.

    Raises:
        Invalid: the folder is there and not empty.
    """
    if folder.exists() and any(folder.iterdir()):
        raise Invalid(f"{folder}: is not empty; a bundle is written to a folder of its own.")
    (folder / "snapshots").mkdir(parents=True, exist_ok=True)
    rows = []
    for n, snapshot in enumerate(simulation, start=1):
        image = f"snapshots/{snapshot.key.sequence:06d}{snapshot.suffix}"
        (folder / image).write_bytes(snapshot.content)
        pose = (f"{v:.7f}" for v in snapshot.pose_pond)
        rows.append((snapshot.key.sequence, snapshot.key.robot, snapshot.captured_at, image, *pose))
        progress(n)
    document = json.dumps(inspection_document(simulation.inspection), indent=1)
    (folder / "session.json").write_text(document, encoding="utf-8")
    _write(folder / "poses.csv", "sequence,robot,captured_at,image,x_m,y_m,theta_rad", rows)
    if truth:
        poses = ((n, *(f"{v:.7f}" for v in pose)) for n, pose in enumerate(simulation.truth_poses))
        _write(folder / "truth_poses.csv", "sequence,x_m,y_m,theta_rad", poses)
        rods = zip((rod.id for rod in simulation.inspection.pond.rods), simulation.truth_fills, strict=True)
        _write(folder / "truth_rods.csv", "rod_id,fill", ((rod, f"{fill:.4f}") for rod, fill in rods))


def _write(path: Path, header: str, rows: Iterable[Iterable[object]]) -> None:
    text = io.StringIO()
    text.write(header + "\n")
    csv.writer(text, lineterminator="\n").writerows(rows)
    path.write_text(text.getvalue(), encoding="utf-8")
