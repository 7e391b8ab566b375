"""What a session is handed out as, as files: each made in a thread of its own, in a file, never in the event loop."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from threading import BoundedSemaphore
from typing import IO

from fastapi import APIRouter
from fastapi.responses import JSONResponse, Response, StreamingResponse

from pondwatch.core.errors import Unavailable
from pondwatch.jobs.forms import Form, form_of
from pondwatch.store.blobs import storage_error

from .services import Here

router = APIRouter(prefix="/api", tags=["exports"])
_CHUNK = 1 << 18
_PATIENCE_S = 60.0
_AT_ONCE = BoundedSemaphore(2)  # each takes a core and memory for a whole raster


@router.get("/sessions/{session_id}/export/{form}", summary="A session as a file")
def export(here: Here, session_id: str, form: str) -> Response:
    """`bundle`: a finished session as evidence, with every picture, chained and signed."""
    made = form_of(form)
    file = _made(here, session_id, made)
    size = file.seek(0, 2)
    file.seek(0)
    headers = {
        "Content-Disposition": f'attachment; filename="{session_id}.{made.suffix}"',
        "Content-Length": str(size),
        "Cache-Control": "no-cache",
    }
    return StreamingResponse(_parts(file), 200, headers, made.media_type)


def _made(here: Here, session_id: str, form: Form) -> IO[bytes]:
    """The file, unnamed: it is gone with the last who reads it, whatever becomes of the server."""
    if not _AT_ONCE.acquire(timeout=_PATIENCE_S):
        raise Unavailable("Other files are being made; try again.")
    try:
        file = tempfile.TemporaryFile(dir=here.store.folder)  # noqa: SIM115 - the answer closes it
        try:
            form.write(here.store, session_id, file, here.now_ms())
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
