"""A place to a pose: sub-pixel, against the one thing that is known without knowing the renderer.

A rod is round. What all rods of a pond show at a distance r from their centre is a profile T(r), learned from the
pond's own snapshots (one for hollow rods, one for filled ones, the outside alone for partly filled ones). It is
symmetric by construction, so the layout's centres, not our first guesses, carry the absolute frame. A snapshot's
pose is then fitted by Gauss-Newton to all pixels of its rods at once, each rod with a gain, an offset and a slope of
its own for the water's light (variable projection, doi 10.1137/0710036), weights robust against what drifts through
the view. The covariance comes from the normal matrix and from how much the rods of a snapshot disagree.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import eigh
from scipy.ndimage import gaussian_filter1d

from .values import Bool, Float, Float32, Int

BIN_PX = 0.5
LEAST_GAIN = 0.5  # of the profile's contrast, under which a rod begins to count as absent
FLOOR_PX = 0.006  # of a pose: interpolation and rendering, below which no covariance is believed
HOLLOW, FILLED, OTHER = 0, 1, 2


@dataclass(frozen=True, slots=True, eq=False)
class Profile:
    """What rods look like along their radius.

    value: (2, B), at radii k BIN_PX, for hollow and filled rods. outside_px: rods of neither kind are compared beyond
    it only, where the two agree. reach_px: compared up to here. axis: (3,), the weights of the colour channels.
    """

    value: Float
    slope: Float
    outside_px: float
    reach_px: float
    axis: Float

    @classmethod
    def of(cls, value: Float, inner_px: float, reach_px: float, axis: Float) -> Profile:
        """With the slope by central differences, and the radius from which hollow and filled rods look the same."""
        contrast = float(np.ptp(value)) + 1e-9
        radii = np.arange(value.shape[1]) * BIN_PX
        apart = (np.abs(value[0] - value[1]) > 0.06 * contrast) & (radii < reach_px - 3)
        outside = float(radii[apart].max(initial=0.0)) + 1.0
        return cls(value, np.gradient(value, BIN_PX, axis=1), max(outside, 1.15 * inner_px), reach_px, axis)

    def blurred(self, sigma_px: float) -> Profile:
        """The same seen out of focus, for a first fit from afar."""
        value = gaussian_filter1d(self.value, sigma_px / BIN_PX, axis=1, mode="nearest")
        return replace(self, value=value, slope=np.gradient(value, BIN_PX, axis=1))

    def at(self, r_px: Float, kind: Int) -> tuple[Float, Float]:
        """Value and slope at radii (K, P) for rods of kinds (K,)."""
        bins = self.value.shape[1]
        x = np.clip(r_px / BIN_PX, 0, bins - 1.001)
        k = x.astype(np.int64)
        f = x - k
        k += np.minimum(kind, 1)[:, None] * bins
        value, slope = (
            table.reshape(-1)[k] + f * np.diff(table, axis=1, append=0.0).reshape(-1)[k]
            for table in (self.value, self.slope)
        )
        return value, slope


@dataclass(frozen=True, slots=True, eq=False)
class Patches:
    """The pixels around K rods of a snapshot. value: (K, P). u, v: (K, P), px. inside: (K, P)."""

    value: Float
    u: Float
    v: Float
    inside: Bool
    kind: Int


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """pose: (3,): centre u, v offset px and angle rad, as a motion of the image. normal: (3, 3), per unit variance.
    variance: of the residual. disagreement: how much the rods' own gradients exceed what white noise gives. whole: how
    many rods' worth of pixels were compared. absent: how many of these show no rod: their gain is next to none."""

    shift: Float
    normal: Float
    variance: float
    disagreement: float
    whole: float
    absent: float


def cut(grey: Float32, centres_px: Float, kind: Int, reach_px: float) -> Patches:
    """The pixels within reach of (K, 2) rod centres."""
    r = int(np.ceil(reach_px)) + 1
    dv, du = np.mgrid[-r : r + 1, -r : r + 1].reshape(2, -1)
    disc = np.hypot(du, dv) <= reach_px + 0.8
    base = np.round(centres_px).astype(np.int64)
    u, v = base[:, :1] + du[disc], base[:, 1:] + dv[disc]
    h, w = grey.shape
    inside = (u >= 0) & (v >= 0) & (u < w) & (v < h)
    value = grey[np.clip(v, 0, h - 1), np.clip(u, 0, w - 1)].astype(np.float64)
    return Patches(value, u.astype(np.float64), v.astype(np.float64), inside, kind)


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
        r = np.hypot(p.u - centres[:, :1], p.v - centres[:, 1:])
        ok = p.inside & (r <= reach_px)
        level = _levelled(p, r, ok, before)
        x = r[ok] / BIN_PX
        k = x.astype(np.int64)
        f = x - k
        row = np.broadcast_to(p.kind[:, None], r.shape)[ok] * bins
        for cell, share in ((k, 1 - f), (k + 1, f)):
            total += np.bincount(row + cell, share * level[ok], 3 * bins).reshape(3, bins)
            weight += np.bincount(row + cell, share, 3 * bins).reshape(3, bins)
    outer = np.arange(bins) * BIN_PX > 1.15 * inner_px
    shared = total.sum(axis=0) / np.maximum(weight.sum(axis=0), 1e-9)
    value = np.where(weight[:2] > 3, total[:2] / np.maximum(weight[:2], 1e-9), shared)
    value = np.where(outer & (weight[:2] < 30), shared, value)
    return Profile.of(value, inner_px, reach_px, axis)


def _levelled(p: Patches, r: Float, ok: Bool, before: Profile | None) -> Float:
    """Pixel values with each rod's gain and offset taken out, by the profile as it was, else by mean and spread."""
    w = ok.astype(np.float64)
    n = np.maximum(w.sum(axis=1, keepdims=True), 1)
    mean = (w * p.value).sum(axis=1, keepdims=True) / n
    if before is None:
        return p.value
    t, _ = before.at(r, p.kind)
    w = w * ((p.kind != OTHER)[:, None] | (r > before.outside_px))
    n = np.maximum(w.sum(axis=1, keepdims=True), 1)
    mean = (w * p.value).sum(axis=1, keepdims=True) / n
    mean_t = (w * t).sum(axis=1, keepdims=True) / n
    spread = (w * (t - mean_t) ** 2).sum(axis=1, keepdims=True)
    gain = (w * (p.value - mean) * (t - mean_t)).sum(axis=1, keepdims=True) / np.maximum(spread, 1e-9)
    gain = np.where(gain > 0.05, gain, 1.0)
    return np.asarray((p.value - mean) / gain + mean_t)


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


def fit(p: Patches, centres_px: Float, about_px: Float, profile: Profile, iterations: int = 3) -> Fit:
    """Move the rods' centres, as one rigid body, to where the pixels say.

    Args:
        centres_px: (K, 2), where the pose puts them. about_px: (2,), the centre of the turn.

    Returns:
        The motion to apply to the centres: shift (du, dv, px) and turn (rad, from u towards v).
    """
    motion, down = np.zeros(3), np.ones(p.value.shape)
    arm = centres_px - about_px
    for _ in range(iterations):
        moved = _moved(arm, motion) + about_px
        columns, r = design(p, moved, about_px, profile)
        weight = _window(p, r, profile)
        count = int(np.count_nonzero(weight))
        solved = _solve(columns, weight * down, count)
        motion = motion + np.clip(solved.step, [-1.5, -1.5, -0.04], [1.5, 1.5, 0.04])
        taken = np.concatenate([solved.light, solved.light[:, :1] * solved.step], axis=1)  # light and step of each rod
        residual = columns[:, 7] - np.matmul(taken[:, None], columns[:, :7])[:, 0]
        down = 1 / (1 + residual**2 / (9 * max(solved.variance, 1e-9)))
    disagreement = _disagreement(solved.gradients, solved.per_rod, solved.normal, solved.variance)
    rod_px = np.pi * profile.reach_px**2
    lacking = np.clip(1 - solved.light[:, 0] / LEAST_GAIN, 0, 1)
    absent = float((np.count_nonzero(weight, axis=1) * lacking).sum()) / rod_px
    return Fit(motion, solved.normal, solved.variance, disagreement, max(0.25, count / rod_px), absent)


def design(p: Patches, centres_px: Float, about_px: Float, profile: Profile) -> tuple[Float, Float]:
    """(K, 8, P), the columns of the model at each pixel: profile, one, du, dv (the light's gain, offset and slope);
    the profile's derivative by the shift in u, in v, and by the turn (for a gain of one); and the pixel itself.
    And how far (K, P) the pixels lie from their rods' centres, px."""
    du, dv = p.u - centres_px[:, :1], p.v - centres_px[:, 1:]
    r = np.sqrt(du * du + dv * dv) + 1e-6
    value, slope = profile.at(r, p.kind)
    slope /= r
    arm = centres_px - about_px
    out = np.empty((len(r), 8, r.shape[1]))
    out[:, 0], out[:, 1], out[:, 2], out[:, 3] = value, 1.0, du, dv
    out[:, 4], out[:, 5] = -slope * du, -slope * dv
    out[:, 6] = out[:, 5] * arm[:, :1] - out[:, 4] * arm[:, 1:]
    out[:, 7] = p.value
    return out, r


@dataclass(frozen=True, slots=True, eq=False)
class _Solved:
    step: Float
    light: Float
    normal: Float
    gradients: Float
    per_rod: Float
    variance: float


def _solve(columns: Float, weight: Float, count: int) -> _Solved:
    """One Gauss-Newton step from the weighted products of the columns; the light is eliminated rod by rod (Schur)."""
    gram = np.matmul(columns * weight[:, None], columns.transpose(0, 2, 1))
    light_block = gram[:, :4, :4] + np.diag([1e-6] * 4)
    solution = np.linalg.solve(light_block, gram[:, :4, 4:])
    reduced = gram[:, 4:, 4:] - np.matmul(gram[:, :4, 4:].transpose(0, 2, 1), solution)
    light = solution[..., 3]
    gain = light[:, 0]
    per_rod = reduced[:, :3, :3] * (gain**2)[:, None, None]
    gradients = reduced[:, :3, 3] * gain[:, None]
    normal = per_rod.sum(axis=0)
    normal = normal + np.diag(1e-6 * np.diag(normal) + 1e-6)
    freedom = max(count - 4 * len(gain) - 3, 1)
    variance = float(reduced[:, 3, 3].sum() / max(float(weight.sum()), 1.0) * count / freedom)
    return _Solved(np.linalg.solve(normal, gradients.sum(axis=0)), light, normal, gradients, per_rod, variance)


def _moved(arm: Float, motion: Float) -> Float:
    c, s = np.cos(motion[2]), np.sin(motion[2])
    return np.stack([c * arm[:, 0] - s * arm[:, 1], s * arm[:, 0] + c * arm[:, 1]], axis=1) + motion[:2]


def _window(p: Patches, r: Float, profile: Profile) -> Float:
    """(K, P): 1 where a pixel, r px from its rod's centre, is compared; falls to 0 over the last two of the reach."""
    w = np.clip((profile.reach_px - r) / 2, 0, 1) * p.inside
    inner = (p.kind == OTHER)[:, None] & (r < profile.outside_px)
    return np.where(inner, 0.0, w)


def _disagreement(gradients: Float, per_rod: Float, normal: Float, variance: float) -> float:
    """Mean over rods of g' (variance H_k)^-1 g over its expectation of 2: about 1 for white noise, more for a model
    that does not hold. Of a round rod alone a turn is a shift, so its gradients by the shift say all."""
    if len(gradients) < 2:
        return 1.0
    step = np.linalg.solve(normal, gradients.sum(axis=0))
    g = (gradients - per_rod @ step)[:, :2]
    per_rod = per_rod[:, :2, :2]
    good = np.linalg.det(per_rod) > 1e-9
    if not good.any():
        return 1.0
    quad = np.einsum("ki,kij,kj->k", g[good], np.linalg.inv(per_rod[good]), g[good])
    return float(np.mean(quad) / (2 * max(variance, 1e-12)) * len(g) / max(len(g) - 1, 1))
