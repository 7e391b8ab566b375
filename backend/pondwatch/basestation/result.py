"""The result of a correction without a server, and the bundle that it is of, as a dossier: for the same exports."""

from __future__ import annotations

import csv
import hashlib
import io
import math
from collections.abc import Mapping
from pathlib import Path

import cv2
import numpy as np

from pondwatch.core.errors import InvalidBundle
from pondwatch.core.frames import raster_size_px
from pondwatch.core.mosaic import default_metres_per_pixel
from pondwatch.core.values import Image
from pondwatch.jobs.dossier import Dossier
from pondwatch.jobs.views import Json

from .bundle import MAX_POSES_BYTES, Bundle, Row
from .source import open_source

_AXES = ("x_m", "y_m", "theta_rad")
_KINDS = {b"\x89PNG": "image/png", b"\xff\xd8\xff": "image/jpeg", b"RIFF": "image/webp"}
_MOST_MOSAIC_BYTES = 512 << 20


def result_dossier(opened: Bundle, result: Path) -> Dossier:
    """The dossier of a result folder.

    Args:
        opened: the bundle that was corrected; its pictures are read while the dossier is written.

    Raises:
        InvalidBundle: names the file, and the row, that does not fit the bundle.
    """
    poses = {(r["robot"], int(r["boot"]), int(r["sequence"])): r for r in _table(result, "poses.csv")}
    digests: dict[str, Row] = {}
    shots = [_shot(opened, row, poses, digests) for row in opened.rows]
    rods = {row["rod_id"]: _rod(row) for row in _table(result, "rods.csv")}
    if absent := [rod.id for rod in opened.inspection.pond.rods if rod.id not in rods]:
        raise InvalidBundle(f"rods.csv: lacks the rod {absent[0]!r} of the bundle.", file="rods.csv")
    mosaic = _mosaic(result, opened)
    facts = {
        "id": result.resolve().name,
        "name": opened.inspection.name,
        "state": "corrected",
        "method": "not on record",
        "revision": 1,
        "coverage": float((mosaic[..., 3] > 0).mean()),
        "quality": "",
        "created_at": min((shot["captured_at"] for shot in shots), default=None),
        "finished_at": None,
    }
    in_order = [rods[rod.id] for rod in opened.inspection.pond.rods]
    shots.sort(key=lambda s: (s["robot"], s["boot"], s["sequence"]))
    return Dossier(
        facts, opened.inspection, shots, in_order, None, lambda: mosaic, lambda d: opened.content(digests[d])
    )


def _table(result: Path, name: str) -> list[dict[str, str]]:
    source = open_source(result)
    try:
        text = source.read(name, MAX_POSES_BYTES).decode()
        return list(csv.DictReader(io.StringIO(text, newline=""), strict=True))
    except (UnicodeDecodeError, csv.Error) as error:
        raise InvalidBundle(f"{name}: is not a table of a result ({error}).", file=name) from error
    finally:
        source.close()


def _shot(
    opened: Bundle, row: Row, poses: Mapping[tuple[str, int, int], Mapping[str, str]], digests: dict[str, Row]
) -> Json:
    key, content = row.key, opened.content(row)
    told = poses.get((key.robot, key.boot, key.sequence))
    if told is None:
        raise InvalidBundle(f"poses.csv: lacks snapshot {key.sequence} of {key.robot}.", file="poses.csv")
    digest = hashlib.sha256(content).hexdigest()
    digests[digest] = row
    values = {name: _number(told, name) for name in (*_AXES, "sigma_xy_m", "sigma_theta_rad")}
    finite = [v if math.isfinite(v) else None for v in row.pose]
    return {
        "robot": key.robot,
        "boot": key.boot,
        "sequence": key.sequence,
        "captured_ms": round(row.captured_s * 1000),
        "captured_at": row.captured_at,
        "received_at": None,
        "raw": dict(zip(_AXES, finite, strict=True)),
        "corrected": None if values["x_m"] is None else {axis: values[axis] for axis in _AXES},
        "sigma_xy_m": values["sigma_xy_m"],
        "sigma_theta_rad": values["sigma_theta_rad"],
        "status": told["status"],
        "fault": None,
        "digest": digest,
        "media_type": next((kind for start, kind in _KINDS.items() if content.startswith(start)), "image/png"),
    }


def _rod(row: Mapping[str, str]) -> Json:
    return {
        "rod_id": row["rod_id"],
        "state": row["state"],
        "fill": _number(row, "fill"),
        "confidence": _number(row, "confidence") or 0.0,
        "views": int(row["views"]),
        "conflicting": False,
        "revision": 1,
    }


def _number(row: Mapping[str, str], name: str) -> float | None:
    return float(row[name]) if row.get(name) else None


def _mosaic(result: Path, opened: Bundle) -> Image:
    source = open_source(result)
    try:
        content = source.read("mosaic.png", _MOST_MOSAIC_BYTES)
    finally:
        source.close()
    image = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED)
    pond, camera = opened.inspection.pond, opened.inspection.camera
    width, height = raster_size_px(pond, default_metres_per_pixel(camera, pond))
    if image is None or image.shape != (height, width, 4):
        raise InvalidBundle(f"mosaic.png: is not the mosaic of this bundle, {width} x {height} px.", file="mosaic.png")
    return np.asarray(image, np.uint8)
