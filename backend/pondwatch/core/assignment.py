"""One place for every snapshot: its posterior, and the search for a better one, one snapshot at a time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .factorgraph import TINY, Graph, Problem, Tie
from .values import Bool, Float, Int

SWEEPS = 6
CLEAR_NATS = 1e-3  # by which a place is better than another, in single precision


def improved(graph: Graph, choices: Int) -> list[Assignment]:
    """Assignments (N, M), single snapshots moved to better places until none is left."""
    index = Index(graph.problem)
    out = [Assignment(index, choice) for choice in choices.T]
    at_work: Sequence[Assignment] = out
    for _ in range(SWEEPS):
        wishes = _better(graph, np.stack([a.choice for a in at_work], axis=1)).T
        at_work = [a for a, wish in zip(at_work, wishes, strict=True) if a.improve(np.flatnonzero(wish))]
        if not at_work:
            break
    return out


def _better(graph: Graph, choices: Int) -> Bool:
    """(N, M): snapshots for which another place is better, all others where an assignment (N, M) has them."""
    p, runs = graph.problem, np.arange(choices.shape[1])
    chosen = np.zeros((len(p.log_prior), len(runs)), np.float32)
    chosen[choices, runs] = 1
    weight = np.repeat(p.log_prior[:, None], len(runs), axis=1)
    if len(graph.hypothesis):
        room = graph.log_looks(len(runs))
        room *= chosen[graph.hypothesis]
        told = np.stack([graph.of_pairs(of_state) for of_state in room])
        weight += graph.of_hypotheses(graph.evidence(told, graph.looks(len(runs)), room))
    for t in p.ties:
        a, b = slice(p.start[t.first], p.start[t.first + 1]), slice(p.start[t.second], p.start[t.second + 1])
        weight[a] += t.log_factor[:, choices[t.second] - p.start[t.second]]
        weight[b] += t.log_factor[choices[t.first] - p.start[t.first]].T
    return np.asarray(graph.top(weight) > weight[choices, runs] + CLEAR_NATS)


class Index:
    """A problem's edges by hypothesis, its ties by snapshot, and what each snapshot's places say of rods; shared by all
    that weigh assignments."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.edges = np.argsort(problem.edge_hypothesis, kind="stable")  # each hypothesis' begin at `first`
        self.first = np.searchsorted(problem.edge_hypothesis[self.edges], np.arange(len(problem.log_prior) + 1))
        self.log_look = np.log(np.maximum(problem.look, TINY))
        self.log_state = np.log(problem.state_prior)
        self.ties: dict[int, list[Tie]] = {}
        for tie in problem.ties:
            self.ties.setdefault(tie.first, []).append(tie)
            self.ties.setdefault(tie.second, []).append(tie)
        self._views: dict[int, tuple[Int, Int, Float, Int]] = {}

    def of(self, hypothesis: int) -> Int:
        """The edges of a hypothesis."""
        return np.asarray(self.edges[self.first[hypothesis] : self.first[hypothesis + 1]])

    def told(self, choice: Int) -> Float:
        """(R, K): what the looks of a choice (N,) say of every rod, nats."""
        p = self.problem
        chosen = np.zeros(len(p.log_prior), dtype=bool)
        chosen[choice] = True
        e = np.flatnonzero(chosen[p.edge_hypothesis])
        out = np.zeros((p.rods, len(p.state_prior)))
        np.add.at(out, p.edge_rod[e], self.log_look[p.edge_look[e]])
        return out

    def views_of(self, snapshot: int) -> tuple[Int, Int, Float, Int]:
        """The rods that a snapshot's places put in view; and of each edge which of them, the look and the place."""
        if snapshot not in self._views:
            p = self.problem
            lo, hi = p.start[snapshot], p.start[snapshot + 1]
            e = self.edges[self.first[lo] : self.first[hi]]
            rods, at = np.unique(p.edge_rod[e], return_inverse=True)
            self._views[snapshot] = rods, at.reshape(-1), p.look[p.edge_look[e]], p.edge_hypothesis[e] - lo
        return self._views[snapshot]


class Assignment:
    """A choice of one place for every snapshot, its score, and the search for a better one, one snapshot at a time."""

    def __init__(self, index: Index, choice: Int) -> None:
        self._index, self._p = index, index.problem
        self.choice, self._sum = choice.copy(), index.told(choice)

    def _add(self, hypothesis: int, sign: int) -> None:
        e = self._index.of(hypothesis)
        np.add.at(self._sum, self._p.edge_rod[e], sign * self._index.log_look[self._p.edge_look[e]])

    def alternatives(self, snapshot: int) -> Float:
        """(H_i,): log posterior of each place of one snapshot, all others as they are."""
        p = self._p
        self._add(int(self.choice[snapshot]), -1)
        lo, hi = p.start[snapshot], p.start[snapshot + 1]
        rods, at, look, place = self._index.views_of(snapshot)
        log_state = self._index.log_state + self._sum[rods]
        state = np.exp(log_state - log_state.max(axis=1, keepdims=True))
        state /= state.sum(axis=1, keepdims=True)
        gain = np.log(np.maximum(np.einsum("ek,ek->e", state[at], look), TINY))
        score = p.log_prior[lo:hi] + np.bincount(place, gain, hi - lo)
        self._add(int(self.choice[snapshot]), 1)
        return np.asarray(score + self._tie_terms(snapshot))

    def _tie_terms(self, snapshot: int) -> Float | float:
        terms: Float | float = 0.0
        for t in self._index.ties.get(snapshot, ()):
            if t.first == snapshot:
                terms = terms + t.log_factor[:, self.choice[t.second] - self._p.start[t.second]]
            else:
                terms = terms + t.log_factor[self.choice[t.first] - self._p.start[t.first]]
        return terms

    def improve(self, snapshots: Int) -> bool:
        """Move each of some snapshots to its best place, the others as they are then; whether any moved."""
        moved = False
        for i in snapshots.tolist():
            best = int(self._p.start[i] + np.argmax(self.alternatives(i)))
            if best != self.choice[i]:
                self._add(int(self.choice[i]), -1)
                self._add(best, 1)
                self.choice[i] = best
                moved = True
        return moved

    def score(self) -> float:
        """Log posterior, nats, up to a constant of the problem."""
        p = self._p
        total = float(log_sum(self._index.log_state + self._sum).sum() + p.log_prior[self.choice].sum())
        at = self.choice - p.start[:-1]
        return total + sum(float(t.log_factor[at[t.first], at[t.second]]) for t in p.ties)

    def states(self) -> Float:
        """(R, K): probabilities of every rod's states, given the choice."""
        x = self._index.log_state + self._sum
        x = np.exp(x - x.max(axis=1, keepdims=True))
        return np.asarray(x / x.sum(axis=1, keepdims=True))


def log_sum(x: Float) -> Float:
    """(R,) of (R, K)."""
    top = x.max(axis=1)
    return np.asarray(np.log(np.exp(x - top[:, None]).sum(axis=1)) + top)
