"""Correction methods by name, and what all of them promise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pondwatch.core.corrector import METHODS, hold, make_corrector
from pondwatch.core.errors import Invalid
from pondwatch.core.values import Inspection, Pond, PoseNoise, Snapshot, SnapshotKey
from tests.core.ponds import CAMERA, METRES, hexagonal, pond_of

MAPPED = Inspection("", CAMERA, pond_of(hexagonal(4, 4, 48 * METRES)), PoseNoise(0.01, 0.1))
UNMAPPED = replace(MAPPED, pond=Pond(0.3, 0.2))
BLANK = np.full((110, 160, 3), 90, np.uint8)
SNAPSHOTS = [Snapshot(SnapshotKey("bubble-1", 0, n), 0.0, np.array([0.05, 0.05, 0.0]), BLANK) for n in range(3)]


def test_a_layout_is_corrected_by_its_lattice_unless_another_method_is_named():
    assert make_corrector(MAPPED).method == "lattice"
    assert make_corrector(MAPPED, "identity").method == "identity"


def test_without_a_layout_another_method_is_taken():
    assert make_corrector(UNMAPPED).method not in ("lattice", "auto")


@pytest.mark.parametrize("method", METHODS)
def test_every_method_named_can_be_made_and_says_its_own_name(method):
    corrector = make_corrector(MAPPED, method)

    assert corrector.method == method or method == "auto"
    assert corrector.quality().snapshots == 0
    assert [r.rod_id for r in corrector.rods()] == [r.id for r in MAPPED.pond.rods]


@pytest.mark.parametrize("method", METHODS)
def test_every_method_answers_each_snapshot_once_and_counts_it(method):
    corrector = make_corrector(MAPPED, method)

    said = corrector.add(SNAPSHOTS)

    assert {p.key for p in said.poses} == {s.key for s in SNAPSHOTS} == set(corrector.poses())
    quality = corrector.settle().quality
    assert quality.snapshots == quality.placed + quality.uncertain + quality.rejected == 3


@pytest.mark.parametrize("method", METHODS)
def test_snapshots_held_back_are_decided_when_all_is_settled(method):
    corrector = make_corrector(MAPPED, method)

    hold(corrector, SNAPSHOTS)
    corrector.settle()

    assert set(corrector.poses()) == {s.key for s in SNAPSHOTS}


def test_a_method_that_there_is_not_is_refused_with_those_that_there_are():
    with pytest.raises(Invalid) as fault:
        make_corrector(MAPPED, "magic")

    assert fault.value.facts == {"method": "magic"}
    assert all(method in fault.value.message for method in ("magic", *METHODS))


def test_the_lattice_of_a_pond_without_a_layout_is_refused():
    with pytest.raises(Invalid):
        make_corrector(UNMAPPED, "lattice")
