"""What every rod is read as, from all looks at it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from .codes import SECTORS
from .values import Bool, Float, Int, RodReading, RodState

EMPTY_BELOW, FULL_ABOVE = 0.05, 0.95
LOOK_SIGMA = 0.03  # of one look's fill: water, caustics, blur
CONFLICT_SPREAD = 0.25  # of single looks about their median


@dataclass(frozen=True, slots=True, eq=False)
class Looks:
    """L looks at rods. rod: (L,). share: (L, SECTORS), pond orientation, 0 hollow to 1 filled. trust: (L,),
    probability that the snapshot lies where it was placed."""

    rod: Int
    share: Float
    trust: Float


def to_pond(share: Float, theta_rad: Float) -> Float:
    """Turn (L, SECTORS) sectors from the image's orientation to the pond's, by linear interpolation.

    Args:
        theta_rad: (L,), headings. Sectors must all be in view.
    """
    shift = np.asarray(theta_rad) / (2 * np.pi / SECTORS)
    x = (np.arange(SECTORS) - shift[:, None]) % SECTORS
    k = np.floor(x).astype(np.int64) % SECTORS
    f = x - np.floor(x)
    rows = np.arange(len(share))[:, None]
    return np.asarray(share[rows, k] * (1 - f) + share[rows, (k + 1) % SECTORS] * f)


def read_rods(ids: tuple[str, ...], looks: Looks, spread: float, known: bool = True) -> tuple[RodReading, ...]:
    """The reading of every rod; those without a look are `unseen`.

    Args:
        spread: noise of one sector, as a share. known: both hollow and filled rods were seen in this session; where
            not, which of the two it is rests on likeness to the annulus alone, and confidence says so.
    """
    n = len(ids)
    single = np.clip(looks.share, -0.2, 1.2).mean(axis=1)
    views = np.bincount(looks.rod, minlength=n)
    weight = np.bincount(looks.rod, looks.trust, n)
    mean = np.bincount(looks.rod, looks.trust * single, n) / np.maximum(weight, 1e-12)
    best = np.zeros(n)
    np.maximum.at(best, looks.rod, looks.trust)
    off = np.abs(single - mean[looks.rod]) > CONFLICT_SPREAD
    conflict = np.bincount(looks.rod, looks.trust * off, n) > 0.5
    sigma = np.sqrt((LOOK_SIGMA**2 + spread**2 / SECTORS) / np.maximum(views, 1) + 0.006**2)
    return tuple(
        _reading(ids[j], float(mean[j]), float(sigma[j]), float(best[j]), int(views[j]), bool(conflict[j]), known)
        for j in range(n)
    )


def _reading(
    rod_id: str, mean: float, sigma: float, trust: float, views: int, conflicting: bool, known: bool
) -> RodReading:
    if views == 0:
        return RodReading(rod_id, RodState.UNSEEN, None, 0.0, 0)
    below, above = float(ndtr((EMPTY_BELOW - mean) / sigma)), float(ndtr((mean - FULL_ABOVE) / sigma))
    chance = {RodState.EMPTY: below, RodState.FULL: above, RodState.PARTIAL: max(0.0, 1 - below - above)}
    state = max(chance, key=lambda s: chance[s])
    low, high = {RodState.EMPTY: (0.0, 0.0499), RodState.FULL: (0.9501, 1.0)}.get(state, (0.05, 0.95))
    confidence = chance[state] * trust * (0.5 if conflicting else 1.0) * (1.0 if known else 0.7)
    return RodReading(rod_id, state, float(np.clip(mean, low, high)), min(confidence, 0.9999), views, conflicting)


def wholly_in_view(centres_px: Float, outer_px: float, width_px: int, height_px: int) -> Bool:
    """(...,): whether a rod's outer circle lies inside the image."""
    u, v = centres_px[..., 0] + 0.5, centres_px[..., 1] + 0.5
    return np.asarray((u >= outer_px) & (v >= outer_px) & (u <= width_px - outer_px) & (v <= height_px - outer_px))
