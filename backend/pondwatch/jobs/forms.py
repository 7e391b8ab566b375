"""The files that a session is handed out as, by name: the one table for the command line and the API."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import IO

from pondwatch.core.errors import Invalid
from pondwatch.store.store import Store

from .dossier import Dossier, dossier
from .dossiertables import tables_of
from .evidencezip import write_evidence
from .ifdo import write_ifdo
from .rasters import write_layers_cog, write_mosaic_cog
from .stamped import DEFAULT_PX, View, write_stamped
from .tablefiles import write_json, write_tables


def _report(found: Dossier, out: IO[bytes]) -> None:
    from .report import write_report  # its library takes as long to load as the rest of what a server needs of `jobs`

    write_report(found, out)


def _recording(found: Dossier, out: IO[bytes]) -> None:
    from .recording import write_recording

    write_recording(found, out)


@dataclass(frozen=True, slots=True)
class Form:
    """A kind of file. write: makes it of a dossier; None for the evidence bundle, which is made of the store. whole: it
    tells discrepancies and changes too."""

    suffix: str
    media_type: str
    told: str
    write: Callable[[Dossier, IO[bytes]], None] | None = None
    whole: bool = False


FORMS: Mapping[str, Form] = {
    "bundle": Form("evidence.zip", "application/zip", "the evidence bundle"),
    "pdf": Form("pdf", "application/pdf", "the report", _report, True),
    "csv": Form("csv.zip", "application/zip", "everything as tables", write_tables, True),
    "json": Form("json", "application/json", "everything as one document", write_json, True),
    "mosaic": Form("mosaic.tif", "image/tiff", "the mosaic as GeoTIFF (COG)", write_mosaic_cog),
    "layers": Form(
        "layers.tif", "image/tiff", "looks, age and sigma of every pixel as GeoTIFF (COG)", write_layers_cog
    ),
    "png": Form("png", "image/png", "a view with stamp and scale bar", lambda d, out: write_stamped(d, None, out)),
    "mcap": Form("mcap", "application/octet-stream", "a recording for Foxglove and Lichtblick", _recording),
    "ifdo": Form("ifdo.json", "application/json", "iFDO metadata of the pictures", write_ifdo),
}


def form_of(name: str) -> Form:
    """The form by its name.

    Raises:
        Invalid: there is none.
    """
    found = FORMS.get(name)
    if found is None:
        raise Invalid(f"There is no format {name[:40]!r}; there are {', '.join(FORMS)}.", format=name[:40])
    return found


def write_form(
    store: Store,
    session_id: str,
    name: str,
    out: IO[bytes],
    now_ms: int,
    view: View | None = None,
) -> None:
    """Write a stored session in a form.

    Args:
        out: an empty file that can be read too. view: of the form `png`.

    Raises:
        Invalid: there is no such form, or no such view. Missing: no such session. And as the writers.
    """
    form = form_of(name)
    if form.write is None:
        write_evidence(store, session_id, out, now_ms)
    else:
        tables = tables_of(store, session_id) if form.whole else ()
        write_dossier(dossier(store, session_id, tables), name, out, view)


def write_dossier(found: Dossier, name: str, out: IO[bytes], view: View | None = None) -> None:
    """Write a dossier in a form; the evidence bundle is none of these.

    Raises:
        Invalid: there is no such form, or it needs a stored session.
    """
    write = form_of(name).write
    if write is None:
        raise Invalid(f"{name}: only a session in a data folder has one.", format=name)
    if name == "png":
        write_stamped(found, view, out)
    else:
        write(found, out)


def view_from(sides: Mapping[str, str | float | None]) -> View | None:
    """The view of `west`, `south`, `east` and `north`, metres, and `width`, px; None where no side is given.

    Raises:
        Invalid: some sides are given and others not.
    """
    names = ("west", "south", "east", "north")
    given = [float(side) for side in map(sides.get, names) if side is not None]
    width = int(sides.get("width") or DEFAULT_PX)
    if not given:
        return None
    if len(given) < len(names):
        raise Invalid("view: west, south, east and north go together.", field="view")
    west, south, east, north = given
    return View(west, south, east, north, width)
