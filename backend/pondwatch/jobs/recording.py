"""A session as a recording (MCAP) that Foxglove and Lichtblick open: every snapshot and its two poses on one clock."""

from __future__ import annotations

import json
from typing import IO, Any

from mcap.writer import CompressionType, Writer

from pondwatch import __version__

from . import foxglove
from .dossier import Dossier
from .views import Json

FRAME = "pond"
_KINDS = {"image/png": "png", "image/jpeg": "jpeg", "image/webp": "webp"}
_COLOURS = {  # by state, colour-blind safe
    "empty": {"r": 0.34, "g": 0.71, "b": 0.91, "a": 0.6},
    "partial": {"r": 0.90, "g": 0.62, "b": 0.0, "a": 0.6},
    "full": {"r": 0.0, "g": 0.45, "b": 0.70, "a": 0.6},
    "unseen": {"r": 0.6, "g": 0.6, "b": 0.6, "a": 0.25},
}


class _Recorder:
    """Channels by topic, made at their first message; JSON messages."""

    def __init__(self, out: IO[bytes]) -> None:
        self._writer: Any = Writer(out, compression=CompressionType.ZSTD)
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        self._writer.start(profile="", library=f"pondwatch {__version__}")

    def write(self, topic: str, schema: Json, ms: int, message: Json) -> None:
        """Add a message."""
        if topic not in self._channels:
            name = schema["title"]
            if name not in self._schemas:
                self._schemas[name] = self._writer.register_schema(name, "jsonschema", json.dumps(schema).encode())
            self._channels[topic] = self._writer.register_channel(topic, "json", self._schemas[name])
        data = json.dumps(message, allow_nan=False).encode()
        self._writer.add_message(self._channels[topic], ms * 1_000_000, data, ms * 1_000_000)

    def finish(self, name: str, facts: dict[str, str]) -> None:
        """Add metadata, then the index and the end."""
        self._writer.add_metadata(name, facts)
        self._writer.finish()


def write_recording(found: Dossier, out: IO[bytes]) -> None:
    """Topics `/<robot>/raw` and `/<robot>/corrected` (foxglove.PoseInFrame), `/<robot>/image`
    (foxglove.CompressedImage) at the time of each snapshot; `/rods` (foxglove.SceneUpdate) at the end. Frame `pond`,
    metres; session and method as metadata.

    Raises:
        Missing, Unavailable: a picture is gone or damaged in the store.
    """
    recorder = _Recorder(out)
    last_ms = 0
    for shot in sorted(found.poses, key=lambda p: (p["captured_ms"], p["robot"], p["boot"], p["sequence"])):
        robot, ms = str(shot["robot"]), int(shot["captured_ms"])
        last_ms = ms
        recorder.write(f"/{robot}/raw", foxglove.POSE_IN_FRAME, ms, foxglove.pose_in_frame(ms, FRAME, shot["raw"]))
        if shot["corrected"] is not None:
            message = foxglove.pose_in_frame(ms, FRAME, shot["corrected"])
            recorder.write(f"/{robot}/corrected", foxglove.POSE_IN_FRAME, ms, message)
        image = foxglove.compressed_image(ms, robot, found.picture(shot["digest"]), _KINDS[shot["media_type"]])
        recorder.write(f"/{robot}/image", foxglove.COMPRESSED_IMAGE, ms, image)
    if found.rods:
        recorder.write("/rods", foxglove.SCENE_UPDATE, last_ms, _rods(found, last_ms))
    recorder.finish("session", {name: _text(value) for name, value in found.facts.items()})


def _rods(found: Dossier, ms: int) -> Json:
    entities = []
    for rod, reading in zip(found.inspection.pond.rods, found.rods, strict=True):
        size = 2 * rod.outer_radius_m, 0.2 * rod.outer_radius_m
        at = {"x_m": rod.x_m, "y_m": rod.y_m}
        entity = foxglove.cylinder_entity(ms, FRAME, rod.id, at, size, _COLOURS[reading["state"]])
        told = {name: _text(reading[name]) for name in ("state", "fill", "confidence", "views")}
        entities.append({**entity, "metadata": [{"key": k, "value": v} for k, v in told.items()]})
    return {"deletions": [], "entities": entities}


def _text(value: Any) -> str:
    return "" if value is None else str(value)
