"""One inspection by seed, from a pond to encoded pictures with wrong poses.

The same spec and seed give the same bytes. A `Simulation` takes its snapshots one by one, so that an upload starts
before the last is taken; `simulate` takes all.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import cached_property

import cv2
import numpy as np

from pondwatch.core.values import Camera, Float, Float32, Inspection, SnapshotKey

from .camera import photograph
from .floor import Floor, render_floor
from .overhead import claimed_noise, noisy_poses
from .palette import print_palette, random_palette
from .pond import as_stated, changed, make_pond
from .spec import ImageKind, SimulationSpec
from .swarm import robots_in_turn, true_poses
from .things import displaced, lying_about
from .water import Water, through_water, unrounded, water_of

_STREAMS = {name: k for k, name in enumerate(("pond", "look", "floor", "path", "noise", "water", "radio", "things"))}
_SUFFIX: dict[ImageKind, str] = {"png": ".png", "jpeg": ".jpg", "webp": ".webp"}
_QUALITY = {"jpeg": cv2.IMWRITE_JPEG_QUALITY, "webp": cv2.IMWRITE_WEBP_QUALITY}


@dataclass(frozen=True, slots=True, eq=False)
class SimulatedSnapshot:
    """One snapshot as a robot sends it. pose_pond: (3,), noisy. captured_at: RFC 3339, UTC."""

    key: SnapshotKey
    captured_s: float
    captured_at: str
    pose_pond: Float
    content: bytes
    suffix: str


@dataclass(frozen=True, slots=True, eq=False)
class SimulatedInspection:
    """What a base station would hand over, and beside it the truth: (N, 3) poses, (R,) fills."""

    inspection: Inspection
    snapshots: tuple[SimulatedSnapshot, ...]
    truth_poses: Float
    truth_fills: Float


class Simulation:
    """A pond with robots over it. Raises Invalid: a spec with a value out of its range."""

    def __init__(self, spec: SimulationSpec, seed: int) -> None:
        spec.check()
        self.spec, self.seed = spec, seed
        pond_seed = seed if spec.pond_seed < 0 else spec.pond_seed
        simulated = changed(make_pond(spec, np.random.default_rng([pond_seed, _STREAMS["pond"]])), spec.changed, seed)
        look, loose = self._rng("look"), self._rng("things")
        simulated = displaced(simulated, spec, loose)
        self._pond = simulated
        self._palette = print_palette() if spec.print_colours else random_palette(look)
        self._water = water_of(spec.water, look)
        self._robots = robots_in_turn(spec)
        stated = as_stated(simulated.pond, spec)
        self.inspection = Inspection(spec.name, spec.stated_camera, stated, claimed_noise(spec))
        self.truth_fills, self.truth_offsets = simulated.fills, simulated.offsets
        self.truth_things = lying_about(simulated, spec, self._palette, loose)
        self.truth_poses = true_poses(spec, self._rng("path"))
        self.poses = np.round(noisy_poses(self.truth_poses, self._robots, spec, self._rng("noise")), 7)

    @cached_property
    def floor(self) -> Floor:
        """The pond's floor, rendered when the first snapshot is taken."""
        return render_floor(self._pond, self._palette, self.spec.camera, self._rng("floor"), self.truth_things)

    def snapshot(self, n: int) -> SimulatedSnapshot:
        """The n-th snapshot; the same whatever was taken before."""
        spec, captured_s = self.spec, self._captured_s(n)
        image = through_water(*self._light(n, self.truth_poses[n], self._water))
        image = np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), np.uint8) if spec.grey else image
        kind, suffix = spec.image_kind, _SUFFIX[spec.image_kind]
        parameters = [_QUALITY[kind], spec.quality] if kind in _QUALITY else []
        content = cv2.imencode(suffix, image, parameters)[1].tobytes()
        key = SnapshotKey(f"bubble-{self._robots[n] + 1}", 0, n)
        return SimulatedSnapshot(key, captured_s, _rfc3339(captured_s), self.poses[n], content, suffix)

    def noiseless(self, n: int, pose: Float) -> Float32:
        """The n-th snapshot without the sensor's noise and rounding, from another pose in the same light: what drifts
        in the water, and the light that it throws, stay where they are in the picture."""
        return unrounded(*self._light(n, pose, replace(self._water, noise=0.0)))

    def __iter__(self) -> Iterator[SimulatedSnapshot]:
        return map(self.snapshot, range(len(self)))

    def __len__(self) -> int:
        return self.spec.snapshots

    def _captured_s(self, n: int) -> float:
        return round(self.spec.start_s + n * self.spec.capture_interval_s, 3)

    def _light(
        self, n: int, pose: Float, water: Water
    ) -> tuple[Float32, Water, Float, float, Camera, np.random.Generator]:
        """What the water takes to the sensor: the floor seen from a pose, in the light of the n-th snapshot."""
        ideal = photograph(self.floor, pose, self.spec.camera)
        rng = np.random.default_rng([self.seed, _STREAMS["water"], n])
        after_s = self._captured_s(n) - self.spec.start_s
        return ideal, water, self.truth_poses[n], after_s, self.spec.camera, rng

    def _rng(self, stream: str) -> np.random.Generator:
        return np.random.default_rng([self.seed, _STREAMS[stream]])


def simulate(spec: SimulationSpec, seed: int) -> SimulatedInspection:
    """All of one inspection, with its truth.

    Raises:
        Invalid: a spec with a value out of its range.
    """
    simulation = Simulation(spec, seed)
    return SimulatedInspection(simulation.inspection, tuple(simulation), simulation.truth_poses, simulation.truth_fills)


def _rfc3339(seconds: float) -> str:
    return datetime.fromtimestamp(seconds, UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
