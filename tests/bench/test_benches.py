"""The benches measure what they say, on a session small enough for every run."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import httpx
import pytest

from pondwatch.core.layouts import lattice
from pondwatch.simulator.bundle import write_bundle
from pondwatch.simulator.simulation import Simulation
from pondwatch.simulator.spec import SimulationSpec
from pondwatch.store.store import Store
from tests.bench import accuracy, compare, findings, pairs, speed
from tests.fakes.whole import whole


@pytest.fixture(scope="module")
def bundle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("bench") / "small"
    write_bundle(Simulation(SimulationSpec(snapshots=12), seed=3), folder)
    return folder


@pytest.fixture(scope="module")
def rows(bundle: Path, tmp_path_factory: pytest.TempPathFactory) -> list[accuracy.Row]:
    """Without a method, and by the one that does nothing."""
    return accuracy.measure(bundle, "identity", tmp_path_factory.mktemp("measured"))


def test_the_row_of_doing_nothing_is_the_same_by_command_and_by_scorer(rows: list[accuracy.Row]) -> None:
    before, after = rows

    # 0.32 of a 60 px pitch in x and in y: the median of such a distance is 1.18 sigma, 22.6 px
    assert before.figures["median_px"] == pytest.approx(22.6, rel=0.5)
    assert after.figures["median_px"] == pytest.approx(before.figures["median_px"], abs=0.01)
    assert after.seconds is not None


def test_every_table_has_a_row_for_each_method(rows: list[accuracy.Row]) -> None:
    for text in (accuracy.short_table(rows), accuracy.long_table(rows), accuracy.paper_table(rows)):
        assert text.count("| small | `identity` |") == 2


def test_adding_to_a_settled_session_is_timed_snapshot_by_snapshot() -> None:
    told = speed.grow(12, "identity", added=5)

    assert 0 < told["median_ms"] <= told["p95_ms"] <= told["slowest_ms"]
    assert told["state_kb_each"] == pytest.approx(1024 * told["state_mb"] / 12)


def test_a_pair_of_inspections_is_measured_against_what_was_planted(tmp_path: Path) -> None:
    spec = SimulationSpec(snapshots=40, noise_pitch=0.1, print_colours=True)
    with Store(tmp_path, f"sqlite:///{tmp_path}/t.sqlite") as store:
        base = pairs.inspect(store, replace(spec, pond_seed=11), 1)
        row = pairs.measured(store, pairs.Pair(spec, 4, "clear", {}, {}, 11), base, 2)

    assert row.rods == len(row.told["rods"]) + sum(row.told["counts"][c] for c in ("same", "not_comparable"))
    assert row.listed == row.as_it_is == row.in_both <= 4
    assert row.made_up == 0


@pytest.mark.long
def test_an_inspection_with_things_and_rods_off_their_place_is_held_against_what_was_put_there() -> None:
    spec = SimulationSpec(
        snapshots=60, noise_pitch=0.1, print_colours=True, objects=2, object_px=10.0, displaced=2, displaced_px=4.0
    )
    of_things = findings.measured(findings.Case("things", "clear", spec, 5))
    of_rods = findings.measured(findings.Case("rods", "clear", spec, 5))

    assert of_things["object"]["put"] == of_rods["rods"]["put"] == 2
    assert of_things["object"]["found"] <= of_things["object"]["seen"] <= 2
    assert of_rods["rods"]["found"] == len(of_rods["rods"]["error_px"])


def test_a_database_for_comparing_holds_what_it_says_and_every_request_is_timed(tmp_path: Path) -> None:
    pond = lattice("square", 0.05, columns=4, rows=3, outer_m=0.018, inner_m=0.012)
    kept = compare.fill(tmp_path / "data", pond, 5, 0.001, changed=2)

    with whole(tmp_path / "data") as running, httpx.Client(base_url=running.url) as client:
        times = compare.asked(client, kept, pond, 2)
        told = client.get("/api/compare", params={"base": kept.before, "with": kept.after}).json()
        listed = client.get(f"/api/ponds/{kept.pond}").json()["inspections"]

    assert (len(told["rods"]), told["comparable"], len(listed)) == (2, True, 5)
    assert all(min(taken) > 0 for taken in times.values())
    assert compare.rows_of(times).count("\n") == 2 + len(times)
