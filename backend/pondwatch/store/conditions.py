"""What the last correction of a session found of condition and position, written with it and never changed."""

from __future__ import annotations

import json
from typing import Any

from sqlalchemy import Connection, delete, insert, select

from .pondtables import conditions


def read(connection: Connection, session_id: str) -> dict[str, Any] | None:
    """The document; None where none was looked for."""
    query = select(conditions.c.document).where(conditions.c.session_id == session_id)
    found = connection.execute(query).scalar_one_or_none()
    return None if found is None else dict(json.loads(found))


def write(connection: Connection, session_id: str, revision: int, document: dict[str, Any]) -> None:
    """Keep it, in place of any before."""
    connection.execute(delete(conditions).where(conditions.c.session_id == session_id))
    text = json.dumps(document, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    row = {"session_id": session_id, "revision": revision, "document": text}
    connection.execute(insert(conditions), row)
