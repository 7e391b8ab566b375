"""Two sessions, rod by rod."""

from __future__ import annotations

from typing import Annotated, Literal

from fastapi import APIRouter, Query
from fastapi.responses import JSONResponse, Response

from pondwatch.jobs import comparing

from .services import Here

router = APIRouter(prefix="/api/compare", tags=["compare"])
Sort = Literal["layout", "rod_id", "change", "confidence", "residual"]


@router.get("", summary="Rods that differ between two sessions")
def compare(
    here: Here,
    base: Annotated[str, Query(max_length=40, description="A session, or `last`: the finished one before.")],
    with_: Annotated[str, Query(alias="with", max_length=40)],
    sort: Sort = "layout",
    order: Literal["asc", "desc"] = "asc",
    form: Annotated[Literal["json", "csv"], Query(alias="format")] = "json",
) -> Response:
    """`rods`: those that were filled, emptied or partly filled, with a confidence from both sides; `not_comparable`:
    those of which nothing is claimed, and why; `residual`: how well the mosaics coincide. Or all that as CSV."""
    found = comparing.find(here.store, base, with_)
    if form == "csv":
        name = f"changes-{found.base.session.id[:12]}-{found.with_.session.id[:12]}.csv"
        headers = {"Content-Disposition": f'attachment; filename="{name}"', "Cache-Control": "no-cache"}
        return Response(comparing.csv_of(found, sort, order == "desc"), 200, headers, "text/csv")
    return JSONResponse(comparing.json_of(found, sort, order == "desc"))
