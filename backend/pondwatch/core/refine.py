"""A place to a pose: sub-pixel, against the one thing that is known without knowing the renderer: rods are round.

A snapshot's pose is fitted by Gauss-Newton to all pixels of its rods at once, as the profile of `appearance` shows
them, each rod with a gain, an offset and a slope of its own for the water's light (variable projection, doi
10.1137/0710036), weights robust against what drifts through the view. The covariance comes from the normal matrix and
from how much the rods of a snapshot disagree. Pixels are worked on in single precision, which costs under 1e-5 px;
what they add up to is solved in double.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .appearance import OTHER, Patches, Profile
from .values import Float, Float32

LEAST_GAIN = 0.5  # of the profile's contrast, under which a rod begins to count as absent
FLOOR_PX = 0.006  # of a pose: interpolation and rendering, below which no covariance is believed
STILL_PX, ARM_PX = 0.004, 80.0  # a step that moves no pixel further than this is the last; of half an image
COLUMNS = 7  # of the model


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


def fit(p: Patches, centres_px: Float, about_px: Float, profile: Profile, iterations: int = 3) -> Fit:
    """Move the rods' centres, as one rigid body, to where the pixels say.

    Args:
        centres_px: (K, 2), where the pose puts them. about_px: (2,), the centre of the turn.

    Returns:
        The motion to apply to the centres: shift (du, dv, px) and turn (rad, from u towards v).
    """
    if not p.parts:
        return Fit(np.zeros(3), np.diag([1e-6] * 3), 0.0, 1.0, 0.25, 0.0)  # no rod says anything
    arm, motion = centres_px - about_px, np.zeros(3)
    columns, weighted = np.empty((2, COLUMNS, len(p.value)), np.float32)
    down = np.ones(len(p.value), np.float32)
    for turn in range(iterations):
        r = design(p, _moved(arm, motion) + about_px, profile, columns)
        weight = _window(p, r, profile)
        compared = weight > 0
        weight *= down
        solved = _solve(p, columns, np.multiply(columns, weight, out=weighted), arm)
        variance = solved.variance(float(weight.sum()), int(np.count_nonzero(compared)))
        motion = motion + np.clip(solved.step, [-1.5, -1.5, -0.04], [1.5, 1.5, 0.04])
        if turn > 1 and np.abs(solved.step * [1, 1, ARM_PX]).max() < STILL_PX:
            break
        if turn + 1 < iterations:
            down = np.float32(1) / (1 + _left(p, columns, solved) ** 2 / np.float32(9 * max(variance, 1e-9)))
    rod_px = np.pi * profile.reach_px**2
    lacking = np.clip(1 - solved.light[:, 0] / LEAST_GAIN, 0, 1)
    counts = p.of_rods(compared)
    absent = float((counts * lacking).sum()) / rod_px
    whole = max(0.25, float(counts.sum()) / rod_px)
    return Fit(motion, solved.normal, variance, _disagreement(solved, variance), whole, absent)


def design(p: Patches, centres_px: Float, profile: Profile, columns: Float32) -> Float32:
    """Fill (COLUMNS, N), what the model has at each pixel: the profile, one, du, dv (the light's gain, offset and
    slope); the profile's derivative by the shift in u and in v (for a gain of one; a turn shifts each rod); and the
    pixel itself.

    Returns:
        (N,), how far the pixels lie from their rods' centres, px.
    """
    du, dv, r = p.off(centres_px)
    value, slope = profile.at(r, p.row)
    slope /= -r
    columns[0], columns[1], columns[2], columns[3], columns[6] = value, 1.0, du, dv, p.value
    np.multiply(slope, du, out=columns[4])
    np.multiply(slope, dv, out=columns[5])
    return r


@dataclass(frozen=True, slots=True, eq=False)
class _Solved:
    """step: (3,). light: (K, 4), of each rod. normal: (3, 3). Of each rod by its own shift: normals (K, 2, 2),
    gradients (K, 2), by_rod (K, 2), px, its part of the step. squares: of the residual, weighted."""

    step: Float
    light: Float
    normal: Float
    per_rod: Float
    gradients: Float
    by_rod: Float
    squares: float

    def variance(self, weight: float, count: int) -> float:
        """Of the residual, by the weights' sum and how many pixels were compared."""
        freedom = max(count - 4 * len(self.light) - 3, 1)
        return self.squares / max(weight, 1.0) * count / freedom


def _solve(p: Patches, columns: Float32, weighted: Float32, arm: Float) -> _Solved:
    """One Gauss-Newton step from the weighted products of the columns; the light is eliminated rod by rod (Schur)."""
    gram = np.array([weighted[:, part] @ columns[:, part].T for part in p.parts], np.float64)
    light_block = gram[:, :4, :4] + np.diag([1e-6] * 4)
    solution = np.linalg.solve(light_block, gram[:, :4, 4:])
    reduced = gram[:, 4:, 4:] - np.matmul(gram[:, :4, 4:].transpose(0, 2, 1), solution)
    light = solution[..., 2]
    gain = light[:, 0]
    per_rod = reduced[:, :2, :2] * (gain**2)[:, None, None]
    gradients = reduced[:, :2, 2] * gain[:, None]
    carried = np.zeros((len(arm), 2, 3))  # a rod's shift by the motion of the image
    carried[:, 0, 0] = carried[:, 1, 1] = 1
    carried[:, 0, 2], carried[:, 1, 2] = -arm[:, 1], arm[:, 0]
    back = carried.transpose(0, 2, 1)
    normal: Float = np.sum(back @ (per_rod @ carried), axis=0)
    normal = normal + np.diag(1e-6 * np.diag(normal) + 1e-6)
    step = np.linalg.solve(normal, np.sum(back @ gradients[..., None], axis=0)[:, 0])
    squares = float(reduced[:, 2, 2].sum())
    return _Solved(np.asarray(step), np.asarray(light), normal, per_rod, gradients, np.asarray(carried @ step), squares)


def _left(p: Patches, columns: Float32, solved: _Solved) -> Float32:
    """(N,): what the light and the step leave of the pixels."""
    taken = np.concatenate([solved.light, solved.light[:, :1] * solved.by_rod], axis=1).astype(np.float32)
    parts = zip(taken, p.parts, strict=True)
    return np.asarray(columns[6] - np.concatenate([of_rod @ columns[:6, part] for of_rod, part in parts]))


def _moved(arm: Float, motion: Float) -> Float:
    c, s = np.cos(motion[2]), np.sin(motion[2])
    return np.stack([c * arm[:, 0] - s * arm[:, 1], s * arm[:, 0] + c * arm[:, 1]], axis=1) + motion[:2]


def _window(p: Patches, r: Float32, profile: Profile) -> Float32:
    """(N,): 1 where a pixel, r px from its rod's centre, is compared; falls to 0 over the last two of the reach."""
    w = np.minimum(np.maximum((np.float32(profile.reach_px) - r) * np.float32(0.5), 0), 1)
    if (p.kind == OTHER).any():
        w[p.other & (r < profile.outside_px)] = 0
    return np.asarray(w)


def _disagreement(s: _Solved, variance: float) -> float:
    """Mean over rods of g' (variance H_k)^-1 g over its expectation of 2, g a rod's own gradients less what the common
    step takes off them: about 1 for white noise, more for a model that does not hold."""
    if len(s.gradients) < 2:
        return 1.0
    g = s.gradients - (s.per_rod @ s.by_rod[..., None])[..., 0]
    good = np.linalg.det(s.per_rod) > 1e-9
    if not good.any():
        return 1.0
    quad = (g[good] * np.linalg.solve(s.per_rod[good], g[good][..., None])[..., 0]).sum(axis=1)
    return float(np.mean(quad) / (2 * max(variance, 1e-12)) * len(g) / max(len(g) - 1, 1))
