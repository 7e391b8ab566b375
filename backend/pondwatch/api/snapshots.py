"""Snapshots: send one, send many, get the picture back as it came."""

from __future__ import annotations

import asyncio
import time
from functools import partial
from typing import Annotated, Any

from fastapi import APIRouter, Path, Request
from fastapi.responses import JSONResponse, Response
from sqlalchemy import Connection
from starlette.datastructures import FormData, UploadFile

from pondwatch.core.errors import PondwatchError, TooLarge
from pondwatch.core.values import SnapshotKey
from pondwatch.jobs import views
from pondwatch.jobs.ingest import Receipt
from pondwatch.jobs.views import Json
from pondwatch.store import sessions, snapshots
from pondwatch.store.sessions import Session
from pondwatch.store.snapshots import StoredSnapshot

from . import problems
from .problems import InvalidRequest
from .schemas import MOST, BatchItemIn, PoseIn, items_of, pose_of
from .services import Here, Services

router = APIRouter(prefix="/api/sessions/{session_id}/snapshots", tags=["snapshots"])


Number = Annotated[int, Path(ge=0, le=MOST)]


def _multipart(properties: dict[str, Any], required: list[str]) -> dict[str, Any]:
    """What the API's document says of a body that is read part by part."""
    schema = {"type": "object", "properties": properties, "required": required}
    return {"requestBody": {"required": True, "content": {"multipart/form-data": {"schema": schema}}}}


_PICTURE = {"type": "string", "format": "binary", "description": "PNG, JPEG or WebP, 8 bits, of the camera's size."}
_ONE = _multipart({"image": _PICTURE, "pose": PoseIn.model_json_schema()}, ["image", "pose"])
_MANY = _multipart({"poses": {"type": "array", "items": BatchItemIn.model_json_schema()}}, ["poses"])


@router.post("", status_code=201, summary="Send a snapshot", openapi_extra=_ONE)
async def send_snapshot(here: Here, session_id: str, request: Request) -> JSONResponse:
    """201 once it is on disk; 200 and the same body where it was there before."""
    started = time.perf_counter()
    try:
        async with request.form(max_files=2, max_fields=8, max_part_size=1 << 16) as form:
            pose = pose_of(await _text(form, "pose"))
            image = await _image(form, "image", here.settings.max_image_bytes)
        take = partial(here.ingest.take, session_id, pose.upload(image))
        receipt = await asyncio.get_running_loop().run_in_executor(here.intake, take)
    except PondwatchError as error:
        here.telemetry.uploads.labels(problems.status_of(error)).inc()
        raise
    status = _counted(here, receipt, len(image))
    here.telemetry.upload_seconds.observe(time.perf_counter() - started)
    return JSONResponse(views.receipt(receipt.session_id, receipt.stored), status)


def _counted(here: Services, receipt: Receipt, size: int) -> int:
    status = 201 if receipt.is_new else 200
    here.telemetry.uploads.labels(status).inc()
    here.telemetry.upload_bytes.inc(size if receipt.is_new else 0)
    return status


@router.post("/batch", summary="Send many snapshots", openapi_extra=_MANY)
async def send_batch(here: Here, session_id: str, request: Request) -> JSONResponse:
    """`results`: what each item would have been answered alone, with its `status`, in order."""
    loop = asyncio.get_running_loop()
    session = await loop.run_in_executor(here.intake, here.ingest.session, session_id)
    most = here.settings.max_batch_items
    async with request.form(max_files=most, max_fields=8, max_part_size=1 << 20) as form:
        items = items_of(await _text(form, "poses"), most)
        pictures = [await _picture_of(form, item, here.settings.max_image_bytes) for item in items]
    taking = [
        loop.run_in_executor(here.intake, _result, here, session, item, picture)
        for item, picture in zip(items, pictures, strict=True)
    ]
    return JSONResponse({"results": await asyncio.gather(*taking)})


async def _picture_of(form: FormData, item: BatchItemIn | PondwatchError, most: int) -> bytes | PondwatchError:
    if isinstance(item, PondwatchError):
        return item
    try:
        return await _image(form, item.image, most)
    except PondwatchError as error:
        return error


def _result(
    here: Services, session: Session, item: BatchItemIn | PondwatchError, picture: bytes | PondwatchError
) -> Json:
    try:
        if isinstance(item, PondwatchError):
            raise item
        if isinstance(picture, PondwatchError):
            raise picture
        receipt = here.ingest.accept(session, item.upload(picture))
    except PondwatchError as error:
        here.telemetry.uploads.labels(problems.status_of(error)).inc()
        return problems.document(error)
    return {"status": _counted(here, receipt, len(picture)), **views.receipt(session.id, receipt.stored)}


@router.get("/{robot}/{boot}/{sequence}/image", summary="The picture as it came")
def get_image(here: Here, session_id: str, robot: str, boot: Number, sequence: Number) -> Response:
    """The bytes that the robot sent, never encoded again."""

    def look(connection: Connection) -> StoredSnapshot:
        sessions.get(connection, session_id)
        return snapshots.get(connection, session_id, SnapshotKey(robot, boot, sequence))

    stored = here.store.read(look).snapshot
    headers = {"Cache-Control": "private, max-age=31536000, immutable", "ETag": f'"{stored.digest}"'}
    return Response(here.store.blobs.get(stored.digest), 200, headers, stored.media_type)


async def _text(form: FormData, name: str) -> bytes | str:
    part = form.get(name)
    if part is None:
        raise InvalidRequest(f"Part {name!r} is missing.", field=name)
    return await part.read() if isinstance(part, UploadFile) else part


async def _image(form: FormData, name: str, most: int) -> bytes:
    part = form.get(name)
    if part is None:
        raise InvalidRequest(f"Part {name!r} is missing.", field=name[:100])
    if not isinstance(part, UploadFile):
        raise InvalidRequest(f"Part {name!r} must be a file: give it a filename.", field=name[:100])
    if part.size is not None and part.size > most:
        raise TooLarge(f"The picture is larger than {most} bytes.", limit_bytes=most)
    await part.seek(0)  # two items of a batch may name the same part
    return await part.read()
