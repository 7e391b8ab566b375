"""A small pond and a swarm over it, as revisions for a `ScriptedSource`: known pixels, known rods, no correction."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from pondwatch.core.values import Camera, Pond, Rod
from pondwatch.live.source import Patch, Raster

from .source import ScriptedSource

SCALE_M = 0.001
CAMERA = Camera(160, 110, SCALE_M)


@dataclass
class Movie:
    """`columns` x `rows` rods on a hexagonal lattice, pitch 60 px. `advance` adds one snapshot as one revision."""

    columns: int = 16
    rows: int = 11
    robots: int = 7
    seed: int = 1
    drift_m: float = 0.012
    taken: int = 0
    corners: dict[tuple[str, int], tuple[int, int]] = field(default_factory=dict)
    views: dict[str, int] = field(default_factory=dict)
    received_ms: int = 0

    def __post_init__(self) -> None:
        self.rng = np.random.default_rng(self.seed)
        self.pond = _lattice(self.columns, self.rows)
        self.fills = {rod.id: float(self.rng.choice([0.0, 1.0, self.rng.uniform(0.1, 0.9)])) for rod in self.pond.rods}
        self.raster = Raster(SCALE_M, round(self.pond.width_m / SCALE_M), round(self.pond.height_m / SCALE_M))
        self.floor = _render(self.pond, self.fills, self.raster)

    def session(self) -> dict[str, Any]:
        """What `GET /api/sessions/{id}` gives at the start."""
        rods = [{name: getattr(rod, name) for name in Rod.__slots__} for rod in self.pond.rods]
        pond = {"width_m": self.pond.width_m, "height_m": self.pond.height_m, "rods": rods}
        return {
            "name": "Pond 3, north bay",
            "state": "running",
            "created_at": now(),
            "camera": {name: getattr(CAMERA, name) for name in Camera.__slots__},
            "pond": pond,
            "counts": {"snapshots": 0, "placed": 0, "uncertain": 0, "rejected": 0},
            "coverage": 0.0,
            "quality": {"sentence": "All snapshots are placed; the poses that came in were off by about 2.1 cm."},
        }

    def advance(self, source: ScriptedSource) -> int:
        """One snapshot more, of the next robot in turn."""
        robot, turn = self.taken % self.robots, self.taken // self.robots
        self.taken += 1
        x_m, y_m = self._path(robot, turn)
        left = int(np.clip(round(x_m / SCALE_M) - 80, 0, self.raster.width_px - 160))
        top = int(np.clip(self.raster.height_px - round(y_m / SCALE_M) - 55, 0, self.raster.height_px - 110))
        patch = self.patch(left, top, 160, 110, source.revision + 1)
        pose = self._pose(robot, turn, (left + 80) * SCALE_M, (self.raster.height_px - top - 55) * SCALE_M)
        self.corners[pose["robot"], turn] = left, top
        rods = [self._read(rod) for rod in self.pond.rods if self._sees(rod, left, top)]
        counts = {
            "snapshots": self.taken,
            "placed": self.taken - self.taken // 40,
            "uncertain": self.taken // 40,
            "rejected": 0,
        }
        return source.step([patch], rods, [pose], counts=counts, coverage=min(1.0, self.taken / 300))

    def snapshot(self, robot: str, sequence: int) -> bytes:
        """The picture that a robot took."""
        x, y = self.corners[robot, sequence]
        return self.patch(x, y, 160, 110, 0).content

    def patch(self, x: int, y: int, width: int, height: int, revision: int) -> Patch:
        """A rectangle of the floor, without loss, so that pixels can be compared."""
        ok, content = cv2.imencode(".png", self.floor[y : y + height, x : x + width])
        assert ok
        return Patch("mosaic", x, y, width, height, revision, "image/png", content.tobytes())

    def _path(self, robot: int, turn: int) -> tuple[float, float]:
        """Each robot sweeps its own band, left to right and back."""
        length = self.pond.width_m
        along = (turn * 0.05 + robot * 0.13) % (2 * length)
        x_m = along if along < length else 2 * length - along
        band = self.pond.height_m / self.robots
        return x_m, band * (robot + 0.5) + 0.25 * band * float(np.sin(turn / 3 + robot))

    def _pose(self, robot: int, turn: int, x_m: float, y_m: float) -> dict[str, Any]:
        drift = self.rng.normal(0, self.drift_m, 3)
        return {
            "robot": f"bubble-{robot + 1}",
            "boot": 0,
            "sequence": turn,
            "x_m": x_m,
            "y_m": y_m,
            "theta_rad": 0.0,
            "sigma_xy_m": 0.0002,
            "sigma_theta_rad": 0.001,
            "status": "uncertain" if self.taken % 40 == 0 else "placed",
            "received_at": self._received_at(),
            "raw_x_m": x_m + drift[0],
            "raw_y_m": y_m + drift[1],
            "raw_theta_rad": drift[2],
        }

    def _received_at(self) -> str:
        """Now; a millisecond after the snapshot before at the earliest, so that moments tell snapshots apart."""
        self.received_ms = max(time.time_ns() // 1_000_000, self.received_ms + 1)
        return rfc3339(self.received_ms)

    def _sees(self, rod: Rod, left: int, top: int) -> bool:
        u, v = rod.x_m / SCALE_M - left, self.raster.height_px - rod.y_m / SCALE_M - top
        return 12 < u < 148 and 12 < v < 98

    def _read(self, rod: Rod) -> dict[str, Any]:
        views = self.views[rod.id] = self.views.get(rod.id, 0) + 1
        fill = self.fills[rod.id]
        state = "empty" if fill < 0.05 else "full" if fill > 0.95 else "partial"
        row = {"rod_id": rod.id, "state": state, "fill": round(fill, 3), "confidence": 1 - 0.2**views, "views": views}
        return {**row, "conflicting": True} if rod.id.endswith("37") else row


def now() -> str:
    """RFC 3339, UTC, milliseconds."""
    return rfc3339(time.time_ns() // 1_000_000)


def rfc3339(unix_ms: int) -> str:
    """UTC, milliseconds."""
    return datetime.fromtimestamp(unix_ms / 1000, UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")


def _lattice(columns: int, rows: int) -> Pond:
    pitch, margin = 0.06, 0.04
    height = 2 * margin + (rows - 1) * pitch * 0.866
    centres = [
        (margin + (column + 0.5 * (row % 2)) * pitch, height - margin - row * pitch * 0.866)
        for row in range(rows)
        for column in range(columns)
    ]
    rods = tuple(Rod(f"R{i:04d}", round(x, 5), round(y, 5), 0.0215, 0.014) for i, (x, y) in enumerate(centres))
    return Pond(round(2 * margin + (columns - 0.5) * pitch, 3), round(height, 3), rods)


def _render(pond: Pond, fills: dict[str, float], raster: Raster) -> NDArray[np.uint8]:
    floor = np.full((raster.height_px, raster.width_px, 3), (118, 104, 84), np.uint8)
    for rod in pond.rods:
        centre = (round(rod.x_m / SCALE_M), round(raster.height_px - rod.y_m / SCALE_M))
        cv2.circle(floor, centre, 21, (150, 142, 128), -1, cv2.LINE_AA)
        cv2.circle(floor, centre, 14, (60, 52, 44), -1, cv2.LINE_AA)
        cv2.ellipse(floor, centre, (14, 14), -90, 0, 360 * fills[rod.id], (96, 168, 196), -1, cv2.LINE_AA)
    noise = np.random.default_rng(0).normal(0, 3, floor.shape)
    return np.clip(floor + noise, 0, 255).astype(np.uint8)
