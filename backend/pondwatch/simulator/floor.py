"""The pond's floor as a fine raster: rods with their fills, cells, stains; or a texture where there is no layout.

A fill of 1 is a solid inner disc, 0 a hollow one (it looks like the ring's own material), anything between a wedge.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from pondwatch.core.values import Camera, Float, Float32, Image

from .palette import Palette
from .pond import SimulatedPond
from .things import Thing

MAX_FLOOR_PX = 40_000_000
FINEST = 4.0  # floor pixels an image pixel


@dataclass(frozen=True, slots=True, eq=False)
class Floor:
    """A raster of the floor and some of its surroundings. left_m, top_m: the outer corner of its first pixel, pond
    frame."""

    image: Image
    metres_per_pixel: float
    left_m: float
    top_m: float


def render_floor(
    simulated: SimulatedPond, palette: Palette, camera: Camera, rng: np.random.Generator, things: Sequence[Thing] = ()
) -> Floor:
    """The floor of a pond, up to 4 pixels an image pixel, with room around it for a camera at its edge."""
    pond = simulated.pond
    border = np.hypot(camera.width_px, camera.height_px) / 2 * camera.metres_per_pixel
    width, height = pond.width_m + 2 * border, pond.height_m + 2 * border
    scale = max(camera.metres_per_pixel / FINEST, float(np.sqrt(width * height / MAX_FLOOR_PX)))
    shape = (int(np.ceil(height / scale)), int(np.ceil(width / scale)), 3)
    image = np.empty(shape, np.uint8)
    image[:] = np.round(palette.floor).astype(np.uint8)
    floor = Floor(image, scale, -border, pond.height_m + border)
    if not pond.rods and not len(simulated.cells):
        return Floor(_texture(shape, scale / camera.metres_per_pixel, palette, rng), scale, floor.left_m, floor.top_m)
    for centre in simulated.cells:
        _draw_cell(floor, centre, simulated, palette)
    truth = zip(pond.rods, simulated.offsets, simulated.fills.tolist(), simulated.starts_rad.tolist(), strict=True)
    for rod, off, fill, start in truth:
        at = np.array([rod.x_m, rod.y_m]) + off
        _draw_rod(floor, at, rod.outer_radius_m, rod.inner_radius_m, fill, start, palette)
    if palette.mottle:
        stains = _octaves(shape[:2], (scale / camera.metres_per_pixel) / 200, 3, rng)
        gain = np.clip(128 * (1 + palette.mottle * stains), 0, 255).astype(np.uint8)
        cv2.multiply(image, cv2.merge([gain] * 3), dst=image, scale=1 / 128)
    for thing in things:
        _draw_thing(floor, thing)
    return floor


def _patch(floor: Floor, centre: Float, reach_m: float) -> tuple[Image, Float32, Float32]:
    """The floor's pixels within reach of a point (a view), and their offsets from it, px, right and up."""
    m = floor.metres_per_pixel
    x, y = (centre[0] - floor.left_m) / m - 0.5, (floor.top_m - centre[1]) / m - 0.5
    reach = reach_m / m + 1
    x0, x1 = max(0, int(x - reach)), min(floor.image.shape[1], int(x + reach) + 2)
    y0, y1 = max(0, int(y - reach)), min(floor.image.shape[0], int(y + reach) + 2)
    right = (np.arange(x0, x1) - x).astype(np.float32)[None, :]
    up = (y - np.arange(y0, y1)).astype(np.float32)[:, None]
    return floor.image[y0:y1, x0:x1], right, up


def _blend(patch: Image, cover: Float32, colour: Float) -> None:
    alpha = np.clip(cover, 0, 1)[..., None]
    patch[:] = (patch + alpha * (colour.astype(np.float32) - patch) + 0.5).astype(np.uint8)


def _draw_cell(floor: Floor, centre: Float, simulated: SimulatedPond, palette: Palette) -> None:
    """The walls of one cell of the lattice: the border of what lies nearer to this site than to another."""
    half = simulated.pitch_m / 2
    wall = palette.wall_width * 0.36 * simulated.pitch_m / 2
    patch, right, up = _patch(floor, centre, half * 1.2 + wall)
    directions = (0, np.pi / 3, -np.pi / 3) if simulated.lattice == "hexagonal" else (0, np.pi / 2)
    away = np.zeros(patch.shape[:2], np.float32)
    for direction in directions:
        c, s = (np.float32(f(direction + simulated.angle_rad)) for f in (np.cos, np.sin))
        np.maximum(away, np.abs(c * right + s * up), out=away)
    edge = np.abs(away - np.float32(half / floor.metres_per_pixel))
    _blend(patch, np.float32(wall / floor.metres_per_pixel + 0.5) - edge, palette.wall)


def _draw_rod(
    floor: Floor, centre: Float, outer_m: float, inner_m: float, fill: float, start_rad: float, palette: Palette
) -> None:
    patch, right, up = _patch(floor, centre, outer_m)
    distance = np.sqrt(right**2 + up**2)

    def disc(radius_m: float) -> Float32:
        return np.asarray(np.float32(radius_m / floor.metres_per_pixel + 0.5) - distance, np.float32)

    _blend(patch, disc(outer_m), palette.line)
    _blend(patch, disc(outer_m * (1 - palette.line_width)), palette.annulus)
    _blend(patch, disc(inner_m), palette.line)
    _blend(patch, disc(inner_m - outer_m * palette.inner_line_width), palette.annulus)
    if fill > 0:
        turn = (np.arctan2(up, right) - np.float32(start_rad)) % np.float32(2 * np.pi)
        _blend(patch, np.where(turn <= fill * 2 * np.pi, disc(inner_m), np.float32(0)), palette.fill)


def _draw_thing(floor: Floor, thing: Thing) -> None:
    """An object hides the floor and has an edge; a stain lets it show through and has none."""
    radius = thing.diameter_m / 2
    soft = 1.0 if thing.kind == "object" else 0.5 * radius / floor.metres_per_pixel
    patch, right, up = _patch(floor, np.array([thing.x_m, thing.y_m]), 1.6 * radius)
    c, s = np.float32(np.cos(thing.turn_rad)), np.float32(np.sin(thing.turn_rad))
    stretch = np.float32(np.sqrt(thing.stretch))
    distance = np.hypot((c * right + s * up) / stretch, (c * up - s * right) * stretch)
    cover = np.clip((np.float32(radius / floor.metres_per_pixel) - distance) / np.float32(soft) + 0.5, 0, 1)
    colour = np.array(thing.colour)
    if thing.kind == "object":
        _blend(patch, cover, colour)
    else:
        patch[:] = (patch * (1 - cover[..., None] * (1 - colour / 255).astype(np.float32)) + 0.5).astype(np.uint8)


def _octaves(
    shape: tuple[int, ...], frequency: float, octaves: int, rng: np.random.Generator, fading: float = 0.7
) -> Float32:
    """Smooth noise, mean 0, deviation about 1: octaves of `frequency` cycles a pixel and doublings of it."""
    out = np.zeros(shape[:2], np.float32)
    for octave in range(octaves):
        cells = [max(4, int(n * frequency * 2**octave) + 2) for n in shape[:2]]
        noise = rng.standard_normal(cells).astype(np.float32) * np.float32(fading**octave)
        out += cv2.resize(noise, (shape[1], shape[0]), interpolation=cv2.INTER_CUBIC)
    return out / np.float32(max(1e-6, float(out.std())))


def _texture(shape: tuple[int, int, int], scale: float, palette: Palette, rng: np.random.Generator) -> Image:
    """A floor of stains and furrows at all sizes from the image's width to its pixel."""
    planes = []
    shared = _octaves(shape[:2], scale / 120, 6, rng, fading=0.95)
    for base in palette.floor:
        own = _octaves(shape[:2], scale / 300, 2, rng)
        planes.append(np.clip(40 + 0.7 * base + 26 * shared + 9 * own, 0, 255).astype(np.uint8))
    return np.asarray(cv2.merge(planes), np.uint8)
