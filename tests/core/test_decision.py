"""From evidence to a graph and from its solution to trust: against densities and odds worked out another way."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from pondwatch.core import states
from pondwatch.core.decision import (
    Table,
    Vocabulary,
    assemble,
    chains,
    known_states,
    tabulate,
    tie_errors,
    turns_of,
)
from pondwatch.core.evidence import gather
from pondwatch.core.factorgraph import Decision, Problem
from pondwatch.core.noise import NoiseModel
from pondwatch.core.values import SnapshotKey
from pondwatch.simulator.spec import SimulationSpec
from tests.core.ponds import hexagonal, inspected, setting_of, square


@pytest.fixture(scope="module")
def pond():
    return inspected(SimulationSpec(snapshots=44), 4)


@pytest.fixture(scope="module")
def evidence(pond):
    reach = NoiseModel.stated(pond.inspection.pose_noise, pond.setting.layout.pitch).reach(pond.setting.layout.pitch)
    return [gather(s, reach, pond.setting) for s in pond.snapshots]


@pytest.fixture(scope="module")
def vocabulary(pond, evidence):
    return Vocabulary.learn(evidence, pond.setting)


@pytest.mark.parametrize(
    ("points", "turns"),
    [
        (hexagonal(6, 6, 0.03), 6),
        (hexagonal(6, 6, 0.03, 0.4), 6),
        (square(6, 6, 0.03, 0.2), 4),
        (square(1, 6, 0.03), 2),
        (np.concatenate([square(6, 6, 0.03), square(6, 6, 0.03, 0.35) + [0.5, 0]]), 4),
        (np.array([[0, 0], [0.03, 0], [0.01, 0.033], [0.05, 0.03]]), 1),
        (np.zeros((1, 2)), 1),
    ],
    ids=["hexagonal", "turned", "square", "row", "two racks", "irregular", "one rod"],
)
def test_a_layout_has_as_many_turns_as_map_its_neighbour_vectors_onto_themselves(points, turns):
    assert turns_of(setting_of(points)) in (turns, 2 if turns == 1 else turns)


def test_which_states_a_pond_uses_is_learned_from_its_looks(pond, vocabulary):
    used = states.fills()[vocabulary.states]

    assert vocabulary.palette.two_levels
    assert vocabulary.prior.sum() == pytest.approx(1)
    for fill in (0.0, 1.0):
        true = np.average(pond.fills == fill, weights=pond.views().sum(axis=0))
        assert vocabulary.prior[used == fill].sum() == pytest.approx(true, abs=0.25)  # sites between rods count too
    assert vocabulary.full_prior().sum() == pytest.approx(1)
    assert len(vocabulary.full_prior()) == states.COUNT
    assert (vocabulary.full_prior() > 0).all()


def test_a_look_is_worth_its_likelihood_over_that_of_the_average_rod(evidence, vocabulary):
    looks = vocabulary.looks(evidence[0], 0.3)

    assert looks.shape == (len(evidence[0].sites_px), len(vocabulary.states))
    np.testing.assert_allclose(looks @ vocabulary.prior, 1)


def test_a_snapshots_factors_are_those_of_the_rods_its_places_show(pond, evidence, vocabulary):
    noise = NoiseModel.stated(pond.inspection.pose_noise, pond.setting.layout.pitch)

    for e in evidence[:8]:
        table = tabulate(e, vocabulary, noise, pond.setting, 6)

        assert len(table.prior) == len(e.places) + 1  # the last: at none of them
        assert (table.prior[-1] < table.prior[:-1].max(initial=-np.inf)) or not len(e.places)
        assert table.look.max(initial=-1) < len(table.values)
        for h, rod in zip(table.hypothesis, table.rod, strict=True):
            assert rod in e.places.rods[h][e.places.real[h] & (e.site[h] >= 0)]


def test_tables_of_snapshots_become_one_graph_with_everything_shifted_to_its_place(vocabulary):
    kinds = len(vocabulary.prior)

    def table(places, rods):
        return Table(np.arange(places + 1.0), np.arange(len(rods)), np.array(rods), np.arange(len(rods)),
                     np.full((len(rods), kinds), float(places)))  # fmt: skip

    problem = assemble([table(2, [5, 6]), table(1, [7])], vocabulary, 9)

    assert problem.start.tolist() == [0, 3, 5]
    assert problem.owner.tolist() == [0, 0, 0, 1, 1]
    assert problem.log_prior.tolist() == [0, 1, 2, 0, 1]
    assert problem.edge_hypothesis.tolist() == [0, 1, 3]
    assert problem.first_edges.tolist() == [0, 2, 3]
    assert problem.edge_rod.tolist() == [5, 6, 7]
    assert problem.look[problem.edge_look, 0].tolist() == [2, 2, 1]


def test_under_another_noise_a_table_known_before_is_what_it_would_be_anew(pond, evidence):
    vocabulary = Vocabulary.learn(evidence, pond.setting)
    before, after = NoiseModel(0.02, 0.1), NoiseModel(0.05, 0.3)

    for e in evidence[:5]:
        known = tabulate(e, vocabulary, before, pond.setting, 6)
        again, anew = (tabulate(e, vocabulary, after, pond.setting, 6, table) for table in (known, None))

        assert (again.prior != known.prior).any()
        for name in ("prior", "hypothesis", "rod", "look", "values"):
            np.testing.assert_array_equal(getattr(again, name), getattr(anew, name))


def test_headings_under_which_all_states_look_alike_share_their_looks(pond, evidence):
    """Quarter-sectors are 3.75 degrees."""
    vocabulary, noise = Vocabulary.learn(evidence, pond.setting), NoiseModel(0.02, 0.1)
    e = next(e for e in evidence if len(e.places))
    pose, step = e.places.poses[0] * [1, 1, 0], 2 * np.pi / 96
    places = e.places.take(np.zeros(3, np.int64))
    turned = replace(places, poses=np.array([pose, pose + [0, 0, 0.45 * step], pose + [0, 0, 3 * step]]))

    table = tabulate(replace(e, places=turned, far=e.far[[0, 0, 0]], site=e.site[[0, 0, 0]]), vocabulary, noise,
                     pond.setting, 6)  # fmt: skip

    sites = len(e.sites_px)
    assert len(table.values) == 2 * sites
    of = [table.look[table.hypothesis == h] for h in range(3)]
    assert of[0].tolist() == of[1].tolist() == (of[2] - sites).tolist()
    np.testing.assert_array_equal(table.values[sites:], vocabulary.looks(e, 3 * step))


def test_snapshots_of_one_robot_and_boot_are_chained_by_sequence_however_they_arrived(evidence):
    keys = [("b", 0, 7), ("a", 0, 2), ("a", 1, 0), ("a", 0, 1), ("b", 0, 3), ("a", 0, 9)]
    arrived = [
        replace(e, snapshot=replace(e.snapshot, key=SnapshotKey(*k))) for e, k in zip(evidence, keys, strict=False)
    ]

    first, second = chains(arrived)

    assert set(zip(first.tolist(), second.tolist(), strict=True)) == {(3, 1), (1, 5), (4, 0)}


def test_robots_whose_errors_are_fresh_are_not_tied(pond, evidence):
    pair = np.array([0]), np.array([1])

    assert tie_errors(evidence, NoiseModel(0.01, 0.1, correlation=0.0), pond.setting, *pair) == []


def test_a_tie_is_the_density_of_an_error_given_the_one_before_over_its_density_alone(pond, evidence):
    sigma, rho = 0.03, 0.9
    noise = NoiseModel(sigma, 0.1, gross=1e-7, correlation=rho)

    (tie,) = tie_errors(evidence, noise, pond.setting, np.array([0]), np.array([1]))

    one, two = ((e.snapshot.pose_pond[:2] - e.places.poses[:, :2]) / sigma for e in evidence[:2])
    joint = multivariate_normal(np.zeros(2), [[1, rho], [rho, 1]])
    alone = multivariate_normal(0, 1)
    compared = 0
    for a, b in np.ndindex(len(one), len(two)):
        expected = sum(
            joint.logpdf([one[a, k], two[b, k]]) - alone.logpdf(one[a, k]) - alone.logpdf(two[b, k]) for k in (0, 1)
        )
        if expected > -8 and max(np.abs(one[a]).max(), np.abs(two[b]).max()) < 2.5:  # else it may be a gross error
            assert tie.log_factor[a, b] == pytest.approx(expected, abs=0.05)
            compared += 1
    assert compared > 5
    assert not tie.log_factor[-1].any()
    assert not tie.log_factor[:, -1].any()


def test_looks_from_doubtful_places_count_as_much_as_these_are_likely():
    """One snapshot: at 70 % it sees rod 0, at 20 % rod 1, at 10 % it lies at none of its places."""
    look = np.array([[0.2, 1.8]])
    problem = Problem(np.array([0, 3]), np.log([0.7, 0.2, 0.1]), np.array([0, 1]), np.array([0, 1]), np.array([0, 0]),
                      look, np.array([0.5, 0.5]), 3)  # fmt: skip
    decision = Decision(np.array([0]), np.array([0.9, 0.06, 0.04]), np.zeros((3, 2)), 0.0)

    known = known_states(problem, decision, np.array([0.7]))

    told = [0.7 * look[0] + 0.3, 0.18 * look[0] + 0.82]  # what is left of 0.3 goes three to two
    expected = [t / t.sum() for t in told] + [[0.5, 0.5]]
    np.testing.assert_allclose(known, expected)


def test_where_every_place_is_sure_what_is_known_is_what_was_decided():
    look = np.array([[0.2, 1.8], [0.5, 1.5]])
    problem = Problem(np.array([0, 1, 2]), np.zeros(2), np.array([0, 1]), np.array([0, 0]), np.array([0, 1]), look,
                      np.array([0.5, 0.5]), 1)  # fmt: skip
    decision = Decision(np.array([0, 1]), np.ones(2), np.zeros((1, 2)), 0.0)

    known = known_states(problem, decision, np.ones(2))

    np.testing.assert_allclose(known, [[0.2 * 0.5, 1.8 * 1.5] / np.array(0.2 * 0.5 + 1.8 * 1.5)])


def test_where_no_place_sees_a_rod_nothing_is_known_of_any():
    nowhere = np.zeros(0, dtype=np.int64)
    problem = Problem(np.array([0, 2]), np.zeros(2), nowhere, nowhere, nowhere, np.zeros((0, 2)),
                      np.array([0.3, 0.7]), 2)  # fmt: skip
    decision = Decision(np.array([0]), np.array([0.9, 0.1]), np.zeros((2, 2)), 0.0)

    known = known_states(problem, decision, np.array([0.9]))

    np.testing.assert_allclose(known, [[0.3, 0.7], [0.3, 0.7]])
