"""How far two mosaics lie apart, from rings whose errors are drawn by hand."""

from __future__ import annotations

import numpy as np
import pytest

from pondwatch.core.coincidence import Registration, registration, residuals
from pondwatch.core.compare import Change, Comparison, Reason, Refusal, Seen, compare
from pondwatch.core.layouts import lattice
from pondwatch.core.values import Float, RodReading, RodState

POND = lattice("hex", 0.06, columns=14, rows=13)
PLACES = np.array([(rod.x_m, rod.y_m) for rod in POND.rods])
PIXEL_M = 0.001
INNER_M = POND.rods[0].inner_radius_m  # 13.8 px, so the limit is 3.45 px
MIDDLE = int(np.argmin(np.hypot(*(PLACES - PLACES.mean(axis=0)).T)))
GROUP = np.argsort(np.hypot(*(PLACES - PLACES[MIDDLE]).T))[:7]  # a rod and the six next to it
MURKY_PX = 0.45  # sigma of the difference of two rings along an axis, as in murky water


def drawn(sigma_px: float, seed: int, moved_px: Float | float = 0.0) -> Float:
    """(K, 2), px: how far rings seem to lie apart that lie `moved_px` apart along x."""
    apart = np.random.default_rng(seed).normal(0, sigma_px, PLACES.shape)
    apart[:, 0] += moved_px
    return apart


def found(apart_px: Float, sigma_px: float) -> tuple[Float, Float, Registration]:
    sigma = np.full(len(apart_px), sigma_px * PIXEL_M)
    residual, known = residuals(apart_px * PIXEL_M, sigma, PLACES, PIXEL_M)
    whole = registration(apart_px * PIXEL_M, np.maximum(sigma, known), residual, 3.45 * PIXEL_M)
    return residual / PIXEL_M, known / PIXEL_M, whole


def compared(apart_px: Float, sigma_px: float) -> Comparison:
    """Two inspections, all rods empty in the first and full in the second."""
    share = np.full(len(PLACES), sigma_px * PIXEL_M / np.sqrt(2))

    def side(state: RodState, offsets_m: Float) -> dict[str, Seen]:
        fill = float(state is RodState.FULL)
        return {
            rod.id: Seen(RodReading(rod.id, state, fill, 0.999, 3), (rod.x_m, rod.y_m), INNER_M, (x, y), sigma)
            for rod, (x, y), sigma in zip(POND.rods, offsets_m.tolist(), share.tolist(), strict=True)
        }

    still = np.zeros_like(PLACES)
    return compare(side(RodState.EMPTY, still), side(RodState.FULL, apart_px * PIXEL_M), None, PIXEL_M)


@pytest.mark.parametrize("seed", range(4))
def test_many_faint_rings_together_tell_that_two_mosaics_lie_within_a_pixel(seed: int) -> None:
    residual, known, whole = found(drawn(MURKY_PX, seed), MURKY_PX)

    assert np.isfinite(residual).all(axis=1).mean() > 0.9
    assert (whole.median_m or 1) < 0.35 * PIXEL_M  # of single rings it would be 0.53
    assert (whole.p95_m or 1) < 1.0 * PIXEL_M
    assert known.max() < MURKY_PX * 1.5
    assert whole.shift_m is not None
    assert whole.sigma_m is not None
    assert np.hypot(*whole.shift_m) < 4 * whole.sigma_m < 0.2 * PIXEL_M


def test_a_mosaic_moved_by_a_pixel_and_a_half_is_measured_so_in_murky_water() -> None:
    _, _, whole = found(drawn(MURKY_PX, 5, moved_px=1.5), MURKY_PX)

    assert whole.shift_m == pytest.approx((1.5 * PIXEL_M, 0.0), abs=0.15 * PIXEL_M)
    assert whole.median_m == pytest.approx(1.5 * PIXEL_M, abs=0.15 * PIXEL_M)


def test_a_group_of_rods_moved_by_a_pixel_and_a_half_is_told_from_the_rest() -> None:
    moved = np.zeros(len(PLACES))
    moved[GROUP] = 1.5
    middle = []
    for seed in range(20):
        residual, _, whole = found(drawn(MURKY_PX, seed, moved), MURKY_PX)
        middle.append(residual[MIDDLE, 0])
        assert (whole.median_m or 1) < 0.4 * PIXEL_M

    assert np.nanmean(middle) == pytest.approx(1.5, abs=0.15)
    assert np.nanstd(middle) < 0.3


def test_a_group_of_rods_moved_over_the_limit_claims_no_difference_and_the_rest_does() -> None:
    moved = np.zeros(len(PLACES))
    moved[GROUP] = 6.0

    seen = compared(drawn(MURKY_PX, 3, moved), MURKY_PX)

    assert seen.refusal is None
    said = [seen.rods[i].reason for i in GROUP]
    assert set(said) <= {Reason.RESIDUAL, Reason.UNMEASURED}
    assert said.count(Reason.RESIDUAL) >= 4
    assert seen.count(Change.FILLED) > 0.85 * len(PLACES)


def test_a_mosaic_moved_over_the_limit_is_refused() -> None:
    seen = compared(drawn(MURKY_PX, 4, 4.5), MURKY_PX)

    assert seen.refusal is Refusal.RESIDUAL
    assert seen.count(Change.NOT_COMPARABLE) == len(PLACES)


def test_rings_that_could_hide_a_pixel_even_together_refuse_the_comparison() -> None:
    seen = compared(drawn(2.0, 6), 2.0)

    assert (seen.refusal, seen.registration.rods) == (Refusal.UNMEASURED, 0)


def test_sigmas_that_say_too_little_are_enlarged_by_how_far_rings_scatter() -> None:
    """Rings that err by 2 px and say 0.1: of one another they prove that they do not know."""
    _, known, whole = found(drawn(2.0, 7), 0.1)

    assert np.median(known) > 0.5
    assert whole.rods < 0.1 * len(PLACES)


def test_a_ring_that_its_neighbours_contradict_speaks_for_itself() -> None:
    moved = np.zeros(len(PLACES))
    moved[MIDDLE] = 2.0

    residual, _, _ = found(drawn(0.15, 8, moved), 0.15)

    assert residual[MIDDLE, 0] == pytest.approx(2.0, abs=0.5)
    assert np.hypot(*residual[GROUP[1:]].T).max() < 0.8


def test_a_rod_alone_and_no_rod_at_all_have_residuals_too() -> None:
    one, _ = residuals(np.array([[0.5, 0.0]]), np.array([0.1]), np.array([[3.0, 4.0]]), 1.0)

    assert one.tolist() == [[0.5, 0.0]]
    assert residuals(np.zeros((0, 2)), np.zeros(0), np.zeros((0, 2)), 1.0)[0].shape == (0, 2)
    assert registration(np.zeros((0, 2)), np.zeros(0), np.zeros((0, 2)), 1.0) == Registration(0, 1.0)
