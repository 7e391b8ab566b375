"""Alive, ready, and how much of everything."""

from __future__ import annotations

from fastapi import APIRouter
from fastapi.responses import JSONResponse, Response
from sqlalchemy import text

from .services import Here

router = APIRouter(tags=["health"])


@router.get("/healthz", summary="Alive")
async def healthz() -> JSONResponse:
    """The process answers."""
    return JSONResponse({"status": "alive"})


@router.get("/readyz", summary="Ready to take uploads")
def readyz(here: Here) -> JSONResponse:
    """The database takes writes and can be read."""
    here.store.write(lambda c: None)
    here.store.read(lambda c: c.execute(text("SELECT 1")).scalar_one())
    return JSONResponse({"status": "ready"})


@router.get("/metrics", summary="Prometheus text")
def metrics(here: Here) -> Response:
    """All metrics."""
    return Response(here.telemetry.text(), media_type="text/plain; version=0.0.4; charset=utf-8")
