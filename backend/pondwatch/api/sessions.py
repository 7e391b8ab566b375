"""Sessions: open, list, look at, finish."""

from __future__ import annotations

import asyncio
import time
from typing import Annotated, Any

from fastapi import APIRouter, Body, Query
from fastapi.responses import JSONResponse
from sqlalchemy import Connection
from starlette.concurrency import run_in_threadpool

from pondwatch.core.errors import InvalidLayout
from pondwatch.core.inspection import parse_inspection
from pondwatch.core.layouts import document_of
from pondwatch.core.values import Inspection
from pondwatch.jobs import baseline, finish, views
from pondwatch.jobs.views import Json
from pondwatch.store import corrections, ponds, sessions
from pondwatch.store.ponds import Wish
from pondwatch.store.sessions import State

from .services import Here, Services

router = APIRouter(prefix="/api/sessions", tags=["sessions"])
_LOOK_S = 0.03


@router.post("", status_code=201, summary="Open a session")
def open_session(
    here: Here, document: Annotated[Any, Body(description="The content of `session.json`.")]
) -> JSONResponse:
    """201 with the session. An optional `method` names how its poses are corrected, an optional `baseline` the
    earlier session that its rods are held against. `pond` may have the `id` of a pond, whose newest layout it takes
    where it has no `rods`, or a `name`; else the layout says which pond it is."""
    wish, document = _pond(here, document)
    inspection = parse_inspection(document)
    method, held_against = _method(here, document, inspection), _baseline(document)

    def unit(connection: Connection) -> str:
        made = sessions.create(connection, inspection, method, here.now_ms(), wish)
        if held_against is not None:
            baseline.choose(connection, made, held_against, here.now_ms())
        return made

    session_id = here.store.write(unit)
    here.watch.wake(session_id)
    return JSONResponse(_one(here, session_id), 201, {"Location": f"/api/sessions/{session_id}"})


def _pond(here: Services, document: Any) -> tuple[Wish, Any]:
    """Which pond a session is said to be of; and its document, with that pond's layout where it has none."""
    pond = document.get("pond") if isinstance(document, dict) else None
    if not isinstance(pond, dict):
        return Wish(), document
    for name, most in (("id", 40), ("name", 64)):
        value = pond.get(name)
        if value is not None and not (isinstance(value, str) and 0 < len(value) <= most and value.isprintable()):
            raise InvalidLayout(f"pond.{name} must be a text of 1 to {most} characters.", field=f"pond.{name}")
    wish = Wish(pond.get("id"), pond.get("name"))
    if wish.id and "rods" not in pond:
        layout = here.store.read(lambda c: ponds.layout(c, str(wish.id)))
        document = {**document, "pond": document_of(layout)}
    return wish, document


def _method(here: Services, document: Json, inspection: Inspection) -> str:
    asked = document.get("method", here.settings.method)
    if not isinstance(asked, str):
        raise InvalidLayout("method must be the name of a correction method.", field="method")
    from pondwatch.jobs.papernets import make_corrector  # the methods take a third of a second to load

    return make_corrector(inspection, asked).method


def _baseline(document: Json) -> str | None:
    asked = document.get("baseline")
    if asked is not None and not isinstance(asked, str):
        raise InvalidLayout("baseline must be the id of an earlier session.", field="baseline")
    return asked


@router.get("", summary="Sessions, newest first")
def list_sessions(
    here: Here,
    limit: Annotated[int, Query(ge=1, le=200)] = 50,
    before: Annotated[str | None, Query(max_length=40, description="The `next` of the page before.")] = None,
    q: Annotated[str | None, Query(max_length=200, description="Part of the name.")] = None,
) -> JSONResponse:
    """`sessions`, and `next` where there are more; those whose name holds `q`."""

    def look(connection: Connection) -> list[Json]:
        page = sessions.page(connection, limit + 1, before, q)
        return [views.session(s, sessions.facts(connection, s.id)) for s in page]

    found = here.store.read(look)
    more = found[limit - 1]["id"] if len(found) > limit else None
    return JSONResponse({"sessions": found[:limit], "next": more})


@router.get("/{session_id}", summary="One session")
def get_session(here: Here, session_id: str) -> JSONResponse:
    """State, counts, coverage, revision; camera, pond with its layout, raster; `corrections` by other methods."""
    return JSONResponse(_one(here, session_id))


@router.post("/{session_id}/finish", summary="No more uploads; run the last full correction")
async def finish_session(
    here: Here, session_id: str, wait: Annotated[float, Query(ge=0, le=60, description="Seconds to wait.")] = 4.0
) -> JSONResponse:
    """200 and the session once it is finished; 202 where that takes longer, or the server stops. May be repeated."""
    state = await run_in_threadpool(_begin, here, session_id)
    until = time.monotonic() + wait
    while state is State.FINISHING and time.monotonic() < until and not here.stopping.is_set():
        await asyncio.sleep(_LOOK_S)
        state = await run_in_threadpool(_state, here, session_id)
    view = await run_in_threadpool(_one, here, session_id)
    return JSONResponse(view, 202 if state is State.FINISHING else 200)


def _begin(here: Services, session_id: str) -> State:
    state = finish.begin(here.store, session_id, here.now_ms())
    if state is State.FINISHING:
        here.queue.wake(session_id)
        here.observer.changed(session_id, here.store.read(lambda c: sessions.get(c, session_id)).revision)
    return state


def _state(here: Services, session_id: str) -> State:
    return here.store.read(lambda c: sessions.get(c, session_id)).state


def _one(here: Services, session_id: str) -> Json:
    def look(connection: Connection) -> Json:
        session = sessions.get(connection, session_id, with_rods=True)
        view = views.session(session, sessions.facts(connection, session_id))
        view["corrections"] = [views.correction(c) for c in corrections.of(connection, session_id)]
        view["pond"]["rods"] = views.layout(session.inspection.pond.rods)
        return view

    return here.store.read(look)
