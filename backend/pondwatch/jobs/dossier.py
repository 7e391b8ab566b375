"""All that a session comes to, as what is exported of it is made of: the one thing that every writer takes."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from sqlalchemy import Connection, RowMapping

from pondwatch.core.layers import Layers, Sight, layers
from pondwatch.core.mosaic import default_metres_per_pixel
from pondwatch.core.values import Image, Inspection
from pondwatch.store import revisions, seals, sessions
from pondwatch.store.clock import rfc3339
from pondwatch.store.store import Store

from . import tiles, views
from .views import Json


@dataclass(frozen=True, slots=True)
class Table:
    """A table of a report. rows: texts, as many as columns. headline: what it comes to, in a few words. marks: a letter
    for each rod that it names as abnormal, and marked what the letter says. places: x m, y m, pond frame, and what is
    written there on the mosaic. pictures: square ones as PNG, with what they show."""

    title: str
    note: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    headline: str = ""
    marks: Mapping[str, str] = field(default_factory=dict)
    marked: str = ""
    places: Sequence[tuple[float, float, str]] = ()
    pictures: Sequence[tuple[bytes, str]] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Dossier:
    """A session at a revision.

    facts: `id`, `name`, `state`, `method`, `revision`, `coverage`, `quality`, `created_at`, `finished_at`.
    poses: in order of robot, boot, sequence: the key, `captured_ms`, `captured_at`, `received_at`, `raw` and
        `corrected` (x_m, y_m, theta_rad; the latter None where rejected), `sigma_xy_m`, `sigma_theta_rad`, `status`,
        `fault`, `digest`, `media_type`.
    rods: every one of the layout, as `views.rod`. seal: the signed manifest, None where there is none.
    mosaic: draws it, (h, w, 4) BGRA. picture: a snapshot's bytes, by its digest. tables: what else a report shows.
    """

    facts: Mapping[str, object]
    inspection: Inspection
    poses: Sequence[Json]
    rods: Sequence[Json]
    seal: Json | None
    mosaic: Callable[[], Image]
    picture: Callable[[str], bytes]
    tables: Sequence[Table] = ()

    @property
    def metres_per_pixel(self) -> float:
        """The scale of the mosaic's raster."""
        return default_metres_per_pixel(self.inspection.camera, self.inspection.pond)

    def layers(self) -> Layers:
        """Looks, age and sigma of every raster pixel."""
        sights = [_sight(pose) for pose in self.poses if pose["corrected"] is not None]
        return layers(sights, self.inspection.camera, self.inspection.pond, self.metres_per_pixel)


def dossier(store: Store, session_id: str, tables: Sequence[Table] = ()) -> Dossier:
    """The dossier of a stored session, at one revision.

    Raises:
        Missing: there is no such session.
    """

    def look(connection: Connection) -> Dossier:
        session = sessions.get(connection, session_id, with_rods=True)
        rods = {row["rod_id"]: views.rod(row) for row in revisions.rod_rows(connection, session_id)}
        seal = seals.find(connection, session_id)
        facts = {
            "id": session_id,
            "name": session.inspection.name,
            "state": session.state.value,
            "method": session.method,
            "revision": session.revision,
            "coverage": session.seen_share,
            "quality": session.quality,
            "created_at": rfc3339(session.created_ms),
            "finished_at": rfc3339(session.finished_ms),
        }
        return Dossier(
            facts,
            session.inspection,
            [_pose(row) for row in seals.snapshot_rows(connection, session_id) if row["status"] is not None],
            [rods.get(rod.id) or views.unseen(rod.id) for rod in session.inspection.pond.rods],
            json.loads(seal.manifest) if seal else None,
            lambda: tiles.whole(store, session_id)[1],
            store.blobs.get,
            tables,
        )

    return store.read(look)


def seen_rods(rods: Sequence[Json]) -> dict[str, int]:
    """How many rods are in each state, in the order empty, partial, full, unseen."""
    return {state: sum(r["state"] == state for r in rods) for state in ("empty", "partial", "full", "unseen")}


def _sight(pose: Json) -> Sight:
    at = pose["corrected"]
    place = np.array([at["x_m"], at["y_m"], at["theta_rad"]])
    return Sight(place, pose["captured_ms"] / 1000, pose["sigma_xy_m"], pose["sigma_theta_rad"])


def _pose(row: RowMapping) -> Json:
    axes = ("x_m", "y_m", "theta_rad")
    names = ("robot", "boot", "sequence", "captured_ms", "status", "sigma_xy_m", "sigma_theta_rad", "fault")
    return {
        **{name: row[name] for name in names},
        "captured_at": rfc3339(row["captured_ms"]),
        "received_at": rfc3339(row["received_ms"]),
        "raw": {axis: row[axis] for axis in axes},
        "corrected": None if row["to_x_m"] is None else {axis: row[f"to_{axis}"] for axis in axes},
        "digest": row["digest"],
        "media_type": row["media_type"],
    }
