"""The pictures of a report, each with the pond's axes: the mosaic, the coverage, and the rods as a drawing."""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from reportlab.lib import colors
from reportlab.lib.utils import ImageReader
from reportlab.platypus import Flowable

from pondwatch.core.values import Pond

from .dossier import Dossier
from .raster import encoded
from .stamped import View, metres, round_length, view_of
from .views import Json

PLAIN, BOLD = "Pond", "Pond-Bold"
ABNORMAL = colors.Color(0.72, 0.20, 0.05)
GREY = colors.Color(0.45, 0.45, 0.45)
_WIDE_PX = 1600
_TALL_PX = 1600
_STEPS = np.array([255, 200, 150, 105, 65, 30], np.uint8)  # grey, by looks
_LETTERS = {"empty": "E", "partial": "P", "full": "F", "unseen": "-"}
_SHADES = {"empty": 1.0, "partial": 0.8, "full": 0.55, "unseen": 1.0}
_LEFT, _BELOW, _ABOVE = 30.0, 24.0, 4.0  # points around a picture: for the axes


@dataclass(frozen=True, slots=True)
class Mark:
    """A numbered place on a picture, m, pond frame."""

    x_m: float
    y_m: float
    text: str


def mosaic_picture(found: Dossier) -> bytes:
    """The mosaic as JPEG, never-seen floor in grey."""
    pond = found.inspection.pond
    scale = max(pond.width_m / _WIDE_PX, pond.height_m / _TALL_PX, found.metres_per_pixel)
    width = max(1, round(pond.width_m / scale))
    picture, _ = view_of(found, View(0.0, 0.0, pond.width_m, pond.height_m, width))
    return encoded(picture, ".jpg")


def coverage_picture(looks: NDArray[np.uint16]) -> bytes:
    """How often each place was seen, darker for more, as PNG. looks: (h, w)."""
    shrink = max(1, -(-max(looks.shape) // _WIDE_PX))
    return encoded(_STEPS[np.minimum(looks[::shrink, ::shrink], len(_STEPS) - 1)], ".png")


class Sheet(Flowable):  # type: ignore[misc]
    """A plan of the pond in a frame, with axes in its own unit and a scale bar; what it shows is drawn by `paint`."""

    def __init__(self, pond: Pond, wide: float, tall: float, marks: Sequence[Mark] = ()) -> None:
        super().__init__()
        self._pond, self._marks = pond, marks
        self.scale = min((wide - _LEFT) / pond.width_m, (tall - _BELOW - _ABOVE) / pond.height_m)
        self._wide, self._tall = pond.width_m * self.scale, pond.height_m * self.scale
        self.width, self.height = self._wide + _LEFT, self._tall + _BELOW + _ABOVE

    def draw(self) -> None:
        """Called by reportlab, with the origin at the lower left."""
        canvas: Any = self.canv
        canvas.translate(_LEFT, _BELOW)
        canvas.setLineWidth(0.5)
        self.paint(canvas, self._wide, self._tall)
        canvas.setStrokeColor(colors.black)
        canvas.rect(0, 0, self._wide, self._tall)
        self._axes(canvas)
        for mark in self._marks:
            self._pin(canvas, mark)

    def paint(self, canvas: Any, wide: float, tall: float) -> None:
        """What lies in the frame; its origin is the pond's, `scale` points a metre."""
        raise NotImplementedError

    def _axes(self, canvas: Any) -> None:
        step_m = round_length(max(self._pond.width_m, self._pond.height_m) / 4)
        canvas.setFont(PLAIN, 6)
        canvas.setFillColor(GREY)
        for at_m in _ticks(self._pond.width_m, step_m):
            x = at_m * self.scale
            canvas.line(x, 0, x, -3)
            canvas.drawCentredString(x, -10, metres(at_m) if at_m else "0")
        for at_m in _ticks(self._pond.height_m, step_m):
            y = at_m * self.scale
            canvas.line(0, y, -3, y)
            canvas.drawRightString(-5, y - 2, metres(at_m) if at_m else "0")
        self._bar(canvas)

    def _bar(self, canvas: Any) -> None:
        length_m = round_length(self._pond.width_m / 5)
        left = self._wide - length_m * self.scale
        canvas.setFillColor(colors.black)
        canvas.rect(left, -19, length_m * self.scale, 2, fill=1)
        canvas.drawRightString(left - 3, -20, metres(length_m))

    def _pin(self, canvas: Any, mark: Mark) -> None:
        """A number in a box beside its place, inside the frame."""
        x, y, size = mark.x_m * self.scale, mark.y_m * self.scale, 4 + 4 * len(mark.text)
        left = min(x + 5, self._wide - size - 1)
        low = min(max(y + 5, 1), self._tall - 10)
        canvas.setStrokeColor(ABNORMAL)
        canvas.setLineWidth(1)
        canvas.circle(x, y, 5)
        canvas.setFillColor(colors.white)
        canvas.rect(left, low, size, 9, fill=1)
        canvas.setFillColor(ABNORMAL)
        canvas.setFont(BOLD, 6.5)
        canvas.drawCentredString(left + size / 2, low + 2.2, mark.text)


class PictureSheet(Sheet):
    """An encoded picture of the whole pond."""

    def __init__(self, content: bytes, pond: Pond, wide: float, tall: float, marks: Sequence[Mark] = ()) -> None:
        super().__init__(pond, wide, tall, marks)
        self._content = content

    def paint(self, canvas: Any, wide: float, tall: float) -> None:
        """The picture fills the frame."""
        canvas.drawImage(ImageReader(io.BytesIO(self._content)), 0, 0, wide, tall)


class RodMap(Sheet):
    """Every rod at its place in the layout, with its state's letter and shade. letters: by rod, of what is abnormal."""

    def __init__(
        self, pond: Pond, rods: Sequence[Json], wide: float, tall: float, letters: Mapping[str, str] | None = None
    ) -> None:
        super().__init__(pond, wide, tall)
        self._rods, self._letters = rods, letters or {}

    def paint(self, canvas: Any, wide: float, tall: float) -> None:
        """Circles of the outer radius."""
        for rod, reading in zip(self._pond.rods, self._rods, strict=True):
            self._rod(canvas, (rod.x_m * self.scale, rod.y_m * self.scale), rod.outer_radius_m * self.scale, reading)
        canvas.setDash([])

    def _rod(self, canvas: Any, at: tuple[float, float], radius: float, reading: Json) -> None:
        shade, abnormal = _SHADES[reading["state"]], self._letters.get(reading["rod_id"], "")
        canvas.setFillColor(colors.Color(shade, shade, shade))
        canvas.setStrokeColor(ABNORMAL if abnormal else colors.black)
        canvas.setLineWidth(1.4 if abnormal else 0.4)
        canvas.setDash([1, 1] if reading["state"] == "unseen" else [])
        canvas.circle(*at, radius, fill=1)
        size = max(2.0, min(8.0, 1.1 * radius))
        canvas.setFillColor(colors.black)
        canvas.setFont(BOLD, size)
        letter = _LETTERS[reading["state"]] + ("!" if reading["conflicting"] else "")
        canvas.drawCentredString(at[0], at[1] - 0.36 * size, letter)
        if abnormal:
            canvas.setFillColor(ABNORMAL)
            canvas.setFont(BOLD, 0.75 * size)
            canvas.drawString(at[0] + 0.75 * radius, at[1] + 0.7 * radius, abnormal)


def _ticks(length_m: float, step_m: float) -> Iterator[float]:
    return (n * step_m for n in range(int(length_m / step_m + 1e-9) + 1))


def legend(entries: Sequence[tuple[float | None, str]]) -> Flowable:
    """A line of grey swatches with their words; None: a dashed ring."""
    return _Legend(entries)


class _Legend(Flowable):  # type: ignore[misc]
    def __init__(self, entries: Sequence[tuple[float | None, str]]) -> None:
        super().__init__()
        self._entries, self.width, self.height = entries, 400.0, 13.0

    def draw(self) -> None:
        canvas: Any = self.canv
        canvas.setFont(PLAIN, 7)
        canvas.setLineWidth(0.4)
        x = _LEFT
        for shade, words in self._entries:
            canvas.setDash([1, 1] if shade is None else [])
            grey = 1.0 if shade is None else shade
            canvas.setFillColor(colors.Color(grey, grey, grey))
            canvas.rect(x, 3, 10, 7, fill=1)
            canvas.setFillColor(colors.black)
            canvas.drawString(x + 14, 4, words)
            x += 26 + canvas.stringWidth(words, PLAIN, 7)
        canvas.setDash([])
