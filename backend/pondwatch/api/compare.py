"""Two sessions, rod by rod."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query
from fastapi.responses import JSONResponse
from sqlalchemy import Connection

from pondwatch.jobs import views
from pondwatch.jobs.views import Json
from pondwatch.store import revisions, sessions

from .services import Here

router = APIRouter(prefix="/api/compare", tags=["compare"])
Id = Annotated[str, Query(max_length=40)]


@router.get("", summary="Rods that differ between two sessions")
def compare(here: Here, base: Id, with_: Annotated[str, Query(alias="with", max_length=40)]) -> JSONResponse:
    """`rods`: those seen in both whose states differ, with the probability that they do. Rods of one layout alone and
    rods not observed are counted apart."""
    before, after = here.store.read(lambda c: (_read(c, base), _read(c, with_)))
    old, new = before.pop("readings"), after.pop("readings")
    common = [rod_id for rod_id in old if rod_id in new]
    seen = [r for r in common if "unseen" not in (old[r]["state"], new[r]["state"])]
    differing = [_difference(r, old[r], new[r]) for r in seen if old[r]["state"] != new[r]["state"]]
    return JSONResponse(
        {
            "base": before,
            "with": after,
            "rods": differing,
            "compared": len(seen),
            "not_observed": len(common) - len(seen),
            "only_in_base": sorted(old.keys() - new.keys()),
            "only_in_with": sorted(new.keys() - old.keys()),
        }
    )


def _read(connection: Connection, session_id: str) -> Json:
    session = sessions.get(connection, session_id, with_rods=True)
    facts = sessions.facts(connection, session_id)
    readings = {r.id: views.unseen(r.id) for r in session.inspection.pond.rods}
    readings |= {row["rod_id"]: views.rod(row) for row in revisions.rod_rows(connection, session_id)}
    return {
        "session": session_id,
        "revision": session.revision,
        "coverage": session.seen_share,
        "rods": facts.rods,
        "rods_seen": facts.rods_seen,
        "readings": readings,
    }


def _difference(rod_id: str, old: Json, new: Json) -> Json:
    """The states are different with at least the probability that both readings are right."""
    sides = {
        name: {"state": r["state"], "fill": r["fill"], "confidence": r["confidence"], "views": r["views"]}
        for name, r in (("base", old), ("with", new))
    }
    return {"rod_id": rod_id, **sides, "confidence": old["confidence"] * new["confidence"]}
