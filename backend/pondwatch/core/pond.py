"""The design layout as arrays: where rods are, who is next to whom, which are in view of a pose.

Nothing here takes the layout for a lattice: pitch and neighbour vectors are measured from it, so a square lattice,
a hexagonal one, racks at an angle and missing rods are all the same to what follows.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .errors import InvalidLayout
from .values import Bool, Float, Int, Pond

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

NEIGHBOUR_REACH = 1.25  # in pitches: closer than this, two rods are neighbours


@dataclass(frozen=True, slots=True, eq=False)
class Layout:
    """The layout of a mapped pond. All lengths in metres, pond frame.

    centres: (N, 2). inner_radius, outer_radius, pitch: scalars (medians). steps: (M, 2), the distinct vectors from a
    rod to its neighbours (six for a hexagonal lattice, four for a square one).
    """

    ids: tuple[str, ...]
    centres: Float
    inner_radius: float
    outer_radius: float
    pitch: float
    steps: Float
    tree: cKDTree

    @classmethod
    def of(cls, pond: Pond) -> Layout:
        """The layout of a pond that has rods.

        Raises:
            InvalidLayout: no rods, or rods without an extent.
        """
        if not pond.rods:
            raise InvalidLayout("The pond has no rods in its layout.")
        centres = np.array([[r.x_m, r.y_m] for r in pond.rods])
        inner = float(np.median([r.inner_radius_m for r in pond.rods]))
        outer = float(np.median([r.outer_radius_m for r in pond.rods]))
        if not 0 < inner <= outer:
            raise InvalidLayout(f"The rods' radii are {inner:g} m inside and {outer:g} m outside.")
        tree = tree_of(centres)
        pitch = _pitch(tree, centres, outer)
        return cls(
            tuple(r.id for r in pond.rods), centres, inner, outer, pitch, _neighbour_steps(tree, centres, pitch), tree
        )

    def within(self, points: Float, radius: float) -> tuple[Int, Bool]:
        """The rods near each of (H, 2) points: indices (H, K), padded with 0, and which of them are real (H, K)."""
        counts = np.atleast_1d(self.tree.query_ball_point(points, radius, return_length=True))
        most = max(1, int(counts.max(initial=1)))
        distance, index = self.tree.query(points, k=np.arange(1, most + 1), distance_upper_bound=radius)
        real = np.isfinite(distance)
        return np.where(real, index, 0).astype(np.int64), real


def neighbour_steps(centres: Float) -> Float:
    """(M, 2), m: the distinct vectors from a rod to its neighbours, of rods at (N, 2)."""
    if len(centres) < 2:
        return np.zeros((0, 2))
    tree = tree_of(centres)
    return _neighbour_steps(tree, centres, _pitch(tree, centres, 0.0))


def tree_of(points: Float) -> cKDTree:
    """To look for the nearest of (N, 2) points."""
    from scipy.spatial import cKDTree  # half a second to load, which a server does without

    return cKDTree(points)


def _pitch(tree: cKDTree, centres: Float, outer: float) -> float:
    if len(centres) < 2:
        return 4 * outer
    nearest = np.asarray(tree.query(centres, k=2)[0])
    return float(np.median(nearest[:, 1]))


def _neighbour_steps(tree: cKDTree, centres: Float, pitch: float) -> Float:
    """Distinct vectors to neighbours, pond frame: those that lie within 3 % of a pitch of each other are one."""
    pairs = tree.query_pairs(NEIGHBOUR_REACH * pitch, output_type="ndarray")
    if not len(pairs):
        return np.zeros((0, 2))
    d = centres[pairs[:, 1]] - centres[pairs[:, 0]]
    both = np.concatenate([d, -d])
    cells, index, counts = np.unique(np.round(both / (0.06 * pitch)), axis=0, return_inverse=True, return_counts=True)
    index = index.reshape(-1)
    means = np.stack([np.bincount(index, both[:, k], len(cells)) / counts for k in (0, 1)], axis=1)
    order = np.argsort(-counts, kind="stable")[:24]
    return _merged(means[order], counts[order], 0.06 * pitch)


def _merged(vectors: Float, counts: Int, reach: float) -> Float:
    """Greedy merge of vectors closer than `reach`, the most frequent first; at most 24 come in."""
    kept: list[Float] = []
    for v, _ in zip(vectors, counts, strict=True):
        if all(np.hypot(*(v - k)) > reach for k in kept):
            kept.append(v)
    return np.array(kept)
