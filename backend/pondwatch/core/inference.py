"""The joint decision: which place each snapshot lies at, and which state each rod is in.

A factor graph. Variables: the place L_i of each snapshot (its hypotheses) and the state X_j of each rod. For each rod
that a place puts in view there is a look: the likelihood of what was seen, given the rod's state. Consecutive
snapshots of one robot may be tied by the smoothness of its pose error. Solved by loopy belief propagation
(`propagation.py`) with restarts from random first weights and an evidence ramp; each run is decoded, improved one
snapshot at a time (`assignment.py`), and the assignment with the highest posterior is kept. Posteriors are compared,
not agreement: runs that agree may all have stopped at the same wrong place.

Randomness is an argument: the same seed gives the same decision.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from .assignment import improved
from .factorgraph import Decision, Graph, Problem
from .ports import Spread, one_by_one
from .propagation import propagate
from .values import Float

RAMP = 20  # iterations over which the evidence is turned up
JITTER_NATS = 2.0
SAME_NATS = 0.05  # scores that differ by less are one
TOGETHER = 400_000  # numbers that the messages of runs done at once are, at most: they stay near the processor


def decide(
    problem: Problem,
    seed: int = 0,
    restarts: int = 24,
    agree: int = 3,
    iterations: int = 60,
    spread: Spread | None = None,
) -> list[Decision]:
    """Search for the best assignment.

    Args:
        restarts: so many runs at most; the first starts from even messages without a ramp.
        agree: stop once the best score was reached by so many runs.
        spread: where given, the runs that are needed whatever the others find are made beside each other, without ties
            one by one and not several at once on one core, which takes less time in all.

    Returns:
        The assignments found, best first, some of them more than once.
    """
    graph, size = Graph(problem), len(problem.log_prior)

    def made(runs: range) -> list[Decision]:
        if runs.start == 0:
            return _runs(graph, np.zeros((size, 1)), np.zeros((size, 1)), iterations, 1)
        rngs = [np.random.default_rng([seed, run]) for run in runs]
        jitter = JITTER_NATS * np.stack([rng.gumbel(size=size) for rng in rngs], axis=1)
        return _runs(graph, np.zeros_like(jitter), jitter, iterations, RAMP)

    sure = 1 if spread is None else min(restarts, agree)
    step = _together(graph) if problem.ties else 1  # along ties most of the work is one for all runs
    needed = [range(1), *(range(run, min(run + step, sure)) for run in range(1, sure, step))]
    found = [d for runs in (spread or one_by_one)(made, needed, (), large=True) for d in runs]
    while len(found) < restarts and _agreeing(found) < agree:
        lacking = min(restarts - len(found), agree - _agreeing(found), _together(graph))
        found += made(range(len(found), len(found) + lacking))
    return sorted(found, key=lambda d: -d.score)


def nudged(problem: Problem, favours: Sequence[Float], iterations: int = 60) -> list[Decision]:
    """The assignments that a search finds where some hypotheses are favoured, by nats (H,), scored without the favour.

    What lies a few nats below the best, because many snapshots would have to move together, is found this way.
    """
    graph, found = Graph(problem), list[Decision]()
    for part in _parts(favours, _together(graph)):
        favour = np.stack(part, axis=1)
        found += _runs(graph, favour, np.zeros_like(favour), iterations, 1)
    return found


def _runs(graph: Graph, favour: Float, jitter: Float, iterations: int, ramp: int) -> list[Decision]:
    """What as many runs find as there are columns in favour (H, M) and jitter (H, M), nats."""
    weight = propagate(graph, graph.problem.log_prior[:, None] + favour, jitter, iterations, ramp)
    beliefs = graph.normalised(weight - favour).T
    assignments = improved(graph, graph.best(weight))
    return [Decision(a.choice, b.copy(), a.states(), a.score()) for a, b in zip(assignments, beliefs, strict=True)]


def _agreeing(found: Sequence[Decision]) -> int:
    """How many reached the best score."""
    best = max(d.score for d in found)
    return sum(d.score > best - SAME_NATS for d in found)


def _together(graph: Graph) -> int:
    return max(1, TOGETHER // graph.size)


def _parts(favours: Sequence[Float], most: int) -> Iterable[Sequence[Float]]:
    return (favours[k : k + most] for k in range(0, len(favours), most))
