"""The benches measure what they say, on a session small enough for every run."""

from __future__ import annotations

from pathlib import Path

import pytest

from pondwatch.simulator.bundle import write_bundle
from pondwatch.simulator.simulation import Simulation
from pondwatch.simulator.spec import SimulationSpec
from pondwatch.store.store import Store
from tests.bench import accuracy, pairs, speed


@pytest.fixture(scope="module")
def bundle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("bench") / "small"
    write_bundle(Simulation(SimulationSpec(snapshots=12), seed=3), folder)
    return folder


def test_the_row_of_doing_nothing_is_the_same_by_command_and_by_scorer(bundle: Path, tmp_path: Path) -> None:
    before, after = accuracy.measure(bundle, "identity", tmp_path)

    # 0.32 of a 60 px pitch in x and in y: the median of such a distance is 1.18 sigma, 22.6 px
    assert before.figures["median_px"] == pytest.approx(22.6, rel=0.5)
    assert after.figures["median_px"] == pytest.approx(before.figures["median_px"], abs=0.01)
    assert after.seconds is not None


def test_every_table_has_a_row_for_each_method(bundle: Path, tmp_path: Path) -> None:
    rows = accuracy.measure(bundle, "identity", tmp_path)

    for text in (accuracy.short_table(rows), accuracy.long_table(rows), accuracy.paper_table(rows)):
        assert text.count("| small | `identity` |") == 2


def test_adding_to_a_settled_session_is_timed_snapshot_by_snapshot() -> None:
    told = speed.grow(12, "identity", added=5)

    assert 0 < told["median_ms"] <= told["p95_ms"] <= told["slowest_ms"]
    assert told["state_kb_each"] == pytest.approx(1024 * told["state_mb"] / 12)


def test_a_pair_of_inspections_is_measured_against_what_was_planted(tmp_path: Path) -> None:
    spec = SimulationSpec(snapshots=40, noise_pitch=0.1, print_colours=True)
    with Store(tmp_path, f"sqlite:///{tmp_path}/t.sqlite") as store:
        row = pairs.measured(store, pairs.Pair(spec, 4, "clear", {}, {}), 11)

    assert row.rods == len(row.told["rods"]) + sum(row.told["counts"][c] for c in ("same", "not_comparable"))
    assert row.listed == row.as_it_is == row.in_both <= 4
    assert row.made_up == 0
