"""Alarms of a session: what rings, what was done about it, and what it is held against."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated

from fastapi import APIRouter, Path, Query
from fastapi.responses import JSONResponse
from sqlalchemy import Connection, RowMapping

from pondwatch.core.alarmacts import Act
from pondwatch.core.errors import PondwatchError
from pondwatch.jobs import alarmviews, baseline
from pondwatch.store import alarms, sessions

from . import problems
from .schemas import MOST, BaselineIn, DeedIn, GroupDeedIn
from .services import Here

router = APIRouter(prefix="/api/sessions/{session_id}", tags=["alarms"])
Number = Annotated[int, Path(ge=0, le=MOST)]


@router.get("/alarms", summary="Alarms as they stand")
def get_alarms(
    here: Here,
    session_id: str,
    past: Annotated[bool, Query(description="Those that are over and done with too.")] = False,
) -> JSONResponse:
    """`alarms` that are retained or quiet; `groups` of what rings, by kind, the worst first; the `limits` in force."""
    rows = [row for row in here.watch.told(session_id).rows if past or row["retained"] or row["quiet"]]
    groups = here.watch.groups(session_id)
    chosen = here.store.read(lambda c: alarms.baseline(c, session_id))
    view = {"session": session_id, "alarms": rows, "groups": groups, "baseline": chosen}
    return JSONResponse(view | {"limits": asdict(here.watch.limits)})


@router.get("/alarms/events", summary="What became of the alarms, newest first")
def get_events(
    here: Here,
    session_id: str,
    limit: Annotated[int, Query(ge=1, le=1000)] = 200,
    before: Annotated[int | None, Query(ge=0, le=MOST, description="The `next` of the page before.")] = None,
    alarm: Annotated[int | None, Query(ge=0, le=MOST, description="Of this one alone.")] = None,
) -> JSONResponse:
    """`events`: every transition, with who, when and the comment; `next` where there are more."""

    def look(connection: Connection) -> list[RowMapping]:
        sessions.get(connection, session_id)
        return list(alarms.events(connection, session_id, limit + 1, before, alarm))

    found = [alarmviews.event(row) for row in here.store.read(look)]
    more = found[limit - 1]["id"] if len(found) > limit else None
    return JSONResponse({"events": found[:limit], "next": more})


@router.post("/alarms/{alarm}/{act}", summary="Do something to an alarm")
def act_on_alarm(here: Here, session_id: str, alarm: Number, act: Act, asked: DeedIn) -> JSONResponse:
    """200 and the alarm as it is then; 409 where that makes no sense now. `comment` says why, `by` who."""
    result = here.watch.act(session_id, [alarm], asked.deed(act))[0]
    if isinstance(result, PondwatchError):
        raise result
    return JSONResponse(result)


@router.post("/alarms/{act}", summary="Do the same to many alarms")
def act_on_alarms(here: Here, session_id: str, act: Act, asked: GroupDeedIn) -> JSONResponse:
    """`results`: what each would have been answered alone, with its `status`, in order."""
    results = here.watch.act(session_id, asked.alarms, asked.deed(act))
    told = [problems.document(r) if isinstance(r, PondwatchError) else {"status": 200, **r} for r in results]
    return JSONResponse({"results": told})


@router.put("/baseline", summary="Hold a session against an earlier one")
def put_baseline(here: Here, session_id: str, asked: BaselineIn) -> JSONResponse:
    """200 with `baseline`; null for none. 409 unless it is an earlier, finished session of the same pond."""
    revision = here.store.write(lambda c: baseline.choose(c, session_id, asked.baseline, here.now_ms()))
    here.observer.changed(session_id, revision)
    return JSONResponse({"session": session_id, "baseline": asked.baseline})
