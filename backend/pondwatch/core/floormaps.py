"""Maps of what was examined of a floor, and the regions of it that look otherwise than they should.

Pure: arrays in, arrays out.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from .cells import Cells
from .residual import Residuals
from .values import Bool, Float, Float32, Image, Int

WORTH_A_LOOK = 10.0  # standard deviations, from which single looks are asked, or more in bad water
_CLEAN = 7.5  # under which floor is taken to be as it should be
_CHANCE = 1.0  # cells over the limit that are expected by chance, an inspection, before single looks are asked
_LEAST_CELLS = 20
MOST_REGIONS = 200
_MARGIN_PX = 3
_SURROUND_PX = 4
_MOST_PIXELS = 500
_DARK = 60.0  # grey levels, of three colours: darker floor is not held to its own share of light


@dataclass(frozen=True, slots=True, eq=False)
class Maps:
    """Of the raster: z (h, w), grey (h, w, 3), expected (h, w, 3), 0 where not examined (h, w). metres_per_pixel."""

    z: Float32
    grey: NDArray[np.int16]
    expected: Image
    examined: Bool
    metres_per_pixel: float

    @classmethod
    def blank(cls, shape: tuple[int, ...], metres_per_pixel: float) -> Maps:
        """Nothing was examined."""
        grey, expected = np.zeros((*shape, 3), np.int16), np.zeros((*shape, 3), np.uint8)
        return cls(np.zeros(shape, np.float32), grey, expected, np.zeros(shape, bool), metres_per_pixel)

    def put(self, cells: Cells, left: Residuals) -> None:
        """Take over what was examined of cells."""
        reach, (height, width) = cells.reach, self.z.shape
        for k, (x, y) in enumerate(np.round(cells.centre_px).astype(int).tolist()):
            x0, y0, x1, y1 = max(0, x - reach), max(0, y - reach), min(width, x + reach + 1), min(height, y + reach + 1)
            if x0 >= x1 or y0 >= y1:
                continue
            here = slice(y0, y1), slice(x0, x1)
            part = slice(y0 - y + reach, y1 - y + reach), slice(x0 - x + reach, x1 - x + reach)
            mine = left.examined[k][part]
            self.z[here][mine] = left.z[k][part][mine]
            self.grey[here][mine] = np.round(left.grey[k][part][mine])
            self.expected[here][mine] = np.clip(np.round(left.expected[k][part][mine]), 0, 255)
            self.examined[here] |= mine

    def strength(self, here: tuple[slice, slice]) -> Float32:
        """(h, w): the residual as a share of the light that was expected."""
        grey, expected = self.grey[here].astype(np.float32), self.expected[here].astype(np.float32)
        share = np.linalg.norm(grey, axis=2) / (np.linalg.norm(expected, axis=2) + _DARK)
        return np.asarray(cv2.GaussianBlur(share, (0, 0), 0.8), np.float32)


@dataclass(frozen=True, slots=True, eq=False)
class Region:
    """Pixels (N, 2), x and y, of a thing; peak: its significance."""

    pixels: Int
    peak: float


def worth_a_look(peaks: Float) -> float:
    """From how many standard deviations a residual is worth a look, in a pond the greatest residuals of whose cells
    (C,) are these.

    Residuals are not normal: glare, ripples and blocks of compression have tails, and more so in bad water. The
    greatest of many in a cell follows Gumbel's law, whose two parameters the lower half of all cells tells, for
    things lie in few of them. So high a limit that in a pond without any `_CHANCE` cells are expected over it, whose
    looks are then asked; and not under `WORTH_A_LOOK`.
    """
    if len(peaks) < _LEAST_CELLS:
        return WORTH_A_LOOK
    low, middle = np.percentile(peaks, [10, 50]).tolist()
    scale = (middle - low) / np.log(np.log(0.1) / np.log(0.5))
    return max(WORTH_A_LOOK, float(middle + scale * (np.log(np.log(2)) + np.log(len(peaks) / _CHANCE))))


def regions_of(maps: Maps, least: float = WORTH_A_LOOK) -> list[Region]:
    """Where the residual is over `least` standard deviations, each with the pixels of at least half its strength."""
    over = (maps.z > least).astype(np.uint8)
    if not over.any():
        return []
    joined = cv2.dilate(over, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * _MARGIN_PX + 1,) * 2))
    count, labels, stats, _ = cv2.connectedComponentsWithStats(joined)
    regions = []
    for label in range(1, count):
        x, y, wide, tall = stats[label, :4].tolist()
        here = slice(y, y + tall), slice(x, x + wide)
        mine = (labels[here] == label) & maps.examined[here]
        part = np.where(mine, maps.strength(here), np.float32(0))
        core = part > 0.5 * np.percentile(part[mine], 98)
        rows, columns = np.nonzero(core)
        peak = float(maps.z[here][mine].max())
        if len(rows):
            regions.append(Region(np.stack([columns + x, rows + y], axis=1), peak))
    return sorted(regions, key=lambda r: -r.peak)[:MOST_REGIONS]


def surroundings(region: Region, maps: Maps) -> Int:
    """(M, 2): pixels near a region where nothing is found, by which a look's light is judged."""
    reach = _SURROUND_PX + round(0.25 * float(np.ptp(region.pixels, axis=0).max()))
    low = np.maximum(region.pixels.min(axis=0) - 2 * reach, 0)
    high = region.pixels.max(axis=0) + 2 * reach + 1
    here = slice(low[1], high[1]), slice(low[0], high[0])
    own = np.zeros(maps.z[here].shape, np.uint8)
    own[region.pixels[:, 1] - low[1], region.pixels[:, 0] - low[0]] = 1
    ring = cv2.dilate(own, np.ones((2 * reach + 1,) * 2, np.uint8))
    ring[cv2.dilate(own, np.ones((5, 5), np.uint8)) > 0] = 0
    rows, columns = np.nonzero((ring > 0) & maps.examined[here] & (maps.z[here] < _CLEAN))
    found = np.stack([columns, rows], axis=1) + low
    return np.asarray(found[:: max(1, len(found) // _MOST_PIXELS)], np.int64)
