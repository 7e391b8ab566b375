"""Session bundles (`pond-session/1`): the session, a row a snapshot, and pictures read one at a time.

A fault in the bundle is an `InvalidBundle` that names file and row (counted from the header, which is row 1). A fault
of one snapshot (a picture that does not decode or has another size, a pose that is not finite) is that snapshot's
alone: it is returned beside the row.
"""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Self

import numpy as np

from pondwatch.core.errors import Invalid, InvalidBundle, InvalidImage, InvalidLayout, InvalidPose
from pondwatch.core.images import decode
from pondwatch.core.inspection import parse_inspection
from pondwatch.core.values import Inspection, Snapshot, SnapshotKey

from .source import Source, inside, open_source

COLUMNS = ("sequence", "robot", "captured_at", "image", "x_m", "y_m", "theta_rad")
MAX_SESSION_BYTES = 64 << 20
MAX_POSES_BYTES = 256 << 20
MAX_IMAGE_BYTES = 32 << 20


@dataclass(frozen=True, slots=True)
class Row:
    """One row of poses.csv. pose: x m, y m, theta rad, pond frame; it may hold values that are not finite."""

    row: int
    key: SnapshotKey
    captured_at: str
    captured_s: float
    image: str
    pose: tuple[float, float, float]


class Bundle:
    """An open bundle. Use as a context manager.

    Raises:
        InvalidBundle: names file and row.
    """

    def __init__(self, path: Path) -> None:
        self._source = open_source(path)
        try:
            self.document = _document(self._source)
            self.inspection = _inspection(self.document)
            self.rows: Sequence[Row] = _rows(self._source)
        except BaseException:
            self._source.close()
            raise

    def content(self, row: Row) -> bytes:
        """The bytes of a row's picture."""
        return self._source.read(row.image, MAX_IMAGE_BYTES)

    def snapshot(self, row: Row) -> Snapshot | Invalid:
        """A row's snapshot; or what is wrong with it, where it is to be rejected alone."""
        return self.decoded(row, self.content(row))

    def decoded(self, row: Row, content: bytes) -> Snapshot | Invalid:
        """The same from the bytes of its picture; asks nothing of the bundle's files."""
        if not all(map(math.isfinite, row.pose)):
            return InvalidPose(f"poses.csv, row {row.row}: the pose has a value that is not finite.")
        try:
            image = decode(content, self.inspection.camera)
        except InvalidImage as error:
            return InvalidImage(f"{row.image}: {error.message}", **error.facts)
        return Snapshot(row.key, row.captured_s, np.array(row.pose), image)

    def snapshots(self, rows: Sequence[Row]) -> Iterator[tuple[Row, Snapshot | Invalid]]:
        """Rows with their snapshots, read as they are asked for."""
        for row in rows:
            yield row, self.snapshot(row)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._source.close()


def _document(source: Source) -> object:
    content = source.read("session.json", MAX_SESSION_BYTES)
    try:
        return json.loads(content.decode("utf-8-sig"))
    except json.JSONDecodeError as error:
        message = f"session.json, row {error.lineno}: is not JSON: {error.msg}."
        raise InvalidBundle(message, file="session.json", row=error.lineno) from error
    except (UnicodeDecodeError, RecursionError, ValueError) as error:
        raise InvalidBundle(f"session.json: is not JSON in UTF-8: {error}.", file="session.json") from error


def _inspection(document: object) -> Inspection:
    try:
        return parse_inspection(document)
    except InvalidLayout as error:
        raise InvalidBundle(f"session.json: {error.message}", file="session.json", **error.facts) from error


def _rows(source: Source) -> tuple[Row, ...]:
    try:
        text = source.read("poses.csv", MAX_POSES_BYTES).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InvalidBundle(f"poses.csv: is not UTF-8: {error.reason}.", file="poses.csv") from error
    reader = csv.DictReader(io.StringIO(text, newline=""), strict=True)
    rows: list[Row] = []
    first: dict[SnapshotKey, int] = {}
    try:
        _check_header(reader.fieldnames)
        for fields in reader:
            row = _row(fields, reader.line_num)
            if row.key in first:
                raise _fault(row.row, f"{_name(row.key)} was given before, in row {first[row.key]}")
            if not source.has(row.image):
                raise _fault(row.row, f"the picture {row.image!r} is missing")
            first[row.key] = row.row
            rows.append(row)
    except csv.Error as error:
        raise _fault(reader.line_num, f"is not CSV: {error}") from error
    return tuple(rows)


def _check_header(found: Sequence[str] | None) -> None:
    absent = [name for name in COLUMNS if name not in (found or ())]
    if absent:
        raise _fault(1, f"the header lacks {', '.join(absent)}")


def _row(fields: dict[str, str | None], number: int) -> Row:
    """A row of text fields; DictReader gives None for a field that is not there."""
    for name in COLUMNS:
        if not fields.get(name):
            raise _fault(number, f"{name} is missing")
    values = {name: text or "" for name, text in fields.items() if name}
    key = SnapshotKey(
        _robot(values["robot"], number),
        _whole(values.get("boot") or "0", "boot", number),
        _whole(values["sequence"], "sequence", number),
    )
    x, y, theta = (_number(values[name], name, number) for name in ("x_m", "y_m", "theta_rad"))
    captured_s = _time(values["captured_at"], number)
    return Row(number, key, values["captured_at"], captured_s, _path(values["image"], number), (x, y, theta))


def _robot(text: str, number: int) -> str:
    if len(text) > 200 or not text.isprintable():
        raise _fault(number, "robot must be 1 to 200 printable characters")
    return text


def _whole(text: str, name: str, number: int) -> int:
    if not (text.isascii() and text.isdigit() and len(text) < 19):
        raise _fault(number, f"{name} must be a whole number, and is {text[:40]!r}")
    return int(text)


def _number(text: str, name: str, number: int) -> float:
    try:
        return float(text)
    except ValueError:
        raise _fault(number, f"{name} must be a number, and is {text[:40]!r}") from None


def _time(text: str, number: int) -> float:
    try:
        moment = datetime.fromisoformat(text)
        if moment.tzinfo is None:
            raise ValueError
        return moment.timestamp()
    except (ValueError, OverflowError):
        raise _fault(number, f"captured_at must be a time as 2026-01-31T08:00:00.000Z, and is {text[:40]!r}") from None


def _path(text: str, number: int) -> str:
    try:
        return inside(text)
    except InvalidBundle:
        raise _fault(number, f"image must be a path inside the bundle, and is {text[:80]!r}") from None


def _name(key: SnapshotKey) -> str:
    boot = f", boot {key.boot}" if key.boot else ""
    return f"snapshot {key.sequence} of {key.robot}{boot}"


def _fault(row: int, what: str) -> InvalidBundle:
    return InvalidBundle(f"poses.csv, row {row}: {what}.", file="poses.csv", row=row)
