"""Ponds: their layouts by version, their inspections, the past of their rods, and what is declared to be in them."""

from __future__ import annotations

import hashlib
from typing import Annotated, Literal

from fastapi import APIRouter, Query, Request
from fastapi import Path as PathParameter
from fastapi.responses import JSONResponse, Response
from sqlalchemy import Connection
from starlette.concurrency import run_in_threadpool

from pondwatch.core.errors import InvalidLayout, Missing
from pondwatch.core.inventory import parse_inventory
from pondwatch.core.layouts import csv_of, document_of, from_csv, from_json
from pondwatch.core.values import Pond
from pondwatch.jobs import pondviews
from pondwatch.jobs.views import Json
from pondwatch.store import inventories, ponds, sessions

from .schemas import MOST, Name, NameIn
from .services import Here, Services

router = APIRouter(prefix="/api/ponds", tags=["ponds"])
Format = Annotated[Literal["json", "csv"], Query(alias="format")]
Version = Annotated[int, PathParameter(ge=1, le=MOST)]
Side = Annotated[float | None, Query(gt=0, le=1000, description="m; a CSV has only rods, so it needs both sides.")]
FromSession = Annotated[str | None, Query(max_length=40, description="Take the layout of this session, and no body.")]
_BODY = {
    "requestBody": {
        "content": {
            "application/json": {"schema": {"type": "object"}},
            "text/csv": {"schema": {"type": "string"}},
        }
    }
}
_CSV = {"requestBody": {"content": {"text/csv": {"schema": {"type": "string"}}}}}


@router.get("", summary="Ponds, newest first")
def list_ponds(here: Here) -> JSONResponse:
    """`ponds`, each with how many inspections it has and the last of them."""
    return JSONResponse({"ponds": here.store.read(lambda c: pondviews.every_pond(c, ponds.every(c)))})


@router.post("", status_code=201, summary="A new pond", openapi_extra=_BODY)
async def create_pond(
    here: Here,
    request: Request,
    name: Annotated[Name, Query()],
    session: FromSession = None,
    width_m: Side = None,
    height_m: Side = None,
) -> JSONResponse:
    """201 with the pond. Its layout is the body, JSON as `pond` of a session.json or CSV, or a session's."""
    content = await request.body()

    def make() -> Json:
        layout, source = _layout(here, request, content, session, (width_m, height_m))
        pond_id = here.store.write(lambda c: ponds.create(c, name, layout, source, here.now_ms()))
        return here.store.read(lambda c: pondviews.whole_pond(c, pond_id))

    made = await run_in_threadpool(make)
    return JSONResponse(made, 201, {"Location": f"/api/ponds/{made['id']}"})


@router.get("/{pond_id}", summary="One pond")
def get_pond(here: Here, pond_id: str) -> JSONResponse:
    """Its newest layout, the versions of it, its inspections and its declared inventories."""
    return JSONResponse(here.store.read(lambda c: pondviews.whole_pond(c, pond_id)))


@router.patch("/{pond_id}", summary="Rename a pond")
def rename_pond(here: Here, pond_id: str, said: NameIn) -> JSONResponse:
    """The pond by its new name."""
    here.store.write(lambda c: ponds.rename(c, pond_id, said.name))
    return get_pond(here, pond_id)


@router.post("/{pond_id}/layouts", status_code=201, summary="A further version of a layout", openapi_extra=_BODY)
async def add_layout(
    here: Here,
    request: Request,
    pond_id: str,
    session: FromSession = None,
    width_m: Side = None,
    height_m: Side = None,
) -> JSONResponse:
    """201 with the pond; the same layout as the newest is that one again. Inspections keep the layout they had."""
    content = await request.body()

    def make() -> Json:
        newest = here.store.read(lambda c: ponds.layout(c, pond_id))
        size = (width_m or newest.width_m, height_m or newest.height_m)
        layout, source = _layout(here, request, content, session, size)
        here.store.write(lambda c: ponds.add_layout(c, pond_id, layout, source, here.now_ms()))
        return here.store.read(lambda c: pondviews.whole_pond(c, pond_id))

    return JSONResponse(await run_in_threadpool(make), 201)


def _layout(
    here: Services, request: Request, content: bytes, session_id: str | None, size_m: tuple[float | None, float | None]
) -> tuple[Pond, str]:
    """A layout, and where it is from."""
    if session_id is not None:
        session = here.store.read(lambda c: sessions.get(c, session_id, with_rods=True))
        return session.inspection.pond, f"inspection {session.inspection.name!r}"
    kind = request.headers.get("content-type", "application/json").partition(";")[0].strip().lower()
    if kind == "text/csv":
        if size_m[0] is None or size_m[1] is None:
            raise InvalidLayout("width_m and height_m must be given beside a CSV.", field="width_m")
        return from_csv(content, size_m[0], size_m[1]), "CSV"
    return from_json(content), "JSON"


@router.get("/{pond_id}/layouts/{version}", summary="A version of a layout")
def get_layout(
    here: Here, pond_id: str, version: int, form: Annotated[str, Query(alias="format")] = "json"
) -> Response:
    """As JSON; `format=csv` gives the rods as CSV, which may be imported again."""
    layout = here.store.read(lambda c: ponds.layout(c, pond_id, version))
    if form == "csv":
        headers = {"Content-Disposition": f'attachment; filename="layout-{version}.csv"'}
        return Response(csv_of(layout), 200, headers, "text/csv")
    return JSONResponse(document_of(layout))


@router.get("/{pond_id}/trends", summary="A pond through time")
def get_trends(here: Here, pond_id: str) -> JSONResponse:
    """`inspections`, oldest first, the last hundred: rods by state and not observed, coverage, mean fill."""

    def look(connection: Connection) -> list[Json]:
        ponds.get(connection, pond_id)
        return pondviews.trend(here.store, connection, pond_id)

    return JSONResponse({"pond": pond_id, "inspections": here.store.read(look)})


@router.get("/{pond_id}/rods/{rod_id}/history", summary="One rod through all inspections")
def get_history(here: Here, pond_id: str, rod_id: str) -> JSONResponse:
    """`history`, oldest first: its reading in every inspection of the pond; `state` null, and a `reason`, where an
    inspection did not observe it."""

    def look(connection: Connection) -> list[Json]:
        ponds.get(connection, pond_id)
        return pondviews.history(connection, pond_id, rod_id)

    found = here.store.read(look)
    known = [row for row in found if row["reason"] != "not_in_layout"]
    if not known and rod_id not in {r.id for r in here.store.read(lambda c: ponds.layout(c, pond_id)).rods}:
        raise Missing("There is no such rod.", kind="rod", id=rod_id[:100])
    return JSONResponse({"pond": pond_id, "rod_id": rod_id, "history": found})


@router.post("/{pond_id}/inventories", status_code=201, summary="Import a declared inventory", openapi_extra=_CSV)
async def import_inventory(
    here: Here, request: Request, pond_id: str, name: Annotated[Name, Query()] = "inventory.csv"
) -> JSONResponse:
    """201 with the inventory. The body is CSV with the header `item,position,state,date`; it is checked whole against
    the newest layout, and one faulty line refuses all of it."""
    content = await request.body()

    def make() -> Json:
        stored = here.store.read(lambda c: ponds.get(c, pond_id))
        layout = here.store.read(lambda c: ponds.layout(c, pond_id, stored.version))
        lines = parse_inventory(content, {rod.id for rod in layout.rods})
        mark = hashlib.sha256(content).hexdigest()

        def unit(connection: Connection) -> Json:
            made = inventories.add(connection, pond_id, name, mark, stored.version, lines, here.now_ms())
            return pondviews.inventory(inventories.get(connection, made))

        return here.store.write(unit)

    return JSONResponse(await run_in_threadpool(make), 201)


@router.get("/{pond_id}/inventories", summary="Declared inventories")
def list_inventories(here: Here, pond_id: str) -> JSONResponse:
    """`inventories`, newest first."""

    def look(connection: Connection) -> list[Json]:
        ponds.get(connection, pond_id)
        return [pondviews.inventory(i) for i in inventories.of_pond(connection, pond_id)]

    return JSONResponse({"inventories": here.store.read(look)})


sessions_router = APIRouter(prefix="/api/sessions/{session_id}", tags=["ponds"])


@sessions_router.get("/reconcile", summary="Declared against observed")
def reconcile(
    here: Here,
    session_id: str,
    inventory: Annotated[str, Query(max_length=40)] = pondviews.LATEST,
    form: Format = "json",
) -> Response:
    """Every line of a declared inventory: `agree`, `disagree` (a discrepancy), `not_observed` or `ambiguous`; `counts`
    add up to the list. `undeclared`: positions that no line names. `inventory` is an id, or `latest`."""
    head, found = pondviews.reconciliation(here.store, session_id, inventory)
    if form == "csv":
        headers = {"Content-Disposition": f'attachment; filename="reconciliation-{session_id[:12]}.csv"'}
        return Response(pondviews.reconciliation_csv(found), 200, headers, "text/csv")
    return JSONResponse(pondviews.reconciliation_json(head, found))
