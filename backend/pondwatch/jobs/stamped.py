"""A picture of a view of the mosaic, with what it shows and when written into it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import IO

import cv2
import numpy as np

from pondwatch.core.errors import Invalid
from pondwatch.core.frames import pond_to_raster
from pondwatch.core.values import Image

from .dossier import Dossier
from .exports import mosaic_png

MOST_PX = 4096
LEAST_PX = 320
DEFAULT_PX = 1600
_FOOT_PX = 64
_GROUND = (214, 214, 214)  # of what was never seen
_INK = (32, 32, 32)
_FONT = cv2.FONT_HERSHEY_SIMPLEX


@dataclass(frozen=True, slots=True)
class View:
    """A part of the pond: west, south, east, north in metres, pond frame. width_px: of the picture."""

    west_m: float
    south_m: float
    east_m: float
    north_m: float
    width_px: int = DEFAULT_PX


def write_stamped(found: Dossier, view: View | None, out: IO[bytes]) -> None:
    """Write the view as PNG; the whole pond where none is given.

    Raises:
        Invalid: a view that is empty, of another order, or outside the pond.
    """
    out.write(mosaic_png(stamped(found, view)))


def stamped(found: Dossier, view: View | None = None) -> Image:
    """(h, w, 3), BGR: the view, and under it session, time, revision, place, and a scale bar."""
    pond = found.inspection.pond
    seen = view or View(0.0, 0.0, pond.width_m, pond.height_m)
    _check(seen, pond.width_m, pond.height_m)
    picture, pixel_m = view_of(found, seen)
    height, width = picture.shape[:2]
    sheet = np.full((height + _FOOT_PX, width, 3), 245, np.uint8)
    sheet[:height] = picture
    facts = found.facts
    moment = str(facts["finished_at"] or (found.poses[-1]["captured_at"] if found.poses else facts["created_at"]))
    first = f"{facts['name']}  {facts['id']}"
    corners = f"x {seen.west_m:.3f} to {seen.east_m:.3f} m, y {seen.south_m:.3f} to {seen.north_m:.3f} m"
    bar_m = round_length(pixel_m * width * 0.2)
    bar_px = round(bar_m / pixel_m)
    room = width - bar_px - 48
    _write(sheet, first, 12, height + 22, room)
    _write(sheet, f"{moment}  revision {facts['revision']}  {corners}", 12, height + 48, room)
    left, line = width - 16 - bar_px, height + 42
    cv2.rectangle(sheet, (left, line), (left + bar_px, line + 6), _INK, -1)
    _write(sheet, metres(bar_m), left, height + 30, bar_px)
    return sheet


def _check(view: View, width_m: float, height_m: float) -> None:
    sides = view.west_m, view.south_m, view.east_m, view.north_m
    if not all(map(math.isfinite, sides)) or not (view.west_m < view.east_m and view.south_m < view.north_m):
        raise Invalid("view: west must be less than east, and south less than north.", field="view")
    if view.west_m >= width_m or view.south_m >= height_m or view.east_m <= 0 or view.north_m <= 0:
        raise Invalid("view: lies outside the pond.", field="view")
    if not LEAST_PX <= view.width_px <= MOST_PX:
        raise Invalid(f"view: the width must be from {LEAST_PX} to {MOST_PX} px.", field="width")


def view_of(found: Dossier, view: View) -> tuple[Image, float]:
    """The view, never-seen floor in grey, and the metres of one of its pixels."""
    pixel_m = (view.east_m - view.west_m) / view.width_px
    height = max(1, round((view.north_m - view.south_m) / pixel_m))
    if height > 4 * MOST_PX:
        raise Invalid("view: is too tall for its width.", field="view")
    scale = found.metres_per_pixel
    first = np.array([view.west_m + pixel_m / 2, view.north_m - pixel_m / 2])
    x, y = pond_to_raster(first, found.inspection.pond, scale)
    step = pixel_m / scale
    to_raster = np.array([[step, 0, x], [0, step, y]])
    bgra = found.mosaic()
    if step > 1:  # what a picture this coarse cannot hold
        size = max(1, round(bgra.shape[1] / step)), max(1, round(bgra.shape[0] / step))
        shrink = np.array(bgra.shape[1::-1]) / size
        bgra = np.asarray(cv2.resize(bgra, size, interpolation=cv2.INTER_AREA), np.uint8)
        to_raster = (to_raster + [[0, 0, 0.5], [0, 0, 0.5]]) / shrink[:, None] - [[0, 0, 0.5], [0, 0, 0.5]]
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    warped = cv2.warpAffine(bgra, to_raster, (view.width_px, height), flags=flags, borderMode=cv2.BORDER_CONSTANT)
    alpha = warped[..., 3:] / np.float32(255)
    picture = warped[..., :3] + (1 - alpha) * np.array(_GROUND, np.float32)  # colours are 0 where alpha is
    return np.clip(picture + 0.5, 0, 255).astype(np.uint8), pixel_m


def round_length(most_m: float) -> float:
    """The longest of 1, 2 or 5 times a power of ten that is not over it."""
    power = 10.0 ** math.floor(math.log10(most_m))
    return max(k * power for k in (1, 2, 5) if k * power <= most_m * (1 + 1e-9))


def metres(length_m: float) -> str:
    """A length as it is written beside a bar."""
    return f"{length_m:g} m" if length_m >= 1 else f"{length_m * 1000:g} mm"


def _write(sheet: Image, text: str, x: int, y: int, room_px: int) -> None:
    """Text that fits; letters that the font lacks are question marks."""
    plain = text.encode("ascii", "replace").decode()
    wide = cv2.getTextSize(plain, _FONT, 0.5, 1)[0][0]
    cv2.putText(sheet, plain, (x, y), _FONT, min(0.5, 0.5 * room_px / max(1, wide)), _INK, 1, cv2.LINE_AA)
