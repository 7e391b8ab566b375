"""The factor graph of the joint decision, flat, and the sums over it that message passing needs.

Variables: the place of each snapshot (its hypotheses) and the state of each rod. An edge says that a hypothesis puts a
rod in view, with the look that was seen there. `inference.py` decides it.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.sparse import csr_matrix

from .values import Float, Int

TINY = 1e-300


@dataclass(frozen=True, slots=True, eq=False)
class Tie:
    """Two consecutive snapshots of one robot. log_factor: (H_first, H_second), nats."""

    first: int
    second: int
    log_factor: Float


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """The factor graph, flat.

    start: (N + 1,), hypotheses of snapshot i are start[i]:start[i + 1]. log_prior: (H,), nats.
    edge_hypothesis, edge_rod, edge_look: (E,), hypothesis e sees the rod with that look.
    look: (L, K), likelihood of a look under each state over its likelihood under the prior.
    state_prior: (K,). rods: how many. ties: chains in time.
    """

    start: Int
    log_prior: Float
    edge_hypothesis: Int
    edge_rod: Int
    edge_look: Int
    look: Float
    state_prior: Float
    rods: int
    ties: Sequence[Tie] = field(default=())

    @property
    def snapshots(self) -> int:
        """How many."""
        return len(self.start) - 1

    @property
    def owner(self) -> Int:
        """(H,): the snapshot of each hypothesis."""
        return np.repeat(np.arange(self.snapshots), np.diff(self.start))


@dataclass(frozen=True, slots=True, eq=False)
class Decision:
    """choice: (N,), hypothesis of each snapshot. belief: (H,), its marginal. states: (R, K). score: log posterior of
    the choice, nats, up to a constant of the problem."""

    choice: Int
    belief: Float
    states: Float
    score: float


class Graph:
    """The index structure that every run shares: edges grouped by (snapshot, rod) pairs."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        owner = problem.owner
        self.owner = owner
        key = owner[problem.edge_hypothesis] * problem.rods + problem.edge_rod
        pairs, self.edge_pair = np.unique(key, return_inverse=True)
        self.pair_snapshot, self.pair_rod = pairs // problem.rods, pairs % problem.rods
        edges = len(key)
        self.by_pair = csr_matrix((np.ones(edges), (self.edge_pair, np.arange(edges))), (len(pairs), edges))
        self.edges = np.argsort(problem.edge_hypothesis, kind="stable")  # by hypothesis; each one's begin at `first`
        self.first = np.searchsorted(problem.edge_hypothesis[self.edges], np.arange(len(problem.log_prior) + 1))
        self.log_look = np.log(np.maximum(problem.look, TINY))
        self.by_rod = csr_matrix(
            (np.ones(len(pairs)), (self.pair_rod, np.arange(len(pairs)))), (problem.rods, len(pairs))
        )
        self._views: dict[int, tuple[Int, Int, Float, Int]] = {}

    def favouring(self, nats: Float) -> Graph:
        """The same structure for a problem whose hypotheses are likelier by nats (H,)."""
        out = copy.copy(self)
        out.problem = replace(self.problem, log_prior=self.problem.log_prior + nats)
        return out

    def views_of(self, snapshot: int) -> tuple[Int, Int, Float, Int]:
        """What a snapshot's places say of rods: these rods, and of each edge which of them, the look and the place."""
        if snapshot not in self._views:
            p = self.problem
            lo, hi = p.start[snapshot], p.start[snapshot + 1]
            e = self.edges[self.first[lo] : self.first[hi]]
            rods, at = np.unique(p.edge_rod[e], return_inverse=True)
            self._views[snapshot] = rods, at.reshape(-1), p.look[p.edge_look[e]], p.edge_hypothesis[e] - lo
        return self._views[snapshot]

    def of_hypotheses(self, per_edge: Float) -> Float:
        """(H,): sums over each hypothesis' edges."""
        return np.asarray(np.bincount(self.problem.edge_hypothesis, per_edge, len(self.problem.log_prior)), np.float64)

    def of_pairs(self, per_edge: Float) -> Float:
        """(P,): sums over each pair's edges."""
        return np.asarray(np.bincount(self.edge_pair, per_edge, len(self.pair_rod)), np.float64)

    def top(self, per_hypothesis: Float) -> Float:
        """(N,): the maximum over each snapshot's hypotheses."""
        return np.maximum.reduceat(per_hypothesis, self.problem.start[:-1])

    def total(self, per_hypothesis: Float) -> Float:
        """(N,): the sum over each snapshot's hypotheses."""
        return np.add.reduceat(per_hypothesis, self.problem.start[:-1])

    def normalised(self, log_weight: Float) -> Float:
        """(H,): probabilities within each snapshot."""
        w = np.exp(log_weight - self.top(log_weight)[self.owner])
        return np.asarray(w / self.total(w)[self.owner])
