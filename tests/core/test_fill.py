"""What rods are read as, from looks made by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pondwatch.core import states
from pondwatch.core.codes import SECTORS
from pondwatch.core.fill import Looks, read_rods, to_pond, wholly_in_view
from pondwatch.core.values import RodState

ANGLES = 2 * np.pi * np.arange(SECTORS) / SECTORS


def _wedge(fill, start_rad=0.3):
    """(SECTORS,): what a wedge that begins at a pond angle shows, sector by sector."""
    fine = (np.arange(60) - 29.5) / 60 * 2 * np.pi / SECTORS
    return (((ANGLES[:, None] + fine - start_rad) % (2 * np.pi)) < 2 * np.pi * fill).mean(axis=1)


def _looks(rods, shares, trust=1.0, noise=0.05, seed=0):
    share = np.array(shares) + noise * np.random.default_rng(seed).standard_normal((len(rods), SECTORS))
    return Looks(np.array(rods), share, np.full(len(rods), trust) if np.isscalar(trust) else np.array(trust))


def _one(shares, **how):
    (reading,) = read_rods(("R0",), _looks([0] * len(shares), shares, **how))
    return reading


@given(turns=st.integers(-30, 30))
def test_turned_by_whole_sectors_a_look_is_the_same_sectors_further_on(turns):
    share = np.arange(SECTORS, dtype=float)[None]

    turned = to_pond(share, np.array([turns * 2 * np.pi / SECTORS]))[0]

    np.testing.assert_allclose(turned, np.roll(share[0], turns), atol=1e-9)


def test_a_look_taken_by_a_turned_camera_shows_the_wedge_where_it_lies_in_the_pond():
    """At a heading of 90 degrees what the image shows to its right lies upwards in the pond."""
    right = np.where(np.cos(ANGLES) > 0.6, 1.0, 0.0)

    up = to_pond(right[None], np.array([np.pi / 2]))[0]

    np.testing.assert_allclose(up, np.where(np.sin(ANGLES) > 0.6, 1.0, 0.0), atol=1e-9)


@pytest.mark.parametrize("fill", [0.0, 0.1, 0.25, 0.5, 0.75, 0.9, 1.0])
def test_a_rod_is_read_with_its_state_and_its_fill(fill):
    reading = _one([_wedge(fill)] * 3)

    state = {0.0: RodState.EMPTY, 1.0: RodState.FULL}.get(fill, RodState.PARTIAL)
    assert reading.state is state
    assert reading.fill == pytest.approx(fill, abs=0.03)
    assert reading.views == 3
    assert reading.confidence > 0.9
    assert not reading.conflicting


@given(fill=st.floats(0.08, 0.92), start_rad=st.floats(-3, 3))
def test_a_wedge_of_any_size_and_angle_is_measured(fill, start_rad):
    reading = _one([_wedge(fill, start_rad)] * 2, noise=0.0)

    assert reading.state is RodState.PARTIAL
    assert reading.fill == pytest.approx(fill, abs=0.01)


@given(st.floats(0, 1), st.integers(0, 100))
def test_state_and_fill_never_contradict_each_other(fill, seed):
    reading = _one([_wedge(fill)], noise=0.2, seed=seed)

    by_fill = RodState.EMPTY if reading.fill < 0.05 else RodState.FULL if reading.fill > 0.95 else RodState.PARTIAL
    assert reading.state is by_fill
    assert 0 <= reading.fill <= 1
    assert 0 <= reading.confidence < 1


def test_rods_without_a_look_are_unseen():
    readings = read_rods(("a", "b", "c"), _looks([1], [_wedge(1.0)]))

    assert [r.rod_id for r in readings] == ["a", "b", "c"]
    assert [r.state for r in readings] == [RodState.UNSEEN, RodState.FULL, RodState.UNSEEN]
    assert (readings[0].fill, readings[0].confidence, readings[0].views) == (None, 0.0, 0)


def test_no_looks_at_all_leave_every_rod_unseen():
    nothing = Looks(np.zeros(0, np.int64), np.zeros((0, SECTORS)), np.zeros(0))

    assert {r.state for r in read_rods(("a", "b"), nothing)} == {RodState.UNSEEN}


def test_something_that_drifts_over_part_of_one_look_changes_nothing():
    covered = np.zeros(SECTORS)
    covered[3:9] = 1.5

    reading = _one([_wedge(0.0), covered, _wedge(0.0)])

    assert reading.state is RodState.EMPTY
    assert not reading.conflicting


def test_looks_of_which_half_say_full_and_half_empty_conflict():
    reading = _one([_wedge(0.0), _wedge(0.0), _wedge(1.0), _wedge(1.0)])

    assert reading.conflicting
    assert reading.confidence <= 0.5


def test_looks_that_may_be_of_other_rods_make_a_reading_doubtful_but_no_conflict():
    doubtful = _one([_wedge(0.0), _wedge(0.0), _wedge(1.0), _wedge(1.0)], trust=[0.999, 0.98, 0.9, 0.9])
    sure = _one([_wedge(0.0), _wedge(0.0), _wedge(1.0), _wedge(1.0)], trust=[0.999, 0.999, 0.999, 0.995])

    assert not doubtful.conflicting
    assert doubtful.confidence <= 0.5
    assert sure.conflicting


def test_one_look_of_a_snapshot_that_may_lie_elsewhere_does_not_outvote_a_sure_one():
    reading = _one([_wedge(0.0), _wedge(1.0)], trust=[0.999, 0.55])

    assert reading.state is RodState.EMPTY


def test_a_rod_seen_only_from_a_place_in_doubt_is_read_with_as_much_doubt():
    assert _one([_wedge(1.0)], trust=0.7).confidence <= 0.7
    assert _one([_wedge(1.0)], trust=0.99).confidence > 0.9


def test_where_hollow_and_filled_may_be_confused_confidence_says_so():
    looks = _looks([0], [_wedge(0.0)])

    (surely,), (perhaps,) = read_rods(("R0",), looks), read_rods(("R0",), looks, certainty=0.7)

    assert perhaps.state is surely.state
    assert perhaps.confidence < 0.8 < surely.confidence


def test_a_rod_perhaps_never_in_view_is_read_where_nearly_all_rods_are_alike_with_little_confidence():
    looks = _looks([0], [_wedge(0.0)], trust=0.2)
    alike = np.full(states.COUNT, 1e-4)
    alike[states.EMPTY] = 0.99
    mixed = np.full(states.COUNT, 1e-4)
    mixed[[states.EMPTY, states.FULL]] = 0.49

    (read,), (unread,) = (read_rods(("R0",), looks, prior / prior.sum()) for prior in (alike, mixed))

    assert (read.state, unread.state) == (RodState.EMPTY, RodState.UNSEEN)
    assert read.confidence <= 0.2


def test_a_rod_that_was_almost_surely_never_in_view_is_unseen_in_any_pond():
    alike = np.full(states.COUNT, 1e-6)
    alike[states.EMPTY] = 1.0

    (reading,) = read_rods(("R0",), _looks([0], [_wedge(0.0)], trust=0.05), alike)

    assert reading.state is RodState.UNSEEN


def test_the_order_of_looks_leaves_no_trace_but_in_the_last_digits():
    shares = [_wedge(f) for f in (0.5, 0.45, 0.55, 0.5)]

    first, second = _one(shares, noise=0), _one(shares[::-1], noise=0)

    assert first.state is second.state
    assert first.fill == pytest.approx(second.fill, abs=1e-12)


def test_a_rod_is_wholly_in_view_where_its_outer_circle_lies_inside_the_pictures_border():
    """The border runs half a pixel outside the outermost pixels' centres: from -0.5 to 159.5 and to 109.5."""
    centres = np.array([[9.5, 50], [9.4, 50], [149.5, 50], [149.6, 50], [80, 9.5], [80, 99.5], [80, 99.7], [-20, 50]])

    inside = wholly_in_view(centres, 10.0, 160, 110)

    assert inside.tolist() == [True, False, True, False, True, True, False, False]


def _unlike(taught):
    looks = Looks(np.zeros(2, dtype=np.int64), np.zeros((2, SECTORS)), np.ones(2), np.array([0.9, 1.0]))
    (reading,) = read_rods(("R0",), looks, taught=taught)
    return reading


def test_a_rod_that_shows_no_level_known_is_not_read_while_few_rods_taught_the_levels():
    assert _unlike(taught=5).state is RodState.UNSEEN


def test_a_rod_that_shows_no_level_known_conflicts_where_many_rods_taught_the_levels():
    reading = _unlike(taught=200)

    assert reading.conflicting
    assert reading.confidence <= 0.5
