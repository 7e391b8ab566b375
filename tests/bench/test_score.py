"""The scorer: figures by hand on a small pond, and the same as a reference scorer's where it is at hand."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path

import numpy as np
import pytest

from tests.bench.score import Figures, Truth, identity, read_result, read_truth, score

SHARED = Path(__file__).parents[3] / "shared"
POSES = "sequence,robot,captured_at,image,x_m,y_m,theta_rad\n"
RESULT = "sequence,robot,boot,x_m,y_m,theta_rad,sigma_xy_m,sigma_theta_rad,status\n"


@pytest.fixture
def bundle(tmp_path: Path) -> Path:
    """100 x 60 pixels at 1 mm each over a pond of 1 m x 0.5 m; two snapshots; three rods, one never seen."""
    rods = [("A", 0.2, 0.2), ("B", 0.6, 0.3), ("C", 0.9, 0.45)]
    layout = [{"id": i, "x_m": x, "y_m": y, "outer_radius_m": 0.01, "inner_radius_m": 0.006} for i, x, y in rods]
    session = {
        "format": "pond-session/1",
        "name": "by hand",
        "camera": {"width_px": 100, "height_px": 60, "metres_per_pixel": 0.001},
        "pond": {"width_m": 1.0, "height_m": 0.5, "rods": layout},
    }
    folder = tmp_path / "bundle"
    folder.mkdir()
    (folder / "session.json").write_text(json.dumps(session))
    (folder / "poses.csv").write_text(POSES + "0,a,,0.png,0.23,0.24,0.1\n1,a,,1.png,0.6,0.3,3.14159265\n")
    (folder / "truth_poses.csv").write_text("sequence,x_m,y_m,theta_rad\n0,0.2,0.2,0.0\n1,0.6,0.3,3.14159265\n")
    (folder / "truth_rods.csv").write_text("rod_id,fill\nA,1.0\nB,0.5\nC,0.0\n")
    return folder


def test_doing_nothing_leaves_the_error_that_came_with_the_poses(bundle: Path) -> None:
    truth = read_truth(bundle)

    figures = score(truth, identity(truth))

    assert figures["median_px"] == pytest.approx(25.0)  # one snapshot 50 px off (30, 40), one exact
    assert figures["gross"] == 0.5
    np.testing.assert_allclose(figures["mse"], [0.03**2 / 2, 0.08**2 / 2, 0.1**2 / 2])
    np.testing.assert_allclose(figures["mae"], [0.015, 0.04, 0.05])
    assert figures["r2"][0] == pytest.approx(1 - 0.03**2 / (2 * 0.2**2))


def test_a_correction_is_scored_by_what_it_says_and_what_is_so(bundle: Path, tmp_path: Path) -> None:
    (tmp_path / "poses.csv").write_text(
        RESULT + "0,a,0,0.2,0.21,0.0,0.001,0.01,placed\n1,a,0,0.6,0.3,3.14159265,0.001,0.01,uncertain\n"
    )
    (tmp_path / "rods.csv").write_text(
        "rod_id,state,fill,confidence,views\nA,full,0.98,1,1\nB,empty,0.01,1,1\nC,empty,0.0,0.9,1\n"
    )
    truth = read_truth(bundle)

    figures = score(truth, read_result(tmp_path, truth))

    assert figures["gross"] == 0.5  # 10 px off
    assert (figures["sure"], figures["gross_among_sure"]) == (0.5, 1.0)
    assert figures["within_3_sigma"] == 0.0  # 10 px against 3 x sqrt(2) x 1 px
    assert figures["iou_footprint"] == pytest.approx((5000 / 7000 + 1) / 2)  # 10 of 60 rows apart
    assert (figures["rods_visible"], figures["rod_state_accuracy"]) == (2, 0.5)
    assert figures["rod_fill_mae"] == pytest.approx((0.02 + 0.49) / 2)
    assert figures["rods_read_though_never_visible"] == 1


def test_a_snapshot_without_a_pose_counts_with_its_noisy_one(bundle: Path, tmp_path: Path) -> None:
    (tmp_path / "poses.csv").write_text(RESULT + "0,a,0,,,,,,rejected\n1,a,0,0.6,0.3,3.14159265,0.001,0.01,placed\n")
    truth = read_truth(bundle)

    figures = score(truth, read_result(tmp_path, truth))

    assert (figures["placed"], figures["sure"]) == (0.5, 0.5)
    assert figures["median_px"] == pytest.approx(25.0)


def test_of_a_correction_that_places_nothing_no_alignment_is_told(bundle: Path, tmp_path: Path) -> None:
    (tmp_path / "poses.csv").write_text(RESULT + "0,a,0,,,,,,rejected\n1,a,0,,,,,,rejected\n")
    truth = read_truth(bundle)

    figures = score(truth, read_result(tmp_path, truth))

    assert (figures["median_px_aligned"], figures["gross_aligned"]) == (None, None)
    assert (figures["placed"], figures["gross"]) == (0.0, 0.5)


@pytest.mark.parametrize("name", ["plain", "unmapped"])
def test_it_agrees_with_the_reference_scorer(name: str, tmp_path: Path) -> None:
    if not (SHARED / "score.py").exists():
        pytest.skip("the reference scorer is not at hand")
    truth = read_truth(SHARED / "samples" / name)
    _write_a_made_up_result(truth, tmp_path)

    ours = score(truth, read_result(tmp_path, truth))

    theirs = _reference(SHARED / "samples" / name, tmp_path)
    told = {figure: value for figure, value in theirs.items() if truth.fills or not figure.startswith("rod")}
    assert set(told) <= set(ours)
    for figure, value in told.items():
        assert ours[figure] == pytest.approx(value, rel=1e-6, abs=2e-6), figure


def _write_a_made_up_result(truth: Truth, folder: Path) -> None:
    rng = np.random.default_rng(5)
    poses = truth.poses + rng.normal(0, [0.002, 0.002, 0.02], truth.poses.shape)
    statuses = rng.choice(["placed", "placed", "uncertain", "rejected"], len(poses))
    rows = [
        f"{s},a,0,,,,,,rejected" if status == "rejected" else f"{s},a,0,{x:.9f},{y:.9f},{t:.9f},0.001,0.01,{status}"
        for s, (x, y, t), status in zip(truth.sequences, poses, statuses, strict=True)
    ]
    (folder / "poses.csv").write_text(RESULT + "\n".join(rows) + "\n")
    states = rng.choice(["empty,0.01", "full,0.99", "partial,0.5", "unseen,"], len(truth.fills))
    rods = [f"{rod},{state},0.9,2" for rod, state in zip(truth.fills, states, strict=True)]
    (folder / "rods.csv").write_text("rod_id,state,fill,confidence,views\n" + "\n".join(rods) + "\n")


def _reference(bundle: Path, result: Path) -> Figures:
    spec = importlib.util.spec_from_file_location("reference_score", SHARED / "score.py")
    assert spec
    assert spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    figures: Figures = module.score(bundle, result)
    return figures
