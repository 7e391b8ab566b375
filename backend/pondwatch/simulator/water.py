"""What water, light, radiation and the sensor do to a picture."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from pondwatch.core.frames import image_to_pond
from pondwatch.core.values import Camera, Float, Float32, Image

from .spec import WaterKind


@dataclass(frozen=True, slots=True, kw_only=True)
class Water:
    """Strengths; 0 is none. Lengths in image pixels, light in grey levels of 255."""

    veil: float = 0.0  # share of the light that is scattered on the way
    veil_colour: tuple[float, float, float] = (90.0, 95.0, 70.0)  # BGR
    blur_px: float = 0.0
    motion_px: float = 0.0
    vignette: float = 0.0
    caustics: float = 0.0
    gain: float = 0.0  # one standard deviation, natural log, a snapshot
    particles: float = 0.0  # mean number in view
    glare: float = 0.0  # probability of a reflection in view
    speckle: float = 0.0  # mean number of pixels hit by radiation
    noise: float = 1.5  # one standard deviation


def water_of(kind: WaterKind, rng: np.random.Generator) -> Water:
    """Clear: a still pool and a good sensor. Murky: everything at once, its strengths by chance."""
    if kind == "clear":
        return Water(blur_px=0.4, noise=2.0)
    strength = rng.uniform(0.7, 1.1)
    tint = tuple((np.array([80.0, 90.0, 62.0]) * rng.uniform(0.8, 1.2, 3)).tolist())
    return Water(
        veil=0.45 * strength, veil_colour=tint, blur_px=0.9 * strength, motion_px=1.5 * strength, vignette=0.35,
        caustics=0.3 * strength, gain=0.15, particles=2.5, glare=0.05, speckle=3.0, noise=3.0,
    )  # fmt: skip


def through_water(
    ideal: Float32, water: Water, pose_pond: Float, captured_s: float, camera: Camera, rng: np.random.Generator
) -> Image:
    """(H, W, 3), 8 bits, of (H, W, 3), 0 to 255: the picture as the sensor gives it."""
    return np.round(unrounded(ideal, water, pose_pond, captured_s, camera, rng)).astype(np.uint8)


def unrounded(
    ideal: Float32, water: Water, pose_pond: Float, captured_s: float, camera: Camera, rng: np.random.Generator
) -> Float32:
    """The same before it is rounded: (H, W, 3), 0 to 255."""
    image = _lit(ideal.copy(), water, pose_pond, captured_s, camera)
    if water.veil:
        image += np.float32(water.veil) * (np.array(water.veil_colour, np.float32) - image)
    image = _blurred(image, water, rng)
    _add_spots(image, water, rng)
    image *= np.float32(np.exp(rng.normal(0, water.gain)) if water.gain else 1.0) * _vignette(camera, water.vignette)
    image += rng.standard_normal(image.shape, np.float32) * np.float32(water.noise)
    _add_speckle(image, water, rng)
    return np.clip(image, 0, 255)


def _lit(image: Float32, water: Water, pose_pond: Float, captured_s: float, camera: Camera) -> Float32:
    """Sunlight through waves: bright nets that lie on the floor and wander with time."""
    if not water.caustics:
        return image
    v, u = np.mgrid[: camera.height_px, : camera.width_px]
    points = image_to_pond(np.stack([u, v], axis=-1), pose_pond, camera) / (camera.metres_per_pixel * 40)
    net = np.zeros(image.shape[:2])
    for k, direction in enumerate((0.3, 1.5, 2.6, 4.1)):
        c, s = np.cos(direction), np.sin(direction)
        across = points[..., 0] * -s + points[..., 1] * c
        phase = captured_s % 1000 * (1.1 + 0.3 * k)
        net += np.sin((points[..., 0] * c + points[..., 1] * s) * (4 + k) + np.sin(across * 3) + phase)
    ridges = np.exp(-((net * 1.4) ** 2)) - 0.35
    return np.asarray(image * (1 + water.caustics * ridges).astype(np.float32)[..., None], np.float32)


def _blurred(image: Float32, water: Water, rng: np.random.Generator) -> Float32:
    if water.blur_px:
        image = np.asarray(cv2.GaussianBlur(image, (0, 0), water.blur_px, borderType=cv2.BORDER_REPLICATE), np.float32)
    length = abs(rng.normal(0, water.motion_px)) if water.motion_px else 0.0
    if length > 0.3:
        image = np.asarray(cv2.filter2D(image, -1, _streak(length, rng.uniform(0, np.pi))), np.float32)
    return image


def _streak(length_px: float, direction_rad: float) -> Float32:
    """A kernel that smears along a line, its centre of mass at its middle."""
    half = int(np.ceil(length_px / 2)) + 1
    kernel = np.zeros((2 * half + 1, 2 * half + 1), np.float32)
    for t in np.linspace(-0.5, 0.5, 33) * length_px:
        x, y = half + t * np.cos(direction_rad), half + t * np.sin(direction_rad)
        i, j = int(x), int(y)
        kernel[j : j + 2, i : i + 2] += np.outer([1 - (y - j), y - j], [1 - (x - i), x - i])
    return np.asarray(kernel / kernel.sum(), np.float32)


def _vignette(camera: Camera, strength: float) -> Float32:
    v, u = np.mgrid[-1 : 1 : camera.height_px * 1j, -1 : 1 : camera.width_px * 1j]
    return np.asarray(1 - strength * (u**2 + v**2) / 2, np.float32)[..., None]


def _add_spots(image: Float32, water: Water, rng: np.random.Generator) -> None:
    """Particles near the lens, and the lamp's own reflection."""
    height, width = image.shape[:2]
    spots = [(rng.uniform(0.6, 2.5), rng.uniform(60, 180)) for _ in range(rng.poisson(water.particles))]
    if rng.random() < water.glare:
        spots.append((rng.uniform(6, 14), 200.0))
    for radius, light in spots:
        x, y = rng.uniform(0, width), rng.uniform(0, height)
        x0, x1 = max(0, int(x - 3 * radius)), min(width, int(x + 3 * radius) + 1)
        y0, y1 = max(0, int(y - 3 * radius)), min(height, int(y + 3 * radius) + 1)
        v, u = np.mgrid[y0:y1, x0:x1]
        glow = np.exp(-((u - x) ** 2 + (v - y) ** 2) / (2 * radius**2)) * light
        image[y0:y1, x0:x1] += glow.astype(np.float32)[..., None]


def _add_speckle(image: Float32, water: Water, rng: np.random.Generator) -> None:
    """Single pixels that a gamma ray lit."""
    hits = rng.poisson(water.speckle)
    v, u = rng.integers(0, image.shape[0], hits), rng.integers(0, image.shape[1], hits)
    image[v, u] += rng.uniform(60, 255, (hits, 1)).astype(np.float32)
