"""The factor graph of the joint decision, flat, and the sums over it that message passing needs.

Variables: the place of each snapshot (its hypotheses) and the state of each rod. An edge says that a hypothesis puts a
rod in view, with the look that was seen there. `inference.py` decides it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.sparse import csr_matrix

from .values import Float, Float32, Int

TINY = 1e-300
LEAST = np.float32(1e-30)  # of a likelihood, in single precision


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

    @property
    def first_edges(self) -> Int:
        """(N + 1,): the edges of snapshot i are first[i]:first[i + 1], where they are in the order of the snapshots."""
        return np.searchsorted(self.owner[self.edge_hypothesis], np.arange(self.snapshots + 1))


@dataclass(frozen=True, slots=True, eq=False)
class Decision:
    """choice: (N,), hypothesis of each snapshot. belief: (H,), its marginal. states: (R, K). score: log posterior of
    the choice, nats, up to a constant of the problem."""

    choice: Int
    belief: Float
    states: Float
    score: float


class Graph:
    """The index structure that every run shares. Edges are grouped by (snapshot, rod) pairs. M runs are worked on at
    once, in single precision; theirs is the last axis everywhere, so that what is one for all is looked up once.

    hypothesis: (E,), of each edge. edge_pair: (E,). pair_snapshot, pair_rod: (P,). owner: (H,), the snapshot of each
    hypothesis.
    """

    def __init__(self, problem: Problem) -> None:
        self.problem, self.owner, self.hypothesis = problem, problem.owner, problem.edge_hypothesis
        key = self.owner[self.hypothesis] * problem.rods + problem.edge_rod
        pairs, self.edge_pair = np.unique(key, return_inverse=True)
        self.pair_snapshot, self.pair_rod = np.divmod(pairs, max(problem.rods, 1))
        self._to_pairs = _sums(self.edge_pair, len(pairs))
        self._to_rods = _sums(self.pair_rod, problem.rods)
        self._to_hypotheses = _sums(self.hypothesis, len(self.owner))
        self._log_look = np.log(np.maximum(problem.look, LEAST)).astype(np.float32)
        self._log_state = np.log(problem.state_prior).astype(np.float32)[:, None, None]

    @property
    def size(self) -> int:
        """How many numbers the messages of one run along all edges are."""
        return max(1, int(self._log_look.shape[1]) * len(self.hypothesis))

    def looks(self, runs: int, share: float = 1.0) -> Float32:
        """(K, E, M): the likelihoods of each edge's look, taken to the power of a share; the same for all runs."""
        look = np.exp(np.float32(share) * self._log_look).T
        return self._at_edges(np.repeat(look[..., None], runs, axis=2))

    def log_looks(self, runs: int) -> Float32:
        """(K, E, M): their logarithms."""
        return self._at_edges(np.repeat(self._log_look.T[..., None], runs, axis=2))

    def _at_edges(self, of_looks: Float32) -> Float32:
        return np.take(of_looks, self.problem.edge_look, axis=1)

    def of_hypotheses(self, per_edge: Float32) -> Float:
        """(H, M): sums over each hypothesis' edges."""
        return np.asarray(self._to_hypotheses @ per_edge, np.float64)

    def of_pairs(self, per_edge: Float32) -> Float32:
        """(P, M): sums over each pair's edges."""
        return np.asarray(self._to_pairs @ per_edge)

    def cavities(self, message: Float32) -> Float32:
        """(K, P, M): what is known of each pair's rod without what its own snapshot says, from what every snapshot says
        of it, message: (K, P, M), nats."""
        told = np.stack([self._to_rods @ of_state for of_state in message])
        told += self._log_state
        cavity = np.take(told, self.pair_rod, axis=1)
        cavity -= message
        cavity -= cavity.max(axis=0)
        np.exp(cavity, out=cavity)
        cavity /= cavity.sum(axis=0)
        return np.asarray(cavity)

    def evidence(self, message: Float32, look: Float32, room: Float32) -> Float32:
        """(E, M): nats that each edge's look speaks for its hypothesis. room: (K, E, M), is written over."""
        np.take(self.cavities(message), self.edge_pair, axis=1, out=room, mode="clip")
        np.multiply(room, look, out=room)
        return np.asarray(np.log(np.maximum(room.sum(axis=0), LEAST)))

    def top(self, per_hypothesis: Float) -> Float:
        """(N, M): the maximum over each snapshot's hypotheses."""
        return np.asarray(np.maximum.reduceat(per_hypothesis, self.problem.start[:-1], axis=0))

    def total(self, per_hypothesis: Float) -> Float:
        """(N, M): the sum over each snapshot's hypotheses."""
        return np.asarray(np.add.reduceat(per_hypothesis, self.problem.start[:-1], axis=0))

    def normalised(self, log_weight: Float) -> Float:
        """(H, M): probabilities within each snapshot."""
        w = np.exp(log_weight - self.top(log_weight)[self.owner])
        return np.asarray(w / self.total(w)[self.owner])

    def best(self, weight: Float) -> Int:
        """(N, M): the hypothesis of the greatest weight (H, M) of each snapshot, the first of equals."""
        numbers = np.arange(len(self.owner))[:, None]
        at = np.where(weight == self.top(weight)[self.owner], numbers, len(self.owner))
        return np.asarray(np.minimum.reduceat(at, self.problem.start[:-1], axis=0))


def _sums(of: Int, size: int) -> csr_matrix:
    """The matrix that sums what belongs to the same of `size` things: of: (E,), which one."""
    return csr_matrix((np.ones(len(of), np.float32), (of, np.arange(len(of)))), (size, len(of)))
