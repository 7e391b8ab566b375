"""What single looks must show of what all of them together seem to, and how much that must be."""

from __future__ import annotations

import numpy as np
import pytest

from pondwatch.core.floormaps import WORTH_A_LOOK, worth_a_look
from pondwatch.core.witnesses import agreeing, is_borne_out, is_steady


@pytest.mark.parametrize(("middle", "scale"), [(5.0, 0.6), (7.0, 1.5)])
def test_in_a_pond_whose_residuals_have_tails_about_one_cell_is_worth_a_look_by_chance(
    middle: float, scale: float
) -> None:
    """The greatest of many is Gumbel's; a tenth of the cells hold things, and change the limit little."""
    rng = np.random.default_rng(1)
    over = []
    for _ in range(400):
        peaks = rng.gumbel(middle, scale, 180)
        peaks[:18] = 60.0
        over.append((peaks[18:] > worth_a_look(peaks)).sum())

    assert np.mean(over) < 1.0


def test_a_quiet_pond_and_one_of_few_cells_keep_the_limit_that_a_witness_needs() -> None:
    assert worth_a_look(np.random.default_rng(2).gumbel(3.5, 0.3, 180)) == WORTH_A_LOOK
    assert worth_a_look(np.full(5, 30.0)) == WORTH_A_LOOK


def test_glare_on_a_ring_in_one_look_of_five_is_no_rod_off_its_place() -> None:
    assert not is_steady([1.2, -0.2, -0.4, 0.0, 4.3], 9.0)
    assert not is_steady([2.0, 1.9, 2.1, 2.0], 9.0)  # all looks show twice what they agree on: it is the light


def test_looks_that_show_a_rod_off_its_place_now_more_and_now_less_do_so_together() -> None:
    assert is_steady([0.1, 0.4, 1.1, 1.0, 0.5, 0.9, 0.1], 9.0)
    assert not is_borne_out([0.1, 0.4, 1.1, 1.0, 0.5, 0.9, 0.1], 12.0)  # a thing is in each look, or is none


def test_where_too_few_looks_show_a_ring_whole_its_significance_decides() -> None:
    assert is_steady([1.0, 1.0], 20.0)
    assert not is_steady([1.0, 1.0], 9.0)


def test_a_look_that_shows_more_than_half_of_a_thing_agrees() -> None:
    assert agreeing([1.0, 0.6, 0.5, -0.2]) == 2


@pytest.mark.parametrize(
    ("shown", "peak", "is_thing"),
    [
        ([1.0, 0.9, 1.1, 0.1], 16.0, True),  # three of four are enough of what is strong
        ([1.0, 0.9, 0.2, 0.1], 16.0, False),
        ([1.0, 0.9, 1.1, 0.1], 12.0, False),  # of what is weaker each must show it
        ([1.0, 0.9, 1.1, 1.0], 12.0, True),
        ([0.6, 2.4, 0.6, 0.8], 12.0, False),  # each does, and not alike: 1.1 is 2.5 standard errors of 0.44
        ([1.0, 1.0, 1.0], 16.0, False),  # the median of three is one of them
        ([1.0, 1.0, 1.0], 23.0, True),
        ([1.0, 1.0], 100.0, False),
        ([1.7, 1.6, 1.8, 1.7], 30.0, False),  # looks show more than all agree on: they differ in the light around it
    ],
)
def test_the_weaker_a_thing_is_the_more_alike_looks_must_show_it(
    shown: list[float], peak: float, is_thing: bool
) -> None:
    assert is_borne_out(shown, peak) is is_thing
