"""Simulated snapshots of ponds unlike each other, with their rods: colours, widths, lattices, scales and waters vary
far beyond what any one pond shows."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import cv2
import numpy as np

from pondwatch.core.frames import pond_to_image
from pondwatch.core.rodsight import CANONICAL_PX, CHANNELS, STRIDE, look
from pondwatch.core.values import Camera, Float, Float32, Image
from pondwatch.simulator.camera import photograph
from pondwatch.simulator.floor import render_floor
from pondwatch.simulator.palette import Palette, print_palette, random_palette
from pondwatch.simulator.pond import SimulatedPond, make_pond
from pondwatch.simulator.spec import SimulationSpec
from pondwatch.simulator.water import Water, through_water, water_of

CROP = (80, 96)  # canonical px, rows and columns
SCALE_ERROR = 0.2
SURE, UNSURE = 0.25, 0.08  # share of a rod in the image: to be found from the one, not to be found below the other
WATERS = ("clear", "murky", "harder", "any")
COLOURS = ("floor", "wall", "line", "annulus", "fill")


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """A snapshot with its rods. image: (H, W, 3). centres_px: (K, 2), all whose share in view is over UNSURE.
    share: (K,). outer_px, inner_px: radii. fill: (K,). middle_rad: (K,), the middle of the wedge, right to down."""

    image: Image
    centres_px: Float
    share: Float
    outer_px: float
    inner_px: float
    fill: Float
    middle_rad: Float


def scenes(seed: int, ponds: int, each: int, water: str = "any", wide: bool = True) -> Iterator[Scene]:
    """Snapshots of ponds by seed. `wide`: ponds of any make; otherwise as an ordinary simulation has them."""
    for n in range(ponds):
        rng = np.random.default_rng([seed, n])
        spec = _spec(rng, wide)
        simulated = _pond(spec, rng, wide)
        palette = _palette(rng) if wide else random_palette(rng)
        floor = render_floor(simulated, palette, spec.camera, rng)
        for _ in range(each):
            pose = rng.uniform((0.1, 0.1, -np.pi), (0.9, 0.9, np.pi)) * (*spec.pond_size_m, 1)
            strengths = waters(water, spec.pitch_px / 60, rng)
            ideal = photograph(floor, pose, spec.camera)
            image = through_water(ideal, strengths, pose, rng.uniform(0, 1000), spec.camera, rng)
            quality = int(rng.integers(35, 96)) if wide or water == "harder" else 92
            coded = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])[1]
            yield _scene(np.asarray(cv2.imdecode(coded, cv2.IMREAD_COLOR), np.uint8), simulated, pose, spec.camera)


def waters(kind: str, size: float, rng: np.random.Generator) -> Water:
    """A water: `clear`, `murky`, `harder` (1.3 to 1.8 times as bad), or `any` from still to worse than that."""
    if kind in ("clear", "murky"):
        return water_of("clear" if kind == "clear" else "murky", rng)
    if kind == "any" and rng.random() < 0.15:
        return water_of("clear", rng)
    s = rng.uniform(1.3, 1.8, 10) if kind == "harder" else rng.uniform(0.1, 1.9, 10)
    tint = tuple(rng.uniform((40, 50, 40), (130, 130, 110)).tolist())
    return Water(
        veil=min(0.42 * s[0], 0.75), veil_colour=tint, blur_px=0.9 * s[1] * size, motion_px=1.3 * s[2] * size,
        vignette=min(0.35 * s[3], 0.6), caustics=0.3 * s[4], gain=0.15 * s[5], particles=2.5 * s[6],
        glare=0.1 * s[7], speckle=3.0 * s[8], noise=3.0 * s[9],
    )  # fmt: skip


def _spec(rng: np.random.Generator, wide: bool) -> SimulationSpec:
    if not wide:
        return SimulationSpec(snapshots=24)
    pitch = float(np.exp(rng.uniform(np.log(32), np.log(84))))
    width, height = (int(v) for v in rng.uniform((2.0, 1.5), (3.2, 2.4)) * pitch)
    return SimulationSpec(
        snapshots=16, camera=Camera(width, height, 0.0005625), pitch_px=pitch,
        lattice="hexagonal" if rng.random() < 0.6 else "square", lattice_angle_rad=float(rng.uniform(0, np.pi)),
        missing=float(rng.choice([0.03, 0.15, 0.35])), edge_cells=bool(rng.random() < 0.5),
        fills="wedges" if rng.random() < 0.5 else "quarters",
    )  # fmt: skip


def _pond(spec: SimulationSpec, rng: np.random.Generator, wide: bool) -> SimulatedPond:
    """Rods of any width, with or without cells around them."""
    simulated = make_pond(spec, rng)
    if not wide:
        return simulated
    outer = spec.pitch_m * rng.uniform(0.29, 0.45)
    inner = outer * rng.uniform(0.5, 0.8)
    rods = tuple(replace(r, outer_radius_m=outer, inner_radius_m=inner) for r in simulated.pond.rods)
    cells = simulated.cells if rng.random() < 0.75 else simulated.cells[:1]
    return replace(simulated, pond=replace(simulated.pond, rods=rods), cells=cells)


def _palette(rng: np.random.Generator) -> Palette:
    """Often fainter, and with thinner or thicker lines, than ponds are simulated elsewhere."""
    chance = rng.random()
    if chance < 0.1:
        return print_palette()
    palette = random_palette(rng)
    if chance < 0.4:
        return palette
    grey, fade = rng.uniform(60, 180, 3), rng.uniform(0.35, 1.0)
    faded = {name: grey + fade * (getattr(palette, name) - grey) for name in COLOURS}
    wall, line, inner_line = rng.uniform((0.03, 0.03, 0.0), (0.3, 0.25, 0.2)).tolist()
    return replace(
        palette,
        **faded,
        wall_width=wall,
        line_width=line,
        inner_line_width=inner_line,
        mottle=float(rng.uniform(0, 0.35)),
    )


def _scene(image: Image, simulated: SimulatedPond, pose: Float, camera: Camera) -> Scene:
    rods = simulated.pond.rods
    centres = pond_to_image(np.array([[r.x_m, r.y_m] for r in rods]).reshape(-1, 2), pose, camera)
    outer, inner = (r / camera.metres_per_pixel for r in (rods[0].outer_radius_m, rods[0].inner_radius_m))
    share = in_view(centres, outer, camera.width_px, camera.height_px)
    seen = share > UNSURE
    middle = pose[2] - (simulated.starts_rad + np.pi * simulated.fills)
    return Scene(image, centres[seen], share[seen], outer, inner, simulated.fills[seen], middle[seen])


def in_view(centres_px: Float, outer_px: float, width_px: int, height_px: int) -> Float:
    """(K,): the share of each rod's rings that lies in the image."""
    turn = np.arange(48) * 2 * np.pi / 48
    ring = np.stack([np.cos(turn), np.sin(turn)], axis=-1) * outer_px
    points = centres_px[:, None, None] + ring[:, None] * np.array([0.6, 0.8, 1.0])[:, None]
    return np.asarray(((points > -0.5) & (points < [width_px - 0.5, height_px - 0.5])).all(axis=-1).mean(axis=(1, 2)))


@dataclass(frozen=True, slots=True, eq=False)
class Crops:
    """What the network is trained on. planes: (N, 4, h, w). target: (N, 8, h / 4, w / 4). known, rod: see `parts`."""

    planes: Float32
    target: Float32
    known: np.ndarray
    rod: np.ndarray


def crops(seed: int, ponds: int, each: int) -> Crops:
    """Pieces of scenes by seed, the scale wrong by up to SCALE_ERROR."""
    made = [_crop(s, np.random.default_rng([seed, 1, n])) for n, s in enumerate(scenes(seed, ponds, each))]
    return Crops(*(np.stack(part) for part in zip(*made, strict=True)))


def _crop(scene: Scene, rng: np.random.Generator) -> tuple[Float32, Float32, np.ndarray, np.ndarray]:
    believed = scene.outer_px * rng.uniform(1 - SCALE_ERROR, 1 + SCALE_ERROR)
    sight = look(scene.image, believed)
    height, width = sight.planes.shape[1:]
    y, x = (int(rng.integers(min(0, n - c), max(0, n - c) + 1)) for n, c in zip((height, width), CROP, strict=True))
    planes = np.zeros((4, *CROP), np.float32)
    part = sight.planes[:, max(0, y) : y + CROP[0], max(0, x) : x + CROP[1]]
    planes[:, max(0, -y) : max(0, -y) + part.shape[1], max(0, -x) : max(0, -x) + part.shape[2]] = part
    centres = sight.to_canonical(scene.centres_px) - [x, y]
    return planes, *_target(scene, centres, float(np.log(scene.outer_px / believed)))


def _target(scene: Scene, centres: Float, log_size: float) -> tuple[Float32, np.ndarray, np.ndarray]:
    shape = (CROP[0] // STRIDE, CROP[1] // STRIDE)
    v, u = np.mgrid[: shape[0], : shape[1]] * STRIDE + (STRIDE - 1) / 2
    target = np.zeros((len(CHANNELS), *shape), np.float32)
    known, rod = np.ones(shape, bool), np.zeros(shape, bool)
    for k, (x, y) in enumerate(centres):
        dx, dy = x - u, y - v
        distance = np.hypot(dx, dy)
        if scene.share[k] < SURE:
            known &= distance > CANONICAL_PX / 2
            continue
        heat = np.exp(-((distance / STRIDE) ** 2) / 2)
        heat[distance <= distance.min() + 1e-6] = 1 if distance.min() < STRIDE else 0
        target[0] = np.maximum(target[0], heat)
        near = distance < 1.8 * STRIDE
        rod |= near
        length = np.sin(np.pi * scene.fill[k])
        wedge = length * np.cos(scene.middle_rad[k]), length * np.sin(scene.middle_rad[k])
        for channel, value in zip((1, 2, 4, 5, 6, 7), (dx, dy, log_size, scene.fill[k], *wedge), strict=True):
            target[channel][near] = value[near] if isinstance(value, np.ndarray) else value
    return target, known, rod
