"""Where rods lie in a finished mosaic: the centre of every rod's ring, measured in the picture itself.

Two mosaics of one pond are registered as well as their rings coincide; the difference of what is measured here, rod by
rod, is the residual between them. Nothing of a picture's colours is taken for known: two inspections may differ in
light and water. The inside of a rod, where a fill may be new, is left out.

Two steps. The point that all edges of a ring face is near its centre (Parthasarathy, "Rapid, accurate particle tracking
by calculation of radial symmetry centers", doi:10.1038/nmeth.2071). From there, or from where the layout says,
whichever explains it better, the ring is fitted by what a ring of this mosaic looks like on average, with a light that
may slope and a contrast of its own: least squares, reweighted so that what drifts through loses its say. Every ring
comes with its own sigma; where the average ring explains less than half of what is seen there is none.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from .frames import pond_to_raster
from .values import Bool, Float, Float32, Image, Int, Pond

_CHUNK = 128  # rods looked at together: bounds the memory at some tens of megabytes
_ROUNDS = 4
_SMOOTH_PX = 1.0
_BIN_PX = 0.5
_LEAST_SEEN = 0.6  # share of the ring's pixels
_LEAST_EXPLAINED = 0.5  # of what is seen there, light apart: less, and it is no ring
_MOST_SIGMA_PX = 1.0  # along one axis: beyond it an edge is no longer straight
_LEAST_SIGMA_PX = 0.02  # along one axis: no ring is measured better
_MOST_STEP_PX = 1.0
_NEAR_PX = 0.5  # closer than this the layout's own place is start enough
_LEAST_NOISE, _LEAST_CONTRAST = 0.3, 0.05  # of brightness; of the average ring's
_CORRELATED = 3.0  # neighbouring pixels err together: they were smoothed, and mosaics blend whole snapshots
_INSIDE, _OUTSIDE = 0.2, 1.15  # of the way from the inner radius to the outer one; of the outer radius


@dataclass(frozen=True, slots=True, eq=False)
class _Patches:
    """Rings of K rods, all P x P px. right, down: (K, 1, P) and (K, P, 1), px from where the layout puts the centre.
    near, far: (K,), px: between them is ring."""

    image: Float32  # (K, P, P, 3)
    seen: Bool
    right: Float32
    down: Float32
    near: Float
    far: Float

    def of(self, which: Int) -> _Patches:
        """Some of them."""
        return _Patches(
            self.image[which],
            self.seen[which],
            self.right[which],
            self.down[which],
            self.near[which],
            self.far[which],
        )

    def ring(self, centre: Float) -> tuple[Float32, Float32, Float32, Bool]:
        """Offsets and distances from (K, 2) centres, (K, P, P) each, and which pixels are ring and seen."""
        x = self.right - centre[:, :1, None].astype(np.float32)
        y = self.down - centre[:, 1:, None].astype(np.float32)
        r = np.hypot(x, y)
        inside = (r > self.near[:, None, None]) & (r < self.far[:, None, None])
        return np.broadcast_to(x, r.shape), np.broadcast_to(y, r.shape), r, inside & self.seen


def ring_offsets(bgra: Image, pond: Pond, metres_per_pixel: float) -> Float:
    """How far the picture of every rod lies from where the layout says.

    Args:
        bgra: (h, w, 4), 8 bits, a mosaic of the whole pond; alpha 0 where nothing was seen.

    Returns:
        (R, 3), m, pond frame, in the layout's order: the offset, and one standard deviation of it along x and along y;
        NaN where the ring was not seen, or no ring is to be seen there. How well a ring must be known is for those to
        say who compare.
    """
    places = np.array([(r.x_m, r.y_m) for r in pond.rods]).reshape(-1, 2)
    centres = pond_to_raster(places, pond, metres_per_pixel)
    radii = np.array([(r.inner_radius_m, r.outer_radius_m) for r in pond.rods]).reshape(-1, 2) / metres_per_pixel
    parts = [slice(start, start + _CHUNK) for start in range(0, len(centres), _CHUNK)]
    cut = [_cut(bgra, centres[part], radii[part]) for part in parts]
    coarse = [_faced(patches) for patches in cut]
    look = _look(cut, coarse)
    if look is None:
        return np.full((len(centres), 3), np.nan)
    found = np.concatenate([_fitted(p, c, *look) for p, c in zip(cut, coarse, strict=True)])
    return np.asarray(found * [metres_per_pixel, -metres_per_pixel, metres_per_pixel])


def _cut(bgra: Image, centres: Float, radii: Float) -> _Patches:
    reach = int(np.ceil(_OUTSIDE * radii[:, 1].max())) + 3
    corner = np.round(centres).astype(np.int64)
    size = (2 * reach + 1, 2 * reach + 1)
    patches = np.stack([_patch(bgra, x - reach, y - reach, size) for x, y in corner.tolist()])
    steps = np.arange(-reach, reach + 1)
    right = (steps + (corner - centres)[:, :1]).astype(np.float32)[:, None, :]
    down = (steps + (corner - centres)[:, 1:]).astype(np.float32)[:, :, None]
    near = radii[:, 0] + _INSIDE * (radii[:, 1] - radii[:, 0])
    return _Patches(patches[..., :3], patches[..., 3] == 255, right, down, near, _OUTSIDE * radii[:, 1])


def _patch(bgra: Image, x: int, y: int, size: tuple[int, int]) -> Float32:
    """(P, P, 4): a part of the mosaic, smoothed; the last plane 255 where it and its neighbours were seen."""
    height, width = bgra.shape[:2]
    x0, y0, x1, y1 = max(0, x), max(0, y), min(width, x + size[0]), min(height, y + size[1])
    out = np.zeros((size[1], size[0], 4), np.float32)
    if x0 < x1 and y0 < y1:
        part = bgra[y0:y1, x0:x1].astype(np.float32)
        part[..., 3] = cv2.erode(part[..., 3], np.ones((5, 5), np.uint8), borderType=cv2.BORDER_REPLICATE)
        part[..., :3] = cv2.GaussianBlur(part[..., :3], (0, 0), _SMOOTH_PX)
        out[y0 - y : y1 - y, x0 - x : x1 - x] = part
    return out


def _faced(patches: _Patches) -> Float:
    """(K, 2), px: where the lines along the gradients of each ring meet; 0 where they do not."""
    centre = np.zeros((len(patches.image), 2))
    x, y, _, ring = patches.ring(centre)
    xx, yy, xy = (np.where(ring, m, np.float32(0)) for m in _faces(patches.image))
    strength = np.maximum(xx + yy, np.float32(1e-9))
    say = np.ones_like(xx)
    for _ in range(_ROUNDS):
        a, b, c = (np.einsum("kij,kij->k", say, m, dtype=np.float64) for m in (xx, yy, xy))
        p = np.einsum("kij,kij->k", say, xx * x + xy * y, dtype=np.float64)
        q = np.einsum("kij,kij->k", say, xy * x + yy * y, dtype=np.float64)
        det = a * b - c * c
        clear = det > 1e-3 * np.maximum(a + b, 1e-9) ** 2
        found = np.stack([b * p - c * q, a * q - c * p], axis=1) / np.where(clear, det, 1.0)[:, None]
        centre = np.where(clear[:, None], found, 0.0)
        dx, dy, _, _ = patches.ring(centre)
        square = (xx * dx * dx + 2 * xy * dx * dy + yy * dy * dy) / strength
        say = 1 / (1 + square * square)
    return centre


def _faces(image: Float32) -> tuple[Float32, Float32, Float32]:
    """(K, P, P) each: the sums over colours of the outer product of every pixel's edge direction, xx, yy and xy."""
    gx, gy = np.zeros_like(image), np.zeros_like(image)
    gx[:, :, 1:-1] = image[:, :, 2:] - image[:, :, :-2]
    gy[:, 1:-1] = image[:, 2:] - image[:, :-2]
    return (gy * gy).sum(axis=-1), (gx * gx).sum(axis=-1), -(gx * gy).sum(axis=-1)


def _look(cut: list[_Patches], coarse: list[Float]) -> tuple[Float, Float] | None:
    """What a ring of this mosaic looks like: (B,) brightness by distance in bins of `_BIN_PX`, and (3,), the mix of
    colours in which it shows best; None where no ring was seen."""
    parts = []
    for patches, centre in zip(cut, coarse, strict=True):
        near = np.hypot(*centre.T) < 0.5 * (patches.far - patches.near)
        _, _, r, ring = patches.ring(np.where(near[:, None], centre, 0.0))
        parts.append((np.floor(r[ring] / _BIN_PX).astype(np.int64), patches.image[ring]))
    bins, colours = (np.concatenate([p[k] for p in parts]) for k in (0, 1)) if parts else (np.zeros(0, int), None)
    if colours is None or not len(bins):
        return None
    count = np.bincount(bins)
    sums = np.stack([np.bincount(bins, colours[:, k]) for k in range(3)], axis=1)
    known = np.flatnonzero(count)
    mean = sums[known] / count[known, None]
    mix = np.linalg.svd(mean - mean.mean(axis=0))[2][0]
    return np.interp(np.arange(len(count)), known, mean @ mix), mix


@dataclass(frozen=True, slots=True, eq=False)
class _Fits:
    """Centres (K, 2), px from where the layout puts them, one sigma of them along an axis (K,), and the share of what
    is seen there, light apart, that a ring explains (K,)."""

    centre: Float
    sigma: Float
    explained: Float


def _fitted(patches: _Patches, coarse: Float, profile: Float, mix: Float) -> Float:
    """(K, 3), px: the rings' centres from where the layout puts them, and their sigma; NaN where there is none."""
    image = np.asarray(patches.image @ mix.astype(np.float32))
    fits = _fit(patches, image, np.zeros_like(coarse), profile)
    far = np.flatnonzero(np.hypot(*coarse.T) > _NEAR_PX)
    if len(far):
        other = _fit(patches.of(far), image[far], coarse[far], profile)
        better = other.explained > fits.explained[far]
        for mine, theirs in ((fits.centre, other.centre), (fits.sigma, other.sigma), (fits.explained, other.explained)):
            mine[far[better]] = theirs[better]
    _, _, r, ring = patches.ring(fits.centre)
    whole = ((r > patches.near[:, None, None]) & (r < patches.far[:, None, None])).sum(axis=(1, 2))
    good = (fits.sigma < _MOST_SIGMA_PX) & (fits.explained > _LEAST_EXPLAINED)
    good &= ring.sum(axis=(1, 2)) >= _LEAST_SEEN * whole
    found = np.column_stack([fits.centre, np.maximum(fits.sigma, _LEAST_SIGMA_PX)])
    return np.where(good[:, None], found, np.nan)


def _fit(patches: _Patches, image: Float32, start: Float, profile: Float) -> _Fits:
    """Gauss-Newton on the average ring."""
    at, slope = (np.arange(len(profile)) + 0.5) * _BIN_PX, np.gradient(profile, _BIN_PX)
    centre, sigma, explained = start.copy(), np.full(len(start), np.inf), np.zeros(len(start))
    flat = image.reshape(len(image), -1, 1)
    say = np.ones_like(flat)
    for _ in range(_ROUNDS):
        *planes, ring = patches.ring(centre)
        x, y, r = (plane.reshape(flat.shape) for plane in planes)
        basis = _basis(x, y, r, np.interp(r, at, profile), np.interp(r, at, slope))
        heard = say * ring.reshape(flat.shape)
        weighted = (heard * basis).transpose(0, 2, 1)
        normal = np.asarray(weighted @ basis, np.float64) + 1e-6 * np.eye(6)
        answer = np.linalg.solve(normal, np.asarray(weighted @ flat, np.float64))
        off = flat - basis @ answer.astype(np.float32)
        left = (heard * off * off).sum(axis=(1, 2), dtype=np.float64)
        spread = np.maximum(np.sqrt(left / np.maximum(heard.sum(axis=(1, 2)), 1)), _LEAST_NOISE)
        contrast = np.where(answer[:, 0, 0] > _LEAST_CONTRAST, answer[:, 0, 0], np.inf)
        own = np.diagonal(np.linalg.inv(normal), axis1=1, axis2=2)[:, :3]
        variance = own[:, 1:].mean(axis=1) * spread**2
        sigma = np.where(np.isfinite(contrast), _CORRELATED * np.sqrt(np.maximum(variance, 0)) / contrast, np.inf)
        gained = np.maximum(answer[:, 0, 0], 0) ** 2 / own[:, 0]
        explained = gained / np.maximum(gained + left, 1e-9)
        centre = centre + np.clip(answer[:, 1:3, 0] / contrast[:, None], -_MOST_STEP_PX, _MOST_STEP_PX)
        say = 1 / (1 + np.square(off / (3 * spread[:, None, None]).astype(np.float32)))
    return _Fits(centre, sigma, explained)


def _basis(x: Float32, y: Float32, r: Float32, level: Float, slope: Float) -> Float32:
    """(K, N, 6): the average ring, what it does when its centre moves right and down, and a light that slopes."""
    steep = slope / np.maximum(r, 1e-6)
    columns = (level, -steep * x, -steep * y, np.ones_like(r), x, y)
    return np.concatenate([np.asarray(column, np.float32) for column in columns], axis=2)
