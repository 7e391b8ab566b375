"""The radio, broken bytes, options by name, and which demo comes next."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from pondwatch.core.errors import Invalid, InvalidImage
from pondwatch.core.images import decode, digest_of
from pondwatch.simulator.client import arrivals, demo_spec, items, next_demo
from pondwatch.simulator.faults import FAULTS, damaged
from pondwatch.simulator.options import specs_of
from pondwatch.simulator.radio import RadioSpec, deliveries
from pondwatch.simulator.simulation import Simulation
from pondwatch.simulator.spec import SimulationSpec

TIMES = np.arange(500) * 0.05
BAD = RadioSpec(loss=0.1, delay_s=0.5, twice=0.1, broken=0.1)


def arriving(radio, seed=0):
    return deliveries(TIMES, radio, np.random.default_rng(seed))


def test_a_perfect_radio_delivers_each_once_in_order():
    assert [(d.index, d.at_s, d.fault) for d in arriving(RadioSpec())] == [(n, TIMES[n], None) for n in range(500)]


def test_a_bad_radio_still_delivers_each_whole_and_never_before_it_was_taken():
    found = arriving(BAD)

    assert {d.index for d in found if d.fault is None} == set(range(500))
    assert all(d.at_s >= TIMES[d.index] - 0.0011 for d in found)
    assert [d.at_s for d in found] == sorted(d.at_s for d in found)


def test_a_bad_radio_disorders_doubles_and_breaks():
    found = arriving(BAD)
    whole = [d.index for d in found if d.fault is None]

    assert sum(a > b for a, b in pairwise(whole)) > 100
    assert 25 < len(whole) - 500 < 90
    assert 25 < sum(d.fault is not None for d in found) < 90
    assert found == arriving(BAD)


@pytest.mark.parametrize("fault", FAULTS)
def test_damaged_bytes_are_other_bytes_that_their_digest_tells(fault):
    content = bytes(range(256)) * 4

    for seed in range(20):
        assert digest_of(damaged(content, fault, np.random.default_rng(seed))) != digest_of(content)


def test_an_item_that_is_broken_on_the_way_carries_the_digest_of_the_whole_picture():
    simulation = Simulation(SimulationSpec(snapshots=30, coverage=4.0), seed=1)
    found = arrivals(simulation, RadioSpec(broken=0.5))

    sent = list(zip(found, items(simulation, found), strict=True))
    broken = [item for delivery, item in sent if delivery.fault]
    whole = [item for delivery, item in sent if not delivery.fault]

    assert len(broken) > 5
    assert all(digest_of(item.content) != item.digest for item in broken)
    assert all(digest_of(item.content) == item.digest for item in whole)
    assert {item.key.sequence for item in whole} == set(range(30))
    assert decode(whole[0].content, simulation.spec.camera).shape == (110, 160, 3)
    with pytest.raises(InvalidImage):
        decode(b"", simulation.spec.camera)


def test_options_take_the_kind_of_their_value():
    spec, radio = specs_of(
        {"snapshots": 30, "lattice": "square"},
        ["fills=striped", "heading-known=no", "outliers=0.05", "snapshots=40", "delay_s=2"],
    )

    assert spec == SimulationSpec(snapshots=40, lattice="square", fills="striped", heading_known=False, outliers=0.05)
    assert radio == RadioSpec(delay_s=2.0)


@pytest.mark.parametrize(
    ("named", "settings", "says"),
    [
        ({}, ["fill=striped"], "--set 'fill=striped': must be NAME=VALUE"),
        ({}, ["fills"], "must be NAME=VALUE"),
        ({}, ["camera=3"], "must be NAME=VALUE"),
        ({}, ["outliers=many"], "outliers must be of the kind of 0.0, and is 'many'"),
        ({}, ["mapped=perhaps"], "mapped must be of the kind of True"),
        ({}, ["outliers=3"], "outliers must be from 0 to 1"),
        ({"lattice": "round"}, [], "lattice must be one of hexagonal, square"),
    ],
)
def test_an_option_that_makes_no_sense_is_named(named, settings, says):
    with pytest.raises(Invalid) as caught:
        specs_of(named, settings)

    assert says in caught.value.message


class Sessions:
    """An uploader that only lists sessions."""

    def __init__(self, *sessions):
        self._sessions = [{"id": f"id-{n}", "name": name, "state": s} for n, (name, s) in enumerate(sessions)]

    def sessions(self):
        return self._sessions


@pytest.mark.parametrize(
    ("sessions", "expected"),
    [
        ((), (1, None)),
        ((("Demo inspection 2", "finished"), ("Demo inspection 1", "finished")), (3, None)),
        ((("Demo inspection 2", "open"), ("Demo inspection 1", "finished")), (2, "id-0")),
        ((("Pond 4", "open"), ("Demo inspection x", "open")), (1, None)),
    ],
)
def test_a_demo_that_was_cut_short_goes_on_and_else_a_new_one_begins(sessions, expected):
    assert next_demo(Sessions(*sessions)) == expected


def test_a_demo_is_the_same_again_by_its_number():
    one, again = (Simulation(demo_spec(3, 20), 3) for _ in range(2))

    assert one.snapshot(5).content == again.snapshot(5).content
    assert one.inspection == again.inspection
