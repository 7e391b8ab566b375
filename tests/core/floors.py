"""Floors that nobody mapped, by seed, and swarms that photograph them: what the tests of the method `graph` run on.

Drawn by OpenCV on a raster of one camera pixel and sampled by bicubic interpolation; shares no code with the core's
registration or frames, so that it can judge them.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from pondwatch.core.values import Camera, Float, Float32, Inspection, Pond, PoseNoise, Snapshot, SnapshotKey

SCALE = 0.0005  # metres a pixel
WIDTH, HEIGHT = 160, 110


def _noise(rng: np.random.Generator, shape: tuple[int, int], sigma: float) -> Float32:
    field = cv2.GaussianBlur(rng.standard_normal(shape).astype(np.float32), (0, 0), sigma)
    return np.asarray(field / field.std(), dtype=np.float32)


def draw_floor(kind: str, size_px: tuple[int, int], seed: int) -> Float32:
    """(H, W), 0 to 255. kinds: gravel (strong fine texture), mud (weak coarse texture), rows (stripes of period 9 px
    and little else), tiles (a square lattice of 40 px with stains), rods (a hexagonal lattice of 60 px, each disc of
    one of three fills)."""
    rng = np.random.default_rng(seed)
    shape = (size_px[1], size_px[0])
    y, x = np.mgrid[: shape[0], : shape[1]].astype(np.float32)
    if kind == "gravel":
        return 120 + 30 * _noise(rng, shape, 1.5) + 15 * _noise(rng, shape, 12)
    if kind == "mud":
        return 110 + 5 * _noise(rng, shape, 4.0) + 6 * _noise(rng, shape, 25)
    if kind == "rows":
        rows = np.sin((x * np.sin(0.3) + y * np.cos(0.3)) * (2 * np.pi / 9))
        return 120 + 30 * rows.astype(np.float32) + 10 * _noise(rng, shape, 1.5)
    if kind == "tiles":
        joints = ((x % 40 < 3) | (y % 40 < 3)).astype(np.float32)
        return cv2.GaussianBlur(140 - 60 * joints, (0, 0), 0.8) + 6 * _noise(rng, shape, 2.5)
    image = np.full(shape, 90, np.float32)
    for row, v in enumerate(np.arange(0, shape[0] + 52, 52)):
        for u in np.arange(30 * (row % 2), shape[1] + 60, 60):
            centre = (int(u * 16), int(v * 16))
            cv2.circle(image, centre, 21 * 16, 150, -1, cv2.LINE_AA, 4)
            cv2.circle(image, centre, 13 * 16, float(rng.choice([60, 110, 200])), -1, cv2.LINE_AA, 4)
    return cv2.GaussianBlur(image, (0, 0), 0.8) + _noise(rng, shape, 1.2)


@dataclass(frozen=True, slots=True, eq=False)
class Swarm:
    """An inspection with its truth: truth (N, 3), m, m, rad, pond frame, in the order of the snapshots."""

    inspection: Inspection
    snapshots: tuple[Snapshot, ...]
    truth: Float


def photograph(floor: Float32, pose: Float, noise: float, rng: np.random.Generator, murk: float = 0.0) -> Float32:
    """One picture at a pose, m, m, rad, pond frame. murk: share of contrast lost to drifting light."""
    v, u = np.mgrid[:HEIGHT, :WIDTH].astype(np.float64)
    a, b = u - (WIDTH - 1) / 2, -(v - (HEIGHT - 1) / 2)
    c, s = np.cos(pose[2]), np.sin(pose[2])
    right = pose[0] / SCALE + c * a - s * b - 0.5
    down = floor.shape[0] - (pose[1] / SCALE + s * a + c * b) - 0.5
    seen = cv2.remap(floor, right.astype(np.float32), down.astype(np.float32), cv2.INTER_CUBIC, borderValue=100.0)
    if murk:
        vignette = 1 - 0.3 * ((a / WIDTH) ** 2 + (b / HEIGHT) ** 2)
        light = 1 + 0.1 * _noise(rng, (HEIGHT, WIDTH), 15)
        lit = (vignette * light * rng.uniform(0.8, 1.1)).astype(np.float32)
        seen = ((1 - murk) * seen + murk * 100) * lit
    return seen + noise * rng.standard_normal(seen.shape).astype(np.float32)


def inspect(
    kind: str, seed: int, count: int = 60, *, pond_px: tuple[int, int] = (420, 300), sigma_px: float = 19.0,
    sigma_rad: float = 0.1, noise: float = 2.0, murk: float = 0.0, claimed: float | None = 1.0,
) -> Swarm:  # fmt: skip
    """A swarm of three robots over a floor. claimed: how many times the true noise the session claims, or nothing."""
    rng = np.random.default_rng(seed + 1000)
    floor = draw_floor(kind, pond_px, seed)
    low, high = np.array([60.0, 50.0, -1.0]), np.array([pond_px[0] - 60.0, pond_px[1] - 50.0, 1.0])
    truth = rng.uniform(low, high, (count, 3)) * [SCALE, SCALE, 1]
    noisy = truth + rng.standard_normal((count, 3)) * [sigma_px * SCALE, sigma_px * SCALE, sigma_rad]
    snapshots = []
    for n in range(count):
        picture = photograph(floor, truth[n], noise, rng, murk)
        picture = np.repeat(picture.clip(0, 255).round().astype(np.uint8)[..., None], 3, axis=2)
        picture = cv2.imdecode(cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, 90])[1], cv2.IMREAD_COLOR)
        snapshots.append(Snapshot(SnapshotKey(f"r{n % 3}", 0, n // 3), float(n), noisy[n], picture))
    said = None if claimed is None else PoseNoise(sigma_px * SCALE * claimed, sigma_rad * claimed)
    camera = Camera(WIDTH, HEIGHT, SCALE)
    pond = Pond(pond_px[0] * SCALE, pond_px[1] * SCALE)
    return Swarm(Inspection(f"{kind}-{seed}", camera, pond, said), tuple(snapshots), truth)


def aligned_errors_px(poses: Float, truth: Float) -> Float:
    """(N,): distance of positions (N, 2+), m, from the truth after the best rigid motion of those that fit it."""
    keep = np.ones(len(poses), dtype=bool)
    for _ in range(10):
        a, b = poses[keep, :2].mean(axis=0), truth[keep, :2].mean(axis=0)
        u, _, vt = np.linalg.svd((poses[keep, :2] - a).T @ (truth[keep, :2] - b))
        turn = vt.T @ np.diag([1, np.sign(np.linalg.det(vt.T @ u.T))]) @ u.T
        apart = np.hypot(*((poses[:, :2] - a) @ turn.T + b - truth[:, :2]).T) / SCALE
        keep = apart <= max(5.0, 3 * float(np.median(apart)))
    return np.asarray(apart)
