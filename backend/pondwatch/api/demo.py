"""The demo: a simulated inspection that uploads to this server like any base station's."""

from __future__ import annotations

from fastapi import APIRouter, Request
from fastapi.responses import JSONResponse

from pondwatch.core.errors import Conflict, Unavailable

from .services import Here

router = APIRouter(prefix="/api/demo", tags=["sessions"])


@router.post("", status_code=202, summary="Start the demo inspection")
def start_demo(here: Here, request: Request) -> JSONResponse:
    """202: simulated robots begin to upload, and their inspection is listed within seconds; one that was cut short
    goes on. 409 while they do so already."""
    if not here.robots.begin(_own_url(request)):
        raise Conflict("The demo inspection runs already.")
    return JSONResponse({"state": "started"}, 202)


def _own_url(request: Request) -> str:
    """Where this server listens, whatever name it was asked by."""
    host, port = request.scope.get("server") or ("", None)
    if port is None:
        raise Unavailable("The server listens at no port that the simulator could send to.")
    return f"http://{f'[{host}]' if ':' in host else host}:{port}"
