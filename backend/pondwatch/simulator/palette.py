"""How a pond looks: colours and line widths. The layout knows nothing of it, and no correction may."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pondwatch.core.values import Float

_LUMA = np.array([0.114, 0.587, 0.299])  # of B, G, R


@dataclass(frozen=True, slots=True, eq=False)
class Palette:
    """Colours: (3,), BGR, 0 to 255. Widths: shares of the outer radius. Mottle: how strong the floor's stains are."""

    floor: Float
    wall: Float
    line: Float
    annulus: Float
    fill: Float
    wall_width: float
    line_width: float
    inner_line_width: float
    mottle: float


def print_palette() -> Palette:
    """Dark lines, white rings and blue cells: a printed mock-up of a pond."""
    colours = ((218, 184, 140), (134, 96, 58), (40, 32, 30), (252, 252, 252), (40, 32, 30))
    floor, wall, line, annulus, fill = (np.array(c, float) for c in colours)
    return Palette(floor, wall, line, annulus, fill, 0.18, 0.14, 0.1, 0.0)


def random_palette(rng: np.random.Generator) -> Palette:
    """Any colours under which a person could still tell a fill from a ring, and a ring from the floor."""
    while True:
        floor, wall, line, annulus, fill = rng.uniform(15, 240, (5, 3)) * 0.5 + rng.uniform(15, 240, (5, 1)) * 0.5
        light = np.array([_LUMA @ c for c in (floor, line, annulus, fill)])
        if abs(light[2] - light[3]) > 60 and max(abs(light[0] - light[2]), abs(light[0] - light[1])) > 50:
            break
    wall_width, line_width, inner_width = rng.uniform((0.06, 0.06, 0.04), (0.25, 0.2, 0.16)).tolist()
    return Palette(floor, wall, line, annulus, fill, wall_width, line_width, inner_width, float(rng.uniform(0.0, 0.25)))
