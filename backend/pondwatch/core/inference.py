"""The joint decision: which place each snapshot lies at, and which state each rod is in.

A factor graph. Variables: the place L_i of each snapshot (its hypotheses) and the state X_j of each rod. For each rod
that a place puts in view there is a look: the likelihood of what was seen, given the rod's state. Consecutive
snapshots of one robot may be tied by the smoothness of its pose error. Solved by loopy belief propagation
(doi 10.1109/18.910572) with restarts from random first messages and an evidence ramp; each run is decoded,
improved one snapshot at a time, and the assignment with the highest posterior is kept. Posteriors are compared, not
agreement: runs that agree may all have stopped at the same wrong place.

Randomness is an argument: the same seed gives the same decision.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .factorgraph import TINY, Decision, Graph, Problem, Tie
from .values import Float, Int

RAMP = 20  # iterations over which the evidence is turned up
DAMPING = 0.35


def propagate(graph: Graph, rng: np.random.Generator | None, iterations: int, ramp: int) -> tuple[Float, Float]:
    """One run of loopy belief propagation.

    Returns:
        log weight of each hypothesis (H,), and log belief of each rod's states (R, K), not normalised.
    """
    p = graph.problem
    log_message = np.zeros((len(graph.pair_rod), len(p.state_prior)))
    jitter = rng.gumbel(size=len(p.log_prior)) * 2.0 if rng is not None else np.zeros(len(p.log_prior))
    log_state = np.log(p.state_prior)
    chain = np.zeros(len(p.log_prior))
    previous = np.zeros(0)
    for step in range(iterations):
        beta = min(1.0, (step + 1) / max(1, ramp))
        look = (np.exp(beta * graph.log_look) if beta < 1 else p.look)[p.edge_look]
        cavity = (log_state + graph.by_rod @ log_message)[graph.pair_rod] - log_message
        cavity = np.exp(cavity - cavity.max(axis=1, keepdims=True))
        cavity /= cavity.sum(axis=1, keepdims=True)
        evidence = np.log(np.maximum(np.einsum("ek,ek->e", cavity[graph.edge_pair], look), TINY))
        weight = p.log_prior + graph.of_hypotheses(evidence) + (1 - beta) * jitter
        chain = _chain_messages(p, weight) if p.ties else chain
        total = weight + chain
        message = _to_rods(graph, total, evidence, look)
        log_message = DAMPING * log_message + (1 - DAMPING) * np.log(np.maximum(message, TINY))
        if beta == 1:
            belief = graph.normalised(total)
            if len(previous) and np.abs(belief - previous).max() < 1e-4:
                break
            previous = belief
    return total, log_state + graph.by_rod @ log_message


def _to_rods(graph: Graph, total: Float, evidence: Float, look: Float) -> Float:
    """(P, K): messages from snapshots to rods; a place that does not see the rod says nothing of it."""
    p = graph.problem
    top = graph.top(total)
    share = np.exp(total - top[graph.owner])
    with_rod = share[p.edge_hypothesis]
    without = np.maximum(graph.total(share)[graph.pair_snapshot] - graph.of_pairs(with_rod), 0)
    cavity = with_rod * np.exp(np.clip(-evidence, -60, 60))
    seen = graph.by_pair @ (cavity[:, None] * look)
    return np.asarray((seen + without[:, None]) / (graph.of_pairs(cavity) + without + TINY)[:, None])


def _chain_messages(p: Problem, weight: Float) -> Float:
    """(H,): what its neighbours in time say of each hypothesis, by a forward and a backward pass over the ties."""
    forward, backward = np.zeros_like(weight), np.zeros_like(weight)
    for t in p.ties:
        a, b = slice(p.start[t.first], p.start[t.first + 1]), slice(p.start[t.second], p.start[t.second + 1])
        forward[b] = _log_sum((weight[a] + forward[a])[:, None] + t.log_factor, 0)
    for t in reversed(p.ties):
        a, b = slice(p.start[t.first], p.start[t.first + 1]), slice(p.start[t.second], p.start[t.second + 1])
        backward[a] = _log_sum((weight[b] + backward[b])[None] + t.log_factor, 1)
    return forward + backward


def _log_sum(x: Float, axis: int) -> Float:
    top = x.max(axis=axis, keepdims=True)
    total = np.log(np.exp(x - top).sum(axis=axis)) + top.squeeze(axis)
    return np.asarray(total - total.max())


class _Assignment:
    """A choice of one place for every snapshot, its score, and the search for a better one, one snapshot at a time."""

    def __init__(self, graph: Graph, choice: Int) -> None:
        self._graph, self._p = graph, graph.problem
        p = self._p
        self._edges, self._first, self._log_look = graph.edges, graph.first, graph.log_look
        self.choice = choice.copy()
        self._sum = np.zeros((p.rods, len(p.state_prior)))
        for h in self.choice:
            self._add(int(h), 1)
        self._ties: dict[int, list[Tie]] = {}
        for t in p.ties:
            self._ties.setdefault(t.first, []).append(t)
            self._ties.setdefault(t.second, []).append(t)

    def _of(self, hypothesis: int) -> Int:
        return np.asarray(self._edges[self._first[hypothesis] : self._first[hypothesis + 1]])

    def _add(self, hypothesis: int, sign: int) -> None:
        e = self._of(hypothesis)
        np.add.at(self._sum, self._p.edge_rod[e], sign * self._log_look[self._p.edge_look[e]])

    def alternatives(self, snapshot: int) -> Float:
        """(H_i,): log posterior of each place of one snapshot, all others as they are."""
        p = self._p
        self._add(int(self.choice[snapshot]), -1)
        lo, hi = p.start[snapshot], p.start[snapshot + 1]
        rods, at, look, place = self._graph.views_of(snapshot)
        log_state = np.log(p.state_prior) + self._sum[rods]
        state = np.exp(log_state - log_state.max(axis=1, keepdims=True))
        state /= state.sum(axis=1, keepdims=True)
        gain = np.log(np.maximum(np.einsum("ek,ek->e", state[at], look), TINY))
        score = p.log_prior[lo:hi] + np.bincount(place, gain, hi - lo)
        self._add(int(self.choice[snapshot]), 1)
        return np.asarray(score + self._tie_terms(snapshot))

    def _tie_terms(self, snapshot: int) -> Float | float:
        terms: Float | float = 0.0
        for t in self._ties.get(snapshot, ()):
            if t.first == snapshot:
                terms = terms + t.log_factor[:, self.choice[t.second] - self._p.start[t.second]]
            else:
                terms = terms + t.log_factor[self.choice[t.first] - self._p.start[t.first]]
        return terms

    def improve(self, sweeps: int = 6) -> None:
        """Move single snapshots to better places until none is left."""
        for _ in range(sweeps):
            moved = False
            for i in range(self._p.snapshots):
                if self._p.start[i + 1] - self._p.start[i] < 2:
                    continue
                best = int(self._p.start[i] + np.argmax(self.alternatives(i)))
                if best != self.choice[i]:
                    self._add(int(self.choice[i]), -1)
                    self._add(best, 1)
                    self.choice[i] = best
                    moved = True
            if not moved:
                return

    def score(self) -> float:
        """Log posterior, nats, up to a constant of the problem."""
        p = self._p
        x = np.log(p.state_prior) + self._sum
        top = x.max(axis=1)
        total = float((np.log(np.exp(x - top[:, None]).sum(axis=1)) + top).sum() + p.log_prior[self.choice].sum())
        at = self.choice - p.start[:-1]
        return total + sum(float(t.log_factor[at[t.first], at[t.second]]) for t in p.ties)

    def states(self) -> Float:
        """(R, K): probabilities of every rod's states, given the choice."""
        x = np.log(self._p.state_prior) + self._sum
        x = np.exp(x - x.max(axis=1, keepdims=True))
        return np.asarray(x / x.sum(axis=1, keepdims=True))


def decide(problem: Problem, seed: int = 0, restarts: int = 24, agree: int = 3, iterations: int = 60) -> list[Decision]:
    """Search for the best assignment.

    Args:
        restarts: at most so many runs; the first starts from even messages without a ramp.
        agree: stop once the best score was reached by so many runs.

    Returns:
        The distinct assignments found, best first.
    """
    graph = Graph(problem)
    found: list[Decision] = []
    hits = 0
    for run in range(restarts):
        rng = np.random.default_rng([seed, run]) if run else None
        weight, _ = propagate(graph, rng, iterations, RAMP if run else 1)
        assignment = _Assignment(graph, _choice(problem, weight))
        assignment.improve()
        score = assignment.score()
        best = found[0].score if found else -np.inf
        hits = hits + 1 if abs(score - best) < 0.05 else (1 if score > best else hits)
        found.append(Decision(assignment.choice, graph.normalised(weight), assignment.states(), score))
        found.sort(key=lambda d: -d.score)
        if hits >= agree:
            break
    return found


def nudged(problem: Problem, favours: Sequence[Float], iterations: int = 60) -> list[Decision]:
    """The assignments that a search finds where some hypotheses are favoured, by nats (H,), scored without the favour.

    What lies a few nats below the best, because many snapshots would have to move together, is found this way.
    """
    plain, found = Graph(problem), []
    for favour in favours:
        weight, _ = propagate(plain.favouring(favour), None, iterations, 1)
        assignment = _Assignment(plain, _choice(problem, weight))
        assignment.improve()
        belief = plain.normalised(weight - favour)
        found.append(Decision(assignment.choice, belief, assignment.states(), assignment.score()))
    return found


def _choice(p: Problem, weight: Float) -> Int:
    return np.array([p.start[i] + int(np.argmax(weight[p.start[i] : p.start[i + 1]])) for i in range(p.snapshots)])
