"""The Foxglove schemas that recordings are written with, as JSON schemas (docs.foxglove.dev/docs/sdk/schemas), and
messages by them."""

from __future__ import annotations

import base64
import math
from typing import Any

from .views import Json

_NUMBER: Json = {"type": "number"}
_TEXT: Json = {"type": "string"}


def _object(title: str, **properties: Any) -> Json:
    return {"title": title, "type": "object", "properties": properties}


def _list(items: Json) -> Json:
    return {"type": "array", "items": items}


def _moment(title: str = "time") -> Json:
    return _object(
        title,
        sec={"type": "integer", "minimum": 0},
        nsec={"type": "integer", "minimum": 0, "maximum": 999_999_999},
    )


_VECTOR = _object("foxglove.Vector3", x=_NUMBER, y=_NUMBER, z=_NUMBER)
_TURN = _object("foxglove.Quaternion", x=_NUMBER, y=_NUMBER, z=_NUMBER, w=_NUMBER)
_POSE = _object("foxglove.Pose", position=_VECTOR, orientation=_TURN)
_COLOUR = _object("foxglove.Color", r=_NUMBER, g=_NUMBER, b=_NUMBER, a=_NUMBER)
_PAIR = _object("foxglove.KeyValuePair", key=_TEXT, value=_TEXT)
_CYLINDER = _object(
    "foxglove.CylinderPrimitive",
    pose=_POSE,
    size=_VECTOR,
    bottom_scale=_NUMBER,
    top_scale=_NUMBER,
    color=_COLOUR,
)
_OTHERS = ("arrows", "cubes", "spheres", "lines", "triangles", "texts", "models")
_ENTITY = _object(
    "foxglove.SceneEntity",
    timestamp=_moment(),
    frame_id=_TEXT,
    id=_TEXT,
    lifetime=_moment("duration"),
    frame_locked={"type": "boolean"},
    metadata=_list(_PAIR),
    cylinders=_list(_CYLINDER),
    **{name: _list({"type": "object"}) for name in _OTHERS},
)
POSE_IN_FRAME = _object("foxglove.PoseInFrame", timestamp=_moment(), frame_id=_TEXT, pose=_POSE)
COMPRESSED_IMAGE = _object(
    "foxglove.CompressedImage",
    timestamp=_moment(),
    frame_id=_TEXT,
    data={"type": "string", "contentEncoding": "base64"},
    format=_TEXT,
)
SCENE_UPDATE = _object(
    "foxglove.SceneUpdate",
    deletions=_list({"title": "foxglove.SceneEntityDeletion", "type": "object"}),
    entities=_list(_ENTITY),
)


def moment(ms: int) -> Json:
    """Milliseconds since the epoch."""
    return {"sec": ms // 1000, "nsec": ms % 1000 * 1_000_000}


def pose(x_m: float, y_m: float, theta_rad: float = 0.0) -> Json:
    """A pose in the plane z = 0, turned about z."""
    turn = {"x": 0.0, "y": 0.0, "z": math.sin(theta_rad / 2), "w": math.cos(theta_rad / 2)}
    return {"position": {"x": x_m, "y": y_m, "z": 0.0}, "orientation": turn}


def pose_in_frame(ms: int, frame: str, at: Json) -> Json:
    """foxglove.PoseInFrame. at: x_m, y_m, theta_rad."""
    return {"timestamp": moment(ms), "frame_id": frame, "pose": pose(at["x_m"], at["y_m"], at["theta_rad"])}


def compressed_image(ms: int, frame: str, content: bytes, kind: str) -> Json:
    """foxglove.CompressedImage. kind: jpeg, png or webp."""
    data = base64.b64encode(content).decode()
    return {"timestamp": moment(ms), "frame_id": frame, "data": data, "format": kind}


def cylinder_entity(ms: int, frame: str, name: str, at: Json, size_m: tuple[float, float], colour: Json) -> Json:
    """foxglove.SceneEntity of one upright cylinder. at: x_m, y_m. size_m: diameter and height. Its `metadata` is for
    the caller to fill."""
    cylinder = {
        "pose": pose(at["x_m"], at["y_m"]),
        "size": {"x": size_m[0], "y": size_m[0], "z": size_m[1]},
        "bottom_scale": 1.0,
        "top_scale": 1.0,
        "color": colour,
    }
    entity = {"timestamp": moment(ms), "frame_id": frame, "id": name, "lifetime": {"sec": 0, "nsec": 0}}
    empty: Json = {other: [] for other in _OTHERS}
    return {**entity, "frame_locked": False, "metadata": [], "cylinders": [cylinder], **empty}
