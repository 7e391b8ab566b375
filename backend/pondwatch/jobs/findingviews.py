"""Findings of condition and position as JSON values, a CSV table, and a table of a report: the one place for all."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from pondwatch.core.findings import Condition, Finding
from pondwatch.core.frames import pond_to_raster
from pondwatch.core.values import Image, Pond, Rect

from .dossier import Table
from .raster import encoded
from .views import Json

COLUMNS = (
    "number", "kind", "x_m", "y_m", "size_mm", "confidence", "significance", "looks", "agreeing", "rod_id",
    "offset_x_mm", "offset_y_mm", "sigma_mm",
)  # fmt: skip
DISPLACED = "O"
_WORDS = {"foreign-object": "foreign object", "stain": "stain", "rod-displaced": "rod displaced"}
_MANY = {"foreign-object": "foreign objects", "stain": "stains", "rod-displaced": "rods displaced"}
_LEAST_REACH_PX, _MOST_REACH_PX = 12, 400
_GROUND = 214  # of what was never seen


def document(condition: Condition, pond: Pond) -> Json:
    """All that was found, the most significant first; `examined`: the share of the raster that could be looked at;
    `positions`: every rod that was measured, in the layout's order."""
    found = [_finding(number, finding) for number, finding in enumerate(condition.findings, 1)]
    return {"examined": round(condition.examined, 6), "findings": found, "positions": _positions(condition, pond)}


def _finding(number: int, f: Finding) -> Json:
    offset = (None, None) if f.offset_m is None else tuple(_mm(v) for v in f.offset_m)
    return {
        "number": number,
        "kind": f.kind.value,
        "x_m": round(f.x_m, 7),
        "y_m": round(f.y_m, 7),
        "size_mm": _mm(f.size_m),
        "confidence": round(f.confidence, 4),
        "significance": round(f.significance, 2),
        "looks": f.looks,
        "agreeing": f.agreeing,
        "rod_id": f.rod_id,
        "offset_x_mm": offset[0],
        "offset_y_mm": offset[1],
        "sigma_mm": None if f.sigma_m is None else _mm(f.sigma_m),
    }


def _positions(condition: Condition, pond: Pond) -> list[Json]:
    if condition.offsets is None:
        return []
    found = zip(pond.rods, condition.offsets.offset_m.tolist(), condition.offsets.sigma_m.tolist(), strict=True)
    return [
        {"rod_id": rod.id, "offset_x_mm": _mm(x), "offset_y_mm": _mm(y), "sigma_mm": _mm(sigma)}
        for rod, (x, y), sigma in found
        if x == x and sigma == sigma
    ]


def _mm(metres: float) -> float:
    return round(metres * 1000, 4)


def findings_csv(findings: Sequence[Json]) -> bytes:
    """A row a finding; offsets are empty where it is not a rod."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    writer.writerows(["" if f[name] is None else f[name] for name in COLUMNS] for f in findings)
    return text.getvalue().encode()


def around(finding: Json, pond: Pond, metres_per_pixel: float) -> Rect:
    """The square of the mosaic's raster that shows a finding with what is near it."""
    u, v = pond_to_raster(np.array([finding["x_m"], finding["y_m"]]), pond, metres_per_pixel).tolist()
    half = round(1.2 * finding["size_mm"] / 1000 / metres_per_pixel)
    half = min(_MOST_REACH_PX, max(_LEAST_REACH_PX, half))
    return Rect(round(u) - half, round(v) - half, 2 * half + 1, 2 * half + 1)


def findings_table(
    condition: Mapping[str, Any] | None, pond: Pond, metres_per_pixel: float, mosaic: Callable[[], Image]
) -> Table:
    """Findings for a report, with their pictures; places are numbered as in it."""
    columns = ("number", "what", "x, m", "y, m", "size, mm", "offset, mm", "confidence", "looks", "rod")
    if condition is None or not pond.rods:
        said = "Condition and position were not looked at: the inspection is not finished, or there is no layout."
        return Table("Findings", said, columns, (), "not looked at")
    findings = condition["findings"]
    kinds = ", ".join(_counted(sum(f["kind"] == kind for f in findings), kind) for kind in _WORDS)
    note = (
        f"What the layout does not explain: {kinds}. {100 * condition['examined']:.1f} % of the pond's floor was seen "
        f"by three snapshots or more and could be looked at; {len(condition['positions'])} rods were measured. "
        "Confidence of an object or a stain: that one more snapshot would show it; of a rod: that it stands off."
    )
    image = mosaic() if findings else None
    pictures = [(_picture(image, around(f, pond, metres_per_pixel)), _caption(f)) for f in findings[:12]]
    return Table(
        "Findings", note, columns, [_row(f) for f in findings], str(len(findings)),
        {f["rod_id"]: DISPLACED for f in findings if f["kind"] == "rod-displaced"}, "O off its place.",
        [(f["x_m"], f["y_m"], str(f["number"])) for f in findings], pictures,
    )  # fmt: skip


def _counted(count: int, kind: str) -> str:
    """`1 stain`, `2 rods displaced`."""
    return f"{count} {_WORDS[kind] if count == 1 else _MANY[kind]}"


def _caption(f: Json) -> str:
    return f"{f['number']}: {_WORDS[f['kind']]}"


def _row(f: Json) -> tuple[str, ...]:
    moved = "" if f["sigma_mm"] is None else f"{f['offset_x_mm']:+.2f}, {f['offset_y_mm']:+.2f} ± {f['sigma_mm']:.2f}"
    return (
        str(f["number"]), _WORDS[f["kind"]], f"{f['x_m']:.4f}", f"{f['y_m']:.4f}", f"{f['size_mm']:.1f}", moved,
        f"{f['confidence']:.3f}", f"{f['agreeing']} of {f['looks']}", f["rod_id"],
    )  # fmt: skip


def _picture(mosaic: Image | None, rect: Rect) -> bytes:
    """A part of the mosaic (h, w, 4) as PNG, never-seen floor and what lies beyond in grey."""
    out = np.full((rect.height, rect.width, 3), _GROUND, np.uint8)
    if mosaic is not None:
        x0, y0 = max(0, rect.x), max(0, rect.y)
        part = mosaic[y0 : rect.y + rect.height, x0 : rect.x + rect.width]
        here = out[y0 - rect.y : y0 - rect.y + part.shape[0], x0 - rect.x : x0 - rect.x + part.shape[1]]
        here[:] = np.where(part[..., 3:] > 0, part[..., :3], here)
    return encoded(out, ".png")
