"""From the content of `session.json` to an `Inspection`, and back. The API and the bundles share it.

Pure. Whatever is wrong is named by its field, as `pond.rods[17].x_m`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from .errors import InvalidLayout
from .pond import tree_of
from .values import Camera, Inspection, Pond, PoseNoise, Rod

FORMAT = "pond-session/1"
MAX_RODS = 50_000
MAX_SIDE_PX = 8192
MAX_IMAGE_PX = 24_000_000
MAX_POND_M = 1000.0
MAX_TEXT = 200


def parse_inspection(document: object) -> Inspection:
    """What a session is, checked: sizes, finite numbers, rods that are inside the pond, apart and named once.

    Args:
        document: the content of `session.json` as JSON values. Fields that are not known are passed over.

    Raises:
        InvalidLayout: names the field. facts: field.
    """
    root = _object(document, "session.json")
    if root.get("format") != FORMAT:
        raise _fault("format", f"must be {FORMAT!r}, and is {_short(root.get('format'))}")
    noise = root.get("pose_noise")
    return Inspection(
        _text(root, "name", "name") if "name" in root else "unnamed",
        _camera(_object(root.get("camera"), "camera")),
        _pond(_object(root.get("pond"), "pond")),
        None if noise is None else _noise(_object(noise, "pose_noise")),
    )


def parse_pond(document: object) -> Pond:
    """A pond's size and layout alone, checked as those of an inspection are.

    Raises:
        InvalidLayout: names the field. facts: field.
    """
    return _pond(_object(document, "pond"))


def inspection_document(inspection: Inspection) -> dict[str, Any]:
    """The JSON values that `parse_inspection` makes the same inspection of."""
    camera, pond, noise = inspection.camera, inspection.pond, inspection.pose_noise
    names = ("id", "x_m", "y_m", "outer_radius_m", "inner_radius_m")
    rods = [{name: getattr(rod, name) for name in names} for rod in pond.rods]
    document: dict[str, Any] = {
        "format": FORMAT,
        "name": inspection.name,
        "camera": {
            "width_px": camera.width_px,
            "height_px": camera.height_px,
            "metres_per_pixel": camera.metres_per_pixel,
        },
        "pond": {"width_m": pond.width_m, "height_m": pond.height_m, "rods": rods},
    }
    if noise:
        document["pose_noise"] = {"sigma_xy_m": noise.sigma_xy_m, "sigma_theta_rad": noise.sigma_theta_rad}
    return document


def _camera(camera: Mapping[str, Any]) -> Camera:
    width, height = (_side_px(camera, name) for name in ("width_px", "height_px"))
    if width * height > MAX_IMAGE_PX:
        raise _fault("camera", f"takes pictures of {width} x {height} pixels; {MAX_IMAGE_PX} pixels is the most")
    return Camera(width, height, _positive(camera, "metres_per_pixel", "camera.metres_per_pixel"))


def _side_px(camera: Mapping[str, Any], name: str) -> int:
    value = camera.get(name)
    if isinstance(value, bool) or not isinstance(value, int) or not 8 <= value <= MAX_SIDE_PX:
        raise _fault(f"camera.{name}", f"must be a whole number from 8 to {MAX_SIDE_PX}, and is {_short(value)}")
    return value


def _noise(noise: Mapping[str, Any]) -> PoseNoise:
    sigmas = {name: _number(noise, name, f"pose_noise.{name}") for name in ("sigma_xy_m", "sigma_theta_rad")}
    for name, value in sigmas.items():
        if value < 0:
            raise _fault(f"pose_noise.{name}", f"must not be negative, and is {value}")
    return PoseNoise(**sigmas)


def _pond(pond: Mapping[str, Any]) -> Pond:
    width, height = (_positive(pond, name, f"pond.{name}", MAX_POND_M) for name in ("width_m", "height_m"))
    listed = pond.get("rods")
    listed = [] if listed is None else listed
    if not isinstance(listed, list) or len(listed) > MAX_RODS:
        raise _fault("pond.rods", f"must be a list of at most {MAX_RODS} rods")
    rods = tuple(_rod(_object(rod, f"pond.rods[{i}]"), f"pond.rods[{i}]") for i, rod in enumerate(listed))
    checked = Pond(width, height, rods)
    _check_places(checked)
    return checked


def _rod(rod: Mapping[str, Any], field: str) -> Rod:
    identity = _text(rod, "id", f"{field}.id")
    x, y = (_number(rod, name, f"{field}.{name}") for name in ("x_m", "y_m"))
    outer, inner = (_positive(rod, name, f"{field}.{name}") for name in ("outer_radius_m", "inner_radius_m"))
    if inner > outer:
        raise _fault(f"{field}.inner_radius_m", f"is {inner}, more than the outer radius {outer}")
    return Rod(identity, x, y, outer, inner)


def _check_places(pond: Pond) -> None:
    first: dict[str, int] = {}
    for i, rod in enumerate(pond.rods):
        if rod.id in first:
            raise _fault(f"pond.rods[{i}].id", f"{rod.id!r} was given before, by pond.rods[{first[rod.id]}]")
        first[rod.id] = i
        r = rod.outer_radius_m
        if not (-r <= rod.x_m <= pond.width_m + r and -r <= rod.y_m <= pond.height_m + r):
            raise _fault(f"pond.rods[{i}]", f"{rod.id!r} lies outside the pond, at ({rod.x_m}, {rod.y_m})")
    if len(pond.rods) > 1:
        _check_apart(pond)


def _check_apart(pond: Pond) -> None:
    """Two rods whose centres are nearer than an inner radius are one rod given twice."""
    centres = np.array([(r.x_m, r.y_m) for r in pond.rods])
    found = tree_of(centres).query(centres, k=2)
    distance, nearest = (np.asarray(part) for part in found)
    close = np.flatnonzero(distance[:, 1] < np.array([r.inner_radius_m for r in pond.rods]))
    if close.size:
        i, j = int(close[-1]), int(next(k for k in nearest[close[-1]] if k != close[-1]))
        raise _fault(f"pond.rods[{i}]", f"{pond.rods[i].id!r} lies on {pond.rods[j].id!r}, pond.rods[{j}]")


def _object(value: object, field: str) -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        raise _fault(field, "is missing" if value is None else f"must be an object, and is {_short(value)}")
    return value


def _text(holder: Mapping[str, Any], name: str, field: str) -> str:
    value = holder.get(name)
    if not isinstance(value, str) or not 0 < len(value) <= MAX_TEXT or not value.isprintable():
        raise _fault(field, f"must be a text of 1 to {MAX_TEXT} printable characters, and is {_short(value)}")
    return value


def _number(holder: Mapping[str, Any], name: str, field: str) -> float:
    value = holder.get(name)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise _fault(field, "is missing" if value is None else f"must be a number, and is {_short(value)}")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise _fault(field, f"must be finite, and is {_short(value)}")
    return number


def _positive(holder: Mapping[str, Any], name: str, field: str, most: float = math.inf) -> float:
    value = _number(holder, name, field)
    if not 0 < value <= most:
        raise _fault(field, f"must be above 0{'' if most == math.inf else f' and at most {most:g}'}, and is {value}")
    return value


def _short(value: object) -> str:
    text = repr(value) if not isinstance(value, int) or abs(value) < 10**18 else "a very large number"
    return text if len(text) <= 60 else text[:57] + "..."


def _fault(field: str, what: str) -> InvalidLayout:
    return InvalidLayout(f"{field} {what}.", field=field)
