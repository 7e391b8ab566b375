"""The frames of the live feed, as text and bytes. Pure: no socket, no clock.

One delivery takes a client from the revision that it holds to a newer one. In it come, in this order and each only
where there is something to say: `hello` (at the start, and where the state that follows replaces everything),
`alarm`s, patches, `rods`, `poses`, `notes`, `job`s, and last `session`. Every value is the newest of its key, so that a
delivery may overlap an earlier one. A client holds revision R once the `session` frame with R arrived, and not
before: cut off in between, it reconnects with the revision before.

Alarms do not go by revisions. After each `hello` come all that are retained or quiet, in place of those held; later
each that is otherwise, once.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pondwatch.core.errors import Invalid

from .source import Alarms, Changes, Patch, Raster

Frame = str | bytes

_LENGTH = struct.Struct(">I")
_PATCH_FIELDS = ("layer", "x", "y", "width", "height", "revision", "mime")


@dataclass(frozen=True, slots=True)
class Bells:
    """Alarms as frames by their ids, with whether each is of interest to one who comes only now."""

    version: int
    frames: Mapping[int, tuple[str, bool]]


@dataclass(frozen=True, slots=True)
class Delivery:
    """What takes a client to `revision`. status: the closing `session` frame; frames: what comes before it."""

    revision: int
    full: bool
    frames: tuple[Frame, ...]
    status: str
    bells: Bells


def hello(session: str, revision: int, raster: Raster, *, full: bool) -> str:
    """The first frame. full: forget what is held, the whole state follows."""
    grid = {
        "metres_per_pixel": raster.metres_per_pixel,
        "width_px": raster.width_px,
        "height_px": raster.height_px,
    }
    return _text("hello", {"session": session, "revision": revision, "full": full, "raster": grid})


def beat(revision: int, at: str) -> str:
    """A sign of life. revision: the last one delivered in full to this client; at: RFC 3339, the server's clock."""
    return _text("beat", {"revision": revision, "at": at})


def bells(alarms: Alarms) -> Bells:
    """The frames that carry these alarms."""
    frames = {row["id"]: (_text("alarm", row), bool(row["retained"] or row["quiet"])) for row in alarms.rows}
    return Bells(alarms.version, frames)


def delivery(changes: Changes, rung: Bells | None = None) -> Delivery:
    """The frames that carry these changes. rung: the alarms' frames made last; taken again if they are the same."""
    frames: list[Frame] = [patch_frame(patch) for patch in changes.patches]
    if changes.rods:
        frames.append(_text("rods", {"revision": changes.revision, "rods": changes.rods}))
    if changes.poses:
        frames.append(_text("poses", {"revision": changes.revision, "poses": changes.poses}))
    if changes.notes:
        frames.append(_text("notes", {"notes": changes.notes}))
    frames += [_text("job", {**job, "revision": changes.revision}) for job in changes.jobs]
    status = _text("session", {**changes.session, "revision": changes.revision})
    fresh = rung if rung is not None and rung.version == changes.alarms.version else bells(changes.alarms)
    return Delivery(changes.revision, changes.full, tuple(frames), status, fresh)


def patch_frame(patch: Patch) -> bytes:
    """A patch as a binary frame: the header's length (4 bytes, big-endian), the JSON header, the image."""
    header = _text("patch", {name: getattr(patch, name) for name in _PATCH_FIELDS}).encode()
    return _LENGTH.pack(len(header)) + header + patch.content


def read_patch(frame: bytes) -> Patch:
    """The patch in a binary frame; undoes `patch_frame`.

    Raises:
        Invalid: the frame is cut short, or its header is not that of a patch.
    """
    if len(frame) < _LENGTH.size:
        raise Invalid("The binary frame is shorter than the length of its header.")
    (length,) = _LENGTH.unpack_from(frame)
    end = _LENGTH.size + length
    if len(frame) < end:
        raise Invalid("The binary frame ends within its header.", header_bytes=length, frame_bytes=len(frame))
    try:
        header = json.loads(frame[_LENGTH.size : end])
        fields = {name: header[name] for name in _PATCH_FIELDS}
    except (ValueError, KeyError, TypeError) as error:
        raise Invalid(f"The header of the binary frame is not that of a patch: {error}.") from error
    return Patch(**fields, content=frame[end:])


def _text(kind: str, body: dict[str, Any]) -> str:
    return json.dumps({**body, "type": kind}, separators=(",", ":"), allow_nan=False)
