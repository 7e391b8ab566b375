"""The files that a session is handed out as, by name: the one table for the command line and the API."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import IO

from pondwatch.core.errors import Invalid
from pondwatch.store.store import Store

from .evidencezip import write_evidence


@dataclass(frozen=True, slots=True)
class Form:
    """A kind of file. write: (store, session id, an empty file, milliseconds since the epoch)."""

    suffix: str
    media_type: str
    write: Callable[[Store, str, IO[bytes], int], None]


FORMS: Mapping[str, Form] = {"bundle": Form("evidence.zip", "application/zip", write_evidence)}


def form_of(name: str) -> Form:
    """The form by its name.

    Raises:
        Invalid: there is none.
    """
    found = FORMS.get(name)
    if found is None:
        raise Invalid(f"There is no format {name[:40]!r}; there are {', '.join(FORMS)}.", format=name[:40])
    return found
