"""What is otherwise than the layout says: things and stains on the floor, and rods off their place."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from pondwatch.core.values import Float

from .palette import Palette
from .pond import SimulatedPond
from .spec import SimulationSpec

_LEAST_CONTRAST = 60.0  # grey levels between an object and what is around it, in one channel at least
Kind = Literal["object", "stain"]


@dataclass(frozen=True, slots=True)
class Thing:
    """One thing on the floor, pond frame. diameter_m: of the disc of its area. stretch: length to width. colour: BGR;
    a stain's is the share of the light that it lets through, times 255."""

    kind: Kind
    x_m: float
    y_m: float
    diameter_m: float
    stretch: float
    turn_rad: float
    colour: tuple[float, float, float]


def displaced(simulated: SimulatedPond, spec: SimulationSpec, rng: np.random.Generator) -> SimulatedPond:
    """The same pond with some of its rods moved by so much, each in a direction of its own."""
    count = min(spec.displaced, len(simulated.fills))
    if not count:
        return simulated
    which = rng.choice(len(simulated.fills), count, replace=False)
    turn = rng.uniform(-np.pi, np.pi, count)
    offsets = simulated.offsets.copy()
    length_m = spec.displaced_px * spec.camera.metres_per_pixel
    offsets[which] = length_m * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    return replace(simulated, offsets=offsets)


def lying_about(
    simulated: SimulatedPond, spec: SimulationSpec, palette: Palette, rng: np.random.Generator
) -> tuple[Thing, ...]:
    """Objects, then stains, apart from each other, at places where robots come by."""
    places: list[Float] = []
    out = []
    kinds: tuple[tuple[Kind, int, float], ...] = (
        ("object", spec.objects, spec.object_px),
        ("stain", spec.stains, spec.stain_px),
    )
    for kind, count, size_px in kinds:
        size_m = size_px * spec.camera.metres_per_pixel
        for _ in range(count):
            place = _free_place(simulated, places, max(size_m, spec.pitch_m), rng)
            places.append(place)
            stretch, turn = (float(v) for v in (rng.uniform(1, 2), rng.uniform(0, np.pi)))
            colour = _other_colour(palette, rng) if kind == "object" else _tint(rng)
            x_m, y_m = place.tolist()
            out.append(Thing(kind, x_m, y_m, size_m, stretch, turn, colour))
    return tuple(out)


def _free_place(simulated: SimulatedPond, taken: list[Float], apart_m: float, rng: np.random.Generator) -> Float:
    """(2,), m: inside the pond, half a pitch from its wall, away from what lies there already where there is room."""
    size = np.array([simulated.pond.width_m, simulated.pond.height_m])
    margin = np.minimum(0.75 * simulated.pitch_m, size / 4)
    place: Float = size / 2
    for _ in range(200):
        place = rng.uniform(margin, size - margin)
        if all(np.hypot(*(place - other)) > 2 * apart_m for other in taken):
            break
    return place


def _other_colour(palette: Palette, rng: np.random.Generator) -> tuple[float, float, float]:
    """A colour that one can tell from all that the pond is made of."""
    known = np.stack([palette.floor, palette.wall, palette.line, palette.annulus, palette.fill])
    colour = rng.uniform(15, 240, 3)
    for _ in range(200):
        if np.abs(known - colour).max(axis=1).min() > _LEAST_CONTRAST:
            break
        colour = rng.uniform(15, 240, 3)
    b, g, r = colour.tolist()
    return b, g, r


def _tint(rng: np.random.Generator) -> tuple[float, float, float]:
    """What a stain lets through: three fifths of the light or less, in no channel more than four fifths."""
    b, g, r = (255 * np.clip(rng.uniform(0.35, 0.6) + rng.uniform(-0.15, 0.2, 3), 0.2, 0.8)).tolist()
    return b, g, r
