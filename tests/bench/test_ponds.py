"""Ponds measured in memory: the bound by another route, counts by hand, records that outlive a crash."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from pondwatch.core.values import Camera
from pondwatch.simulator.camera import photograph
from pondwatch.simulator.simulation import Simulation
from pondwatch.simulator.spec import SimulationSpec
from tests.bench import factors, moonshot
from tests.bench.bound import bound_px
from tests.bench.ponds import CORRECTOR, Kept, code_digest, jumps, measured, needed, pooled, simulated
from tests.bench.score import Result

SMALL = SimulationSpec(snapshots=10, image_kind="png", margin_px=20.0)


def test_the_bound_is_the_one_that_slopes_of_a_finer_picture_give() -> None:
    simulation = Simulation(SMALL, seed=5)

    ratios = [bound_px(simulation, n) / _bound_by_slopes(simulation, n) for n in range(6)]

    assert np.median(ratios) == pytest.approx(1, abs=0.08)


def _bound_by_slopes(simulation: Simulation, n: int) -> float:
    """By the slopes of a picture four times finer, averaged and blurred as the camera and the clear water do."""
    pose, camera = simulation.truth_poses[n], SMALL.camera
    finer = Camera(4 * camera.width_px, 4 * camera.height_px, camera.metres_per_pixel / 4)
    by_v, by_u = np.gradient(photograph(simulation.floor, pose, finer), 0.25, axis=(0, 1))  # a pixel, of the coarse
    slopes = [cv2.GaussianBlur(_by_fours(g), (0, 0), 0.4, borderType=cv2.BORDER_REPLICATE) for g in (by_u, by_v)]
    v, u = np.mgrid[: camera.height_px, : camera.width_px] - np.array([54.5, 79.5])[:, None, None]
    turn = slopes[1] * u[..., None] - slopes[0] * v[..., None]
    columns = np.stack([*slopes, turn], axis=-1).reshape(-1, 3).astype(float)
    noise = 2.0**2 + 1 / 12  # of the sensor in clear water, and of rounding
    covariance = noise * np.linalg.inv(columns.T @ columns)
    return float(np.sqrt(covariance[0, 0] + covariance[1, 1]))


def _by_fours(picture: Any) -> Any:
    height, width = picture.shape[0] // 4, picture.shape[1] // 4
    return picture.reshape(height, 4, width, 4, 3).mean(axis=(1, 3))


def test_a_pond_measured_in_memory_tells_figures_errors_over_the_bound_and_jumps() -> None:
    record = measured(SMALL, 4, "identity", bounds=3)

    assert record["figures"]["median_px"] == record["identity"]["median_px"] > 5  # both do nothing
    assert len(record["over_bound"]) <= 3
    assert record["jumps"]["snapshots"] == 10


def test_jumps_are_counted_among_all_and_among_the_placed() -> None:
    truth = simulated(Simulation(SMALL, seed=4)).truth
    off_px = np.array([0, 3, 6, 29, 31, 0, 0, 31, 0, 0])
    poses = truth.poses + np.outer(off_px * SMALL.camera.metres_per_pixel, [1, 0, 0])
    statuses = tuple("uncertain" if k in (2, 7) else "placed" for k in range(10))

    found = jumps(truth, Result(poses, np.full(10, np.nan), statuses, {}), pitch_px=60.0)

    assert (found["half_pitch"], found["half_pitch_placed"]) == (2, 1)
    assert (found["gross"], found["gross_placed"], found["placed"]) == (4, 2, 8)


def test_records_survive_a_line_that_was_cut_off(tmp_path: Path) -> None:
    kept = Kept("a", tmp_path)
    kept.add({"x": 1})
    with kept.path.open("a") as file:
        file.write('{"x": 2')

    assert Kept("a", tmp_path).records() == [{"x": 1}]


def test_records_of_poses_outlive_a_change_of_what_poses_do_not_depend_on(tmp_path: Path) -> None:
    (tmp_path / "corrector.py").write_text("from . import noise\nfrom .lattice import Lattice\n")
    (tmp_path / "lattice.py").write_text("import math\nfrom .values import Pose\n")
    for name in ("noise", "values", "report"):
        (tmp_path / f"{name}.py").write_text("")
    before = code_digest([tmp_path / "corrector.py"])

    (tmp_path / "report.py").write_text("x = 1\n")
    same = code_digest([tmp_path / "corrector.py"])
    (tmp_path / "values.py").write_text("x = 1\n")

    assert same == before != code_digest([tmp_path / "corrector.py"])
    assert {p.stem for p in needed(CORRECTOR)} >= {"corrector", "lattice", "graph", "refine", "hypotheses", "values"}


def test_quantiles_are_of_all_ponds_together() -> None:
    assert pooled([{"over_bound": [1.0, 2.0]}, {"over_bound": [9.0]}, {"over_bound": []}], 0.5) == 2.0
    assert pooled([{"over_bound": []}], 0.5) is None


def test_every_pond_of_the_moonshot_can_be_simulated() -> None:
    specs = [moonshot.spec_of(seed) for seed in range(500)]

    for spec in specs:
        spec.check()
    assert 0.1 <= min(s.noise_pitch for s in specs) < max(s.noise_pitch for s in specs) < 0.5
    assert sum(s.water == "murky" for s in specs) / 500 == pytest.approx(0.2, abs=0.06)


def test_every_case_is_met_once_before_any_is_met_twice_and_quick_leaves_out_the_large() -> None:
    wanted = list(factors._wanted(2, quick=False))

    first = [name for name, _, seed in wanted if seed == factors.FIRST_SEED]
    assert [seed for _, _, seed in wanted] == sorted(seed for _, _, seed in wanted)
    assert len(set(first)) == len(first)
    assert "snapshots: 5000" in first
    assert max(spec.snapshots for _, spec, _ in factors._wanted(2, quick=True)) <= factors.QUICK


def test_the_base_case_stands_in_every_factor_under_one_name() -> None:
    names = [name for factor in factors.FACTORS for name, _ in factors._cases(factor)]

    assert names.count("base") >= 6
    assert dict(factors._cases(factors.FACTORS[0]))["pose noise, pitch: 0.64"] == replace(
        factors.BASE, noise_pitch=0.64
    )
