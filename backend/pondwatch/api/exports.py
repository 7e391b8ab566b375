"""What a session is handed out as, as files: each made in a thread of its own, in a file, never in the event loop."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from threading import BoundedSemaphore
from typing import IO, Annotated

from fastapi import APIRouter, Query
from fastapi.responses import JSONResponse, Response, StreamingResponse

from pondwatch.core.errors import Unavailable
from pondwatch.jobs.forms import form_of, view_from, write_form
from pondwatch.store.blobs import storage_error

from .services import Here

router = APIRouter(prefix="/api", tags=["exports"])
Side = Annotated[float | None, Query(description="Of a view, metres, pond frame.")]
_CHUNK = 1 << 18
_PATIENCE_S = 60.0
_AT_ONCE = BoundedSemaphore(2)  # each takes a core and memory for a whole raster


@router.get("/sessions/{session_id}/export/{form}", summary="A session as a file")
def export(
    here: Here,
    session_id: str,
    form: str,
    west: Side = None,
    south: Side = None,
    east: Side = None,
    north: Side = None,
    width: Annotated[int | None, Query(description="Of a view, px.")] = None,
) -> Response:
    """`bundle`, the signed evidence of a finished session; `pdf`, the report; `csv`, `json`, everything; `mosaic`,
    `layers`, as cloud-optimised GeoTIFF; `png`, a view with a stamp; `mcap`, a recording; `ifdo`, of the pictures.

    A view is `west`, `south`, `east` and `north`, metres, pond frame; the whole pond where they are absent."""
    made = form_of(form)
    view = view_from({"west": west, "south": south, "east": east, "north": north, "width": width})
    here.queue.draw(session_id)
    file = _made(here, lambda out: write_form(here.store, session_id, form, out, here.now_ms(), view))
    size = file.seek(0, 2)
    file.seek(0)
    headers = {
        "Content-Disposition": f'attachment; filename="{session_id}.{made.suffix}"',
        "Content-Length": str(size),
        "Cache-Control": "no-cache",
    }
    return StreamingResponse(_parts(file), 200, headers, made.media_type)


def _made(here: Here, write: Callable[[IO[bytes]], None]) -> IO[bytes]:
    """The file, unnamed: it is gone with the last who reads it, whatever becomes of the server."""
    if not _AT_ONCE.acquire(timeout=_PATIENCE_S):
        raise Unavailable("Other files are being made; try again.")
    try:
        file = tempfile.TemporaryFile(dir=here.store.folder)  # noqa: SIM115 - the answer closes it
        try:
            write(file)
        except BaseException:
            file.close()
            raise
    except OSError as error:
        raise storage_error(error) from error
    finally:
        _AT_ONCE.release()
    return file


def _parts(file: IO[bytes]) -> Iterator[bytes]:
    with file:
        while part := file.read(_CHUNK):
            yield part


@router.get("/key", summary="The public key that sessions are signed with")
def get_key(here: Here) -> JSONResponse:
    """`public`, 32 bytes in hexadecimal, and `pem`, the same as `pondwatch verify --key` takes it."""
    signer = here.store.signer
    return JSONResponse({"algorithm": "Ed25519", "public": signer.public, "pem": signer.public_pem.decode()})
