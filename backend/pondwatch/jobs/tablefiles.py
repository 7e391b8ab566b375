"""Everything of a session as tables (CSV in a .zip) and as one JSON document."""

from __future__ import annotations

import csv
import io
import json
import zipfile
from collections.abc import Iterable, Sequence
from typing import IO

from pondwatch.core.inspection import inspection_document

from .dossier import Dossier, Table
from .views import Json

_MOMENT = (1980, 1, 1, 0, 0, 0)
_AXES = ("x_m", "y_m", "theta_rad")
SNAPSHOTS = (
    "sequence", "robot", "boot", "captured_at", "received_at", *(f"raw_{axis}" for axis in _AXES), *_AXES,
    "sigma_xy_m", "sigma_theta_rad", "status", "fault", "image_sha256",
)  # fmt: skip
RODS = (
    "rod_id", "x_m", "y_m", "outer_radius_m", "inner_radius_m", "state", "fill", "confidence", "views", "conflicting",
)  # fmt: skip


def write_tables(found: Dossier, out: IO[bytes]) -> None:
    """`session.csv`, `snapshots.csv` and `rods.csv`, and a table for each of the dossier's own. Empty is unknown."""
    layout = {rod.id: rod for rod in found.inspection.pond.rods}
    places = ("x_m", "y_m", "outer_radius_m", "inner_radius_m")
    rods = ({**{n: getattr(layout[r["rod_id"]], n) for n in places}, **r} for r in found.rods)
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        facts = {**found.facts, **_frame(found)}
        _put(archive, "session.csv", ("name", "value"), facts.items())
        _put(archive, "snapshots.csv", SNAPSHOTS, (_row(SNAPSHOTS, _flat(pose)) for pose in found.poses))
        _put(archive, "rods.csv", RODS, (_row(RODS, rod) for rod in rods))
        for table in found.tables:
            _put(archive, f"{table.title.lower().replace(' ', '-')}.csv", table.columns, table.rows)


def write_json(found: Dossier, out: IO[bytes]) -> None:
    """One document: `session`, `inspection`, `raster`, `snapshots`, `rods`, `seal` and `tables`."""
    document = {
        "session": dict(found.facts),
        "inspection": inspection_document(found.inspection),
        "raster": _frame(found),
        "snapshots": [{k: v for k, v in pose.items() if k != "captured_ms"} for pose in found.poses],
        "rods": list(found.rods),
        "tables": [_table(table) for table in found.tables],
        "seal": found.seal,
    }
    text = json.JSONEncoder(ensure_ascii=False, indent=1).iterencode(document)
    for part in text:
        out.write(part.encode())


def _table(table: Table) -> Json:
    told = {"title": table.title, "headline": table.headline, "note": table.note}
    return {**told, "columns": list(table.columns), "rows": [list(row) for row in table.rows]}


def _frame(found: Dossier) -> Json:
    return {
        "metres_per_pixel": found.metres_per_pixel,
        "pond_width_m": found.inspection.pond.width_m,
        "pond_height_m": found.inspection.pond.height_m,
    }


def _flat(pose: Json) -> Json:
    corrected = pose["corrected"] or {}
    raw = {f"raw_{axis}": pose["raw"][axis] for axis in _AXES}
    return {**pose, **raw, **{axis: corrected.get(axis) for axis in _AXES}, "image_sha256": pose["digest"]}


def _row(columns: Sequence[str], values: Json) -> list[object]:
    return [values[name] for name in columns]


def _put(archive: zipfile.ZipFile, name: str, columns: Sequence[str], rows: Iterable[Iterable[object]]) -> None:
    entry = zipfile.ZipInfo(name, _MOMENT)
    entry.external_attr, entry.compress_type = 0o644 << 16, zipfile.ZIP_DEFLATED
    with archive.open(entry, "w") as member, io.TextIOWrapper(member, "utf-8", newline="") as text:
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(rows)
