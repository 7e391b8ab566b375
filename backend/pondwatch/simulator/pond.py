"""A pond by seed: a lattice of rods, their fills, and the cells around them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pondwatch.core.values import Float, Pond, Rod

from .spec import Lattice, SimulationSpec


@dataclass(frozen=True, slots=True, eq=False)
class SimulatedPond:
    """A pond and what is true of it.

    fills: (R,), 0 to 1, in the layout's order. offsets: (R, 2), m, how far each stands off its place. starts_rad: (R,),
    where each wedge starts, counter-clockwise in the pond frame. cells: (C, 2), m, the centres of lattice cells, with a
    rod or without.
    """

    pond: Pond
    fills: Float
    offsets: Float
    starts_rad: Float
    cells: Float
    lattice: Lattice
    pitch_m: float
    angle_rad: float


def make_pond(spec: SimulationSpec, rng: np.random.Generator) -> SimulatedPond:
    """A pond with a layout, or an unmapped one without rods."""
    width, height = spec.pond_size_m
    sites = _sites(spec, rng) if spec.mapped else np.zeros((0, 2))
    present = rng.random(len(sites)) >= spec.missing
    outer_m, inner_m = (round(share * spec.pitch_m, 7) for share in (spec.outer_radius_pitch, spec.inner_radius_pitch))
    rods = tuple(
        Rod(f"R{i:04d}", x, y, outer_m, inner_m) for i, (x, y) in enumerate(np.round(sites[present], 7).tolist())
    )
    fills = _fills(spec, sites[present], rng)
    starts = rng.uniform(-np.pi, np.pi, len(rods))
    cells = sites if spec.edge_cells else sites[present]
    offsets = np.zeros((len(rods), 2))
    return SimulatedPond(Pond(width, height, rods), fills, offsets, starts, cells, spec.lattice, spec.pitch_m,
                         spec.lattice_angle_rad)  # fmt: skip


def as_stated(pond: Pond, spec: SimulationSpec) -> Pond:
    """What the layout says of a pond: everything in its place, rods as wide as it has them."""
    scale = spec.layout_radius
    if scale == 1:
        return pond
    rods = (
        replace(r, outer_radius_m=scale * r.outer_radius_m, inner_radius_m=scale * r.inner_radius_m) for r in pond.rods
    )
    return replace(pond, rods=tuple(rods))


def changed(simulated: SimulatedPond, count: int, seed: int) -> SimulatedPond:
    """The same pond with other fills in `count` of its rods: each filled, emptied or partly filled by a quarter or
    more."""
    if not count:
        return simulated
    rng = np.random.default_rng([seed, 103])
    which = rng.choice(len(simulated.fills), min(count, len(simulated.fills)), replace=False)
    fills = simulated.fills.copy()
    for i in which:
        others = [fill for fill in (0.0, 0.25, 0.5, 0.75, 1.0) if abs(fill - fills[i]) > 0.2]
        fills[i] = rng.choice(others)
    return replace(simulated, fills=fills)


def _sites(spec: SimulationSpec, rng: np.random.Generator) -> Float:
    """(S, 2), m: lattice points whose rods lie inside the pond, from the upper left, row by row."""
    size, pitch = np.array(spec.pond_size_m), spec.pitch_m
    reach = int(np.ceil(np.hypot(*size) / pitch)) + 2
    i, j = np.meshgrid(np.arange(-reach, reach + 1), np.arange(-reach, reach + 1))
    if spec.lattice == "hexagonal":
        grid = np.stack([i + (j % 2) / 2, j * np.sqrt(3) / 2], axis=-1)
    else:
        grid = np.stack([i, j], axis=-1).astype(np.float64)
    c, s = np.cos(spec.lattice_angle_rad), np.sin(spec.lattice_angle_rad)
    phase = rng.uniform(-0.5, 0.5, 2)
    points = (grid.reshape(-1, 2) + phase) @ np.array([[c, s], [-s, c]]) * pitch + size / 2
    margin = spec.outer_radius_pitch * pitch * 1.1
    inside = points[((points > margin) & (points < size - margin)).all(axis=1)]
    return np.asarray(inside[np.lexsort((inside[:, 0], -np.round(inside[:, 1] / pitch, 3)))])


def _fills(spec: SimulationSpec, sites: Float, rng: np.random.Generator) -> Float:
    n = len(sites)
    if spec.fills in ("empty", "full"):
        return np.full(n, float(spec.fills == "full"))
    if spec.fills == "striped":
        return np.asarray((np.round(sites[:, 1] / spec.pitch_m).astype(int) % 2).astype(np.float64))
    if spec.fills == "quarters":
        return rng.choice([0.0, 0.25, 0.5, 0.75, 1.0], n, p=[0.3, 0.1, 0.1, 0.1, 0.4])
    partial = np.round(rng.uniform(0.1, 0.9, n), 4)
    return np.asarray(np.where(rng.random(n) < 0.4, partial, rng.choice([0.0, 1.0], n)))
