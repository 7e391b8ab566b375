"""Condition and position: rods that stand off their place, and what lies on the floor that no layout explains.

Pure: arrays in, arrays out; the same looks in any order give the same findings.

A place is a finding where the floor that all looks agree on (`consensus.py`) differs from what the layout and the look
of all other cells predict (`residual.py`) by more than chance and bad water do, and where each look by itself shows it:
what drifts, glares or flickers is in some looks and not in others. A rod is one where its ring stands off its place by
more than its sigma (`offsets.py`); a whole pond that is off is not.

Not looked at: a pixel that fewer than three looks show, a cell that is hardly in view, the inside of a partly filled
rod, floor that is nobody's cell, and ponds with too few rods to learn from or without a layout.
"""

from __future__ import annotations

import enum
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from .cells import cut, pitch_of, sites_of
from .consensus import Look, Warp, consensus
from .floormaps import Maps, Region, regions_of, surroundings, worth_a_look
from .frames import pond_to_raster, raster_to_pond
from .mosaic import default_metres_per_pixel
from .offsets import Offsets, measured, settled
from .ports import Spread, one_by_one
from .residual import residuals
from .values import Bool, Camera, Float, Pond, RodReading
from .witnesses import LEAST_LOOKS, agreeing, is_borne_out, is_steady, pattern_shares, shares

DISPLACED_SIGMA = 8.0
LEAST_OFFSET_PX = 0.15
LEAST_MENDED = 0.2  # of what a ring at its place leaves unexplained, that one off it must explain
DRAWN_ALONG = 0.03  # of an offset that the neighbours of a rod may still seem to have of it
OFFSET_ERROR = 0.1  # of an offset: what making it whole leaves in doubt
MOST_FINDINGS = 200
_PITCH_PX = 64.0  # the raster need not be finer
_CLAIM = 0.5  # of the significance of what claims a cell: weaker things in it belong to that
_MOST_PIXELS = 500
_MOSTLY = 0.6  # of the cell that most was examined of


class Kind(enum.StrEnum):
    """What was found."""

    FOREIGN_OBJECT = "foreign-object"  # it hides what is below
    STAIN = "stain"  # what is below shows through, darker, or it has no edge
    ROD_DISPLACED = "rod-displaced"


@dataclass(frozen=True, slots=True)
class Finding:
    """One finding. place: m, pond frame. size_m: the diameter of a disc of its area; of a rod its outer diameter.
    significance: standard deviations. looks, agreeing: how many snapshots show the place, and how many of them the
    finding. confidence: of a thing, that one more look would show it (rule of succession); of a rod, that it stands
    off by more than `LEAST_OFFSET_PX`. rod_id: the rod, or the nearest to a thing. offset_m, sigma_m: of a rod."""

    kind: Kind
    x_m: float
    y_m: float
    size_m: float
    confidence: float
    significance: float
    looks: int
    agreeing: int
    rod_id: str
    offset_m: tuple[float, float] | None = None
    sigma_m: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Condition:
    """All findings, the surest first; and how much of the pond's raster was looked at, 0 to 1."""

    findings: tuple[Finding, ...]
    offsets: Offsets | None
    examined: float


NOTHING = Condition((), None, 0.0)


def find(
    looks: Sequence[Look], camera: Camera, pond: Pond, rods: Sequence[RodReading], spread: Spread = one_by_one
) -> Condition:
    """Look over a pond.

    Args:
        looks: snapshots that lie surely where they are said to.
        rods: a reading for every rod of the layout, in its order.
        spread: of few things, each much work.
    """
    if not pond.rods or len(looks) < LEAST_LOOKS:
        return NOTHING
    scale = _scale(camera, pond)
    agreed = consensus(looks, camera, pond, scale, spread)
    sites, maps = sites_of(pond, rods), Maps.blank(agreed.count.shape, scale)
    peaks: list[Float] = []
    off, at_rod, mended = np.full((len(pond.rods), 2), np.nan), np.zeros(len(pond.rods)), np.zeros(len(pond.rods))
    for which in sites.parts():
        cells = cut(agreed, pond, sites, which)
        left = residuals(cells, pond.rods[0].inner_radius_m / scale, spread)
        peaks.append(left.z.max(axis=(1, 2))[_mostly(left.examined)])
        mine = cells.rod >= 0
        offset, explains = measured(cells, left, pond, scale)
        off[cells.rod[mine]], mended[cells.rod[mine]] = offset[mine], explains[mine]
        at_rod[cells.rod[mine]] = cells.looks[mine]
        maps.put(cells, left)
    offsets = settled(off, at_rod, looks, camera, pond, scale)
    moved = [f for f in _displaced(offsets, mended, pond, scale) if _borne_out(f, maps, agreed.warps, pond)]
    _let_go_of(maps, moved, pond)
    regions = regions_of(maps, worth_a_look(np.concatenate(peaks)))
    things = _unclaimed([_thing(region, maps, agreed.warps, pond) for region in regions], sites.pitch)
    found = sorted([*moved, *things], key=lambda f: (-f.significance, f.x_m, f.y_m))[:MOST_FINDINGS]
    return Condition(tuple(found), offsets, float(maps.examined.mean()))


def _mostly(examined: Bool) -> Bool:
    """(K,): cells most of which was examined, for the greatest residual of a corner is less."""
    size = examined.sum(axis=(1, 2))
    return np.asarray(size > _MOSTLY * max(1, int(size.max(initial=0))))


def _scale(camera: Camera, pond: Pond) -> float:
    """Metres a pixel: the mosaic's, or as coarse as shows a rod well."""
    return max(default_metres_per_pixel(camera, pond), pitch_of(pond) / _PITCH_PX)


def _displaced(offsets: Offsets, mended: Float, pond: Pond, scale: float) -> list[Finding]:
    """Rods off their places. mended: (R,), as `offsets.measured` tells it."""
    size = np.hypot(*offsets.offset_m.T)
    if not np.isfinite(size).any():
        return []
    least = max(LEAST_OFFSET_PX * scale, DRAWN_ALONG * float(np.nanmax(size)))
    out = []
    is_off = np.nan_to_num(size) > np.maximum(DISPLACED_SIGMA * offsets.sigma_m, least)
    for i in np.flatnonzero(is_off & (mended > LEAST_MENDED)).tolist():
        rod, looks = pond.rods[i], int(offsets.looks[i])
        sigma = float(np.hypot(offsets.sigma_m[i], OFFSET_ERROR * size[i]))
        x_m, y_m = offsets.offset_m[i].tolist()
        significance = float(size[i] / offsets.sigma_m[i])
        sure = 1 - float(np.exp(-(((size[i] - LEAST_OFFSET_PX * scale) / sigma) ** 2) / 2))
        out.append(
            Finding(
                Kind.ROD_DISPLACED, rod.x_m + x_m, rod.y_m + y_m, 2 * rod.outer_radius_m, sure, significance, looks,
                looks, rod.id, (x_m, y_m), sigma,
            )
        )  # fmt: skip
    return out


def _borne_out(finding: Finding, maps: Maps, warps: Sequence[Warp], pond: Pond) -> bool:
    """Whether single looks show a rod off its place: glare on a ring is in some of them."""
    at = np.round(pond_to_raster(np.array([finding.x_m, finding.y_m]), pond, maps.metres_per_pixel)).astype(int)
    reach = round(finding.size_m / 2 / maps.metres_per_pixel)
    low, high = np.maximum(at - reach, 0), np.maximum(at + reach + 1, 0)
    rows, columns = np.nonzero(maps.examined[low[1] : high[1], low[0] : high[0]])
    pixels = (np.stack([columns, rows], axis=1) + low)[:: max(1, len(rows) // _MOST_PIXELS)]
    if not len(pixels):
        return False
    around = surroundings(Region(pixels, finding.significance), maps)
    return is_steady(pattern_shares(warps, pixels, around, maps), finding.significance)


def _let_go_of(maps: Maps, moved: Sequence[Finding], pond: Pond) -> None:
    """Around a rod that stands off, the layout explains nothing."""
    mask = np.zeros(maps.z.shape, np.uint8)
    for finding in moved:
        at = pond_to_raster(np.array([finding.x_m, finding.y_m]), pond, maps.metres_per_pixel)
        off = np.hypot(*(finding.offset_m or (0.0, 0.0)))
        radius = round((0.85 * finding.size_m + off) / maps.metres_per_pixel)
        cv2.circle(mask, (round(float(at[0])), round(float(at[1]))), radius, 1, -1)
    maps.z[mask > 0] = 0
    maps.examined[mask > 0] = False


def _unclaimed(things: Sequence[Finding | None], pitch_m: float) -> list[Finding]:
    """Those that are things of their own, the most significant first. What is large spoils the light and the look of
    the cells that it lies in; a far weaker residual in them is its doing."""
    kept: list[Finding] = []
    for thing in sorted((t for t in things if t is not None), key=lambda t: -t.significance):
        if not any(
            thing.significance < _CLAIM * other.significance
            and np.hypot(thing.x_m - other.x_m, thing.y_m - other.y_m) < 0.9 * pitch_m + other.size_m / 2
            for other in kept
        ):
            kept.append(thing)
    return kept


def _thing(region: Region, maps: Maps, warps: Sequence[Warp], pond: Pond) -> Finding | None:
    """The finding of a region; None where the looks do not bear it out."""
    some = region.pixels[:: max(1, len(region.pixels) // _MOST_PIXELS)]
    shown = shares(warps, some, surroundings(region, maps), maps)
    at = raster_to_pond(region.pixels.mean(axis=0), pond, maps.metres_per_pixel)
    if not is_borne_out(shown, region.peak):
        return None
    size_m = 2 * float(np.sqrt(len(region.pixels) / np.pi)) * maps.metres_per_pixel
    nearest = min(pond.rods, key=lambda r: (r.x_m - at[0]) ** 2 + (r.y_m - at[1]) ** 2)
    count = agreeing(shown)
    confidence = (count + 1) / (len(shown) + 2)
    return Finding(
        _kind(region, maps), float(at[0]), float(at[1]), size_m, confidence, region.peak, len(shown), count,
        nearest.id,
    )  # fmt: skip


def _kind(region: Region, maps: Maps) -> Kind:
    """A stain takes light of every colour, and the floor shows through it or it fades out; all else is an object."""
    x, y = region.pixels.T
    grey, expected = maps.grey[y, x].astype(np.float64), maps.expected[y, x].astype(np.float64)
    if len(x) < 60 or (grey.mean(axis=0) > 0).any():
        return Kind.FOREIGN_OBJECT
    structure = expected - expected.mean(axis=0)
    shown = (grey + expected) - (grey + expected).mean(axis=0)
    if structure.std() > 10:
        through = float((structure * shown).sum() / (structure**2).sum())
        return Kind.STAIN if through > 0.25 else Kind.FOREIGN_OBJECT
    low, high = region.pixels.min(axis=0) - 8, region.pixels.max(axis=0) + 9
    part = np.linalg.norm(maps.grey[max(0, low[1]) : high[1], max(0, low[0]) : high[0]], axis=2)
    top = float(np.percentile(part, 99))
    return Kind.STAIN if (part > 0.8 * top).sum() < 0.6 * (part > 0.25 * top).sum() else Kind.FOREIGN_OBJECT
