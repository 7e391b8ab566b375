"""Medians beside NumPy's own."""

from __future__ import annotations

import numpy as np
import pytest

from pondwatch.core.ranks import median, median_of_many, middle


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("count", [1, 2, 3, 8, 9])
def test_a_median_is_numpys_to_the_last_digit(count: int, dtype: type) -> None:
    values = np.random.default_rng(count).normal(size=(count, 5, 3)).astype(dtype)
    for axis, turned in ((0, values), (1, values.transpose(1, 0, 2)), (2, values.transpose(1, 2, 0))):
        found = median(turned, axis)
        assert found.dtype == dtype
        assert (found == np.median(turned, axis=axis)).all()
        assert (middle(np.sort(turned, axis=axis), axis) == found).all()


@pytest.mark.parametrize("shape", [(1,), (2,), (37, 41), (40, 50)])
def test_a_median_of_many_is_numpys_to_the_last_digit(shape: tuple[int, ...]) -> None:
    values = np.random.default_rng(3).normal(size=shape).astype(np.float32)
    assert median_of_many(values) == float(np.median(values))


def test_values_that_are_alike_stay_as_they_are() -> None:
    assert median_of_many(np.full((30, 7), 0.1, np.float32)) == float(np.float32(0.1))
