"""Jobs: what is being corrected and assembled, how far, and what went wrong."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query
from fastapi import Path as PathParameter
from fastapi.responses import JSONResponse

from pondwatch.jobs import views
from pondwatch.store import jobs

from .services import Here

router = APIRouter(prefix="/api/jobs", tags=["jobs"])


@router.get("", summary="Jobs, newest first")
def list_jobs(
    here: Here,
    session: Annotated[str | None, Query(max_length=40)] = None,
    limit: Annotated[int, Query(ge=1, le=1000)] = 200,
) -> JSONResponse:
    """`jobs`, of one session where asked for."""
    return JSONResponse({"jobs": [views.job(row) for row in here.store.read(lambda c: jobs.rows(c, session, limit))]})


@router.get("/{job_id}", summary="One job")
def get_job(here: Here, job_id: Annotated[int, PathParameter(ge=0, le=2**53 - 1)]) -> JSONResponse:
    """Kind, state, progress from 0 to 1, attempts, error."""
    return JSONResponse(views.job(here.store.read(lambda c: jobs.get(c, job_id))))
