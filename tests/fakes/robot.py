"""Snapshots as a robot would send them: small pictures of a made-up floor, each at another place."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np

SCALE_M = 0.001
WIDTH_PX, HEIGHT_PX = 48, 32


def document(**changes: Any) -> dict[str, Any]:
    """The content of a `session.json`: a pond of 200 x 120 raster pixels with 6 rods."""
    rods = [
        {"id": f"R{i}", "x_m": 0.03 + 0.03 * i, "y_m": 0.06, "outer_radius_m": 0.01, "inner_radius_m": 0.006}
        for i in range(6)
    ]
    camera = {"width_px": WIDTH_PX, "height_px": HEIGHT_PX, "metres_per_pixel": SCALE_M}
    pond = {"width_m": 0.2, "height_m": 0.12, "rods": rods}
    noise = {"sigma_xy_m": 0.004, "sigma_theta_rad": 0.05}
    base = {"format": "pond-session/1", "name": "Test pond", "camera": camera, "pond": pond, "pose_noise": noise}
    return {**base, "method": "identity", **changes}


def picture(seed: int, width_px: int = WIDTH_PX, height_px: int = HEIGHT_PX, kind: str = ".png") -> bytes:
    """A picture that no other seed gives."""
    pixels = np.random.default_rng(seed).integers(0, 256, (height_px // 4, width_px // 4, 3), dtype=np.uint8)
    done, content = cv2.imencode(kind, cv2.resize(pixels, (width_px, height_px)))
    assert done
    return content.tobytes()


@dataclass(frozen=True, slots=True)
class Shot:
    """One snapshot. The sequence decides where it lies and what it shows."""

    sequence: int
    robot: str = "bubble-1"
    boot: int = 0
    image: bytes | None = None
    changes: tuple[tuple[str, Any], ...] = ()

    @property
    def content(self) -> bytes:
        """The picture's bytes."""
        return picture(self.sequence) if self.image is None else self.image

    @property
    def digest(self) -> str:
        """SHA-256, hexadecimal."""
        return hashlib.sha256(self.content).hexdigest()

    def pose(self) -> dict[str, Any]:
        """Part `pose`."""
        random = np.random.default_rng([self.sequence, *self.robot.encode()])
        x, y, theta = random.uniform((0.02, 0.02, -3), (0.18, 0.10, 3))
        base = {
            "robot": self.robot,
            "boot": self.boot,
            "sequence": self.sequence,
            "captured_at": f"2026-01-01T08:{self.sequence // 60 % 60:02d}:{self.sequence % 60:02d}.250Z",
            "x_m": x,
            "y_m": y,
            "theta_rad": theta,
            "digest": f"sha256:{self.digest}",
        }
        changed = {**base, **dict(self.changes)}
        return {name: value for name, value in changed.items() if value is not ...}

    def but(self, **changes: Any) -> Shot:
        """With other fields of its pose; `...` leaves one out."""
        return replace(self, changes=(*self.changes, *changes.items()))

    def parts(self) -> dict[str, Any]:
        """The parts of an upload, as httpx takes them."""
        return {
            "image": ("picture.png", self.content, "image/png"),
            "pose": (None, json.dumps(self.pose()), "application/json"),
        }
