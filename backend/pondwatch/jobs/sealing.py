"""A finished session as evidence: its records, chained, and a manifest that is signed when the session is closed.

`docs/evidence.md` describes the records and the manifest. Both are made of what is stored and of nothing else, in one
spelling: the same rows always give the same bytes, so a row that is changed afterwards contradicts the seal. Changing
what is written here is a new format.
"""

from __future__ import annotations

import csv
import hashlib
import io
import json
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import structlog
from sqlalchemy import Connection, RowMapping

from pondwatch.core.auditchain import Head, canonical, linked
from pondwatch.core.errors import Conflict, StorageFull, Unavailable
from pondwatch.core.inspection import inspection_document
from pondwatch.store import conditions, revisions, seals, sessions
from pondwatch.store.clock import rfc3339
from pondwatch.store.seals import Seal
from pondwatch.store.sessions import Session, State
from pondwatch.store.store import Store

from .evidencemarks import FORMAT
from .provenance import made_by
from .views import Json

SUFFIXES = {"image/png": "png", "image/jpeg": "jpg", "image/webp": "webp"}
_AXES = ("x_m", "y_m", "theta_rad")
_POSES = ("sequence", "robot", "boot", "captured_at", "image", *_AXES)


class NotClosed(Conflict):
    """Only a finished session is evidence. facts: session, state."""


class SealBroken(Conflict):
    """What is stored is not what was sealed. facts: session, sealed_at."""


@dataclass(frozen=True, slots=True)
class File:
    """A file of the bundle. content: its bytes; None where they are the blob of this digest."""

    path: str
    sha256: str
    content: bytes | None

    @property
    def told(self) -> Json:
        """As a record names it."""
        return {"path": self.path, "sha256": self.sha256}


def seal(store: Store, session_id: str, now_ms: int) -> Seal:
    """The seal of a finished session; made where there is none yet. Once made it stays.

    Raises:
        Missing: there is no such session. NotClosed: it is not finished. Unavailable, StorageFull: nothing changed.
    """
    found = store.read(lambda c: seals.find(c, session_id))
    if found is not None:
        return found
    session, head = store.read(lambda c: (_closed(c, session_id), head_of(c, session_id)))
    manifest = _manifest(session, head, store.signer.public, now_ms)
    made = Seal(manifest, store.signer.sign(manifest))
    return store.write(lambda c: seals.keep(c, session_id, made))


def answerable(connection: Connection, session: Session) -> Json:
    """What made a session's result: as it was sealed; while it is not, this program. See `made_by`."""
    found = seals.find(connection, session.id)
    told: Json = json.loads(found.manifest)["sealed_by"] if found else made_by(session.method)
    return told


def seal_if_possible(store: Store, session_id: str, now_ms: int) -> None:
    """As `seal`; where the store or the key fails it is logged, and done at the next start or by who asks for it."""
    try:
        seal(store, session_id, now_ms)
    except (Unavailable, StorageFull) as error:
        structlog.get_logger().error("not_sealed", session=session_id, error=error.message)


def checked(store: Store, session_id: str, now_ms: int) -> Seal:
    """The seal of a finished session, after what is stored was held against it.

    Raises:
        SealBroken: it was sealed otherwise. And as `seal`.
    """
    made = seal(store, session_id, now_ms)
    manifest = json.loads(made.manifest)
    head = store.read(lambda c: head_of(c, session_id))
    if manifest["records"] != {"count": head.count, "head": head.digest}:
        said = f"What is stored of the session is not what was sealed at {manifest['sealed_at']}."
        raise SealBroken(said, session=session_id, sealed_at=manifest["sealed_at"])
    return made


def head_of(connection: Connection, session_id: str) -> Head:
    """What the records come to."""
    heads = (head for _, head in linked(body for body, _ in records(connection, session_id)))
    return deque(heads, maxlen=1)[0]  # there is a record of the session at least


def _closed(connection: Connection, session_id: str) -> Session:
    session = sessions.get(connection, session_id)
    if session.state is not State.FINISHED:
        said = f"The session is {session.state.value}; it is evidence once it is finished."
        raise NotClosed(said, session=session_id, state=session.state.value)
    return session


def _manifest(session: Session, head: Head, public: str, now_ms: int) -> bytes:
    told = {
        "format": FORMAT,
        "session": {"id": session.id, "name": session.inspection.name, "finished_at": rfc3339(session.finished_ms)},
        "sealed_at": rfc3339(now_ms),
        "sealed_by": made_by(session.method),
        "records": {"count": head.count, "head": head.digest},
        "key": {"algorithm": "Ed25519", "public": public},
    }
    return json.dumps(told, indent=2, sort_keys=True, ensure_ascii=False).encode() + b"\n"


def records(connection: Connection, session_id: str) -> Iterator[tuple[Json, File | None]]:
    """The records' bodies in order, each with the file that it names."""
    session = sessions.get(connection, session_id, with_rods=True)
    layout = canonical(inspection_document(session.inspection)) + b"\n"
    yield from (_filed({"kind": "session", **_session(session)}, _file("session.json", layout)),)
    table = _Table()
    for row in seals.snapshot_rows(connection, session_id):
        image = File(f"images/{row['digest']}.{SUFFIXES[row['media_type']]}", row["digest"], None)
        table.add(row, image.path)
        yield _filed({"kind": "snapshot", **_snapshot(row)}, image)
    yield _filed({"kind": "poses"}, _file("poses.csv", table.content()))
    for row in revisions.rod_rows(connection, session_id):
        names = ("rod_id", "state", "fill", "confidence", "views", "conflicting")
        yield {"kind": "rod", **{name: row[name] for name in names}}, None
    for finding in (conditions.read(connection, session_id) or {}).get("findings", ()):
        yield {**finding, "kind": "finding", "what": finding["kind"]}, None
    for row in seals.tile_rows(connection, session_id, "mosaic"):
        place = {"x": row["x"], "y": row["y"]}
        tile = _file(f"mosaic/{row['x']}-{row['y']}.png", bytes(row["content"]))
        yield _filed({"kind": "tile", **place}, tile)


def _filed(body: Json, file: File) -> tuple[Json, File]:
    return {**body, "file": file.told}, file


def _file(path: str, content: bytes) -> File:
    return File(path, hashlib.sha256(content).hexdigest(), content)


def _session(session: Session) -> Json:
    return {
        "id": session.id,
        "name": session.inspection.name,
        "method": session.method,
        "revision": session.revision,
        "coverage": session.seen_share,
        "quality": session.quality,
        "created_at": rfc3339(session.created_ms),
        "finished_at": rfc3339(session.finished_ms),
    }


def _snapshot(row: RowMapping) -> Json:
    names = ("robot", "boot", "sequence", "status", "sigma_xy_m", "sigma_theta_rad", "fault")
    return {
        **{name: row[name] for name in names},
        "captured_at": rfc3339(row["captured_ms"]),
        "received_at": rfc3339(row["received_ms"]),
        "raw": {axis: row[axis] for axis in _AXES},
        "corrected": None if row["to_x_m"] is None else {axis: row[f"to_{axis}"] for axis in _AXES},
    }


class _Table:
    """`poses.csv` of the session bundle that the evidence bundle is too: the noisy poses, in full precision."""

    def __init__(self) -> None:
        self._text = io.StringIO()
        self._writer = csv.writer(self._text, lineterminator="\n")
        self._writer.writerow(_POSES)

    def add(self, row: RowMapping, image: str) -> None:
        pose: list[Any] = [repr(float(row[axis])) for axis in _AXES]
        key = row["sequence"], row["robot"], row["boot"], rfc3339(row["captured_ms"])
        self._writer.writerow([*key, image, *pose])

    def content(self) -> bytes:
        return self._text.getvalue().encode()
