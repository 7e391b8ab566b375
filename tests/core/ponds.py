"""Ponds of rods for the tests of the lattice corrector's parts: lattices by hand, pictures of rods by a formula, and
the project's simulator, each inspection made once.

What is drawn here is drawn pixel by pixel from the distance to a rod's centre; it shares no code with the core.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import cv2
import numpy as np

from pondwatch.core.evidence import Setting
from pondwatch.core.pond import Layout
from pondwatch.core.values import Bool, Camera, Float, Image, Inspection, Pond, PoseNoise, Rod, RodState, Snapshot
from pondwatch.simulator.simulation import SimulatedSnapshot, simulate
from pondwatch.simulator.spec import SimulationSpec

METRES = 0.0005  # a pixel
CAMERA = Camera(160, 110, METRES)
PITCH_PX, OUTER_PX, INNER_PX = 48.0, 17.0, 11.0
GROSS_PX = 5.0


def hexagonal(rows: int = 9, columns: int = 9, pitch: float = 1.0, angle_rad: float = 0.0) -> Float:
    """(rows * columns, 2): a hexagonal lattice, its first site at the origin, turned about it."""
    i, j = np.meshgrid(np.arange(columns), np.arange(rows))
    return _turned(np.stack([i + (j % 2) / 2, j * np.sqrt(3) / 2], axis=-1).reshape(-1, 2) * pitch, angle_rad)


def square(rows: int = 9, columns: int = 9, pitch: float = 1.0, angle_rad: float = 0.0) -> Float:
    """(rows * columns, 2): a square lattice, its first site at the origin, turned about it."""
    i, j = np.meshgrid(np.arange(columns), np.arange(rows))
    return _turned(np.stack([i, j], axis=-1).reshape(-1, 2) * pitch, angle_rad)


def _turned(points: Float, angle_rad: float) -> Float:
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return np.asarray(points @ np.array([[c, s], [-s, c]]))


def pond_of(points_m: Float, outer_m: float = OUTER_PX * METRES, inner_m: float = INNER_PX * METRES) -> Pond:
    """A pond with rods at (R, 2) points."""
    rods = tuple(Rod(f"R{n}", float(x), float(y), outer_m, inner_m) for n, (x, y) in enumerate(points_m))
    return Pond(float(np.ptp(points_m[:, 0])) + 0.1, float(np.ptp(points_m[:, 1])) + 0.1, rods)


def setting_of(points_m: Float) -> Setting:
    """Rods of the usual size at (R, 2) points, under the usual camera."""
    return Setting.of(Layout.of(pond_of(points_m)), CAMERA)


def in_image(points_m: Float, pose: Float) -> Float:
    """(R, 2), px: where pond points lie in a picture taken at a pose, by complex numbers."""
    z = (points_m[:, 0] + 1j * points_m[:, 1] - complex(pose[0], pose[1])) * np.exp(-1j * pose[2]) / METRES
    return np.stack([z.real + 79.5, 54.5 - z.imag], axis=1)


def draw_rods(
    centres_px: Float,
    fills: Float | None = None,
    starts_rad: Float | None = None,
    levels: tuple[float, float, float, float] = (90.0, 30.0, 190.0, 60.0),
    noise: float = 1.0,
    seed: int = 0,
) -> Image:
    """(110, 160, 3): rods as stacks of discs, drawn four times finer and averaged.

    levels: grey of the floor, of the line around a rod, of its ring (and a hollow rod's inside), of its filling.
    starts_rad: where each wedge begins, counter-clockwise in the image from its u axis.
    """
    fine = 4
    v, u = (np.mgrid[: CAMERA.height_px * fine, : CAMERA.width_px * fine] + 0.5) / fine - 0.5
    floor, line, ring, filling = levels
    image = np.full(u.shape, floor)
    fills = np.zeros(len(centres_px)) if fills is None else fills
    starts = np.zeros(len(centres_px)) if starts_rad is None else starts_rad
    for (cu, cv), fill, start in zip(centres_px, fills, starts, strict=True):
        r = np.hypot(u - cu, v - cv)
        wedge = (np.arctan2(cv - v, u - cu) - start) % (2 * np.pi) < 2 * np.pi * fill
        image[r < OUTER_PX] = line
        image[r < OUTER_PX - 2] = ring
        image[(r < INNER_PX) & wedge] = filling
    image = image.reshape(CAMERA.height_px, fine, CAMERA.width_px, fine).mean(axis=(1, 3))
    image = cv2.GaussianBlur(image, (0, 0), 0.5)
    image = image[..., None] + noise * np.random.default_rng(seed).standard_normal((*image.shape, 3))
    return np.clip(np.round(image), 0, 255).astype(np.uint8)


@dataclass(frozen=True, slots=True, eq=False)
class Inspected:
    """A simulated inspection with its truth: truth (N, 3), pond frame; fills (R,)."""

    inspection: Inspection
    snapshots: tuple[Snapshot, ...]
    truth: Float
    fills: Float

    @property
    def setting(self) -> Setting:
        """Its layout under its camera."""
        return Setting.of(Layout.of(self.inspection.pond), self.inspection.camera)

    @property
    def noise(self) -> PoseNoise:
        """How far its poses are really off: root mean squares, of those that are not grossly wrong."""
        off = np.array([s.pose_pond for s in self.snapshots]) - self.truth
        apart = np.hypot(off[:, 0], off[:, 1])
        kept = off[apart < 5 * np.median(apart)]
        turn = np.angle(np.exp(1j * kept[:, 2]))
        return PoseNoise(float(np.sqrt(np.mean(kept[:, :2] ** 2))), float(np.sqrt(np.mean(turn**2))))

    def views(self, margin_px: float = 0.0) -> Bool:
        """(N, R): whose true footprint holds which rod's outer circle wholly, with so much room to spare."""
        camera = self.inspection.camera
        rods = np.array([[r.x_m, r.y_m, r.outer_radius_m] for r in self.inspection.pond.rods])
        z = (rods[:, 0] + 1j * rods[:, 1])[None] - (self.truth[:, 0] + 1j * self.truth[:, 1])[:, None]
        z = np.abs((z * np.exp(-1j * self.truth[:, 2])[:, None]).view(np.float64).reshape(*z.shape, 2))
        room = np.array([camera.width_px, camera.height_px]) / 2 - margin_px
        return np.asarray((z < room * camera.metres_per_pixel - rods[None, :, 2:]).all(axis=-1))

    def states(self) -> list[RodState]:
        """(R,): the true state of each rod."""
        return [RodState.EMPTY if f < 0.05 else RodState.FULL if f > 0.95 else RodState.PARTIAL for f in self.fills]


@cache
def inspected(spec: SimulationSpec, seed: int) -> Inspected:
    """One inspection of the simulator's, decoded."""
    made = simulate(spec, seed)
    snapshots = tuple(map(decoded, made.snapshots))
    return Inspected(made.inspection, snapshots, made.truth_poses, made.truth_fills)


def decoded(taken: SimulatedSnapshot) -> Snapshot:
    """A simulated snapshot with its picture decoded."""
    image = cv2.imdecode(np.frombuffer(taken.content, np.uint8), cv2.IMREAD_COLOR)
    assert image is not None
    return Snapshot(taken.key, taken.captured_s, taken.pose_pond, np.asarray(image, np.uint8))
