"""Further corrections of a finished session by other methods, beside its own result."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query
from fastapi.responses import JSONResponse
from sqlalchemy import Connection

from pondwatch.core.errors import Invalid, Unavailable
from pondwatch.core.values import RodState
from pondwatch.jobs import comparing, correct, views
from pondwatch.jobs.views import Json
from pondwatch.store import corrections, sessions
from pondwatch.store.sessions import Session

from .results import rods_by
from .schemas import CorrectionIn
from .services import Here

router = APIRouter(prefix="/api/sessions/{session_id}/corrections", tags=["results"])


@router.post("", status_code=202, summary="Correct a finished session by another method")
def correct_again(here: Here, session_id: str, asked: CorrectionIn) -> JSONResponse:
    """202 with the correction, which a job makes; 200 where it is made. `poses` and `rods` give it by `method`."""

    def look(connection: Connection) -> Session:
        return sessions.get(connection, session_id, with_rods=True)

    from pondwatch.jobs.papernets import make_corrector  # the methods take a third of a second to load

    method = make_corrector(here.store.read(look).inspection, asked.method).method
    correction = correct.begin(here.store, session_id, method, here.now_ms())
    here.queue.wake(session_id)
    return JSONResponse(views.correction(correction), 200 if correction.state == "done" else 202)


@router.get("", summary="A session's further corrections, and the methods there are for it")
def list_corrections(here: Here, session_id: str) -> JSONResponse:
    """`corrections`; `own`, the session's method; `methods`: those that this server has and this session can be
    corrected by, its own among them."""

    def look(connection: Connection) -> tuple[Session, list[Json]]:
        session = sessions.get(connection, session_id, with_rods=True)
        return session, [views.correction(c) for c in corrections.of(connection, session_id)]

    from pondwatch.jobs.papernets import METHODS

    session, made = here.store.read(look)
    names = [name for name in METHODS if name != "auto" and _fits(session, name)]
    return JSONResponse({"session": session_id, "own": session.method, "methods": names, "corrections": made})


def _fits(session: Session, method: str) -> bool:
    from pondwatch.jobs.papernets import make_corrector

    try:
        make_corrector(session.inspection, method)
    except (Invalid, Unavailable):
        return False
    return True


@router.get("/verdicts", summary="Rods whose verdicts two methods differ in")
def compare_methods(
    here: Here,
    session_id: str,
    with_: Annotated[str, Query(alias="with", max_length=40, description="A method of `corrections`.")],
    base: Annotated[str | None, Query(max_length=40, description="Another; else the session's own.")] = None,
) -> JSONResponse:
    """`rods`: those that the two methods read otherwise, over the same snapshots; `counts` of each by state."""

    def look(connection: Connection) -> list[tuple[str, int, list[Json]]]:
        found = [rods_by(connection, session_id, method) for method in (base, with_)]
        return [((other or session).method, (other or session).revision, rods) for session, other, rods in found]

    (own, revision, before), (other, other_revision, after) = here.store.read(look)
    differing = comparing.verdicts(*({r["rod_id"]: views.reading(r) for r in rods} for rods in (before, after)))
    return JSONResponse(
        {
            "session": session_id,
            "base": {"method": own, "revision": revision, "counts": _counts(before)},
            "with": {"method": other, "revision": other_revision, "counts": _counts(after)},
            "rods": differing,
            "same": len(before) - len(differing),
        }
    )


def _counts(rods: list[Json]) -> dict[str, int]:
    return {state.value: sum(rod["state"] == state.value for rod in rods) for state in RodState}
