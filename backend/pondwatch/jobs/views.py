"""Rows of the store as JSON values, named as in the formats: the one place for the API and the live feed."""

from __future__ import annotations

from typing import Any

from sqlalchemy import RowMapping

from pondwatch.core.frames import raster_size_px
from pondwatch.core.mosaic import default_metres_per_pixel
from pondwatch.core.values import Rod, RodReading, RodState
from pondwatch.store.clock import rfc3339
from pondwatch.store.corrections import Correction
from pondwatch.store.sessions import Facts, Session
from pondwatch.store.snapshots import StoredSnapshot

Json = dict[str, Any]


def metres_per_pixel(session: Session) -> float:
    """The scale of a session's raster; the same for as long as the session exists."""
    return default_metres_per_pixel(session.inspection.camera, session.inspection.pond)


def raster_size(session: Session) -> tuple[int, int]:
    """(width, height), px, of a session's raster."""
    return raster_size_px(session.inspection.pond, metres_per_pixel(session))


def camera(session: Session) -> Json:
    """`width_px`, `height_px`, `metres_per_pixel`."""
    taken_by = session.inspection.camera
    return {
        "width_px": taken_by.width_px,
        "height_px": taken_by.height_px,
        "metres_per_pixel": taken_by.metres_per_pixel,
    }


def place(rod: Rod) -> Json:
    """Where the layout has a rod, m, pond frame: `x_m`, `y_m`, and its `outer_radius_m`."""
    return {"x_m": rod.x_m, "y_m": rod.y_m, "outer_radius_m": rod.outer_radius_m}


def session(session: Session, facts: Facts) -> Json:
    """A session without its layout."""
    pond, noise = session.inspection.pond, session.inspection.pose_noise
    width, height = raster_size(session)
    return {
        "id": session.id,
        "name": session.inspection.name,
        "state": session.state.value,
        "method": session.method,
        "revision": session.revision,
        "counts": {name: getattr(facts, name) for name in ("snapshots", "placed", "uncertain", "rejected", "pending")},
        "coverage": session.seen_share,
        "rods": facts.rods,
        "rods_seen": facts.rods_seen,
        "quality": {"sentence": session.quality},
        "baseline": facts.baseline,
        "created_at": rfc3339(session.created_ms),
        "finished_at": rfc3339(session.finished_ms),
        "last_captured_at": rfc3339(facts.last_captured_ms),
        "last_received_at": rfc3339(facts.last_received_ms),
        "camera": camera(session),
        "pond": {
            "width_m": pond.width_m,
            "height_m": pond.height_m,
            "id": session.pond_id,
            "layout_version": session.layout_version,
        },
        "pose_noise": noise and {"sigma_xy_m": noise.sigma_xy_m, "sigma_theta_rad": noise.sigma_theta_rad},
        "raster": {"metres_per_pixel": metres_per_pixel(session), "width_px": width, "height_px": height},
    }


def layout(rods: tuple[Rod, ...]) -> list[Json]:
    """The design layout."""
    names = ("id", "x_m", "y_m", "outer_radius_m", "inner_radius_m")
    return [{name: getattr(rod, name) for name in names} for rod in rods]


def correction(correction: Correction) -> Json:
    """A correction by a further method."""
    times = {"created_at": rfc3339(correction.created_ms), "finished_at": rfc3339(correction.finished_ms)}
    names = ("method", "state", "revision", "error")
    return {name: getattr(correction, name) for name in names} | {"quality": {"sentence": correction.quality}} | times


def pose(row: RowMapping | Json) -> Json:
    """A corrected pose, beside the one that came in, and what the robot said of itself where it did."""
    as_stored = (
        "sequence",
        "robot",
        "boot",
        "x_m",
        "y_m",
        "theta_rad",
        "sigma_xy_m",
        "sigma_theta_rad",
        "status",
        "fault",
        "raw_x_m",
        "raw_y_m",
        "raw_theta_rad",
        "revision",
    )
    times = {"captured_at": rfc3339(row["captured_ms"]), "received_at": rfc3339(row["received_ms"])}
    said = {name: row[name] for name in ("battery", "link_loss", "image_quality") if row[name] is not None}
    return {name: row[name] for name in as_stored} | times | said


def evidence(pose: Json) -> Json:
    """A snapshot as it stands behind a rod, from its `pose`."""
    names = ("robot", "boot", "sequence", "captured_at", "status")
    axes = ("x_m", "y_m", "theta_rad")
    places = {"raw": {axis: pose[f"raw_{axis}"] for axis in axes}, "corrected": {axis: pose[axis] for axis in axes}}
    return {name: pose[name] for name in names} | places


def rod(row: RowMapping | Json, judged: RowMapping | None = None) -> Json:
    """A rod's reading, and what a person says of it in `by_hand`: None where nobody does, or took it back."""
    names = ("rod_id", "state", "fill", "confidence", "views", "conflicting", "revision")
    by_hand = None if judged is None or judged["state"] is None else judgement(judged)
    return {name: row[name] for name in names} | {"by_hand": by_hand}


def judgement(row: RowMapping) -> Json:
    """What a person said of a rod, beside what the machine read then."""
    machine = {name: row[f"machine_{name}"] for name in ("state", "fill", "confidence")}
    told = {name: row[name] for name in ("state", "fill", "reason")}
    return {**told, "by": row["author"], "at": rfc3339(row["at_ms"]), "machine": machine}


def past_reading(row: RowMapping) -> Json:
    """What a rod read as from a moment on."""
    names = ("revision", "state", "fill", "confidence", "views", "conflicting")
    return {"at": rfc3339(row["at_ms"]), **{name: row[name] for name in names}}


def note(row: RowMapping) -> Json:
    """A note."""
    times = {"at": row["at_ms"], "moment": row["moment_ms"], "closed_at": row["closed_ms"]}
    told = {name: row[name] for name in ("id", "text", "rod_id", "x_m", "y_m", "closed_by")}
    return {**told, "by": row["author"], **{name: rfc3339(ms) for name, ms in times.items()}}


def unseen(rod_id: str) -> Json:
    """A rod that was never read."""
    return {
        "rod_id": rod_id,
        "state": "unseen",
        "fill": None,
        "confidence": 0.0,
        "views": 0,
        "conflicting": False,
        "revision": 0,
        "by_hand": None,
    }


def reading(row: RowMapping | Json) -> RodReading:
    """A rod's reading as a value."""
    return RodReading(
        row["rod_id"], RodState(row["state"]), row["fill"], row["confidence"], row["views"], row["conflicting"]
    )


def job(row: RowMapping) -> Json:
    """A job."""
    times = {"created_at": rfc3339(row["created_ms"]), "updated_at": rfc3339(row["updated_ms"])}
    names = ("id", "kind", "state", "progress", "attempts", "error")
    return {name: row[name] for name in names} | {"session": row["session_id"]} | times


def receipt(session_id: str, stored: StoredSnapshot) -> Json:
    """What is said of a stored snapshot: the same whenever it is asked for."""
    key = stored.snapshot.key
    return {
        "session": session_id,
        "robot": key.robot,
        "boot": key.boot,
        "sequence": key.sequence,
        "digest": f"sha256:{stored.snapshot.digest}",
        "received_at": rfc3339(stored.received_ms),
    }
