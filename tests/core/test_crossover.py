"""Parts of assignments taken over, and rivals: against the scores of assignments written down one by one."""

from __future__ import annotations

import numpy as np
import pytest

from pondwatch.core.crossover import Rival, recombined, trust
from pondwatch.core.factorgraph import Decision, Problem, Tie
from pondwatch.core.inference import decide
from tests.core.test_inference import EVEN, SAYS, _every_assignment, _problem, _random

TWO = [(0.0, {0: SAYS["full"]}), (0.0, {1: SAYS["full"]})]  # a snapshot that may lie at either of two rods


def _scored(problem, choice):
    return next(score for c, score in _every_assignment(problem) if (c == choice).all())


def _decision(problem, choice, belief=None):
    belief = np.full(len(problem.log_prior), 0.5) if belief is None else np.array(belief)
    return Decision(np.array(choice), belief, np.zeros((problem.rods, 2)), _scored(problem, choice))


def _halves(ties=()):
    """Snapshots 0 and 1 see rods 0 and 1, snapshots 2 and 3 rods 2 and 3; each pair looks alike at both of its rods,
    and one place of each has a nat more."""
    other = [(p, {rod + 2: look for rod, look in seen.items()}) for p, seen in TWO]
    first = [(1.0, TWO[0][1]), TWO[1]]
    return _problem([first, TWO, [(1.0, other[0][1]), other[1]], other], 4, EVEN, ties)


def test_of_two_assignments_each_right_in_one_half_the_best_is_right_in_both():
    problem = _halves()
    one, two = _decision(problem, [0, 2, 5, 7]), _decision(problem, [1, 3, 4, 6])

    best, rivals = recombined(problem, [one, two])

    assert best.choice.tolist() == [0, 2, 4, 6]
    assert best.score == pytest.approx(_scored(problem, [0, 2, 4, 6]))
    assert [(r.snapshots.tolist(), r.places.tolist()) for r in rivals] == [([0, 1], [1, 3]), ([2, 3], [5, 7])]
    assert [r.nats for r in rivals] == pytest.approx([-1.0, -1.0])  # a pair moved together loses the nat alone


def test_what_is_tied_in_time_goes_together_though_it_sees_no_rod_in_common():
    tie = Tie(1, 2, np.array([[0.5, 0.0], [0.0, 0.5]]))
    problem = _halves([tie])

    _, rivals = recombined(problem, [_decision(problem, [0, 2, 4, 6]), _decision(problem, [1, 3, 5, 7])])

    assert [r.snapshots.tolist() for r in rivals] == [[0, 1, 2, 3]]
    assert rivals[0].nats == pytest.approx(-2.0)


@pytest.mark.parametrize("tied", [False, True])
@pytest.mark.parametrize("seed", range(6))
def test_nats_of_a_rival_are_the_difference_of_two_log_posteriors(seed, tied):
    problem = _random(seed, snapshots=4, rods=5, tied=tied)
    every = sorted(_every_assignment(problem), key=lambda a: -a[1])
    decisions = [Decision(c, np.ones(len(problem.log_prior)), np.zeros((5, 3)), s) for c, s in every[:12]]

    best, rivals = recombined(problem, decisions)

    assert best.choice.tolist() == every[0][0].tolist()
    assert rivals
    for rival in rivals:
        moved = best.choice.copy()
        moved[rival.snapshots] = rival.places
        assert rival.nats == pytest.approx(_scored(problem, moved) - every[0][1])


def test_the_states_are_those_of_the_recombined_assignment():
    problem = _halves()
    best, _ = recombined(problem, [_decision(problem, [0, 2, 5, 7]), _decision(problem, [1, 3, 4, 6])])

    twice = np.array([0.2**2, 1.8**2]) / (0.2**2 + 1.8**2)
    np.testing.assert_allclose(best.states, [twice, EVEN, twice, EVEN])


def _two_snapshots():
    none = np.zeros(0, dtype=np.int64)
    return Problem(np.array([0, 2, 4]), np.zeros(4), none, none, none, np.zeros((0, 2)), EVEN, 1)


def _believed(belief):
    return Decision(np.array([0, 2]), np.array(belief), np.zeros((1, 2)), 0.0)


def test_trust_is_the_marginal_less_the_share_of_groups_that_could_lie_elsewhere():
    """Together both have a quarter of the best's odds elsewhere: what they are trusted for is divided by 1.25."""
    together = Rival(np.array([0, 1]), np.array([1, 3]), float(np.log(0.25)))

    found = trust(_two_snapshots(), _believed([0.95, 0.05, 0.9, 0.1]), [together])

    np.testing.assert_allclose(found, [0.95 / 1.25, 0.9 / 1.25])


def test_what_a_marginal_knows_of_one_snapshot_is_not_counted_twice():
    """A rival of the second alone, with a ninth of its odds: that is what its marginal of 0.9 says already; with a
    third of them it says more."""
    same, more = (Rival(np.array([1]), np.array([3]), float(np.log(odds))) for odds in (1 / 9, 1 / 3))
    decision = _believed([0.95, 0.05, 0.9, 0.1])

    np.testing.assert_allclose(trust(_two_snapshots(), decision, [same]), [0.95, 0.9])
    np.testing.assert_allclose(trust(_two_snapshots(), decision, [more]), [0.95, 0.75])


def test_one_assignment_alone_has_no_rivals():
    problem = _halves()
    decision = decide(problem)[0]

    best, rivals = recombined(problem, [decision, decision])

    assert best is decision
    assert rivals == ()
