"""What rods look like, learned from the pond's own snapshots: a profile along the radius.

A rod is round. What all rods of a pond show at a distance r from their centre is a profile T(r): one for hollow rods,
one for filled ones, the outside alone for partly filled ones. It is symmetric by construction, so the layout's centres,
not our first guesses, carry the absolute frame.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from scipy.linalg import eigh
from scipy.ndimage import gaussian_filter1d

from .values import Bool, Float, Float32, Int

BIN_PX = 0.5
HOLLOW, FILLED, OTHER = 0, 1, 2


@dataclass(frozen=True, slots=True, eq=False)
class Profile:
    """What rods look like along their radius.

    value: (2, B), at radii k BIN_PX, for hollow and filled rods. outside_px: rods of neither kind are compared beyond
    it only, where the two agree. reach_px: compared up to here. axis: (3,), the weights of the colour channels.
    table: (4, 2 B): value, its step to the next radius, slope and its step, hollow rods before filled ones.
    """

    value: Float
    outside_px: float
    reach_px: float
    axis: Float
    table: Float32

    @classmethod
    def of(cls, value: Float, inner_px: float, reach_px: float, axis: Float) -> Profile:
        """With the slope by central differences, and the radius from which hollow and filled rods look the same."""
        contrast = float(np.ptp(value)) + 1e-9
        radii = np.arange(value.shape[1]) * BIN_PX
        apart = (np.abs(value[0] - value[1]) > 0.06 * contrast) & (radii < reach_px - 3)
        outside = float(radii[apart].max(initial=0.0)) + 1.0
        return cls(value, max(outside, 1.15 * inner_px), reach_px, axis, _table(value))

    def blurred(self, sigma_px: float) -> Profile:
        """The same seen out of focus, for a first fit from afar."""
        value = gaussian_filter1d(self.value, sigma_px / BIN_PX, axis=1, mode="nearest")
        return replace(self, value=value, table=_table(value))

    def at(self, r_px: Float32, row: Int) -> tuple[Float32, Float32]:
        """Value and slope at radii (N,) from the centres of rods that follow a row (N,) of `value`."""
        bins = self.value.shape[1]
        x = np.minimum(r_px * np.float32(1 / BIN_PX), np.float32(bins - 1.001))
        k = x.astype(np.intp)
        f = x - k.astype(np.float32)
        k += row * bins
        value, value_step, slope, slope_step = self.table
        return value[k] + f * value_step[k], slope[k] + f * slope_step[k]


def _table(value: Float) -> Float32:
    slope = np.gradient(value, BIN_PX, axis=1)
    steps = (np.diff(t, axis=1, append=0.0) for t in (value, slope))
    value_step, slope_step = steps
    return np.stack([t.reshape(-1) for t in (value, value_step, slope, slope_step)]).astype(np.float32)


@dataclass(frozen=True, slots=True, eq=False)
class Patches:
    """The pixels of a snapshot around K rods, one rod's after the other's.

    value: (N,), grey levels from `level`, the mean of all. u, v: (N,), px. kind: (K,). parts: where each rod's pixels
    are. rod: (N,), which rod's a pixel is. row: (N,), of the profile that its rod follows. other: (N,), whether it
    follows neither.
    """

    value: Float32
    level: float
    u: Float32
    v: Float32
    kind: Int
    parts: Sequence[slice]
    rod: Int
    row: Int
    other: Bool

    def of_rods(self, per_pixel: Float | Float32 | Bool) -> Float:
        """(K,): the sums over each rod's pixels."""
        return np.asarray(np.bincount(self.rod, per_pixel, len(self.kind)), np.float64)

    def off(self, centres_px: Float) -> tuple[Float32, Float32, Float32]:
        """(N,) each, px: from their rods' centres (K, 2) to the pixels, across, down, and how far."""
        du, dv = self.u.copy(), self.v.copy()
        for part, (u, v) in zip(self.parts, centres_px.tolist(), strict=True):  # cheaper than a centre for each pixel
            du[part] -= u
            dv[part] -= v
        return du, dv, np.sqrt(du * du + dv * dv) + np.float32(1e-6)


def cut(grey: Float32, centres_px: Float, kind: Int, reach_px: float) -> Patches:
    """The pixels of an image (H, W) within reach of (K, 2) rod centres."""
    du, dv = _disc(reach_px)
    base = np.round(centres_px).astype(np.int64)
    u, v = base[:, :1] + du, base[:, 1:] + dv
    h, w = grey.shape
    inside = (u >= 0) & (v >= 0) & (u < w) & (v < h)
    counts = np.count_nonzero(inside, axis=1)
    ends = np.cumsum(counts).tolist()
    parts = [slice(end - count, end) for end, count in zip(ends, counts.tolist(), strict=True)]
    rod = np.repeat(np.arange(len(kind)), counts)
    u, v = u[inside], v[inside]
    value = grey[v, u]
    level = np.float32(value.mean() if len(value) else 0)
    row, other = (np.repeat(per_rod, counts) for per_rod in (np.minimum(kind, FILLED), kind == OTHER))
    at = u.astype(np.float32), v.astype(np.float32)
    return Patches(value - level, float(level), *at, kind, parts, rod, row, other)


@lru_cache(maxsize=8)
def _disc(reach_px: float) -> tuple[Int, Int]:
    """The pixels around one, across and down, that a centre up to half a pixel from it may reach."""
    r = int(np.ceil(reach_px)) + 1
    dv, du = np.mgrid[-r : r + 1, -r : r + 1].reshape(2, -1)
    near = np.hypot(du, dv) <= reach_px + 0.8
    return du[near], dv[near]


def learn_profile(
    patches: list[tuple[Patches, Float]], inner_px: float, reach_px: float, axis: Float, before: Profile | None = None
) -> Profile:
    """The radial profile of a session's rods.

    Args:
        patches: of each snapshot, with the centres (K, 2), px, where its pose puts the rods.
        before: an earlier profile, to take out each rod's gain and offset with.
    """
    bins = int(np.ceil(reach_px / BIN_PX)) + 3
    total, weight = np.zeros((3, bins)), np.zeros((3, bins))
    for p, centres in patches:
        r = p.off(centres)[2]
        ok = r <= reach_px
        level = _levelled(p, r, ok, before)[ok]
        x = r[ok] / BIN_PX
        k = x.astype(np.int64)
        f = x - k
        k += p.kind[p.rod[ok]] * bins
        for cell, share in ((k, 1 - f), (k + 1, f)):
            total += np.bincount(cell, share * level, 3 * bins).reshape(3, bins)
            weight += np.bincount(cell, share, 3 * bins).reshape(3, bins)
    outer = np.arange(bins) * BIN_PX > 1.15 * inner_px
    shared = total.sum(axis=0) / np.maximum(weight.sum(axis=0), 1e-9)
    value = np.where(weight[:2] > 3, total[:2] / np.maximum(weight[:2], 1e-9), shared)
    value = np.where(outer & (weight[:2] < 30), shared, value)
    return Profile.of(value, inner_px, reach_px, axis)


def _levelled(p: Patches, r: Float32, ok: Bool, before: Profile | None) -> Float:
    """Pixel values with each rod's gain and offset taken out, by the profile as it was; as they are without one."""
    if before is None:
        return p.value.astype(np.float64) + p.level
    t, _ = before.at(r, p.row)
    w = (ok & ~(p.other & (r <= before.outside_px))).astype(np.float32)
    n = np.maximum(p.of_rods(w), 1)
    mean, mean_t = p.of_rods(w * p.value) / n, p.of_rods(w * t) / n
    off, off_t = p.value - mean[p.rod], t - mean_t[p.rod]
    gain = p.of_rods(w * off * off_t) / np.maximum(p.of_rods(w * off_t**2), 1e-9)
    gain = np.where(gain > 0.05, gain, 1.0)
    return np.asarray(off / gain[p.rod] + mean_t[p.rod])


def contrast_axis(samples: list[tuple[Float, Float]]) -> Float:
    """The weights of the colour channels that show rods best against everything else (Fisher's discriminant).

    What differs from ring to ring is signal; what differs within a ring, light that wanders over the floor above all,
    is noise. In water that flickers in brightness this finds the contrast of hue.

    Args:
        samples: of each snapshot, pixels (N, 3), each rod's mean taken out, and their radii (N,), px.

    Returns:
        (3,), of unit length.
    """
    pixels = np.concatenate([p for p, _ in samples])
    ring = np.concatenate([r for _, r in samples]).astype(np.int64)
    count = np.bincount(ring)
    means = np.stack([np.bincount(ring, pixels[:, k]) for k in range(3)], axis=1) / np.maximum(count, 1)[:, None]
    steps = np.diff(means[count > 30], axis=0)
    within = pixels - means[ring]
    noise = within.T @ within / max(len(pixels), 1) + np.eye(3)
    values, vectors = eigh(steps.T @ steps, noise)
    axis = vectors[:, int(np.argmax(values))]
    return np.asarray(axis / np.linalg.norm(axis) * (np.sign(axis.sum()) or 1.0))
