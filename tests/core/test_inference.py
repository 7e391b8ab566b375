"""The joint decision on graphs so small that every assignment can be written down, and on fields with look-alikes."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from pondwatch.core.factorgraph import Problem, Tie
from pondwatch.core.inference import decide, nudged
from pondwatch.core.ports import one_by_one

EVEN = np.array([0.5, 0.5])
SAYS = {"empty": [1.8, 0.2], "full": [0.2, 1.8], "nothing": [1.0, 1.0]}


def _problem(snapshots, rods, state_prior=EVEN, ties=()):
    """snapshots: for each its places, each (log prior, {rod: look})."""
    places = [p for s in snapshots for p in s]
    edges = [(h, rod, look) for h, (_, seen) in enumerate(places) for rod, look in seen.items()]
    return Problem(
        np.concatenate([[0], np.cumsum([len(s) for s in snapshots])]).astype(np.int64),
        np.array([p for p, _ in places], dtype=float),
        np.array([h for h, _, _ in edges], dtype=np.int64),
        np.array([rod for _, rod, _ in edges], dtype=np.int64),
        np.arange(len(edges)),
        np.array([look for _, _, look in edges], dtype=float).reshape(-1, len(state_prior)),
        np.asarray(state_prior),
        rods,
        tuple(ties),
    )


def _every_assignment(problem):
    """Each choice of a place for every snapshot, with its log posterior, the rods' states summed out one by one."""
    own = [range(a, b) for a, b in zip(problem.start[:-1], problem.start[1:], strict=True)]
    for choice in product(*own):
        total = problem.log_prior[list(choice)].sum()
        for rod in range(problem.rods):
            states = problem.state_prior.copy()
            for h, r, k in zip(problem.edge_hypothesis, problem.edge_rod, problem.edge_look, strict=True):
                if r == rod and h in choice:
                    states = states * problem.look[k]
            total += np.log(states.sum())
        for t in problem.ties:
            at = choice[t.first] - problem.start[t.first], choice[t.second] - problem.start[t.second]
            total += t.log_factor[at]
        yield np.array(choice), float(total)


def _marginals(problem):
    belief = np.zeros(len(problem.log_prior))
    for choice, score in _every_assignment(problem):
        belief[choice] += np.exp(score)
    return belief / belief[: problem.start[1]].sum()


def _random(seed, snapshots=3, rods=3, places=3, tied=False):
    rng = np.random.default_rng(seed)
    prior = rng.dirichlet([2, 2, 1])

    def place():
        seen = rng.choice(rods, rng.integers(1, rods + 1), replace=False)
        return rng.normal(), {int(r): rng.gamma(0.5, 2.0, 3) + 0.01 for r in seen}

    made = [[place() for _ in range(rng.integers(2, places + 1))] for _ in range(snapshots)]
    ties = [Tie(i, i + 1, 2 * rng.standard_normal((len(made[i]), len(made[i + 1])))) for i in range(snapshots - 1)]
    return _problem(made, rods, prior, ties if tied else ())


@pytest.mark.parametrize("tied", [False, True])
@pytest.mark.parametrize("seed", range(12))
def test_the_best_assignment_is_the_best_of_all_assignments(seed, tied):
    problem = _random(seed, snapshots=2 + seed % 3, tied=tied)
    best, score = max(_every_assignment(problem), key=lambda a: a[1])

    decision = decide(problem)[0]

    np.testing.assert_array_equal(decision.choice, best)
    assert decision.score == pytest.approx(score, abs=1e-9)


def test_the_assignments_come_best_first_with_their_true_scores():
    problem = _random(3, snapshots=4)
    scores = {tuple(c): s for c, s in _every_assignment(problem)}

    decisions = decide(problem)

    assert [d.score for d in decisions] == sorted((d.score for d in decisions), reverse=True)
    for d in decisions:
        assert d.score == pytest.approx(scores[tuple(d.choice)], abs=1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_where_no_evidence_runs_in_circles_beliefs_are_the_marginals_of_all_assignments(seed):
    rng = np.random.default_rng(seed)

    def look():
        return rng.gamma(0.5, 2.0, 2) + 0.01

    problem = _problem(  # snapshot, rod, snapshot, rod, snapshot: a chain
        [
            [(0.3, {0: look()}), (-0.2, {1: look()})],
            [(0.0, {1: look(), 2: look()}), (0.4, {1: look()}), (0.1, {2: look()})],
            [(0.0, {2: look()}), (0.5, {3: look()})],
        ],
        4,
    )

    np.testing.assert_allclose(decide(problem)[0].belief, _marginals(problem), atol=1e-3)


def test_ties_alone_give_the_marginals_of_a_chain_in_time():
    rng = np.random.default_rng(7)
    ties = [Tie(0, 1, rng.standard_normal((2, 3))), Tie(1, 2, rng.standard_normal((3, 2)))]
    problem = _problem(
        [[(0.2, {0: [1, 1]}), (0.0, {})], [(0.0, {}), (0.5, {}), (-0.3, {})], [(0.0, {}), (0.1, {})]], 1, EVEN, ties
    )

    np.testing.assert_allclose(decide(problem)[0].belief, _marginals(problem), atol=1e-6)


@pytest.mark.parametrize(("bond", "place"), [(0.0, 1), (0.4, 1), (0.6, 0), (3.0, 0)])
def test_a_tie_turns_a_decision_once_it_weighs_more_than_what_speaks_against_it(bond, place):
    """First snapshot: surely its place 0 (5 nats). Second: place 1 is likelier by half a nat; the tie speaks for 0."""
    tie = Tie(0, 1, np.array([[bond, 0.0], [0.0, 0.0]]))
    problem = _problem([[(5.0, {}), (0.0, {0: SAYS["nothing"]})], [(0.0, {}), (0.5, {})]], 1, EVEN, [tie])

    assert decide(problem)[0].choice.tolist() == [0, 2 + place]


def test_a_look_that_agrees_with_what_another_snapshot_saw_decides_between_two_places():
    """Rod 0 was seen full, rod 1 empty, by a snapshot whose place is sure. The second sees a full rod: it lies at
    rod 0, by odds of (0.1 * 0.2 + 0.9 * 1.8) to (0.9 * 0.2 + 0.1 * 1.8)."""
    sure = [(0.0, {0: SAYS["full"], 1: SAYS["empty"]})]
    problem = _problem([sure, [(0.0, {0: SAYS["full"]}), (0.0, {1: SAYS["full"]})]], 2)

    decision = decide(problem)[0]

    assert decision.choice.tolist() == [0, 1]
    assert decision.belief[1] / decision.belief[2] == pytest.approx(1.64 / 0.36, rel=1e-3)
    np.testing.assert_allclose(decision.states[0], np.array([0.2**2, 1.8**2]) / (0.2**2 + 1.8**2))


def test_the_same_seed_gives_the_same_decision():
    problem = _field(2, side=7, snapshots=20)[0]

    first, second = decide(problem, seed=5), decide(problem, seed=5)

    assert [d.score for d in first] == [d.score for d in second]
    np.testing.assert_array_equal(first[0].belief, second[0].belief)


@pytest.mark.parametrize("restarts", [1, 2, 24])
def test_runs_made_apart_find_what_they_find_at_once_on_one_core(restarts):
    problem = _field(2, side=7, snapshots=20)[0]

    at_once, apart = decide(problem, restarts=restarts), decide(problem, restarts=restarts, spread=one_by_one)

    assert [d.score for d in apart] == [d.score for d in at_once]
    for one, other in zip(apart, at_once, strict=True):
        np.testing.assert_array_equal(one.choice, other.choice)
        np.testing.assert_array_equal(one.belief, other.belief)


def _score(problem, choice):
    """The log posterior of one assignment, by the product of its looks."""
    chosen = np.isin(problem.edge_hypothesis, choice)
    states = np.tile(np.log(problem.state_prior), (problem.rods, 1))
    np.add.at(states, problem.edge_rod[chosen], np.log(problem.look[problem.edge_look[chosen]]))
    return problem.log_prior[choice].sum() + np.logaddexp(states[:, 0], states[:, 1]).sum()


@pytest.mark.parametrize("seed", [3, 10])
def test_restarts_repair_a_cluster_that_lies_one_lattice_vector_off(seed):
    problem, truth, shift = _field(seed)

    alone, found = decide(problem, restarts=1)[0], decide(problem)[0]

    astray = shift[alone.choice][alone.choice != truth]
    _, together = np.unique(astray, axis=0, return_counts=True)
    assert together.max() > 20  # of 70, all by the same vector, each beside the next
    assert alone.score < _score(problem, truth) - 10
    assert found.score > _score(problem, truth) - 1e-6
    assert (found.choice != truth).sum() <= 5  # each alone, and likelier there


def test_moving_one_snapshot_repairs_next_to_nothing_of_a_field_that_lies_one_vector_off():
    """Why there are restarts: with all snapshots moved by one vector nothing inside contradicts it."""
    problem, truth, shift = _field(3)
    everywhere = np.arange(len(shift)).reshape(len(truth), -1)
    moved = everywhere[:, np.flatnonzero((shift[: everywhere.shape[1]] == [0, 1]).all(axis=1))[0]]
    score = _score(problem, moved)

    single = [_score(problem, np.where(np.arange(len(truth)) == i, h, moved)) for i in range(8) for h in everywhere[i]]

    assert score < _score(problem, truth) - 10
    assert max(single) - score < 0.2 * (_score(problem, truth) - score)


def _field(seed, side=10, snapshots=70, sigma=1.0):
    """A square of rods, each empty or full; snapshots that see two by three of them, not quite clearly, and may lie up
    to two rods away from where they do, in a position of whole rods that is off by `sigma`.

    Returns the problem, the true choice, and how far each place is from the true one, (H, 2).
    """
    rng = np.random.default_rng(seed)
    state = rng.integers(0, 2, (side, side))
    made, shifts = [], list(product(range(-2, 3), repeat=2))
    for _ in range(snapshots):
        x, y = rng.integers(2, side - 4, 2)
        window = list(product(range(2), range(3)))
        shown = [0.2 + 1.6 * state[x + i, y + j] for i, j in window]
        off = rng.normal(0, sigma, 2)
        made.append([
            (-((a - off[0]) ** 2 + (b - off[1]) ** 2) / (2 * sigma**2),
             {int((x + a + i) * side + y + b + j): [2 - s, s] for (i, j), s in zip(window, shown, strict=True)})
            for a, b in shifts
        ])  # fmt: skip
    true = np.arange(snapshots) * len(shifts) + shifts.index((0, 0))
    return _problem(made, side * side), true, np.array(shifts * snapshots)


def test_places_that_are_favoured_are_found_and_scored_without_the_favour():
    problem, _, shift = _field(3)
    beside = (shift == [0, 1]).all(axis=1)

    far, near = nudged(problem, [100.0 * beside, 0.0 * beside])

    assert beside[far.choice].sum() > 20 + beside[near.choice].sum()  # of 70; some gained by going back alone
    assert far.score == pytest.approx(_score(problem, far.choice))
    np.testing.assert_array_equal(near.choice, decide(problem, restarts=1)[0].choice)
