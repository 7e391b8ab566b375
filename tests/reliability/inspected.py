"""A simulated inspection as its stations send it, and what the core alone makes of it in one go."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from functools import cache
from typing import Any

from pondwatch.core.corrector import hold, make_corrector
from pondwatch.core.images import decode
from pondwatch.core.inspection import inspection_document, parse_inspection
from pondwatch.core.mosaic import Mosaic
from pondwatch.core.values import Image, RodReading, Snapshot
from pondwatch.simulator.simulation import SimulatedSnapshot, Simulation
from pondwatch.simulator.spec import SimulationSpec

Key = tuple[str, int]  # robot, sequence


@dataclass(frozen=True, slots=True)
class Shot:
    """One snapshot on its way."""

    taken: SimulatedSnapshot

    @property
    def robot(self) -> str:
        """Whose it is."""
        return self.taken.key.robot

    @property
    def sequence(self) -> int:
        """Its number."""
        return self.taken.key.sequence

    @property
    def digest(self) -> str:
        """SHA-256 of its picture, hexadecimal."""
        return hashlib.sha256(self.taken.content).hexdigest()

    def parts(self) -> dict[str, Any]:
        """The parts of an upload, as httpx takes them."""
        x, y, theta = (float(v) for v in self.taken.pose_pond)
        pose = {"robot": self.robot, "sequence": self.sequence, "captured_at": self.taken.captured_at}
        pose |= {"x_m": x, "y_m": y, "theta_rad": theta, "digest": f"sha256:{self.digest}"}
        return {
            "image": (f"{self.sequence}{self.taken.suffix}", self.taken.content, "image/jpeg"),
            "pose": (None, json.dumps(pose), "application/json"),
        }


@dataclass(frozen=True, slots=True)
class Inspected:
    """An inspection: the content of its `session.json`, which names no method, and its snapshots in order of time."""

    document: dict[str, Any]
    shots: tuple[Shot, ...]


@dataclass(frozen=True, slots=True)
class Alone:
    """Poses by (robot, sequence), status and m, m, rad; rods; the whole mosaic."""

    poses: dict[Key, tuple[str, tuple[float, ...] | None]]
    rods: tuple[RodReading, ...]
    mosaic: Image


@cache
def inspected(snapshots: int, seed: int) -> Inspected:
    """A few robots over a small pond whose rods all have their own filling; every point is seen about 7 times."""
    spec = SimulationSpec(snapshots=snapshots, robots=4, coverage=7.0, noise_pitch=0.2)
    simulation = Simulation(spec, seed)
    return Inspected(inspection_document(simulation.inspection), tuple(Shot(taken) for taken in simulation))


def alone(given: Inspected) -> Alone:
    """The same snapshots by the core, without a server, a store or a worker."""
    inspection = parse_inspection(given.document)
    corrector = make_corrector(inspection)
    snapshots = {
        s.taken.key: Snapshot(
            s.taken.key, s.taken.captured_s, s.taken.pose_pond, decode(s.taken.content, inspection.camera)
        )
        for s in given.shots
    }
    hold(corrector, list(snapshots.values()))
    corrector.settle()
    mosaic = Mosaic(inspection.camera, inspection.pond)
    poses: dict[Key, tuple[str, tuple[float, ...] | None]] = {}
    for key, corrected in corrector.poses().items():
        pose = corrected.pose_pond
        if pose is not None:
            mosaic.put(key, snapshots[key].image, pose, snapshots[key].captured_s)
        poses[key.robot, key.sequence] = corrected.status.value, None if pose is None else tuple(map(float, pose))
    return Alone(poses, corrector.rods(), mosaic.bgra())
