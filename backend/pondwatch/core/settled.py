"""An atlas solved as a whole: pose graph, outlying edges dropped, what the noisy poses' errors have in common.

Pure. Map frame of `posegraph.py`.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from . import posegraph as se2
from .atlas import Atlas
from .values import Float, Int

OUTLIER_CHI2 = 30.0  # of 3 degrees of freedom: one in a million
MEDIAN_CHI2 = 2.366
MOST_INFLATION = 40.0


@dataclass(frozen=True, slots=True, eq=False)
class Settled:
    """covariances: (N, 3, 3), map frame. prior_inflation: how many noisy poses count as one. facts: for quality."""

    covariances: Float
    prior_inflation: float
    facts: dict[str, Any]


def settle_atlas(atlas: Atlas, tracks: Sequence[Hashable]) -> Settled:
    """Grow an atlas from nothing and solve it; the atlas then holds the solved poses and the groups that hold.

    tracks: (N,), which snapshots are one robot's, in order of time within each.
    """
    atlas.grow()
    edges = edges_of(atlas)
    first = se2.solve(atlas.poses, edges, atlas.priors, atlas.sigmas)
    worse = max(1.0, float(np.median(first.edge_chi2)) / MEDIAN_CHI2) if len(edges.tail) else 1.0
    keep = first.edge_chi2 < OUTLIER_CHI2 * worse
    kept = edges.where(keep)
    kept = se2.Edges(kept.tail, kept.head, kept.relative, kept.information / worse)
    atlas.poses = first.poses
    atlas.group = _regrouped(len(atlas), kept)
    inflation = prior_inflation(atlas, tracks)
    final = se2.solve(first.poses, kept, atlas.priors, atlas.sigmas, prior_inflation=inflation)
    atlas.poses = final.poses
    lone = np.bincount(atlas.group, minlength=len(atlas))[atlas.group] < 2
    atlas.poses[lone] = atlas.priors[lone]
    facts = {"edges_dropped": int((~keep).sum()), "poses_per_independent_error": round(inflation, 2)}
    return Settled(final.covariances, inflation, facts | _residuals(final.poses, kept) | _cycle_sums(kept))


def edges_of(atlas: Atlas) -> se2.Edges:
    """The atlas's fits as arrays."""
    e = atlas.edges
    return se2.Edges(
        np.array([x.tail for x in e], dtype=np.int64),
        np.array([x.head for x in e], dtype=np.int64),
        np.array([x.fit.relative for x in e]).reshape(-1, 3),
        np.array([x.fit.information for x in e]).reshape(-1, 3, 3),
    )


def _regrouped(count: int, edges: se2.Edges) -> Int:
    links = sparse.coo_matrix((np.ones(len(edges.tail)), (edges.tail, edges.head)), shape=(count, count))
    return np.asarray(connected_components(links, directed=False)[1], dtype=np.int64)


def prior_inflation(atlas: Atlas, tracks: Sequence[Hashable]) -> float:
    """How many noisy poses count as one, by how alike successive errors of a robot are (first-order drift)."""
    main = atlas.group == atlas.main_group()
    products, squares = [], []
    last: dict[Hashable, int] = {}
    residual = atlas.prior_residuals(np.arange(len(atlas)))[:, :2]
    limit = 4 * atlas.sigmas[0]
    for n, track in enumerate(tracks):
        if not main[n] or np.abs(residual[n]).max() > limit:
            continue
        if track in last:
            before = residual[last[track]]
            products.append(before @ residual[n])
            squares.append((before @ before + residual[n] @ residual[n]) / 2)
        last[track] = n
    if len(products) < 8:
        return 1.0
    alike = sum(products) / max(sum(squares), 1e-12)
    alike = alike if alike > 2 / np.sqrt(2 * len(products)) else 0.0
    return float(min((1 + alike) / max(1 - alike, 1e-9), MOST_INFLATION))


def _residuals(poses: Float, edges: se2.Edges) -> dict[str, Any]:
    if not len(edges.tail):
        return {}
    apart = np.hypot(*se2.edge_residuals(poses, edges)[:, :2].T)
    return {"residual_px": float(np.median(apart)), "residual_p95_px": float(np.percentile(apart, 95))}


def _cycle_sums(edges: se2.Edges) -> dict[str, Any]:
    """What the edges round each triangle sum to; zero where none of them jumped."""
    measured: dict[tuple[int, int], Float] = {}
    after: dict[int, list[int]] = {}
    for tail, head, relative in zip(edges.tail.tolist(), edges.head.tolist(), edges.relative, strict=True):
        measured[tail, head] = relative
        after.setdefault(tail, []).append(head)
    found = [(a, b, c) for (a, b) in measured for c in after.get(b, ()) if (a, c) in measured]
    if not found:
        return {"cycles": 0}
    ab, bc, ac = (np.array([measured[t[i], t[j]] for t in found]) for i, j in ((0, 1), (1, 2), (0, 2)))
    sums = np.hypot(*se2.between(ac, se2.compose(ab, bc))[:, :2].T)
    return {
        "cycles": len(found),
        "cycle_sum_median_px": float(np.median(sums)),
        "cycle_sum_largest_px": float(sums.max()),
    }
