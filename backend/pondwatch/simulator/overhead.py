"""The localisation over the pond: it says where a robot was, and is wrong in one of several ways."""

from __future__ import annotations

import numpy as np

from pondwatch.core.frames import wrap_angle
from pondwatch.core.values import Float, Int, PoseNoise

from .spec import SimulationSpec

_MEMORY = 20  # snapshots of one robot after which a drift has forgotten itself by 1/e


def sigmas(spec: SimulationSpec) -> Float:
    """(3,), m, m, rad: one standard deviation of the noise."""
    xy = spec.noise_pitch * spec.pitch_m
    return np.array([xy, xy, spec.noise_theta_rad])


def claimed_noise(spec: SimulationSpec) -> PoseNoise | None:
    """What it says of itself; None where it says nothing."""
    xy, _, theta = sigmas(spec) * spec.claim
    theta = theta if spec.heading_known else np.pi / np.sqrt(3)
    return PoseNoise(float(f"{xy:.6g}"), float(f"{theta:.6g}")) if spec.claim else None


def noisy_poses(truth: Float, robots: Int, spec: SimulationSpec, rng: np.random.Generator) -> Float:
    """(N, 3), m, m, rad: the poses as the localisation gives them, of (N, 3) true ones."""
    error = rng.standard_normal(truth.shape)
    if spec.noise == "drift":
        for robot in np.unique(robots):
            error[robots == robot] = _drift(error[robots == robot])
    poses = truth + error * sigmas(spec)
    lost = rng.random(len(truth)) < spec.outliers
    width, height = spec.pond_size_m
    poses[lost] = rng.uniform((0, 0, -np.pi), (width, height, np.pi), (int(lost.sum()), 3))
    if not spec.heading_known:
        poses[:, 2] = rng.uniform(-np.pi, np.pi, len(truth))
    poses[:, 2] = wrap_angle(poses[:, 2])
    return poses


def _drift(white: Float) -> Float:
    """A random walk held near zero (Ornstein-Uhlenbeck), deviation 1, of white noise (n, 3)."""
    keep = np.exp(-1 / _MEMORY)
    out = white.copy()
    for n in range(1, len(out)):
        out[n] = keep * out[n - 1] + np.sqrt(1 - keep**2) * white[n]
    return out
