"""What the inner circle of a rod shows, as a ring of sectors, and how that is read without knowing any colour.

A rod's own annulus (between its inner and outer radius) is the reference: the sectors are log ratios to it, colour by
colour, so gain, vignette and shading cancel. Over a session these vectors fall into two clusters along one line in
colour space, whatever the palette. The cluster that looks like the annulus is the hollow one: what is seen through
an empty rod's mouth is the same material; what differs is the filling. Where that does not decide, the darker one is.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from .observe import sample
from .ranks import median, middle
from .values import Bool, Camera, Float, Image

SECTORS = 24
INNER_SHARES = (0.3, 0.5, 0.7)  # of the inner radius, where sectors are sampled
ANNULUS_SHARES = (0.15, 0.25, 0.35)  # of the way from inner to outer radius: clear of a thick line around the rod
OFFSET = 8.0  # grey levels; keeps the log ratio of dark pixels finite
LEAST_STEP = 0.12  # log ratio between hollow and filled, under which there is one cluster only
LEAST_SEPARATION = 4.5  # between the clusters, in their own spreads
DISCRIMINANT_ROUNDS, LEAST_WITHIN = 4, 0.02  # log ratio
LIKENESS_NATS = 1.0  # log odds that of two clusters the one more like the annulus is the hollow one
LEVEL_REACH, LEVEL_SPREADS = 0.2, 4.0  # log ratio, and typical distances, from the one level, over which it is another
UNLIKE, UNLIKE_NATS = 0.34, 2.0  # log ratio from which one cluster alone is rather filled, and log odds for e times it
DIPPED_SEPARATION, DIP = 3.0, 0.5  # enough, where between them lies a dip this deep, as a share of the lesser peak

_Parting = tuple[Float, tuple[float, float, float, bool, float]]  # a line, and `_two_means` on it


@dataclass(frozen=True, slots=True, eq=False)
class Codes:
    """The sectors at S sites of a snapshot. ratio: (S, SECTORS, 3), log ratio to the annulus. valid: (S, SECTORS).

    Sector k looks along the angle 2 pi k / SECTORS, counter-clockwise from the image's +u axis.
    """

    ratio: Float
    valid: Bool


@dataclass(frozen=True, slots=True, eq=False)
class Palette:
    """The line in colour space from hollow to filled. axis: (3,), unit. hollow, filled: positions on it.
    spread: noise of one sector, as a share of the way. only: the position of the one level in the data; None where
    both were seen. nats: log odds that hollow and filled are not taken for one another, by what was looked at so far.
    centre: (3,), log ratio, of the one level, and reach how far from it a sector still shows it; None with two levels.
    taught: rods wholly in view that it was learned from.
    """

    axis: Float
    hollow: float
    filled: float
    spread: float
    only: float | None
    nats: float = 0.0
    centre: Float | None = None
    reach: float = LEVEL_REACH
    taught: int = 0

    @property
    def two_levels(self) -> bool:
        """Whether both levels were seen in the data."""
        return self.only is None

    @property
    def certainty(self) -> float:
        """The probability that hollow and filled are not taken for one another."""
        return float(1 / (1 + np.exp(-self.nats)))

    def share(self, ratio: Float) -> Float:
        """(..., 3) log ratios to (...) shares of the way from hollow, 0, to filled, 1."""
        return np.asarray((ratio @ self.axis - self.hollow) / (self.filled - self.hollow))

    def strange(self, ratio: Float) -> Float:
        """(..., SECTORS, 3) log ratios to (...): the share of sectors that show no level seen so far. Where one level
        was seen alone, what differs from it lies in a direction that nobody knows yet."""
        if self.centre is None:
            return np.zeros(np.shape(ratio)[:-2])
        return np.asarray((np.linalg.norm(ratio - self.centre, axis=-1) > self.reach).mean(axis=-1))

    def judged(self, nats: float) -> Palette:
        """With further log odds for it; the other way round where they and its own come to less than none."""
        total = self.nats + nats
        if total >= 0:
            return replace(self, nats=total)
        if self.only is None:
            return replace(self, hollow=self.filled, filled=self.hollow, nats=-total)
        step = -1.0 if self.only == self.hollow else 1.0
        ends = sorted((self.only, self.only + step))
        return replace(self, hollow=ends[0], filled=ends[1], nats=-total)


def read_codes(image: Image, sites_px: Float, inner_px: float, outer_px: float, camera: Camera) -> Codes:
    """Sample the sectors of rods whose centres lie at (S, 2) px, image frame."""
    if not len(sites_px):
        return Codes(np.zeros((0, SECTORS, 3)), np.zeros((0, SECTORS), dtype=bool))
    smooth = cv2.GaussianBlur(image, (0, 0), 0.8).astype(np.float32)
    radii = [k * inner_px for k in INNER_SHARES] + [inner_px + k * (outer_px - inner_px) for k in ANNULUS_SHARES]
    points = _polar(sites_px, radii)
    value, inside = sample(smooth, points), _inside(points, camera)
    rings = len(INNER_SHARES)  # further out lies the annulus
    level = _annulus_level(value[:, rings:], inside[:, rings:])
    ratio = np.log((value[:, :rings] + OFFSET) / (level[:, None, None] + OFFSET))
    inside = inside[:, :rings]
    count = inside.sum(axis=1)
    mean = (ratio * inside[..., None]).sum(axis=1) / np.maximum(count, 1)[..., None]
    return Codes(mean, count >= 2)


def _polar(sites_px: Float, radii: list[float]) -> Float:
    """(S, R, SECTORS, 2), px: points around each site, counter-clockwise as seen with y up."""
    angle = 2 * np.pi * np.arange(SECTORS) / SECTORS
    ray = np.stack([np.cos(angle), -np.sin(angle)], axis=-1)
    return np.asarray(np.asarray(sites_px)[:, None, None] + np.asarray(radii)[:, None, None] * ray)


def _inside(points_px: Float, camera: Camera) -> Bool:
    u, v = points_px[..., 0], points_px[..., 1]
    return np.asarray((u >= 0) & (v >= 0) & (u <= camera.width_px - 1) & (v <= camera.height_px - 1))


def _annulus_level(reference: Float, inside: Bool) -> Float:
    """(S, 3): the median colour of each annulus; where too little of it is in view, the snapshot's."""
    flat, ok = reference.reshape(len(reference), -1, 3), inside.reshape(len(reference), -1)
    if not ok.any():
        return np.full((len(reference), 3), 128.0)
    count = ok.sum(axis=1)
    ranked = np.sort(np.where(ok[..., None], flat, np.inf), axis=1)  # what is out of view comes last
    rows = np.arange(len(flat))
    own = (ranked[rows, np.maximum(count - 1, 0) // 2] + ranked[rows, count // 2 * (count > 0)]) / 2
    enough = count >= SECTORS // 3
    return own if enough.all() else np.where(enough[:, None], own, median(flat[ok]))


def learn_palette(ratio: Float) -> Palette:
    """The palette of a session from (N, 3) log ratios of sectors in view.

    One cluster only: it is hollow where it looks like the annulus, filled where it does not; the other level is
    then a guess, and `two_levels` says so.
    """
    taught = len(ratio) // SECTORS
    if not taught:
        return replace(_one_level(np.zeros(3)), nats=0.0)  # nothing was looked at
    centre = np.median(ratio, axis=0)
    starts = np.linalg.svd(ratio - centre, full_matrices=False)[2]
    axis, (low, high, spread, two, _) = max((_parted(ratio, a) for a in starts), key=_how_well)
    if not two:
        typical = float(np.median(np.linalg.norm(ratio - centre, axis=1)))
        return replace(_one_level(centre), reach=max(LEVEL_REACH, LEVEL_SPREADS * typical), taught=taught)
    hollow, filled = (low, high) if _lower_is_hollow(ratio, axis, low, high) else (high, low)
    return Palette(axis, hollow, filled, max(0.02, spread / (high - low)), None, LIKENESS_NATS, taught=taught)


def _parted(ratio: Float, axis: Float) -> _Parting:
    """The best parting into two clusters that is found from one line on, by turning it to their discriminant."""
    axis = axis * (-np.sign(axis.sum()) or 1.0)  # towards darker
    best: _Parting = (axis, _two_means(ratio @ axis))
    for _ in range(DISCRIMINANT_ROUNDS):
        axis = _discriminant(ratio, best[0], *best[1][:2])
        found: _Parting = (axis, _two_means(ratio @ axis))
        if _how_well(found) <= _how_well(best):
            break
        best = found
    return best


def _how_well(parting: _Parting) -> tuple[bool, float]:
    """Whether there are two clusters, and how much of what varies they explain: how far apart they are in their own
    spreads, and how even their sizes. A stain, or a thing that lies on one rod, is far from all others, and small."""
    low, high, spread, two, upper = parting[1]
    return two, (high - low) / max(spread, 1e-9) * float(np.sqrt(upper * (1 - upper)))


def _discriminant(ratio: Float, axis: Float, low: float, high: float) -> Float:
    """The line on which two clusters lie furthest apart for their own spread.

    Where light wanders over the floor, most of what varies is brightness, and the filling may differ in hue.
    (R. A. Fisher, doi 10.1111/j.1469-1809.1936.tb02137.x.)
    """
    along = ratio @ axis
    step = high - low
    groups = [ratio[np.abs(along - level) < 0.4 * step] for level in (low, high)]
    if step <= 0 or min(len(g) for g in groups) < SECTORS:
        return axis
    centres = [np.median(g, axis=0) for g in groups]
    apart = centres[1] - centres[0]
    off = np.concatenate([g - c for g, c in zip(groups, centres, strict=True)])
    far = np.linalg.norm(off, axis=1)
    off = off[far <= np.percentile(far, 98)]
    within = off.T @ off / len(off) + LEAST_WITHIN**2 * np.eye(3)
    new = np.linalg.solve(within, apart)
    return np.asarray(new / np.linalg.norm(new))


def _lower_is_hollow(ratio: Float, axis: Float, low: float, high: float) -> bool:
    """Whether the brighter cluster is the hollow one: it lies nearer the annulus, or neither clearly does."""
    along = ratio @ axis
    middle = (low + high) / 2
    lower = np.linalg.norm(np.median(ratio[along < middle], axis=0))
    upper = np.linalg.norm(np.median(ratio[along >= middle], axis=0))
    return bool(lower < 1.3 * upper)


def _two_means(x: Float) -> tuple[float, float, float, bool, float]:
    """Two cluster centres on a line, their pooled spread, whether there really are two, and the upper one's share."""
    x, cut = np.sort(x), 0  # what is above `cut` is the upper cluster
    low, high = (float(v) for v in np.percentile(x, [0.3, 99.7]))
    for _ in range(12):
        cut = int(np.searchsorted(x, (low + high) / 2, side="right"))
        if cut in (0, len(x)):
            return low, high, 0.0, False, 0.0
        before, (low, high) = (low, high), (float(middle(x[:cut])), float(middle(x[cut:])))
        if (low, high) == before:
            break
    spread = 1.4826 * float(median(np.abs(x - np.repeat([low, high], [cut, len(x) - cut]))))
    few = min(cut, len(x) - cut) < SECTORS // 4
    enough = DIPPED_SEPARATION if _dipped(x, low, high) else LEAST_SEPARATION
    two = high - low > max(LEAST_STEP, enough * spread) and not few
    return low, high, spread, two, (len(x) - cut) / len(x)


def _dipped(x: Float, low: float, high: float) -> bool:
    """Whether there is less halfway between two levels than at either."""
    at = [int((np.abs(x - level) < 0.1 * (high - low)).sum()) for level in (low, (low + high) / 2, high)]
    return at[1] < DIP * min(at[0], at[2])


def _one_level(centre: Float) -> Palette:
    """One level at (3,), hollow where it is near the annulus; the other level is out of sight."""
    distance = float(np.linalg.norm(centre))
    nats = UNLIKE_NATS * float(np.log(UNLIKE / max(distance, 0.05)))
    dark = np.full(3, -1 / np.sqrt(3))
    if nats >= 0:
        level = float(centre @ dark)
        return Palette(dark, level, level + 1.0, 0.15, level, nats, centre)
    return Palette(centre / distance, 0.0, distance, 0.15, distance, -nats, centre)
