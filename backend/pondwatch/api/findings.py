"""Condition and position: what of the floor and of the rods is otherwise than the layout says."""

from __future__ import annotations

from typing import Annotated, Literal

from fastapi import APIRouter, Query
from fastapi.responses import JSONResponse, Response
from sqlalchemy import Connection

from pondwatch.core.errors import Missing
from pondwatch.jobs import exports, tiles
from pondwatch.jobs.findingviews import around, findings_csv
from pondwatch.jobs.views import Json, metres_per_pixel
from pondwatch.store import conditions, sessions
from pondwatch.store.sessions import Session

from .services import Here

router = APIRouter(prefix="/api/sessions/{session_id}/findings", tags=["findings"])
Format = Annotated[Literal["json", "csv"], Query(alias="format")]


def _of(connection: Connection, session_id: str) -> tuple[Session, Json | None]:
    return sessions.get(connection, session_id), conditions.read(connection, session_id)


@router.get("", summary="Findings of condition and position")
def get_findings(here: Here, session_id: str, form: Format = "json") -> Response:
    """`findings`, the most significant first: a `rod-displaced` off its place, a `foreign-object` or a `stain` that the
    layout does not explain; `positions`, where every rod that was measured stands; `examined`, the share of the floor
    that could be looked at. Known once the session is finished: until then `looked` is false. Or a row a finding."""
    session, found = here.store.read(lambda c: _of(c, session_id))
    told: Json = found or {"examined": 0.0, "findings": [], "positions": []}
    if form == "csv":
        headers = {"Content-Disposition": 'inline; filename="findings.csv"', "Cache-Control": "no-cache"}
        return Response(findings_csv(told["findings"]), 200, headers, "text/csv")
    return JSONResponse({"session": session.id, "revision": session.revision, "looked": found is not None, **told})


@router.get("/{number}/picture.png", summary="A finding in the mosaic")
def get_picture(here: Here, session_id: str, number: int) -> Response:
    """PNG: the mosaic around it; transparent where nothing was seen."""
    session, found = here.store.read(lambda c: _of(c, session_id))
    finding = next((f for f in (found or {}).get("findings", ()) if f["number"] == number), None)
    if finding is None:
        raise Missing("There is no such finding.", kind="finding", id=str(number)[:40])
    _, image = tiles.part(here.store, session_id, around(finding, session.inspection.pond, metres_per_pixel(session)))
    return Response(exports.mosaic_png(image), 200, {"Cache-Control": "no-cache"}, "image/png")
