"""From the assignments that a search found, the groups of snapshots that could as well lie elsewhere.

Two assignments differ in some snapshots. Those that see no rod in common, and are not tied in time, do not know of one
another, so what differs falls into groups, each of which may be taken from the other assignment by itself (partition
crossover, as in arXiv 2407.06742). A group that gains is taken over: the best of a few searches is often the best
of their parts. One that loses little is a rival: all of its snapshots together may lie there, one lattice vector
aside, though each of them, the others where they are, looks sure. Sparse inspections are full of such rivals.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from .assignment import Index, log_sum
from .factorgraph import Decision, Problem, Tie
from .values import Float, Int

LEAST_NATS = -20.0  # of a rival's posterior against the best, under which it is none
ROUNDS = 20


@dataclass(frozen=True, slots=True, eq=False)
class Rival:
    """Snapshots (S,) that could lie at other hypotheses (S,) all together. nats: log posterior against the best."""

    snapshots: Int
    places: Int
    nats: float


def recombined(problem: Problem, decisions: Sequence[Decision]) -> tuple[Decision, tuple[Rival, ...]]:
    """The best assignment that the parts of several make up, and its rivals, the likeliest first.

    Args:
        decisions: the best first.
    """
    parts, best = _Parts(problem), decisions[0]
    others = _distinct(decisions)
    for _ in range(ROUNDS):
        rivals = parts.rivals(best.choice, others)
        gains = [r for r in rivals if r.nats > 1e-6]
        if not gains:
            break
        best = parts.taken(best, gains[0], decisions)
    rivals = parts.rivals(best.choice, others)
    return best, tuple(r for r in rivals if LEAST_NATS < r.nats <= 1e-6)


def trust(problem: Problem, best: Decision, rivals: Sequence[Rival]) -> Float:
    """(N,): probability of the best decision's place for each snapshot: its marginal, less what its rivals have.

    The marginal knows what one snapshot could do by itself; a rival of one counts where that made less of it.
    """
    own = best.belief[best.choice]
    alone, together = np.zeros(problem.snapshots), np.zeros(problem.snapshots)
    for rival in rivals:
        mass = alone if len(rival.snapshots) == 1 else together
        mass[rival.snapshots] += np.exp(min(rival.nats, 0.0))
    return np.asarray(np.minimum(own, 1 / (1 + alone)) / (1 + together))


def _distinct(decisions: Sequence[Decision]) -> list[Int]:
    """The choices, each once."""
    return list({d.choice.tobytes(): d.choice for d in decisions}.values())


class _Parts:
    """One problem, to weigh what few snapshots do."""

    def __init__(self, problem: Problem) -> None:
        self._p, self._index = problem, Index(problem)

    def rivals(self, choice: Int, others: Sequence[Int]) -> list[Rival]:
        """Every group in which another choice differs, once, the likeliest first."""
        told = self._index.told(choice)
        found: dict[bytes, Rival] = {}
        for other in others:
            for group in self._groups(choice, other):
                name = group.tobytes() + other[group].tobytes()
                if name not in found:
                    found[name] = Rival(group, other[group], self._gain(choice, told, group, other[group]))
        return sorted(found.values(), key=lambda r: (-r.nats, r.snapshots.tolist(), r.places.tolist()))

    def taken(self, best: Decision, rival: Rival, decisions: Sequence[Decision]) -> Decision:
        """The best with a rival's places, and its beliefs of them from the decision that they came from."""
        choice, belief, p = best.choice.copy(), best.belief.copy(), self._p
        choice[rival.snapshots] = rival.places
        source = next(d for d in decisions if (d.choice[rival.snapshots] == rival.places).all())
        for i in rival.snapshots.tolist():
            belief[p.start[i] : p.start[i + 1]] = source.belief[p.start[i] : p.start[i + 1]]
        told = self._index.log_state + self._index.told(choice)
        state = np.exp(told - told.max(axis=1, keepdims=True))
        state /= state.sum(axis=1, keepdims=True)
        return replace(best, choice=choice, belief=belief, states=state, score=best.score + rival.nats)

    def _of(self, hypotheses: Int) -> Int:
        """The edges of some hypotheses."""
        return np.concatenate([self._index.of(h) for h in hypotheses.tolist()])

    def _groups(self, choice: Int, other: Int) -> Iterator[Int]:
        """Snapshots that differ, those that share a rod under either choice, or a tie, together."""
        differ = np.flatnonzero(choice != other)
        if not len(differ):
            return
        number = {int(i): n for n, i in enumerate(differ)}
        seen = [self._p.edge_rod[self._of(np.array([choice[i], other[i]]))] for i in differ]
        tied = [
            (number[t.first], n)
            for n, i in enumerate(differ.tolist())
            for t in self._index.ties.get(i, ())
            if t.second == i and t.first in number
        ]
        snapshot = np.repeat(np.arange(len(differ)), [len(s) for s in seen])
        rows = np.concatenate([snapshot, *(np.array(pair) for pair in tied)])
        marks = self._p.rods + np.repeat(np.arange(len(tied)), 2)
        columns = np.concatenate([*seen, marks]).astype(np.int64)
        nodes = len(differ) + self._p.rods + len(tied)  # snapshots, then what binds them
        bonds = coo_matrix((np.ones(len(rows), np.int8), (rows, len(differ) + columns)), shape=(nodes, nodes))
        label = connected_components(bonds, directed=False)[1][: len(differ)]
        for k in np.unique(label):
            yield differ[label == k]

    def _gain(self, choice: Int, told: Float, group: Int, places: Int) -> float:
        """Nats that a choice gains, its group taken to other places."""
        p = self._p
        old, new = self._of(choice[group]), self._of(places)
        rods, at = np.unique(p.edge_rod[np.concatenate([old, new])], return_inverse=True)
        change = np.zeros((len(rods), len(p.state_prior)))
        sign = np.repeat([-1.0, 1.0], [len(old), len(new)])[:, None]
        np.add.at(change, at.reshape(-1), sign * self._index.log_look[p.edge_look[np.concatenate([old, new])]])
        before = self._index.log_state + told[rods]
        seen = float((log_sum(before + change) - log_sum(before)).sum())
        prior = float((p.log_prior[places] - p.log_prior[choice[group]]).sum())
        return seen + prior + self._tie_gain(choice, group, places)

    def _tie_gain(self, choice: Int, group: Int, places: Int) -> float:
        moved = dict(zip(group.tolist(), places.tolist(), strict=True))
        ties = {id(t): t for i in moved for t in self._index.ties.get(i, ())}

        def factor(t: Tie, at: dict[int, int]) -> float:
            first, second = (at.get(i, int(choice[i])) - self._p.start[i] for i in (t.first, t.second))
            return float(t.log_factor[first, second])

        return sum(factor(t, moved) - factor(t, {}) for t in ties.values())
