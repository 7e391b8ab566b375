"""The centre of every ring, measured in a mosaic that was put together by hand."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from pondwatch.core.images import decode
from pondwatch.core.layouts import lattice
from pondwatch.core.marks import ring_offsets
from pondwatch.core.mosaic import Mosaic
from pondwatch.core.values import Image, Pond
from pondwatch.simulator.simulation import Simulation
from pondwatch.simulator.spec import SimulationSpec

M = 0.001
FINE = 8


def painted(pond: Pond, shift_px: tuple[float, float], seed: int = 0, noise: float = 3.0, dark: bool = False) -> Image:
    """Rings on a floor, all `shift_px` right and down of their places; wedges of their own inside; drawn `FINE` times
    larger and averaged."""
    rng = np.random.default_rng(seed)
    width, height = round(pond.width_m / M), round(pond.height_m / M)
    big = np.full((height * FINE, width * FINE, 3), (90, 110, 120), np.uint8)
    line, ring = ((230, 240, 220), (30, 40, 60)) if dark else ((40, 30, 30), (210, 220, 190))
    for rod in pond.rods:
        u = (rod.x_m / M + shift_px[0]) * FINE - 0.5
        v = ((pond.height_m - rod.y_m) / M + shift_px[1]) * FINE - 0.5
        at, scale = (round(u * 16), round(v * 16)), FINE / M * 16
        cv2.circle(big, at, round(rod.outer_radius_m * scale), line, -1, cv2.LINE_AA, 4)
        cv2.circle(big, at, round(rod.outer_radius_m * 0.85 * scale), ring, -1, cv2.LINE_AA, 4)
        cv2.circle(big, at, round(rod.inner_radius_m * scale), line, -1, cv2.LINE_AA, 4)
        start = float(rng.uniform(0, 360))
        reach = round(rod.inner_radius_m * 0.9 * FINE / M)
        cv2.ellipse(big, (round(u), round(v)), (reach, reach), 0, start, start + 120, (10, 10, 200), -1)
    small = cv2.resize(big, (width, height), interpolation=cv2.INTER_AREA).astype(float)
    small += rng.normal(0, noise, small.shape)
    return np.dstack([np.clip(small, 0, 255), np.full((height, width), 255)]).astype(np.uint8)


@pytest.fixture(scope="module")
def pond() -> Pond:
    return lattice("hex", 0.06, columns=6, rows=5)


@pytest.mark.parametrize("shift_px", [(0.0, 0.0), (0.37, -0.62), (-2.4, 1.3)])
def test_a_ring_is_found_to_a_fiftieth_of_a_pixel_wherever_it_was_painted(
    pond: Pond, shift_px: tuple[float, float]
) -> None:
    found_px = ring_offsets(painted(pond, shift_px), pond, M) / M
    offsets_px = found_px[:, :2]

    assert found_px.shape == (30, 3)
    assert (found_px[:, 2] < 0.05).all()
    np.testing.assert_allclose(offsets_px, np.broadcast_to([shift_px[0], -shift_px[1]], (30, 2)), atol=0.05)
    np.testing.assert_allclose(offsets_px.mean(axis=0), [shift_px[0], -shift_px[1]], atol=0.02)


def test_two_mosaics_in_other_colours_give_the_same_centres(pond: Pond) -> None:
    light = ring_offsets(painted(pond, (0.3, 0.4), seed=1), pond, M)
    dark = ring_offsets(painted(pond, (0.3, 0.4), seed=2, dark=True), pond, M)

    assert np.hypot(*(light - dark)[:, :2].T).max() < 0.05 * M


def test_a_ring_that_was_not_seen_or_only_in_part_has_no_centre(pond: Pond) -> None:
    picture = painted(pond, (0.0, 0.0))
    first = pond.rods[0]
    column = round(first.x_m / M)
    picture[:, : column + 5] = 0  # nothing was seen left of the first rod's middle

    offsets = ring_offsets(picture, pond, M)

    assert np.isnan(offsets[0]).all()
    assert np.isfinite(offsets[-1]).all()


def test_rings_in_noise_are_kept_with_a_sigma_that_says_how_far_they_are_off(pond: Pond) -> None:
    """Noise of 60 levels under a contrast of 180: what one ring says is worth a twenty-fifth of a pixel."""
    found_px = ring_offsets(painted(pond, (0.3, 0.2), noise=60.0), pond, M) / M

    assert np.isfinite(found_px).all()
    off = (found_px[:, :2] - [0.3, -0.2]) / found_px[:, 2:]
    assert np.sqrt(np.mean(off**2)) < 1.5
    assert np.median(found_px[:, 2]) > 1.5 * np.median(ring_offsets(painted(pond, (0.3, 0.2)), pond, M)[:, 2] / M)


@pytest.mark.parametrize("aside_px", [(7, 0), (6, 4), (0, 15), (26, 15), (30, 0)])
def test_a_mosaic_that_lies_far_aside_has_no_ring_near_where_one_should_be(
    pond: Pond, aside_px: tuple[int, int]
) -> None:
    """Noise makes no difference: half of what is seen there must be a ring."""
    for noise in (3.0, 40.0):
        found_px = ring_offsets(np.roll(painted(pond, (0, 0), noise=noise), aside_px, axis=(1, 0)), pond, M) / M

        near = np.hypot(*found_px[:, :2].T) < 3.4  # a quarter of the inner radius
        assert near.sum() <= 1


def test_a_floor_without_rings_has_no_centres(pond: Pond) -> None:
    bare = np.random.default_rng(1).integers(0, 255, (*painted(pond, (0, 0)).shape[:2], 4), dtype=np.uint8)
    bare[..., 3] = 255

    assert np.isnan(ring_offsets(bare, pond, M)).all()
    assert np.isnan(ring_offsets(np.zeros_like(bare), pond, M)).all()
    assert ring_offsets(bare, Pond(pond.width_m, pond.height_m), M).shape == (0, 3)


def test_in_a_simulated_mosaic_whose_poses_are_all_off_by_the_same_the_rings_are_off_by_that() -> None:
    simulation = Simulation(SimulationSpec(snapshots=60, coverage=6.0), seed=5)
    inspection = simulation.inspection
    mosaic = Mosaic(inspection.camera, inspection.pond)
    shift_px = np.array([0.8, -0.45])
    for n, pose in enumerate(simulation.truth_poses):
        snapshot = simulation.snapshot(n)
        moved = pose + [*(shift_px * inspection.camera.metres_per_pixel), 0.0]
        mosaic.put(snapshot.key, decode(snapshot.content, inspection.camera), moved)

    found_m = ring_offsets(mosaic.bgra(), inspection.pond, mosaic.metres_per_pixel)
    offsets_px = found_m[:, :2] / mosaic.metres_per_pixel

    seen = np.isfinite(offsets_px[:, 0])
    assert seen.mean() > 0.8
    off_px = np.hypot(*(offsets_px[seen] - shift_px).T)
    assert np.median(off_px) < 0.2
    assert off_px.max() < 0.5
