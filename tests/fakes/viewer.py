"""A client of the live feed that keeps what it is told, as formats.md says that a client should."""

from __future__ import annotations

import json
from typing import Any

from pondwatch.live.protocol import Frame, read_patch


class Viewer:
    """revision: the last one held in full, None before the first. state: what a page would show."""

    def __init__(self) -> None:
        self.revision: int | None = None
        self.hellos: list[dict[str, Any]] = []
        self.frames = 0
        self.rods: dict[str, Any] = {}
        self.poses: dict[tuple[str, int], Any] = {}
        self.pixels: dict[tuple[int, int], bytes] = {}
        self.session: dict[str, Any] = {}
        self.alarms: dict[int, Any] = {}
        self.rung: list[int] = []

    @property
    def state(self) -> tuple[Any, ...]:
        return self.rods, self.poses, self.pixels, self.session

    def take(self, frame: Frame) -> str:
        """Apply one frame; returns its type."""
        self.frames += 1
        if isinstance(frame, bytes):
            patch = read_patch(frame)
            self.pixels[(patch.x, patch.y)] = patch.content
            return "patch"
        message = json.loads(frame)
        kind = str(message.pop("type"))
        if kind == "hello":
            self.hellos.append(message)
            self.alarms = {}
            if message["full"]:
                self.rods, self.poses, self.pixels = {}, {}, {}
        elif kind == "rods":
            self.rods.update({rod["rod_id"]: rod for rod in message["rods"]})
        elif kind == "poses":
            self.poses.update({(pose["robot"], pose["sequence"]): pose for pose in message["poses"]})
        elif kind == "alarm":
            self.alarms[message["id"]] = message
            self.rung.append(message["id"])
        elif kind == "session":
            self.session, self.revision = message, message["revision"]
        return kind
