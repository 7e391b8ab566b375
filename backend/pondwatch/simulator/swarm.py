"""Where the robots are when they take their pictures."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline

from pondwatch.core.values import Float, Int

from .spec import SimulationSpec

_LEG = 12  # snapshots between two waypoints


def robots_in_turn(spec: SimulationSpec) -> Int:
    """(N,): which robot takes which snapshot, one after the other."""
    return np.arange(spec.snapshots) % spec.robots


def true_poses(spec: SimulationSpec, rng: np.random.Generator) -> Float:
    """(N, 3), m, m, rad, pond frame, image centres inside the pond."""
    if spec.path == "uniform":
        return rng.uniform(*_bounds(spec), (spec.snapshots, 3))
    poses = np.empty((spec.snapshots, 3))
    turns = robots_in_turn(spec)
    for robot in range(spec.robots):
        mine = turns == robot
        path = _smooth if spec.path == "smooth" else _sweep
        poses[mine] = path(spec, robot, int(mine.sum()), rng)
    return poses


def _smooth(spec: SimulationSpec, _: int, count: int, rng: np.random.Generator) -> Float:
    """A curve through random waypoints."""
    legs = max(3, -(-count // _LEG) + 1)
    low, high = _bounds(spec)
    curve = CubicSpline(np.arange(legs), rng.uniform(low, high, (legs, 3)))(np.linspace(0, legs - 1, count))
    return np.clip(curve, low, high)


def _sweep(spec: SimulationSpec, robot: int, count: int, rng: np.random.Generator) -> Float:
    """Up and down inside the robot's own strip of the pond, as a boat surveys, with drift."""
    width, height = spec.pond_size_m
    strip = width / spec.robots
    step_m = spec.camera.width_px * spec.camera.metres_per_pixel * 0.45
    columns = max(1, round(strip / step_m))
    along = np.linspace(0, columns, count, endpoint=False)
    column = np.minimum(along.astype(int), columns - 1)
    part = along - column
    y = np.where(column % 2 == 0, part, 1 - part) * height
    x = (robot + (column + 0.5) / columns) * strip
    jitter = rng.normal(0, step_m / 6, (count, 2))
    theta = np.clip(np.cumsum(rng.normal(0, 0.15, count)) + rng.uniform(-0.3, 0.3), *_limits(spec.theta_range_rad))
    low, high = _bounds(spec)
    xy = np.clip(np.column_stack([x, y]) + jitter, low[:2], high[:2])
    return np.column_stack([xy, theta])


def _bounds(spec: SimulationSpec) -> tuple[Float, Float]:
    """(3,), (3,): the least and the greatest pose."""
    width, height = spec.pond_size_m
    margin, turn = spec.margin_m, spec.theta_range_rad
    return np.array([margin, margin, -turn]), np.array([width - margin, height - margin, turn])


def _limits(theta_range_rad: float) -> tuple[float, float]:
    return -theta_range_rad, theta_range_rad
