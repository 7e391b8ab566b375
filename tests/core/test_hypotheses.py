"""The places where a snapshot may lie, on drawn lattices: each lays rods on rods, and none that fits is left out."""

from __future__ import annotations

import numpy as np
import pytest

from pondwatch.core.hypotheses import Reach, describe, propose
from pondwatch.core.observe import find_rods
from pondwatch.simulator.spec import SimulationSpec
from tests.core.ponds import (
    CAMERA,
    METRES,
    PITCH_PX,
    draw_rods,
    hexagonal,
    in_image,
    inspected,
    setting_of,
    square,
)

PITCH = PITCH_PX * METRES
HEXAGONAL = hexagonal(15, 15, PITCH)
SQUARE = square(15, 15, PITCH)
INSIDE = np.array([0.17, 0.14, 0.2])  # a pose with rods all around
EVERYWHERE = Reach(np.inf, np.pi)


def _photograph(points, pose, seed=0, gone=()):
    """The rods that a picture shows, and where: those of the layout, less those `gone` from the floor."""
    there = np.setdiff1d(np.arange(len(points)), gone)
    centres = in_image(points[there], pose)
    near = ((centres > -25) & (centres < [185, 135])).all(axis=1)
    fills = np.random.default_rng(seed).choice([0.0, 1.0], int(near.sum()))
    return find_rods(draw_rods(centres[near], fills, seed=seed), setting_of(points).band)


def _places(points, pose, reach, prior=None, **drawn):
    setting = setting_of(points)
    found = _photograph(points, pose, **drawn)
    return propose(found, pose if prior is None else prior, reach, setting.layout, CAMERA), found


def _apart_px(places, pose):
    """(H,): px between each place and a pose; a turn counts by what it moves at the picture's corner."""
    turn = np.angle(np.exp(1j * (places.poses[:, 2] - pose[2])))
    return np.hypot(*(places.poses[:, :2] - pose[:2]).T) / METRES + np.abs(turn) * 97


def _whole(points, pose, margin_px=18):
    """(K,): rods of the layout wholly in view of a pose."""
    c = in_image(points, pose)
    return np.flatnonzero((c > margin_px).all(axis=1) & (c < np.array([159, 109]) - margin_px).all(axis=1))


@pytest.mark.parametrize("points", [HEXAGONAL, SQUARE], ids=["hexagonal", "square"])
def test_every_place_lays_the_rods_found_on_rods_of_the_layout(points):
    places, found = _places(points, INSIDE, Reach(2.2 * PITCH, 0.4))

    assert len(places) > 10
    for pose in places.poses[places.geometry > -1]:
        centres = in_image(points, pose)
        for at in found.centres_px[found.support > 0.9]:
            assert np.hypot(*(centres - at).T).min() < 3


@pytest.mark.parametrize("points", [HEXAGONAL, SQUARE], ids=["hexagonal", "square"])
def test_no_shift_by_a_lattice_vector_within_reach_is_left_out(points):
    reach = 2.1 * PITCH
    places, _ = _places(points, INSIDE, Reach(reach, 0.4))

    shifts = points - points[112]  # all vectors between sites, from a site in the middle
    wanted = [s for s in shifts if np.hypot(*s) < reach - 2 * METRES]
    assert len(wanted) > 10
    for s in wanted:
        assert _apart_px(places, INSIDE + [*s, 0]).min() < 2.5


@pytest.mark.parametrize(("points", "turns"), [(HEXAGONAL, 6), (SQUARE, 4)], ids=["hexagonal", "square"])
def test_an_unknown_heading_leaves_as_many_turns_as_the_lattice_has(points, turns):
    places, _ = _places(points, INSIDE, Reach(0.45 * PITCH, np.pi), prior=INSIDE + [0, 0, 2.0])

    turned = np.degrees(places.poses[places.geometry > -2][:, 2] - INSIDE[2]) % 360
    steps = turned / (360 / turns)

    np.testing.assert_allclose(steps, np.round(steps), atol=0.05)
    assert set(np.round(steps).astype(int) % turns) == set(range(turns))


def test_a_known_heading_leaves_one_turn():
    places, _ = _places(HEXAGONAL, INSIDE, Reach(0.45 * PITCH, 0.4))

    np.testing.assert_allclose(places.poses[:, 2], INSIDE[2], atol=0.05)


def test_a_heading_near_half_a_turn_is_found_across_the_cut():
    pose = np.array([0.17, 0.14, np.pi - 0.02])

    places, _ = _places(HEXAGONAL, pose, Reach(0.5 * PITCH, 0.3), prior=np.array([0.17, 0.14, -np.pi + 0.1]))

    assert _apart_px(places, pose).min() < 2


def test_places_that_lay_rods_beyond_the_edge_of_the_lattice_are_removed():
    corner = np.array([0.015, 0.02, 0.1])  # the lattice's first rod is at (0, 0): half of the picture shows none

    at_edge, found = _places(HEXAGONAL, corner, Reach(2.1 * PITCH, 0.4))
    inside, _ = _places(HEXAGONAL, INSIDE, Reach(2.1 * PITCH, 0.4))

    assert _apart_px(at_edge, corner).min() < 2
    assert (at_edge.geometry > -2).sum() < 0.4 * (inside.geometry > -2).sum()
    for pose, nats in zip(at_edge.poses, at_edge.geometry, strict=True):
        shown = len(_whole(HEXAGONAL, pose))
        if abs(shown - (found.support > 0.99).sum()) >= 3:
            assert nats < -4


def test_a_rod_of_the_layout_that_the_picture_lacks_counts_against_a_place():
    gone = _whole(HEXAGONAL, INSIDE)[:1]

    places, _ = _places(HEXAGONAL, INSIDE, Reach(0.5 * PITCH, 0.4), gone=gone)
    whole, _ = _places(HEXAGONAL, INSIDE, Reach(0.5 * PITCH, 0.4))

    def nats_of_truth(p):
        return p.geometry[np.argmin(_apart_px(p, INSIDE))]

    assert nats_of_truth(whole) > -0.5
    assert nats_of_truth(places) < nats_of_truth(whole) - 2


def test_a_site_without_a_rod_tells_the_place_that_has_it_from_those_beside_it():
    gap = _whole(HEXAGONAL, INSIDE)[0]
    layout = np.delete(HEXAGONAL, gap, axis=0)

    places, _ = _places(layout, INSIDE, Reach(1.2 * PITCH, 0.4))

    best = np.argsort(-places.geometry)
    assert _apart_px(places.take(best[:1]), INSIDE)[0] < 2
    assert places.geometry[best[0]] > places.geometry[best[1]] + 2


def test_on_an_irregular_layout_hardly_any_place_of_the_whole_pond_and_turn_fits_but_the_true_one():
    rng = np.random.default_rng(5)
    irregular = HEXAGONAL + rng.uniform(-0.14, 0.14, HEXAGONAL.shape) * PITCH

    places, _ = _places(irregular, INSIDE, EVERYWHERE)

    near = _apart_px(places, INSIDE) < 3
    assert near.sum() == 1
    assert places.geometry[near].max() == places.geometry.max()
    regular, _ = _places(HEXAGONAL, INSIDE, EVERYWHERE)
    assert (places.geometry > -3).sum() < 0.05 * (regular.geometry > -3).sum()


def test_a_picture_without_rods_has_no_place():
    setting = setting_of(HEXAGONAL)
    found = find_rods(np.full((110, 160, 3), 90, np.uint8), setting.band)

    assert len(propose(found, INSIDE, EVERYWHERE, setting.layout, CAMERA)) == 0


def test_poses_from_elsewhere_are_described_in_their_order():
    setting = setting_of(HEXAGONAL)
    found = _photograph(HEXAGONAL, INSIDE)
    poses = np.array([INSIDE + [0.3 * PITCH, 0, 0], INSIDE])

    places = describe(poses, found, setting.layout, CAMERA)

    np.testing.assert_array_equal(places.poses, poses)
    assert places.geometry[1] > places.geometry[0] + 5
    shown = places.centres_px[1][places.real[1]]
    np.testing.assert_allclose(shown, in_image(HEXAGONAL[places.rods[1][places.real[1]]], INSIDE), atol=1e-6)
    assert set(_whole(HEXAGONAL, INSIDE)) <= set(places.rods[1][places.real[1]])


@pytest.mark.parametrize("water", ["clear", "murky"])
def test_the_true_place_of_nearly_every_simulated_snapshot_is_among_its_places(water):
    pond = inspected(SimulationSpec(snapshots=20, water=water), 5)
    setting = pond.setting
    reach = Reach(4 * 0.32 * setting.layout.pitch, 0.42)
    hit = []
    for snapshot, truth, seen in zip(pond.snapshots, pond.truth, pond.views(-8), strict=True):
        places = propose(find_rods(snapshot.image, setting.band), snapshot.pose_pond, reach, setting.layout,
                         setting.camera)  # fmt: skip
        if seen.sum() >= 2:
            off = np.hypot(*(places.poses[:, :2] - truth[:2]).T) / setting.camera.metres_per_pixel
            hit.append(off.min(initial=np.inf) < 5)

    assert len(hit) > 10
    assert np.mean(hit) >= 0.95
