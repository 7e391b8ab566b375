"""What a session says: poses, rods, the mosaic and its tiles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Literal

import numpy as np
from fastapi import APIRouter, Query
from fastapi.responses import JSONResponse, Response
from sqlalchemy import Connection, RowMapping

from pondwatch.core.coverage import rods_in_view
from pondwatch.core.errors import Missing
from pondwatch.core.frames import pond_to_raster
from pondwatch.core.values import CorrectedPose, Pond, Rect, SnapshotKey, Status
from pondwatch.jobs import exports, sealing, tiles, views
from pondwatch.jobs.views import Json
from pondwatch.store import corrections, judgements, revisions, sessions
from pondwatch.store.corrections import Correction
from pondwatch.store.sessions import Session

from .services import Here

router = APIRouter(prefix="/api/sessions/{session_id}", tags=["results"])
Format = Annotated[Literal["json", "csv"], Query(alias="format")]
Method = Annotated[str | None, Query(max_length=40, description="Of `corrections`; else the session's own.")]


@router.get("/poses", summary="Corrected poses")
def get_poses(here: Here, session_id: str, form: Format = "json", method: Method = None) -> Response:
    """`poses`, in order of robot, boot and sequence, as of `revision`, by `method`; or `poses.csv` itself."""

    def look(connection: Connection) -> tuple[Session, Correction | None, Sequence[RowMapping | Json]]:
        session = sessions.get(connection, session_id)
        other = _other(connection, session, method)
        if other is None:
            return session, None, revisions.pose_rows(connection, session_id)
        return session, other, corrections.pose_rows(connection, other)

    session, other, rows = here.store.read(look)
    if form == "csv":
        return _file(exports.poses_csv(_corrected(row) for row in rows), "text/csv", "poses.csv")
    return JSONResponse({**_head(session, other), "poses": [views.pose(row) for row in rows]})


def _other(connection: Connection, session: Session, method: str | None) -> Correction | None:
    """The further correction that is asked for; None for the session's own result."""
    if method is None or method == session.method:
        return None
    found = corrections.get(connection, session.id, method)
    if found.state != "done":
        raise Missing(f"The correction by {method} is {found.state}.", kind="correction", id=method)
    return found


def _head(session: Session, other: Correction | None) -> Json:
    source = other or session
    return {"session": session.id, "revision": source.revision, "method": source.method}


def _corrected(row: RowMapping | Json) -> CorrectedPose:
    pose = None if row["x_m"] is None else np.array([row["x_m"], row["y_m"], row["theta_rad"]])
    xy, theta = row["sigma_xy_m"], row["sigma_theta_rad"]
    covariance = None if xy is None else np.diag(np.square([xy, xy, theta]))
    return CorrectedPose(
        SnapshotKey(row["robot"], row["boot"], row["sequence"]), pose, covariance, Status(row["status"])
    )


def rods_by(
    connection: Connection, session_id: str, method: str | None = None
) -> tuple[Session, Correction | None, list[Json]]:
    """Every rod of the layout, in its order."""
    session = sessions.get(connection, session_id, with_rods=True)
    other = _other(connection, session, method)
    rows: Sequence[RowMapping | Json] = (
        revisions.rod_rows(connection, session_id) if other is None else corrections.rod_rows(connection, other)
    )
    judged = judgements.newest(connection, session_id)
    read = {row["rod_id"]: row for row in rows}
    layout = session.inspection.pond.rods
    return session, other, [views.rod(read.get(r.id) or views.unseen(r.id), judged.get(r.id)) for r in layout]


@router.get("/rods", summary="Rod readings")
def get_rods(here: Here, session_id: str, form: Format = "json", method: Method = None) -> Response:
    """`rods`, every one of the layout in its order, as of `revision`, by `method`; or `rods.csv` itself."""
    session, other, rods = here.store.read(lambda c: rods_by(c, session_id, method))
    if form == "csv":
        return _file(exports.rods_csv(views.reading(r) for r in rods), "text/csv", "rods.csv")
    return JSONResponse({**_head(session, other), "rods": rods})


@router.get("/rods/{rod_id}", summary="One rod and the snapshots behind it")
def get_rod(here: Here, session_id: str, rod_id: str) -> JSONResponse:
    """The reading, and the snapshots whose corrected footprint holds the whole rod. `place`, in the layout, m, pond
    frame, and `camera` say where it is in each of them. `method_digest` and `model_digest` say by what it was read."""

    def look(connection: Connection) -> tuple[Session, list[Json], list[Json], Json]:
        session, _, rods = rods_by(connection, session_id)
        poses = [views.pose(row) for row in revisions.pose_rows(connection, session_id)]
        return session, rods, poses, sealing.answerable(connection, session)

    session, rods, poses, made = here.store.read(look)
    reading = next((rod for rod in rods if rod["rod_id"] == rod_id), None)
    if reading is None:
        raise Missing("There is no such rod.", kind="rod", id=rod_id[:100])
    seen = [views.evidence(pose) for pose in _showing(session, rod_id, poses)]
    rod = next(rod for rod in session.inspection.pond.rods if rod.id == rod_id)
    told = {"session": session_id, "method": session.method, "place": views.place(rod), "snapshots": seen}
    digests = {"method_digest": f"sha256:{made['method_sha256']}", "model_digest": _digest_of(made["models"])}
    return JSONResponse({**reading, **told, **digests, "camera": views.camera(session)})


def _digest_of(models: Mapping[str, str]) -> str | None:
    """Of the network that a method uses, if it does."""
    return next((f"sha256:{digest}" for digest in models.values()), None)


@router.get("/rods/{rod_id}/picture.png", summary="A rod in the mosaic")
def get_picture(
    here: Here, session_id: str, rod_id: str, reach: Annotated[float, Query(ge=1, le=8, description="Outer radii.")] = 2
) -> Response:
    """PNG: the mosaic around a rod, as it stands; transparent where nothing was seen."""
    session = here.store.read(lambda c: sessions.get(c, session_id, with_rods=True))
    pond, scale = session.inspection.pond, views.metres_per_pixel(session)
    rod = next((rod for rod in pond.rods if rod.id == rod_id), None)
    if rod is None:
        raise Missing("There is no such rod.", kind="rod", id=rod_id[:100])
    u, v = pond_to_raster(np.array([rod.x_m, rod.y_m]), pond, scale).tolist()
    here.queue.draw(session_id)
    half = min(1024, max(8, round(reach * rod.outer_radius_m / scale)))
    _, image = tiles.part(here.store, session_id, Rect(round(u) - half, round(v) - half, 2 * half + 1, 2 * half + 1))
    return _file(exports.mosaic_png(image), "image/png", "rod.png")


def _showing(session: Session, rod_id: str, poses: list[Json]) -> list[Json]:
    pond = session.inspection.pond
    alone = Pond(pond.width_m, pond.height_m, tuple(r for r in pond.rods if r.id == rod_id))
    placed = [pose for pose in poses if pose["x_m"] is not None]
    where = np.array([(p["x_m"], p["y_m"], p["theta_rad"]) for p in placed]).reshape(-1, 3)
    seen = rods_in_view(where, alone, session.inspection.camera)[:, 0]
    return [pose for pose, is_seen in zip(placed, seen, strict=True) if is_seen]


@router.get("/mosaic.png", summary="The mosaic as PNG")
def get_mosaic_png(here: Here, session_id: str) -> Response:
    """The whole raster; alpha 0 where nothing was seen."""
    here.queue.draw(session_id)
    _, image = tiles.whole(here.store, session_id)
    return _file(exports.mosaic_png(image), "image/png", "mosaic.png")


@router.get("/mosaic.pgw", summary="The world file of the PNG")
def get_mosaic_pgw(here: Here, session_id: str) -> Response:
    """Where the PNG lies in the pond."""
    session = here.store.read(lambda c: sessions.get(c, session_id))
    content = exports.world_file(views.metres_per_pixel(session), session.inspection.pond.height_m)
    return _file(content, "text/plain", "mosaic.pgw")


@router.get("/mosaic.tif", summary="The mosaic as GeoTIFF")
def get_mosaic_tif(here: Here, session_id: str) -> Response:
    """In the pond frame; alpha 0 where nothing was seen."""
    here.queue.draw(session_id)
    session, image = tiles.whole(here.store, session_id)
    content = exports.mosaic_tif(image, views.metres_per_pixel(session), session.inspection.pond.height_m)
    return _file(content, "image/tiff", "mosaic.tif")


@router.get("/tiles/{layer}/{z}/{x}/{y}", summary="A 256-pixel tile of a layer")
def get_tile(here: Here, session_id: str, layer: str, z: int, x: int, y: int, revision: int | None = None) -> Response:
    """PNG. z 0 is the whole pond; x right, y down. Immutable where `revision` is the newest.

    `mosaic`: colours. `coverage`: how many looks, 0 to 255. `age`: 65536 R + 256 G + B is how many seconds before the
    newest snapshot a place was last seen. A place never seen is transparent, or 0 in `coverage`."""
    here.queue.draw(session_id)
    content, newest = tiles.tile(here.store, session_id, layer, z, x, y)
    cache = "private, max-age=31536000, immutable" if revision == newest else "no-cache"
    return Response(content, 200, {"Cache-Control": cache, "Pondwatch-Revision": str(newest)}, "image/png")


def _file(content: bytes, media_type: str, name: str) -> Response:
    headers = {"Content-Disposition": f'inline; filename="{name}"', "Cache-Control": "no-cache"}
    return Response(content, 200, headers, media_type)
