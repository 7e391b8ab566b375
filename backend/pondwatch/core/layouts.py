"""Layouts of ponds from files, from a lattice, and known again by a digest.

A layout is the `pond` of a `session.json`: size and rods, metres, pond frame. Pure: text in, values out. Whatever is
wrong with a file is named by its line.
"""

from __future__ import annotations

import csv
import hashlib
import io
import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from .errors import InvalidLayout
from .inspection import parse_pond
from .values import Float, Pond, Rod

COLUMNS = ("id", "x_m", "y_m", "outer_radius_m", "inner_radius_m")
LATTICES = ("hex", "square")
OUTER_OF_PITCH, INNER_OF_PITCH = 0.36, 0.23
MOST_RODS = 50_000


def document_of(pond: Pond) -> dict[str, Any]:
    """The JSON values of a layout."""
    rods = [{name: getattr(rod, name) for name in COLUMNS} for rod in pond.rods]
    return {"width_m": pond.width_m, "height_m": pond.height_m, "rods": rods}


def digest(pond: Pond, name: str = "") -> str:
    """SHA-256, hexadecimal, of a layout, whatever the order of its rods. One without rods says nothing of which pond
    it is: there the name counts too."""
    content = document_of(pond)
    content["rods"].sort(key=lambda rod: rod["id"])
    if not pond.rods:
        content["name"] = name
    return hashlib.sha256(json.dumps(content, sort_keys=True, separators=(",", ":")).encode()).hexdigest()


def csv_of(pond: Pond) -> str:
    """The rods as CSV; the pond's size is not in it."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    writer.writerows((r.id, r.x_m, r.y_m, r.outer_radius_m, r.inner_radius_m) for r in pond.rods)
    return text.getvalue()


def from_csv(content: bytes, width_m: float, height_m: float) -> Pond:
    """A layout of rods as CSV with the header `id,x_m,y_m,outer_radius_m,inner_radius_m`.

    Raises:
        InvalidLayout: names the line. facts: line, field.
    """
    reader = csv.DictReader(io.StringIO(_text(content), newline=""), strict=True)
    rods: list[dict[str, Any]] = []
    lines: list[int] = []
    try:
        absent = [name for name in COLUMNS if name not in (reader.fieldnames or ())]
        if absent:
            raise _fault(1, f"the header lacks {', '.join(absent)}")
        for row in reader:
            rods.append(_rod(row, reader.line_num))
            lines.append(reader.line_num)
    except csv.Error as error:
        raise _fault(reader.reader.line_num, f"is not CSV: {error}") from error
    if not rods:
        raise _fault(1, "there is no rod")
    return _checked({"width_m": width_m, "height_m": height_m, "rods": rods}, lines)


def from_json(content: bytes) -> Pond:
    """A layout as JSON: the `pond` of a session.json, or the whole of one.

    Raises:
        InvalidLayout: names the line. facts: line, field.
    """
    text = _text(content)
    try:
        document = json.loads(text)
    except json.JSONDecodeError as error:
        raise _fault(error.lineno, f"is not JSON: {error.msg}") from error
    except (RecursionError, ValueError) as error:
        raise _fault(1, f"is not JSON: {error}") from error
    inside = document.get("pond", document) if isinstance(document, dict) else document
    return _checked(inside, _lines_of_rods(text))


def lattice(
    kind: str, pitch_m: float, columns: int, rows: int, outer_m: float | None = None, inner_m: float | None = None,
    margin_m: float | None = None,
) -> Pond:  # fmt: skip
    """Rods on a lattice, named R0000 and on, row by row from the upper left.

    Args:
        kind: `hex`, every second row moved by half a pitch, or `square`.
        outer_m, inner_m: radii; 0.36 and 0.23 of the pitch where None.
        margin_m: from the outermost centres to the walls; a pitch where None.

    Raises:
        InvalidLayout: names what is out of range.
    """
    outer = OUTER_OF_PITCH * pitch_m if outer_m is None else outer_m
    inner = INNER_OF_PITCH * pitch_m if inner_m is None else inner_m
    margin = pitch_m if margin_m is None else margin_m
    _check_lattice(kind, pitch_m, columns, rows, outer, margin)
    places, size = _places(kind, pitch_m, columns, rows)
    rods = tuple(
        Rod(f"R{i:04d}", round(x + margin, 7), round(y + margin, 7), round(outer, 7), round(inner, 7))
        for i, (x, y) in enumerate(places.tolist())
    )
    width, height = (round(float(n) + 2 * margin, 7) for n in size)
    return parse_pond(document_of(Pond(width, height, rods)))


def _check_lattice(kind: str, pitch_m: float, columns: int, rows: int, outer_m: float, margin_m: float) -> None:
    if kind not in LATTICES:
        raise InvalidLayout(f"lattice must be one of {', '.join(LATTICES)}, and is {kind!r}.", field="lattice")
    if not (math.isfinite(pitch_m) and pitch_m > 0):
        raise InvalidLayout(f"pitch must be above 0, and is {pitch_m}.", field="pitch")
    if not (columns >= 1 and rows >= 1 and columns * rows <= MOST_RODS):
        raise InvalidLayout(f"{columns} x {rows} rods: there must be 1 to {MOST_RODS}.", field="rows")
    if 2 * outer_m > pitch_m:
        raise InvalidLayout(f"rods of {2 * outer_m:g} m do not fit into a pitch of {pitch_m:g} m.", field="outer")
    if not margin_m >= 0:
        raise InvalidLayout(f"margin must not be negative, and is {margin_m}.", field="margin")


def _places(kind: str, pitch_m: float, columns: int, rows: int) -> tuple[Float, Float]:
    """Centres (N, 2), m, the lowest and leftmost at 0, and how far they reach."""
    column, row = np.meshgrid(np.arange(columns), np.arange(rows))
    high = np.sqrt(3) / 2 if kind == "hex" else 1.0
    moved = (row % 2) / 2 if kind == "hex" else np.zeros_like(row)
    points = np.stack([(column + moved).ravel(), (rows - 1 - row.ravel()) * high], axis=1) * pitch_m
    return points, points.max(axis=0)


def _text(content: bytes) -> str:
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise _fault(line, "is not UTF-8") from error


def _rod(row: Mapping[str | None, Any], line: int) -> dict[str, Any]:
    if None in row:
        raise _fault(line, "has more fields than the header")
    rod: dict[str, Any] = {"id": row["id"]}
    for name in COLUMNS[1:]:
        try:
            rod[name] = float(row[name])
        except (TypeError, ValueError):
            raise _fault(line, f"{name} must be a number, and is {str(row[name])[:40]!r}", name) from None
    return rod


def _checked(document: object, lines: list[int]) -> Pond:
    """The layout; what is wrong with its n-th rod is told with that rod's line."""
    try:
        return parse_pond(document)
    except InvalidLayout as error:
        field = str(error.facts.get("field", ""))
        number = field.partition("[")[2].partition("]")[0]
        if number.isdigit() and int(number) < len(lines):
            line = lines[int(number)]
            raise InvalidLayout(f"line {line}: {error.message}", **{**error.facts, "line": line}) from error
        raise


def _lines_of_rods(text: str) -> list[int]:
    """The line on which each object of the list `rods` begins; none where that cannot be told."""
    decoder = json.JSONDecoder()
    at = text.find("[", text.find('"rods"'))
    if text.find('"rods"') < 0 or at < 0:
        return []
    lines: list[int] = []
    line, counted = 1, 0
    at += 1
    while True:
        while at < len(text) and text[at] in " \t\r\n,":
            at += 1
        if at >= len(text) or text[at] == "]":
            return lines
        line += text.count("\n", counted, at)
        counted = at
        lines.append(line)
        at = decoder.raw_decode(text, at)[1]


def _fault(line: int, what: str, field: str | None = None) -> InvalidLayout:
    return InvalidLayout(f"line {line}: {what}.", line=line, field=field)
