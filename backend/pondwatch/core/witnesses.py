"""What single looks show of a thing that all of them together seem to show.

Pure: arrays in, arrays out. What drifts, glares or flickers is in some looks and not in others; what lies on the floor
is in each.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from .consensus import Warp
from .floormaps import Maps
from .values import Bool, Float, Int

SIGNIFICANT = 15.0  # standard deviations, from which it is enough that most looks show it
OF_THREE = 22.5  # the same where there are three looks alone, whose median is hardly one
AGREE = 0.75  # of the looks at a place, that must show it
LEAST_LOOKS = 3
_HALF = 0.5  # of what the consensus shows: from which a look shows a thing
_MOST = 1.5  # times as much in the mean: then it is the light round it that looks differ in
_EACH = 4  # looks, of which each must show a thing that is less significant
_STEADY = 8.0  # standard errors of the mean of these looks that it must be off nothing
_SURE = 3.0  # standard errors that the mean of what looks show of a rod must be off nothing
_LEAST_SPREAD = 0.1  # of looks that seem to show exactly as much
_SEEN = 0.7  # of a thing's pixels that a look must show to have a say
_LEAST_AROUND = 8  # pixels that a look's light is judged by


def agreeing(shown: Sequence[float]) -> int:
    """How many looks show a thing."""
    return sum(share > _HALF for share in shown)


def is_borne_out(shown: Sequence[float], peak: float) -> bool:
    """Whether looks by themselves show what the consensus does, by how much of it each shows, and its significance.

    What lies on the floor is in every look, about as much. Ripples of light and drifting particles are in some: their
    shares scatter, so the weaker a residual is, the less they may.
    """
    count = len(shown)
    if count < LEAST_LOOKS or agreeing(shown) < AGREE * count or float(np.mean(shown)) > _MOST:
        return False
    if peak > (SIGNIFICANT if count >= _EACH else OF_THREE):
        return True
    spread = max(float(np.std(shown, ddof=1)), _LEAST_SPREAD)
    steady = float(np.mean(shown)) > _STEADY * spread / float(np.sqrt(count))
    return steady and count >= _EACH and agreeing(shown) == count


def is_steady(shown: Sequence[float], peak: float) -> bool:
    """Whether looks show a rod off its place, by how much of it each shows, and its significance: together surely so,
    for in bad water one look alone says little of half a pixel. Where too few show it whole its significance decides.
    """
    count = len(shown)
    if count < LEAST_LOOKS:
        return peak > SIGNIFICANT
    spread = max(float(np.std(shown, ddof=1)), _LEAST_SPREAD)
    return _SURE * spread / float(np.sqrt(count)) < float(np.mean(shown)) < _MOST


def shares(warps: Sequence[Warp], pixels: Int, around: Int, maps: Maps) -> list[float]:
    """How much of what the consensus shows at some pixels each look shows that has them in view: 1 all, 0 nothing.

    Args:
        pixels, around: (N, 2) and (M, 2), x and y in the raster: of the thing, and of clean floor by which a look's
            light is judged.
    """
    low, high = pixels.min(axis=0), pixels.max(axis=0)
    near = (warp for warp in warps if _meets(warp, low, high))
    return [share for warp in near if (share := _share(warp, pixels, around, maps)) is not None]


def pattern_shares(warps: Sequence[Warp], pixels: Int, around: Int, maps: Maps) -> list[float]:
    """As `shares`, of what is lighter here and darker there: pixel by pixel, as a rod's edges are that stand off."""
    low, high = pixels.min(axis=0), pixels.max(axis=0)
    near = (warp for warp in warps if _meets(warp, low, high))
    return [share for warp in near if (share := _share(warp, pixels, around, maps, as_one=False)) is not None]


def _meets(warp: Warp, low: Int, high: Int) -> bool:
    """Whether a look's rectangle has anything of a box."""
    rect = warp.rect
    return bool(
        rect.x <= high[0] and low[0] < rect.x + rect.width and rect.y <= high[1] and low[1] < rect.y + rect.height
    )


def _share(warp: Warp, pixels: Int, around: Int, maps: Maps, as_one: bool = True) -> float | None:
    """Of one look; None where the thing is out of its view. as_one: all pixels together, by their mean."""
    values, inside = _sampled(warp, pixels)
    if inside.mean() < _SEEN:
        return None
    x, y = pixels[inside].T
    wanted = maps.grey[y, x].astype(np.float64)
    left = values[inside] / np.maximum(_gain(warp, around, maps), 0.1) - maps.expected[y, x]
    if as_one:
        wanted, left = wanted.mean(axis=0), left.mean(axis=0)
    return float((left * wanted).sum() / max(float((wanted * wanted).sum()), 1e-6))


def _gain(warp: Warp, around: Int, maps: Maps) -> Float:
    """(3,): a look's light over that of the maps, by clean floor."""
    if len(around) < _LEAST_AROUND:
        return np.ones(3)
    values, inside = _sampled(warp, around)
    if inside.sum() < _LEAST_AROUND:
        return np.ones(3)
    expected = maps.expected[around[inside, 1], around[inside, 0]]
    return np.asarray(np.median(values[inside], axis=0) / np.maximum(np.median(expected, axis=0), 1))


def _sampled(warp: Warp, pixels: Int) -> tuple[Float, Bool]:
    """(N, 3) values of a look at (N, 2) pixels of the raster, and which lie inside it."""
    image = warp.look.image
    at = (pixels - (warp.rect.x, warp.rect.y)) @ warp.back[:, :2].T + warp.back[:, 2]
    inside = np.all((at >= 1) & (at <= np.array(image.shape[1::-1]) - 2), axis=1)
    points = at.astype(np.float32)[None]
    values = cv2.remap(image, points[..., 0], points[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return values[0].astype(np.float64), np.asarray(inside)
