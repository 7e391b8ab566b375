"""What single looks must show of a thing before it is one: by shares of it, and its significance."""

from __future__ import annotations

import pytest

from pondwatch.core.witnesses import agreeing, is_borne_out


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
