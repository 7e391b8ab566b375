"""Further corrections of a finished session by other methods, beside its own result."""

from __future__ import annotations

from fastapi import APIRouter
from fastapi.responses import JSONResponse
from sqlalchemy import Connection

from pondwatch.jobs import correct, views
from pondwatch.jobs.papernets import make_corrector
from pondwatch.store import sessions
from pondwatch.store.sessions import Session

from .schemas import CorrectionIn
from .services import Here

router = APIRouter(prefix="/api/sessions/{session_id}/corrections", tags=["results"])


@router.post("", status_code=202, summary="Correct a finished session by another method")
def correct_again(here: Here, session_id: str, asked: CorrectionIn) -> JSONResponse:
    """202 with the correction, which a job makes; 200 where it is made. `poses` and `rods` give it by `method`."""

    def look(connection: Connection) -> Session:
        return sessions.get(connection, session_id, with_rods=True)

    method = make_corrector(here.store.read(look).inspection, asked.method).method
    correction = correct.begin(here.store, session_id, method, here.now_ms())
    here.queue.wake(session_id)
    return JSONResponse(views.correction(correction), 200 if correction.state == "done" else 202)
