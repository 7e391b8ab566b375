"""What people say: judgements of rods beside the machine's readings, notes, and both as a list for the next shift."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query
from fastapi import Path as PathParameter
from fastapi.responses import JSONResponse
from sqlalchemy import Connection, RowMapping

from pondwatch.core.errors import Missing
from pondwatch.jobs import views
from pondwatch.jobs.views import Json
from pondwatch.store import history, judgements, notes, sessions

from .schemas import MOST, CloseIn, JudgementIn, NoteIn
from .services import Here, Services

router = APIRouter(prefix="/api", tags=["people"])
_MOST_LISTED = 500
NoteId = Annotated[int, PathParameter(ge=0, le=MOST)]


@router.post("/sessions/{session_id}/rods/{rod_id}/judgement", status_code=201, summary="Say what a rod is")
def judge(here: Here, session_id: str, rod_id: str, said: JudgementIn) -> JSONResponse:
    """201 with the judgement beside what the machine read then; `state` null takes earlier ones back. The machine's
    reading stays as it is: rows of rods carry the judgement in `by_hand`."""

    def unit(connection: Connection) -> RowMapping:
        sessions.get(connection, session_id)
        return judgements.add(connection, session_id, said.judgement(rod_id), here.now_ms())

    row = here.store.write(unit)
    _tell(here, session_id)
    return JSONResponse(views.judgement(row), 201)


@router.get("/sessions/{session_id}/rods/{rod_id}/history", summary="How a rod's reading came to be")
def rod_history(here: Here, session_id: str, rod_id: str) -> JSONResponse:
    """`history`: its readings by revision; `by_hand`: all that people said of it; `notes` on it. Each in order."""

    def look(connection: Connection) -> Json:
        layout = sessions.get(connection, session_id, with_rods=True).inspection.pond.rods
        if rod_id not in {rod.id for rod in layout}:
            raise Missing("There is no such rod.", kind="rod", id=rod_id[:100])
        return {
            "session": session_id,
            "rod_id": rod_id,
            "history": [views.past_reading(row) for row in history.of_rod(connection, session_id, rod_id)],
            "by_hand": [views.judgement(row) for row in judgements.of_rod(connection, session_id, rod_id)],
            "notes": [views.note(row) for row in notes.of(connection, session_id, rod_id=rod_id)],
        }

    return JSONResponse(here.store.read(look))


@router.get("/sessions/{session_id}/readings", summary="How all rods' readings came to be")
def all_readings(here: Here, session_id: str) -> JSONResponse:
    """`readings` as of `revision`: what rods read as, from which moment on; in order of revision."""

    def look(connection: Connection) -> Json:
        session = sessions.get(connection, session_id)
        past = [
            {"rod_id": row["rod_id"], **views.past_reading(row)} for row in history.of_session(connection, session_id)
        ]
        return {"session": session_id, "revision": session.revision, "readings": past}

    return JSONResponse(here.store.read(look))


@router.post("/sessions/{session_id}/notes", status_code=201, summary="Write a note")
def write_note(here: Here, session_id: str, said: NoteIn) -> JSONResponse:
    """201 with the note: of a rod, a place, a moment, or the whole inspection."""
    row = here.store.write(lambda c: notes.add(c, session_id, said.note(), here.now_ms()))
    _tell(here, session_id)
    return JSONResponse(views.note(row), 201)


@router.get("/sessions/{session_id}/notes", summary="A session's notes")
def list_notes(here: Here, session_id: str) -> JSONResponse:
    """`notes`, in the order in which they were written."""

    def look(connection: Connection) -> list[Json]:
        sessions.get(connection, session_id)
        return [views.note(row) for row in notes.of(connection, session_id)]

    return JSONResponse({"notes": here.store.read(look)})


@router.post("/sessions/{session_id}/notes/{note_id}/close", summary="Mark a note as dealt with")
def close_note(here: Here, session_id: str, note_id: NoteId, said: CloseIn) -> JSONResponse:
    """The note, closed. It stays in the list; a second time is a conflict."""
    row = here.store.write(lambda c: notes.close(c, session_id, note_id, said.by, here.now_ms()))
    _tell(here, session_id)
    return JSONResponse(views.note(row))


@router.get("/handover", summary="What the next shift should know")
def handover(here: Here, hours: Annotated[float, Query(gt=0, le=24 * 31)] = 12.0) -> JSONResponse:
    """Of all sessions, the newest first: `notes` that are open or of these hours, `judgements` of these hours."""
    from_ms = here.now_ms() - round(hours * 3_600_000)

    def look(connection: Connection) -> Json:
        written = notes.handed_over(connection, from_ms, _MOST_LISTED)
        judged = judgements.since(connection, from_ms, _MOST_LISTED)
        return {
            "notes": [views.note(row) | _where(row) for row in written],
            "judgements": [views.judgement(row) | {"rod_id": row["rod_id"]} | _where(row) for row in judged],
        }

    return JSONResponse(here.store.read(look))


def _where(row: RowMapping) -> Json:
    return {"session": row["session_id"], "session_name": row["name"]}


def _tell(here: Services, session_id: str) -> None:
    """Let viewers know, although no revision was made."""
    here.observer.changed(session_id, here.store.read(lambda c: sessions.get(c, session_id)).revision)
