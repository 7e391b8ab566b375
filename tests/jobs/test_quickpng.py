"""PNG as others read it."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from pondwatch.jobs.quickpng import png


def a_picture(*shape: int) -> NDArray[np.uint8]:
    """Noise, a flat part and a ramp."""
    picture = np.random.default_rng(5).integers(0, 256, shape, dtype=np.uint8)
    picture[: shape[0] // 3] = 77
    picture[-shape[0] // 3 :] = np.arange(shape[1], dtype=np.uint8).reshape(1, -1, *[1] * (len(shape) - 2))
    return picture


def read(content: bytes) -> NDArray[np.uint8]:
    """By OpenCV, as it comes."""
    found = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED)
    assert found is not None
    return np.asarray(found, np.uint8)


@pytest.mark.parametrize("shape", [(31, 47), (31, 47, 3), (31, 47, 4), (1, 1, 3), (1, 300, 4), (300, 1)])
def test_another_reader_finds_the_same_pixels(shape: tuple[int, ...]) -> None:
    picture = a_picture(*shape)
    assert (read(png(picture)) == picture).all()


def test_one_channel_may_have_an_axis_of_its_own() -> None:
    picture = a_picture(20, 30)
    assert png(picture[..., None]) == png(picture)


def test_a_cut_of_a_larger_picture_is_written_as_what_it_shows() -> None:
    picture = a_picture(40, 60, 3)
    assert (read(png(picture[5:17, 9:40])) == picture[5:17, 9:40]).all()
    assert (read(png(picture[5:17, 9:40, 0])) == picture[5:17, 9:40, 0]).all()


def test_a_flat_picture_takes_few_bytes() -> None:
    assert len(png(np.zeros((256, 256, 4), np.uint8))) < 3000


@pytest.mark.parametrize("shape", [(4, 4, 2), (0, 4, 3), (4, 4, 5)])
def test_what_cannot_be_written_is_named(shape: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match=r"shape \(.*cannot be written as PNG"):
        png(np.zeros(shape, np.uint8))
