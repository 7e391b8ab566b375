"""The layout as arrays: pitch, neighbours and rods near a point, against lattices made by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pondwatch.core.errors import InvalidLayout
from pondwatch.core.pond import Layout
from pondwatch.core.values import Pond, Rod
from tests.core.ponds import hexagonal, pond_of, square

LATTICES = {"hexagonal": (hexagonal, 6), "square": (square, 4)}


def _steps_of(layout):
    """Lengths in pitches and angles in degrees, by angle."""
    x, y = layout.steps.T
    order = np.argsort(np.degrees(np.arctan2(y, x)) % 360)
    return np.hypot(x, y)[order] / layout.pitch, (np.degrees(np.arctan2(y, x)) % 360)[order]


@pytest.mark.parametrize(("kind", "turns"), [("hexagonal", 6), ("square", 4)])
@settings(max_examples=20, deadline=None)
@given(angle=st.floats(-3.1, 3.1), pitch=st.floats(0.004, 2.0))
def test_a_lattice_has_as_many_neighbour_vectors_as_its_symmetry_at_any_angle(kind, turns, angle, pitch):
    layout = Layout.of(pond_of(LATTICES[kind][0](pitch=pitch, angle_rad=angle)))

    lengths, degrees = _steps_of(layout)

    assert layout.pitch == pytest.approx(pitch, rel=1e-6)
    np.testing.assert_allclose(lengths, 1, rtol=1e-6)
    assert len(degrees) == turns
    off = (degrees - np.degrees(angle)) % (360 / turns)
    np.testing.assert_allclose(np.minimum(off, 360 / turns - off), 0, atol=1e-4)


def test_missing_rods_change_neither_pitch_nor_neighbour_vectors():
    whole = hexagonal(pitch=0.03)
    kept = np.random.default_rng(3).random(len(whole)) > 0.3

    few, all_of_them = Layout.of(pond_of(whole[kept])), Layout.of(pond_of(whole))

    assert few.pitch == pytest.approx(all_of_them.pitch)
    np.testing.assert_allclose(np.sort(few.steps, axis=0), np.sort(all_of_them.steps, axis=0), atol=1e-9)


def test_two_racks_at_an_angle_have_the_neighbour_vectors_of_both():
    racks = np.concatenate([square(pitch=0.03), square(pitch=0.03, angle_rad=np.radians(20)) + [0.6, 0.0]])

    _, degrees = _steps_of(Layout.of(pond_of(racks)))

    np.testing.assert_allclose(degrees, [0, 20, 90, 110, 180, 200, 270, 290], atol=1e-6)


def test_layouts_rounded_to_a_hundredth_of_the_pitch_keep_six_neighbour_vectors():
    rounded = np.round(hexagonal(angle_rad=0.37), 2)

    lengths, _ = _steps_of(Layout.of(pond_of(rounded)))

    assert len(lengths) == 6
    np.testing.assert_allclose(lengths, 1, atol=0.02)


def test_a_lone_rod_has_no_neighbours_and_a_pitch_that_keeps_others_away():
    layout = Layout.of(pond_of(np.array([[0.5, 0.5]]), outer_m=0.01))

    assert len(layout.steps) == 0
    assert layout.pitch > 2 * layout.outer_radius


def test_a_rod_of_another_size_does_not_change_the_radii_of_the_others():
    rods = (*pond_of(square(pitch=0.05), 0.01, 0.006).rods, Rod("odd", 1.0, 1.0, 0.02, 0.019))

    layout = Layout.of(Pond(2.0, 2.0, rods))

    assert (layout.outer_radius, layout.inner_radius) == (0.01, 0.006)
    assert layout.ids[-1] == "odd"


@given(
    points=st.lists(st.tuples(st.floats(-1, 9), st.floats(-1, 9)), min_size=1, max_size=6), radius=st.floats(0.1, 3.0)
)
def test_the_rods_within_a_radius_are_those_that_measuring_each_finds(points, radius):
    layout = Layout.of(pond_of(square()))

    rods, real = layout.within(np.array(points), radius)

    for point, row, ok in zip(points, rods, real, strict=True):
        distance = np.hypot(*(layout.centres - point).T)
        assert sorted(row[ok]) == np.flatnonzero(distance < radius).tolist()


def test_a_pond_without_rods_has_no_layout():
    with pytest.raises(InvalidLayout):
        Layout.of(Pond(1.0, 1.0))


def test_rods_without_an_extent_are_no_layout():
    with pytest.raises(InvalidLayout):
        Layout.of(pond_of(square(pitch=0.05), outer_m=0.0, inner_m=0.0))
