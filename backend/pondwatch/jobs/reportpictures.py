"""The pictures of a report: the mosaic, the coverage, and the rods as a drawing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from reportlab.lib import colors
from reportlab.platypus import Flowable

from pondwatch.core.values import Image, Pond

from .dossier import Dossier
from .stamped import View, metres, round_length, view_of
from .views import Json

_WIDE_PX = 1600
_TALL_PX = 1600
_STEPS = np.array([255, 200, 150, 105, 65, 30], np.uint8)  # grey, by looks
_LETTERS = {"empty": "E", "partial": "P", "full": "F", "unseen": "-"}
_SHADES = {"empty": 1.0, "partial": 0.8, "full": 0.55, "unseen": 1.0}


@dataclass(frozen=True, slots=True)
class Picture:
    """An encoded picture and its size, width and height."""

    content: bytes
    size_px: tuple[int, int]


def mosaic_picture(found: Dossier) -> Picture:
    """The mosaic as JPEG, never-seen floor in grey."""
    pond = found.inspection.pond
    scale = max(pond.width_m / _WIDE_PX, pond.height_m / _TALL_PX, found.metres_per_pixel)
    width = max(1, round(pond.width_m / scale))
    picture, _ = view_of(found, View(0.0, 0.0, pond.width_m, pond.height_m, width))
    return _encoded(picture, ".jpg")


def coverage_picture(looks: NDArray[np.uint16]) -> Picture:
    """How often each place was seen, darker for more, as PNG. looks: (h, w)."""
    shrink = max(1, -(-max(looks.shape) // _WIDE_PX))
    return _encoded(_STEPS[np.minimum(looks[::shrink, ::shrink], len(_STEPS) - 1)], ".png")


def _encoded(picture: Image, kind: str) -> Picture:
    done, content = cv2.imencode(kind, picture)
    assert done
    return Picture(content.tobytes(), (picture.shape[1], picture.shape[0]))


class RodMap(Flowable):  # type: ignore[misc]
    """Every rod at its place in the layout, with its state's letter and shade."""

    def __init__(self, pond: Pond, rods: Sequence[Json], wide: float, tall: float) -> None:
        super().__init__()
        self._pond, self._rods = pond, rods
        self._scale = min(wide / pond.width_m, tall / pond.height_m)
        self.width, self.height = pond.width_m * self._scale, pond.height_m * self._scale

    def draw(self) -> None:
        """Called by reportlab, with the origin at the lower left."""
        canvas: Any = self.canv
        canvas.setLineWidth(0.4)
        canvas.rect(0, 0, self.width, self.height)
        for rod, reading in zip(self._pond.rods, self._rods, strict=True):
            x, y, radius = (v * self._scale for v in (rod.x_m, rod.y_m, rod.outer_radius_m))
            shade = _SHADES[reading["state"]]
            canvas.setFillColor(colors.Color(shade, shade, shade))
            canvas.setDash([1, 1] if reading["state"] == "unseen" else [])
            canvas.circle(x, y, radius, fill=1)
            canvas.setFillColor(colors.black)
            letter = _LETTERS[reading["state"]] + ("!" if reading["conflicting"] else "")
            size = max(2.0, min(8.0, 1.1 * radius))
            canvas.setFont("Pond-Bold", size)
            canvas.drawCentredString(x, y - 0.36 * size, letter)
        canvas.setDash([])


class _Bar(Flowable):  # type: ignore[misc]
    def __init__(self, length_m: float, wide: float) -> None:
        super().__init__()
        self._length_m, self.width, self.height = length_m, wide, 12

    def draw(self) -> None:
        canvas: Any = self.canv
        canvas.rect(0, 4, self.width, 2, fill=1)
        canvas.setFont("Pond", 7)
        canvas.drawString(self.width + 4, 2, metres(self._length_m))


def scale_bar(whole_m: float, whole: float) -> Flowable:
    """A bar of a round length, about a fifth of a picture that is `whole_m` metres and `whole` points wide."""
    length_m = round_length(whole_m / 5)
    return _Bar(length_m, whole * length_m / whole_m)
