"""Two stored inspections beside each other."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from pondwatch.core.errors import Missing
from pondwatch.core.layouts import lattice
from pondwatch.core.values import RodReading, RodState
from pondwatch.jobs import comparing, registering, tiles
from pondwatch.store import registrations
from pondwatch.store.store import Store
from tests.fakes.inspections import finished, floor, tiles_of

POND = lattice("square", 0.05, columns=5, rows=4, outer_m=0.018, inner_m=0.012)
BEFORE = "EEEEEFFFFFPPPPPEFEF?"
AFTER_ = "EEFEEFFEFFPPPPEEFE?F"


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with Store(tmp_path, f"sqlite:///{tmp_path}/t.sqlite") as opened:
        yield opened


@pytest.fixture
def pair(store: Store) -> tuple[str, str]:
    return finished(store, POND, BEFORE, 1_000), finished(store, POND, AFTER_, 9_000)


def test_changed_rods_are_listed_with_both_sides_and_the_rest_is_counted(store: Store, pair: tuple[str, str]) -> None:
    told = comparing.json_of(comparing.find(store, *pair))

    assert {r["rod_id"]: (r["change"], r["word"]) for r in told["rods"]} == {
        "R0002": ("filled", "moved"), "R0007": ("emptied", "moved"), "R0014": ("emptied", "removed"),
    }  # fmt: skip
    assert {r["rod_id"]: r["reason"] for r in told["not_comparable"]} == {
        "R0018": "not_observed_with", "R0019": "not_observed_base",
    }  # fmt: skip
    assert told["counts"] == {"same": 15, "filled": 1, "emptied": 2, "partly": 0, "not_comparable": 2}
    assert (told["compared"], told["not_observed"], told["comparable"]) == (18, 2, True)
    assert told["rods"][0]["base"]["state"] == "empty"
    assert told["rods"][0]["with"]["fill"] == 1.0


def test_the_residual_is_how_far_one_mosaic_was_moved_in_pixels_and_millimetres(store: Store) -> None:
    still = finished(store, POND, BEFORE, 1_000)
    moved = finished(store, POND, BEFORE, 9_000, image=floor(POND, BEFORE, shift_px=(0.5, 0.25)))

    residual = comparing.json_of(comparing.find(store, still, moved))["residual"]

    assert residual["median_px"] == pytest.approx(np.hypot(0.5, 0.25), abs=0.1)
    assert residual["median_mm"] == pytest.approx(residual["median_px"] * 1.0, abs=1e-4)  # a pixel is a millimetre
    assert residual["shift_mm"] == pytest.approx([0.5, -0.25], abs=0.1)
    assert residual["rods"] == 19


def test_mosaics_that_do_not_lie_on_each_other_claim_no_difference(store: Store) -> None:
    """The limit is a quarter of the inner radius: 3 px here."""
    base = finished(store, POND, BEFORE, 1_000)
    off = finished(store, POND, AFTER_, 9_000, image=floor(POND, AFTER_, shift_px=(3.4, 0.0)))

    told = comparing.json_of(comparing.find(store, base, off))

    assert (told["comparable"], told["reason"], told["rods"]) == (False, "residual", [])
    assert told["residual"]["median_px"] > told["residual"]["limit_px"] == 3.0
    assert {r["reason"] for r in told["not_comparable"]} >= {"residual"}


def test_a_mosaic_too_far_aside_for_its_rings_to_be_found_claims_no_difference(store: Store) -> None:
    base = finished(store, POND, BEFORE, 1_000)
    off = finished(store, POND, AFTER_, 9_000, image=floor(POND, AFTER_, shift_px=(12.0, 0.0)))

    told = comparing.json_of(comparing.find(store, base, off))

    assert (told["comparable"], told["reason"], told["rods"]) == (False, "unmeasured", [])
    assert told["residual"]["median_px"] is None


def test_last_is_the_finished_inspection_of_the_same_pond_before(store: Store, pair: tuple[str, str]) -> None:
    other = lattice("square", 0.05, columns=3, rows=4, outer_m=0.018, inner_m=0.012)
    finished(store, other, "E" * 12, 5_000)

    assert comparing.find(store, "last", pair[1]).base.session.id == pair[0]
    with pytest.raises(Missing):
        comparing.find(store, "last", pair[0])
    with pytest.raises(Missing):
        comparing.find(store, "last", "nobody")


def test_a_csv_has_every_rod_that_is_not_the_same(store: Store, pair: tuple[str, str]) -> None:
    content = comparing.csv_of(comparing.find(store, *pair), "change", descending=True).decode()

    rows = list(csv.DictReader(io.StringIO(content)))
    assert [row["change"] for row in rows] == ["not_comparable"] * 2 + ["emptied"] * 2 + ["filled"]
    assert rows[-1]["base_state"] == "empty"
    assert rows[0]["reason"].startswith("not_observed")


def test_what_was_measured_is_kept_and_measured_anew_after_a_further_revision(
    store: Store, pair: tuple[str, str]
) -> None:
    first = registering.offsets(store, pair[0])

    assert registering.offsets(store, pair[0]) == pytest.approx(first, nan_ok=True)
    assert store.read(lambda c: registrations.read(c, pair[0], 1)) is not None
    assert store.read(lambda c: registrations.read(c, pair[0], 2)) is None


def test_coarse_tiles_that_were_kept_look_like_those_made_on_the_spot(store: Store) -> None:
    pond = lattice("square", 0.05, columns=12, rows=9, outer_m=0.018, inner_m=0.012)
    letters = "".join(np.random.default_rng(2).choice(list("EPF?"), 108))
    session = finished(store, pond, letters, 1_000)
    made = [tiles.tile(store, session, "mosaic", 0, 0, 0)[0], tiles.tile(store, session, "mosaic", 1, 1, 0)[0]]

    registering.prepare(store, session)

    kept = [tiles.tile(store, session, "mosaic", 0, 0, 0)[0], tiles.tile(store, session, "mosaic", 1, 1, 0)[0]]
    for a, b in zip(made, kept, strict=True):
        before, after = (tiles._decoded(content).astype(int) for content in (a, b))
        assert before.shape == after.shape == (256, 256, 4)
        assert np.abs(before - after)[..., 3].mean() < 3
        assert np.abs(before - after).mean() < 4


def test_a_part_of_the_mosaic_is_what_the_whole_has_there(store: Store) -> None:
    session = finished(store, POND, BEFORE, 1_000)
    whole = tiles.whole(store, session)[1]

    _, part = tiles.part(store, session, tiles.Rect(-10, 100, 300, 200))

    assert whole.shape == (250, 300, 4)
    np.testing.assert_array_equal(part[:150, 10:], whole[100:, :290])
    assert not part[:, :10].any()
    assert not part[150:].any()


def test_verdicts_of_two_methods_differ_where_their_states_do() -> None:
    own = {i: RodReading(i, RodState.FULL, 1.0, 0.99, 3) for i in ("A", "B", "C")}
    other = own | {
        "B": RodReading("B", RodState.EMPTY, 0.0, 0.9, 3),
        "C": RodReading("C", RodState.UNSEEN, None, 0.0, 0),
    }

    told = comparing.verdicts(own, other)

    assert [(r["rod_id"], r["with"]["state"]) for r in told] == [("B", "empty"), ("C", "unseen")]
    assert told[0]["p_differ"] == pytest.approx(1 - (0.99 * 0.05 + 0.005 * 0.9 + 0.005 * 0.05))
    assert told[1]["p_differ"] is None


def test_tiles_made_for_a_test_are_those_of_the_whole_mosaic(store: Store) -> None:
    image = floor(POND, BEFORE)
    session = finished(store, POND, BEFORE, 1_000)

    assert len(tiles_of(image)) == 4
    np.testing.assert_array_equal(tiles.whole(store, session)[1], image)
