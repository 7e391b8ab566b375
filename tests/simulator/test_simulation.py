"""The simulator against the frames worked out by hand, against its own truth, and by seed."""

from __future__ import annotations

import csv
from dataclasses import replace
from itertools import pairwise

import cv2
import numpy as np
import pytest

from pondwatch.basestation.bundle import Bundle
from pondwatch.core.coverage import rod_views
from pondwatch.core.errors import Invalid
from pondwatch.core.images import decode
from pondwatch.core.mosaic import Mosaic
from pondwatch.core.values import Camera, Pond, Rod, Snapshot
from pondwatch.simulator.bundle import write_bundle
from pondwatch.simulator.camera import photograph
from pondwatch.simulator.floor import render_floor
from pondwatch.simulator.palette import Palette, random_palette
from pondwatch.simulator.pond import SimulatedPond, make_pond
from pondwatch.simulator.simulation import Simulation, simulate
from pondwatch.simulator.spec import SimulationSpec
from pondwatch.simulator.water import Water, through_water, water_of

CAMERA = Camera(160, 110, 0.0005625)
BLACK, WHITE = np.zeros(3), np.full(3, 255.0)
SMALL = SimulationSpec(snapshots=12, coverage=3.0)


def lone_rod(fill, x=0.1002, y=0.0703):
    rod = Rod("R0000", x, y, 0.012, 0.0078)
    centre = np.array([[x, y]])
    return SimulatedPond(
        Pond(0.2, 0.14, (rod,)), np.array([fill]), np.zeros((1, 2)), np.array([0.4]), centre[:0], "hexagonal", 0.03, 0
    )


def bright_fill():
    """Only the fill shines."""
    return Palette(BLACK, BLACK, BLACK, BLACK, WHITE, 0.1, 0.1, 0.1, 0.0)


def centroid(image):
    v, u = np.mgrid[: image.shape[0], : image.shape[1]]
    return np.array([(u * image).sum(), (v * image).sum()]) / image.sum()


@pytest.mark.parametrize("seed", range(6))
def test_a_rod_lies_in_the_picture_where_the_frames_say_to_a_fiftieth_of_a_pixel(seed):
    rng = np.random.default_rng(seed)
    floor = render_floor(lone_rod(1.0), bright_fill(), CAMERA, rng)
    x, y, theta = 0.1002 + rng.uniform(-0.02, 0.02), 0.0703 + rng.uniform(-0.01, 0.01), rng.uniform(-np.pi, np.pi)

    found = centroid(photograph(floor, np.array([x, y, theta]), CAMERA)[..., 0])

    dx, dy = (0.1002 - x) / 0.0005625, (0.0703 - y) / 0.0005625
    right, up = np.cos(theta) * dx + np.sin(theta) * dy, np.cos(theta) * dy - np.sin(theta) * dx
    np.testing.assert_allclose(found, [79.5 + right, 54.5 - up], atol=0.02)


@pytest.mark.parametrize("fill", [0.0, 0.1, 0.25, 0.5, 0.8, 1.0])
def test_a_wedge_covers_its_share_of_the_inner_disc(fill):
    floor = render_floor(lone_rod(fill), bright_fill(), CAMERA, np.random.default_rng(0))

    image = photograph(floor, np.array([0.1, 0.07, 0.3]), CAMERA)[..., 0]

    disc_px = np.pi * (0.0078 / 0.0005625) ** 2
    assert image.sum() / 255 / disc_px == pytest.approx(fill, abs=0.01)


def test_neighbours_lie_one_pitch_apart_and_all_rods_inside_the_pond():
    for lattice, neighbours in (("hexagonal", 6), ("square", 4)):
        spec = SimulationSpec(lattice=lattice, missing=0.0, lattice_angle_rad=0.3)
        pond = make_pond(spec, np.random.default_rng(1)).pond
        xy = np.array([(r.x_m, r.y_m) for r in pond.rods])
        apart = np.linalg.norm(xy[:, None] - xy, axis=-1) + np.eye(len(xy))

        assert apart.min() == pytest.approx(0.03375, abs=1e-6)
        assert np.count_nonzero(apart < 0.034, axis=1).max() == neighbours
        assert (xy > 0.01215).all()
        assert (xy < np.array([pond.width_m, pond.height_m]) - 0.01215).all()


@pytest.mark.parametrize(("fills", "expected"), [("empty", {0.0}), ("full", {1.0}), ("striped", {0.0, 1.0})])
def test_special_fillings_hold_only_their_states(fills, expected):
    assert set(make_pond(SimulationSpec(fills=fills), np.random.default_rng(0)).fills.tolist()) == expected


def test_a_striped_pond_alternates_row_by_row():
    simulated = make_pond(SimulationSpec(fills="striped", missing=0.0, lattice="square"), np.random.default_rng(0))
    rows = {}
    for rod, fill in zip(simulated.pond.rods, simulated.fills, strict=True):
        rows.setdefault(round(rod.y_m, 5), set()).add(fill)
    states = [rows[y] for y in sorted(rows)]

    assert all(len(state) == 1 for state in states)
    assert all(a != b for a, b in pairwise(states))


def test_the_same_seed_gives_the_same_bytes_and_another_seed_others():
    one, same, other = (simulate(SMALL, seed) for seed in (5, 5, 6))

    assert [s.content for s in one.snapshots] == [s.content for s in same.snapshots]
    np.testing.assert_array_equal([s.pose_pond for s in one.snapshots], [s.pose_pond for s in same.snapshots])
    assert one.inspection == same.inspection
    assert all(a.content != b.content for a, b in zip(one.snapshots, other.snapshots, strict=True))


def test_a_snapshot_is_the_same_whatever_was_taken_before():
    assert Simulation(SMALL, 3).snapshot(7).content == list(Simulation(SMALL, 3))[7].content


def test_a_mosaic_at_the_true_poses_is_sharp_and_at_the_noisy_ones_is_not():
    simulated = simulate(SimulationSpec(snapshots=60, coverage=4.0), seed=2)

    def sharpness(poses):
        camera, pond = simulated.inspection.camera, simulated.inspection.pond
        mosaic = Mosaic(camera, pond)
        for snapshot, pose in zip(simulated.snapshots, poses, strict=True):
            mosaic.put(snapshot.key, decode(snapshot.content, camera), pose)
        return cv2.Laplacian(mosaic.bgra()[..., 1], cv2.CV_32F)[mosaic.looks() > 1].std()

    assert sharpness(simulated.truth_poses) > 1.25 * sharpness([s.pose_pond for s in simulated.snapshots])


@pytest.mark.parametrize("kind", ["independent", "drift"])
def test_pose_noise_has_the_deviation_asked_for(kind):
    simulation = Simulation(SimulationSpec(snapshots=4000, coverage=400, noise=kind, noise_pitch=0.5), seed=1)

    error = simulation.poses - simulation.truth_poses

    np.testing.assert_allclose(
        error.std(axis=0), [0.016875, 0.016875, 0.1], rtol=0.08 if kind == "independent" else 0.25
    )
    assert simulation.inspection.pose_noise.sigma_xy_m == 0.016875


def test_drift_stays_with_its_robot_and_independent_noise_does_not():
    def memory(kind):
        simulation = Simulation(SimulationSpec(snapshots=2100, coverage=400, noise=kind), seed=1)
        mine = (simulation.poses - simulation.truth_poses)[::7, 0]
        return np.corrcoef(mine[1:], mine[:-1])[0, 1]

    assert memory("drift") > 0.85
    assert abs(memory("independent")) < 0.2


def test_unknown_headings_and_outliers_and_a_silent_localisation():
    spec = SimulationSpec(snapshots=2000, coverage=400, heading_known=False, outliers=0.1, claim=0)
    simulation = Simulation(spec, seed=1)

    error = simulation.poses - simulation.truth_poses

    assert simulation.inspection.pose_noise is None
    assert np.histogram(simulation.poses[:, 2], 6, (-np.pi, np.pi))[0].min() > 250
    assert 0.05 < (np.linalg.norm(error[:, :2], axis=1) > 5 * 0.0108).mean() < 0.11


@pytest.mark.parametrize("path", ["uniform", "smooth", "sweep"])
def test_robots_stay_over_the_pond_within_their_headings_and_see_most_of_it(path):
    simulation = Simulation(SimulationSpec(path=path), seed=4)
    pond, camera = simulation.inspection.pond, simulation.inspection.camera
    x, y, theta = simulation.truth_poses.T

    assert x.min() >= 0
    assert x.max() <= pond.width_m
    assert y.min() >= 0
    assert y.max() <= pond.height_m
    assert np.abs(theta).max() <= 1.0
    assert (rod_views(simulation.truth_poses, pond, camera) > 0).mean() > 0.6


def test_a_smooth_path_moves_less_between_looks_than_random_places():
    def step(path):
        poses = Simulation(SimulationSpec(path=path), seed=4).truth_poses[::7, :2]
        return np.median(np.linalg.norm(np.diff(poses, axis=0), axis=1))

    assert step("smooth") < 0.4 * step("uniform")
    assert step("sweep") < 0.4 * step("uniform")


def test_murky_water_takes_contrast_and_still_shows_something():
    rng = np.random.default_rng(0)
    ideal = photograph(render_floor(lone_rod(1.0), bright_fill(), CAMERA, rng), np.array([0.1, 0.07, 0]), CAMERA)
    clear, murky = (
        through_water(ideal, water_of(kind, rng), np.array([0.1, 0.07, 0]), 1.0, CAMERA, np.random.default_rng(1))
        for kind in ("clear", "murky")
    )

    def contrast(image):
        return float(np.median(image[50:59, 75:84])) - float(np.median(image[:20]))

    assert contrast(clear) > 240
    assert 30 < contrast(murky) < 170


def test_motion_blur_moves_nothing():
    spot = np.zeros((110, 160, 3), np.float32)
    spot[40:44, 60:66] = 200

    blurred = through_water(spot, Water(motion_px=6.0, noise=0.0), np.zeros(3), 0.0, CAMERA, np.random.default_rng(3))

    np.testing.assert_allclose(centroid(blurred[..., 0].astype(float)), [62.5, 41.5], atol=0.15)


def test_a_random_palette_lets_a_fill_be_told_from_a_ring():
    for seed in range(50):
        palette = random_palette(np.random.default_rng(seed))
        assert abs((palette.fill - palette.annulus) @ [0.114, 0.587, 0.299]) > 60


def test_an_unmapped_pond_has_a_textured_floor_and_no_layout():
    simulated = simulate(SimulationSpec(snapshots=8, coverage=2, mapped=False), seed=0)
    image = decode(simulated.snapshots[0].content, simulated.inspection.camera)

    assert simulated.inspection.pond.rods == ()
    assert cv2.GaussianBlur(image, (0, 0), 2).std() > 5


@pytest.mark.parametrize("kind", ["png", "jpeg", "webp"])
def test_a_bundle_reads_back_as_it_was_simulated(tmp_path, kind):
    simulation = Simulation(SimulationSpec(snapshots=9, coverage=2.0, image_kind=kind), seed=8)

    write_bundle(simulation, tmp_path / "pond")

    with Bundle(tmp_path / "pond") as bundle:
        snapshots = [bundle.snapshot(row) for row in bundle.rows]
        assert [bundle.content(row) for row in bundle.rows] == [s.content for s in simulation]
        assert bundle.inspection == simulation.inspection
    assert all(isinstance(s, Snapshot) for s in snapshots)
    np.testing.assert_allclose([s.pose_pond for s in snapshots], simulation.poses, atol=1e-9)
    np.testing.assert_allclose([s.captured_s for s in snapshots], [s.captured_s for s in simulation])
    truth = list(csv.DictReader((tmp_path / "pond/truth_rods.csv").read_text().splitlines()))
    assert [float(row["fill"]) for row in truth] == pytest.approx(simulation.truth_fills.tolist())


def test_a_bundle_without_truth_holds_none(tmp_path):
    write_bundle(Simulation(SMALL, 0), tmp_path / "pond", truth=False)

    assert sorted(p.name for p in (tmp_path / "pond").iterdir()) == ["poses.csv", "session.json", "snapshots"]


def test_a_bundle_is_not_written_over_another(tmp_path):
    (tmp_path / "mine.txt").write_text("keep")

    with pytest.raises(Invalid, match="not empty"):
        write_bundle(Simulation(SMALL, 0), tmp_path)


@pytest.mark.parametrize("wrong", [{"snapshots": 0}, {"noise_pitch": float("nan")}, {"missing": 2.0}])
def test_a_spec_out_of_range_is_refused_by_name(wrong):
    with pytest.raises(Invalid, match=next(iter(wrong))):
        simulate(SimulationSpec(**wrong), 0)


def test_robots_keep_their_distance_from_the_wall():
    for path in ("uniform", "sweep", "smooth"):
        spec = SimulationSpec(path=path, margin_px=48.0)
        low, high = spec.margin_m, np.array(spec.pond_size_m) - spec.margin_m

        poses = Simulation(spec, 3).truth_poses[:, :2]

        assert (poses >= low).all()
        assert (poses <= high).all()


def test_things_lie_where_the_truth_says_and_change_nothing_elsewhere() -> None:
    plain, strewn = (Simulation(replace(SMALL, objects=n, object_px=8), seed=5) for n in (0, 2))
    assert (plain.truth_things, len(strewn.truth_things)) == ((), 2)

    changed = np.abs(plain.floor.image.astype(int) - strewn.floor.image).max(axis=2) > 20

    scale = strewn.floor.metres_per_pixel
    rows, columns = np.nonzero(changed)
    x, y = strewn.floor.left_m + (columns + 0.5) * scale, strewn.floor.top_m - (rows + 0.5) * scale
    near = [np.hypot(x - t.x_m, y - t.y_m) < 0.75 * t.diameter_m for t in strewn.truth_things]
    assert np.logical_or(*near).all()
    assert [n.sum() * scale**2 for n in near] == pytest.approx([np.pi / 4 * (8 * 0.0005625) ** 2] * 2, rel=0.15)


def test_a_displaced_rod_is_drawn_off_the_place_that_the_layout_keeps() -> None:
    plain, moved = (Simulation(replace(SMALL, displaced=n, displaced_px=4), seed=5) for n in (0, 1))

    (which,) = np.flatnonzero(moved.truth_offsets.any(axis=1))

    assert plain.inspection == moved.inspection
    assert np.hypot(*moved.truth_offsets[which]) == pytest.approx(4 * 0.0005625)
    assert (plain.floor.image != moved.floor.image).any()
