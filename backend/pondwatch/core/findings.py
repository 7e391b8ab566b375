"""Condition and position: rods that stand off their place, and what lies on the floor that no layout explains.

Pure: arrays in, arrays out; the same looks in any order give the same findings.

A place is a finding where the floor that all looks agree on (`consensus.py`) differs from what the layout and the look
of all other cells predict (`residual.py`) by more than chance and bad water do, and where each look by itself shows it:
what drifts, glares or flickers is in some looks and not in others. A rod is one where its ring stands off its place by
more than its sigma (`offsets.py`); a whole pond that is off is not.

Not looked at: a pixel that fewer than three looks show, the inside of a partly filled rod, floor that is nobody's cell,
and ponds with too few rods to learn from or without a layout.
"""

from __future__ import annotations

import enum
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from .cells import Cells, cut, pitch_of, sites_of
from .consensus import Look, consensus
from .frames import image_to_raster_affine, pond_to_raster, raster_to_pond
from .mosaic import default_metres_per_pixel
from .offsets import Offsets, measured, settled
from .residual import Residuals, residuals
from .values import Bool, Camera, Float, Float32, Image, Int, Pond, RodReading

SIGNIFICANT = 15.0  # standard deviations; clean simulated ponds, clear and murky, stay under it but for what looks deny
AGREE = 0.75  # of the looks at a place that must show it
HALF_SEEN = 0.5  # of the consensus: from which a look shows a thing
DISPLACED_SIGMA = 8.0
LEAST_OFFSET_PX = 0.15
DRAWN_ALONG = 0.03  # of an offset that the neighbours of a rod may still seem to have of it
OFFSET_ERROR = 0.1  # of an offset: what making it whole leaves in doubt
MOST_FINDINGS = 200
_PITCH_PX = 64.0  # the raster need not be finer
_LEAST_LOOKS = 3
_MARGIN_PX = 3
_SURROUND_PX = 4
_SEEN = 0.7  # of a thing's pixels that a look must show to have a say
_CLAIM = 0.5  # of the significance of what claims a cell: weaker things in it belong to that
_MOST_PIXELS = 500
_DARK = 60.0  # grey levels, of three colours: darker floor is not held to its own share of light


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


@dataclass(frozen=True, slots=True, eq=False)
class _Maps:
    """Of the raster: z (h, w), grey (h, w, 3), expected (h, w, 3), 0 where not examined (h, w). metres_per_pixel."""

    z: Float32
    grey: NDArray[np.int16]
    expected: Image
    examined: Bool
    metres_per_pixel: float

    @classmethod
    def blank(cls, shape: tuple[int, ...], metres_per_pixel: float) -> _Maps:
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
class _Region:
    """Pixels (N, 2), x and y, of a thing; peak: its significance."""

    pixels: Int
    peak: float


def find(looks: Sequence[Look], camera: Camera, pond: Pond, rods: Sequence[RodReading]) -> Condition:
    """Look over a pond.

    Args:
        looks: snapshots that lie surely where they are said to.
        rods: a reading for every rod of the layout, in its order.
    """
    if not pond.rods or len(looks) < _LEAST_LOOKS:
        return NOTHING
    scale = _scale(camera, pond)
    agreed = consensus(looks, camera, pond, scale)
    sites, maps = sites_of(pond, rods), _Maps.blank(agreed.count.shape, scale)
    off, at_rod = np.full((len(pond.rods), 2), np.nan), np.zeros(len(pond.rods))
    for which in sites.parts():
        cells = cut(agreed, pond, sites, which)
        left = residuals(cells, pond.rods[0].inner_radius_m / scale)
        mine = cells.rod >= 0
        off[cells.rod[mine]], at_rod[cells.rod[mine]] = measured(cells, left, pond, scale)[mine], cells.looks[mine]
        maps.put(cells, left)
    offsets = settled(off, at_rod, looks, camera, pond, scale)
    moved = _displaced(offsets, pond, scale)
    _let_go_of(maps, moved, pond)
    regions = _regions(maps)
    things = _unclaimed([_thing(region, maps, looks, camera, pond) for region in regions], sites.pitch)
    found = sorted([*moved, *things], key=lambda f: (-f.significance, f.x_m, f.y_m))[:MOST_FINDINGS]
    return Condition(tuple(found), offsets, float(maps.examined.mean()))


def _scale(camera: Camera, pond: Pond) -> float:
    """Metres a pixel: the mosaic's, or as coarse as shows a rod well."""
    return max(default_metres_per_pixel(camera, pond), pitch_of(pond) / _PITCH_PX)


def _displaced(offsets: Offsets, pond: Pond, scale: float) -> list[Finding]:
    """Rods off their places."""
    size = np.hypot(*offsets.offset_m.T)
    if not np.isfinite(size).any():
        return []
    least = max(LEAST_OFFSET_PX * scale, DRAWN_ALONG * float(np.nanmax(size)))
    out = []
    for i in np.flatnonzero(np.nan_to_num(size) > np.maximum(DISPLACED_SIGMA * offsets.sigma_m, least)).tolist():
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


def _let_go_of(maps: _Maps, moved: Sequence[Finding], pond: Pond) -> None:
    """Around a rod that stands off, the layout explains nothing."""
    mask = np.zeros(maps.z.shape, np.uint8)
    for finding in moved:
        at = pond_to_raster(np.array([finding.x_m, finding.y_m]), pond, maps.metres_per_pixel)
        off = np.hypot(*(finding.offset_m or (0.0, 0.0)))
        radius = round((0.85 * finding.size_m + off) / maps.metres_per_pixel)
        cv2.circle(mask, (round(float(at[0])), round(float(at[1]))), radius, 1, -1)
    maps.z[mask > 0] = 0
    maps.examined[mask > 0] = False


def _regions(maps: _Maps) -> list[_Region]:
    """Where the residual is significant, each with the pixels of at least half its strength."""
    over = (maps.z > SIGNIFICANT).astype(np.uint8)
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
            regions.append(_Region(np.stack([columns + x, rows + y], axis=1), peak))
    return sorted(regions, key=lambda r: -r.peak)[:MOST_FINDINGS]


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


def _thing(region: _Region, maps: _Maps, looks: Sequence[Look], camera: Camera, pond: Pond) -> Finding | None:
    """The finding of a region; None where the looks do not bear it out."""
    some = region.pixels[:: max(1, len(region.pixels) // _MOST_PIXELS)]
    around = _surroundings(region, maps)
    at = raster_to_pond(region.pixels.mean(axis=0), pond, maps.metres_per_pixel)
    shown = [s for look in looks if (s := _shown(look, some, around, maps, camera, pond, at)) is not None]
    agreeing = sum(s > HALF_SEEN for s in shown)
    if len(shown) < _LEAST_LOOKS or agreeing < AGREE * len(shown):
        return None
    size_m = 2 * float(np.sqrt(len(region.pixels) / np.pi)) * maps.metres_per_pixel
    nearest = min(pond.rods, key=lambda r: (r.x_m - at[0]) ** 2 + (r.y_m - at[1]) ** 2)
    confidence = (agreeing + 1) / (len(shown) + 2)
    return Finding(
        _kind(region, maps), float(at[0]), float(at[1]), size_m, confidence, region.peak, len(shown), agreeing,
        nearest.id,
    )  # fmt: skip


def _surroundings(region: _Region, maps: _Maps) -> Int:
    """(M, 2): pixels near a region where nothing is found, by which a look's light is judged."""
    reach = _SURROUND_PX + round(0.25 * float(np.ptp(region.pixels, axis=0).max()))
    low = np.maximum(region.pixels.min(axis=0) - 2 * reach, 0)
    high = region.pixels.max(axis=0) + 2 * reach + 1
    here = slice(low[1], high[1]), slice(low[0], high[0])
    own = np.zeros(maps.z[here].shape, np.uint8)
    own[region.pixels[:, 1] - low[1], region.pixels[:, 0] - low[0]] = 1
    ring = cv2.dilate(own, np.ones((2 * reach + 1,) * 2, np.uint8))
    ring[cv2.dilate(own, np.ones((5, 5), np.uint8)) > 0] = 0
    rows, columns = np.nonzero((ring > 0) & maps.examined[here] & (maps.z[here] < SIGNIFICANT / 2))
    found = np.stack([columns, rows], axis=1) + low
    return np.asarray(found[:: max(1, len(found) // _MOST_PIXELS)], np.int64)


def _shown(look: Look, pixels: Int, around: Int, maps: _Maps, camera: Camera, pond: Pond, at: Float) -> float | None:
    """How much of what the consensus shows at some pixels one look shows: 1 all, 0 nothing; None out of its view."""
    reach = np.hypot(camera.width_px, camera.height_px) * camera.metres_per_pixel
    if np.hypot(*(look.pose_pond[:2] - at)) > reach:
        return None
    there = np.vstack([image_to_raster_affine(look.pose_pond, camera, pond, maps.metres_per_pixel), [0, 0, 1]])
    back = np.linalg.inv(there)[:2]
    values, inside = _sampled(look.image, pixels @ back[:, :2].T + back[:, 2])
    if inside.mean() < _SEEN:
        return None
    pixels, values = pixels[inside], values[inside]
    gain = np.ones(3)
    if len(around) >= 8:
        near, known = _sampled(look.image, around @ back[:, :2].T + back[:, 2])
        if known.sum() >= 8:
            expected = maps.expected[around[known, 1], around[known, 0]]
            gain = np.median(near[known], axis=0) / np.maximum(np.median(expected, axis=0), 1)
    x, y = pixels.T
    wanted = maps.grey[y, x].mean(axis=0)
    left = (values / np.maximum(gain, 0.1) - maps.expected[y, x]).mean(axis=0)
    return float(left @ wanted / max(float(wanted @ wanted), 1e-6))


def _sampled(image: Image, at: NDArray[Any]) -> tuple[Float, Bool]:
    """(N, 3) values at (N, 2) points of an image, and which lie inside it."""
    inside = np.all((at >= 1) & (at <= np.array(image.shape[1::-1]) - 2), axis=1)
    points = at.astype(np.float32)[None]
    values = cv2.remap(image, points[..., 0], points[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return values[0].astype(np.float64), np.asarray(inside)


def _kind(region: _Region, maps: _Maps) -> Kind:
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
