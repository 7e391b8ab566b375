"""Whether a rod's mouth shows the ring's own material, hence is hollow, or another, hence is filled.

A rod is a stack of circles of known radii. Two models of what it shows along its radius, each of even steps seen
through a blur: in the hollow one the mouth is the ring's material behind a line of any colour (or none); in the filled
one it is of any colour, up to the ring. Both have as many free colours, so their misfits compare. Blur that pulls a
narrow ring towards the lines beside it, and makes it look unlike a hollow mouth, is in both. No colour, contrast or
polarity comes in.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.special import ndtr

from .observe import RingBand, RodsFound, sample
from .ranks import median
from .values import Float, Image

RADII = 40
REACH = 1.12  # of the outer radius
RAYS = 24
WHOLE = 0.98  # share of the ring band in view
SURE = 0.8  # of the typical response
BLURS_PX = (0.6, 0.9, 1.3, 1.8, 2.4, 3.2)
OUTER_LINES = (0.06, 0.1, 0.14, 0.2)  # widths, of the outer radius
INNER_LINES = (0.04, 0.08, 0.12, 0.16)
MIDDLE = -1.0  # log of the misfits' ratio, from which a mouth is rather hollow than filled
STEEPNESS, MOST_NATS = 4.0, 6.0  # nats for each unit beyond it, and at most


@dataclass(frozen=True, slots=True, eq=False)
class Mouth:
    """Rods wholly in view. centres_px: (S, 2). along: (S, RADII, 3), median around each circle, over the rod's mean."""

    centres_px: Float
    along: Float


def look_into(image: Image, found: RodsFound, band: RingBand) -> Mouth:
    """The mouths of the rods that are surely there."""
    whole = (found.support > WHOLE) & (found.response > SURE * found.typical)
    centres = found.centres_px[whole]
    if not len(centres):
        return Mouth(centres, np.zeros((0, RADII, 3)))
    angle = 2 * np.pi * np.arange(RAYS) / RAYS
    ray = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    points = centres[:, None, None] + _radii(band.outer_px)[:, None, None] * ray
    along = median(sample(np.asarray(image, np.float32), points), axis=2)
    return Mouth(centres, along / np.maximum(along.mean(axis=(1, 2), keepdims=True), 1.0))


def log_odds_hollow(along: Sequence[Float], inner_px: float, outer_px: float) -> float:
    """Log of the odds that rods of one kind are hollow, against filled.

    Args:
        along: (RADII, 3) each, of rods of that kind.
    """
    if not len(along):
        return 0.0
    seen = np.median(np.asarray(along), axis=0)
    hollow, filled = (_misfit(models, seen) for models in _models(round(inner_px, 2), round(outer_px, 2)))
    return float(np.clip(STEEPNESS * (np.log(filled / hollow) - MIDDLE), -MOST_NATS, MOST_NATS))


def _radii(outer_px: float) -> Float:
    return np.linspace(0.0, REACH * outer_px, RADII)


@lru_cache(maxsize=8)
def _models(inner_px: float, outer_px: float) -> tuple[Float, Float]:
    """Orthonormal bases (M, RADII, 4) of what hollow rods and filled rods may show, over blurs and widths of lines."""
    r = _radii(outer_px)
    hollow, filled = [], []
    for blur in BLURS_PX:
        for line in OUTER_LINES:
            edge = outer_px * (1 - line)
            ring, outline, ground = (
                _step(r, a, b, blur) for a, b in ((inner_px, edge), (edge, outer_px), (outer_px, 1e6))
            )
            filled.append(np.stack([_step(r, -1e6, inner_px, blur), ring, outline, ground], axis=1))
            for width in INNER_LINES:
                mouth = inner_px - width * outer_px
                own = ring + _step(r, -1e6, mouth, blur)
                hollow.append(np.stack([own, _step(r, mouth, inner_px, blur), outline, ground], axis=1))
    return np.linalg.qr(np.array(hollow))[0], np.linalg.qr(np.array(filled))[0]


def _step(r: Float, start: float, end: float, blur_px: float) -> Float:
    return np.asarray(ndtr((r - start) / blur_px) - ndtr((r - end) / blur_px))


def _misfit(bases: Float, seen: Float) -> float:
    """The least squared misfit of the models, as a share of all that varies; at least what noise leaves."""
    explained = (np.matmul(bases.transpose(0, 2, 1), seen) ** 2).sum(axis=(1, 2))
    total = float(((seen - seen.mean(axis=0)) ** 2).sum()) + 1e-9
    return float(((seen**2).sum() - explained.max()) / total) + 1e-3
