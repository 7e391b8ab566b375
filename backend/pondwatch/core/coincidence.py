"""How far two mosaics of one pond lie apart at its rods, and how well that is known.

Pure: arrays in, arrays out. Every ring comes with a sigma (`marks.py`); in murky water one alone says little, and many
say much. At a rod, its ring and those of its neighbours are weighed together, a neighbour's the less as two mosaics
may be drawn apart from rod to rod, and hardly where the two contradict each other. By how much rings scatter
about their neighbours more than their sigmas explain, all sigmas are enlarged: what is called known is known by the
pair itself. Where the sigma that is left could hide a pixel, nothing is said to be measured. The shift of the whole is
the mean of all rings, weighed by their sigmas, those that contradict it losing their say.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .pond import tree_of
from .values import Float, Int

SURE_SIGMAS = 3.0  # within which a residual is known
_DRAWN = 0.5  # pixels along an axis, that a residual may differ by from a rod to its neighbour
_NEAR = 1.25  # pitches: closer than this, two rods are neighbours
_NEIGHBOURS = 6
_CONTRADICTS = 3.0  # standard deviations, at which a neighbour has half a say
_ROUNDS = 10
_HEARD = 3.0  # standard deviations, at which a ring has half a say in the shift of all
_RAYLEIGH = 1.1774  # median length of a vector whose components are of unit variance
_LEAST_SIGMA_M = 1e-9


@dataclass(frozen=True, slots=True)
class Registration:
    """How well two mosaics coincide, over the rods where that is known: distances, the shift of all and one standard
    deviation of it along an axis, m, pond frame; None where it is known at none."""

    rods: int
    limit_m: float
    median_m: float | None = None
    p95_m: float | None = None
    max_m: float | None = None
    shift_m: tuple[float, float] | None = None
    sigma_m: float | None = None


def residuals(apart_m: Float, sigma_m: Float, places_m: Float, pixel_m: float) -> tuple[Float, Float]:
    """How far two mosaics lie apart at every rod, by its own ring and its neighbours'.

    Args:
        apart_m: (K, 2), pond frame: how far the rings of every rod lie apart, as they were measured.
        sigma_m: (K,), one standard deviation of it along an axis.
        places_m: (K, 2), pond frame, of the rods.
        pixel_m: what a residual must be known to.

    Returns:
        (K, 2), m, pond frame, NaN where it is not known to a pixel; and (K,), m, its standard deviation along an axis.
    """
    if not len(apart_m):
        return np.zeros((0, 2)), np.zeros(0)
    sigma, near = np.maximum(sigma_m, _LEAST_SIGMA_M), _neighbours(places_m)
    theirs = np.vstack([apart_m, np.full(2, np.nan)])[near]  # (K, N, 2)
    aside = np.nan_to_num(theirs - apart_m[:, None])
    sigma = sigma * _enlarged(aside, sigma, np.append(sigma, np.inf)[near])
    variance = np.append(sigma, np.inf)[near] ** 2 + (_DRAWN * pixel_m) ** 2
    square = (aside**2).sum(axis=2) / (variance + sigma[:, None] ** 2)
    say = 1 / (variance * (1 + (square / _CONTRADICTS**2) ** 2))
    known = 1 / np.sqrt(1 / sigma**2 + say.sum(axis=1))
    pooled = apart_m + (say[..., None] * aside).sum(axis=1) * known[:, None] ** 2
    return np.where((SURE_SIGMAS * known <= pixel_m)[:, None], pooled, np.nan), known


def _enlarged(aside_m: Float, sigma_m: Float, theirs_m: Float) -> float:
    """By what factor the sigmas (K,) of rings and of their neighbours (K, N) must grow to explain how far these lie
    aside of them, (K, N, 2)."""
    say = 1 / theirs_m**2
    total = say.sum(axis=1)
    some = total > 0
    if not some.any():
        return 1.0
    off = np.hypot(*(say[some, :, None] * aside_m[some]).sum(axis=1).T) / total[some]
    return max(1.0, float(np.median(off / np.sqrt(sigma_m[some] ** 2 + 1 / total[some]))) / _RAYLEIGH)


def _neighbours(places_m: Float) -> Int:
    """(K, N): the rods next to every rod; K where there are fewer."""
    count = len(places_m)
    if count < 2:
        return np.full((count, 1), count)
    distance, near = map(np.asarray, tree_of(places_m).query(places_m, min(_NEIGHBOURS + 1, count)))
    pitch = float(np.median(distance[:, 1]))
    return np.asarray(np.where(distance[:, 1:] <= _NEAR * pitch, near[:, 1:], count))


def registration(apart_m: Float, sigma_m: Float, residual_m: Float, limit_m: float) -> Registration:
    """How well two mosaics coincide.

    Args:
        apart_m, sigma_m: (K, 2) and (K,), of rings. residual_m: (K, 2), from `residuals`.
    """
    known = np.isfinite(residual_m[:, 0])
    if not known.any():
        return Registration(0, limit_m)
    distance = np.hypot(*residual_m[known].T)
    shift_m, sigma = _shift(apart_m[known], sigma_m[known])
    median, p95 = np.percentile(distance, [50, 95]).tolist()
    return Registration(int(known.sum()), limit_m, median, p95, float(distance.max()), shift_m, sigma)


def _shift(apart_m: Float, sigma_m: Float) -> tuple[tuple[float, float], float]:
    """The shift of all, robustly, and one standard deviation of it along an axis, m."""
    say = 1 / np.maximum(sigma_m, _LEAST_SIGMA_M) ** 2
    at, heard = np.median(apart_m, axis=0), say
    for _ in range(_ROUNDS):
        square = ((apart_m - at) ** 2).sum(axis=1) * say
        heard = say / (1 + square / _HEARD**2)
        at = (heard[:, None] * apart_m).sum(axis=0) / heard.sum()
    mean_square = float((heard * ((apart_m - at) ** 2).sum(axis=1)).sum() / heard.sum()) / 2
    x, y = at.tolist()
    return (x, y), float(np.sqrt(max(1 / heard.sum(), mean_square * (heard**2).sum() / heard.sum() ** 2)))
