"""Ponds, their past, and declared inventories as JSON values: the one place for what the API says of them."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from typing import Any

from sqlalchemy import Connection, RowMapping

from pondwatch.core.inventory import Reconciled, Reconciliation, reconcile
from pondwatch.core.layouts import document_of
from pondwatch.core.values import RodReading, RodState
from pondwatch.store import inventories, ponds, sessions, trends
from pondwatch.store.clock import rfc3339
from pondwatch.store.inventories import Inventory
from pondwatch.store.ponds import LayoutVersion, StoredPond
from pondwatch.store.sessions import State
from pondwatch.store.store import Store

from .views import Json

LATEST = "latest"
RECONCILED = (
    "line", "item", "position", "declared_state", "date", "outcome", "observed_state", "fill", "confidence", "views",
)  # fmt: skip


def pond(stored: StoredPond) -> Json:
    """A pond without its layout."""
    names = ("id", "name", "rods")
    return {name: getattr(stored, name) for name in names} | {
        "layout_version": stored.version,
        "created_at": rfc3339(stored.created_ms),
    }


def version(stored: LayoutVersion) -> Json:
    """A version of a layout without its rods."""
    told = {name: getattr(stored, name) for name in ("version", "source", "rods")}
    return told | {"digest": f"sha256:{stored.digest}", "created_at": rfc3339(stored.created_ms)}


def history(connection: Connection, pond_id: str, rod_id: str) -> list[Json]:
    """A rod in every inspection of its pond, oldest first. `state` is null where there was nothing to see it by: the
    layout then had no such rod, or no snapshot showed it (`reason`)."""
    return [_moment(row) for row in trends.of_rod(connection, pond_id, rod_id)]


def _moment(row: RowMapping) -> Json:
    seen = row["state"] not in (None, "unseen")
    return {
        "session": row["id"],
        "name": row["name"],
        "session_state": row["session_state"],
        "method": row["method"],
        "at": rfc3339(row["finished_ms"] or row["created_ms"]),
        "layout_version": row["layout_version"],
        "state": row["state"] if seen else None,
        "fill": row["fill"] if seen else None,
        "confidence": row["confidence"] if seen else None,
        "views": row["views"] or 0,
        "conflicting": bool(row["conflicting"]),
        "reason": None if seen else "not_observed" if row["in_layout"] else "not_in_layout",
    }


def trend(store: Store, connection: Connection, pond_id: str) -> list[Json]:
    """Counts of rods by state in every inspection of a pond, oldest first; what is in none of them was not observed."""
    out = []
    for row in trends.inspections(connection, pond_id):
        counted = _counts(store, connection, row)
        counts = {name: counted[name] for name in ("empty", "partial", "full")}
        out.append(
            {
                "session": row["id"],
                "name": row["name"],
                "session_state": row["state"],
                "at": rfc3339(row["finished_ms"] or row["created_ms"]),
                "coverage": row["seen_share"],
                "rods": counted["rods"],
                "counts": counts | {"not_observed": counted["rods"] - sum(counts.values())},
                "conflicting": counted["conflicting"],
                "mean_fill": counted["mean_fill"],
            }
        )
    return out


def _counts(store: Store, connection: Connection, session: RowMapping) -> Json:
    """Of an inspection that is finished they do not change while its revision does not."""
    if session["state"] != State.FINISHED:
        return trends.counts(connection, session["id"])
    key = session["id"], session["revision"]
    return store.counts.get(key, lambda: trends.counts(connection, session["id"]))


def inventory(stored: Inventory) -> Json:
    """A declared inventory without its lines."""
    return {
        "id": stored.id,
        "pond_id": stored.pond_id,
        "name": stored.name,
        "digest": f"sha256:{stored.digest}",
        "layout_version": stored.layout_version,
        "lines": stored.count,
        "created_at": rfc3339(stored.created_ms),
    }


def reconciliation(store: Store, session_id: str, inventory_id: str) -> tuple[Json, Reconciliation]:
    """A session against a declared inventory, `latest` for the last that was imported for its pond.

    Raises:
        Missing: there is no such session or inventory.
    """

    def look(connection: Connection) -> tuple[Json, Reconciliation]:
        session = sessions.get(connection, session_id)
        if inventory_id == LATEST:
            chosen = inventories.newest(connection, session.pond_id)
        else:
            chosen = inventories.get(connection, inventory_id)
        readings = {str(row[0]): _reading(row) for row in trends.side(connection, session_id)}
        found = reconcile(inventories.lines(connection, chosen.id), readings)
        head = {
            "session": session_id,
            "name": session.inspection.name,
            "revision": session.revision,
            "method": session.method,
            "same_pond": session.pond_id == chosen.pond_id,
            "inventory": inventory(chosen),
        }
        return head, found

    return store.read(look)


def _reading(row: tuple[Any, ...]) -> RodReading:
    rod_id, _, _, _, state, fill, confidence, views, conflicting = row
    if state is None:
        return RodReading(rod_id, RodState.UNSEEN, None, 0.0, 0)
    return RodReading(rod_id, RodState(state), fill, confidence, views, conflicting)


def reconciliation_json(head: Json, found: Reconciliation) -> Json:
    """The answer of a reconciliation."""
    return head | {
        "counts": found.counts(),
        "total": len(found.lines),
        "lines": [_line(line) for line in found.lines],
        "undeclared": [{"position": r.rod_id, "observed": _observed(r)} for r in found.undeclared],
    }


def reconciliation_csv(found: Reconciliation) -> bytes:
    """Every line of a reconciliation."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(RECONCILED)
    for line in found.lines:
        d, r = line.declared, line.reading
        observed = (r.state.value, r.fill, r.confidence, r.views) if r else ("unseen", None, 0.0, 0)
        sure = "" if line.confidence is None else round(line.confidence, 6)
        fill = "" if observed[1] is None else round(observed[1], 4)
        writer.writerow(
            (d.line, d.item, d.position, d.state.value, d.on, line.outcome.value, observed[0], fill, sure, observed[3])
        )
    return text.getvalue().encode()


def _line(line: Reconciled) -> Json:
    d = line.declared
    return {
        "line": d.line,
        "item": d.item,
        "position": d.position,
        "declared": d.state.value,
        "date": d.on,
        "outcome": line.outcome.value,
        "confidence": line.confidence,
        "observed": None if line.reading is None else _observed(line.reading),
    }


def _observed(reading: RodReading) -> Json:
    names = ("fill", "confidence", "views", "conflicting")
    return {"state": reading.state.value} | {name: getattr(reading, name) for name in names}


def whole_pond(connection: Connection, pond_id: str) -> Json:
    """A pond with its layout, the versions of it, its inspections and inventories, newest first."""
    return pond(ponds.get(connection, pond_id)) | {
        "layout": document_of(ponds.layout(connection, pond_id)),
        "versions": [version(v) for v in ponds.versions(connection, pond_id)],
        "inspections": [_inspection(row) for row in ponds.inspections(connection, pond_id)],
        "inventories": [inventory(i) for i in inventories.of_pond(connection, pond_id)],
    }


def _inspection(row: RowMapping) -> Json:
    names = ("id", "name", "state", "method", "revision", "layout_version")
    times = {"created_at": rfc3339(row["created_ms"]), "finished_at": rfc3339(row["finished_ms"])}
    return {name: row[name] for name in names} | {"coverage": row["seen_share"]} | times


def every_pond(connection: Connection, listed: Sequence[StoredPond]) -> list[Json]:
    """Ponds with how many inspections each has and the last of them."""
    count = ponds.counted(connection)
    return [
        pond(p) | {"inspections": count.get(p.id, (0, None))[0], "last": count.get(p.id, (0, None))[1]} for p in listed
    ]
