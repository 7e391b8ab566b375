"""From errors to RFC 9457 problem documents: the one table, and the handlers that answer with them.

A document says what is wrong to a person (`detail`) and to a program (`type` and the error's facts). It never carries
a path, a statement or a trace: what is not in the table is logged with an id, and the document names that id.
"""

from __future__ import annotations

import re
import uuid
from collections.abc import Mapping
from http import HTTPStatus
from typing import Any

import structlog
from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from pondwatch.core import errors
from pondwatch.core.errors import PondwatchError

BASE = "https://pondwatch.invalid/problems/"
MEDIA_TYPE = "application/problem+json"


class Forbidden(PondwatchError):
    """A page of another origin asked for a change."""


class TooSlow(PondwatchError):
    """A body that did not arrive in time."""


class InvalidRequest(errors.Invalid):
    """A request that does not say what the contract asks for. facts: field."""


STATUSES: Mapping[type[PondwatchError], int] = {
    errors.Invalid: 422,
    errors.Missing: 404,
    errors.Conflict: 409,
    errors.TooLarge: 413,
    errors.Unavailable: 503,
    errors.StorageFull: 507,
    Forbidden: 403,
    TooSlow: 408,
}
_RETRY_AFTER = {503: "2", 507: "30"}


def status_of(error: PondwatchError) -> int:
    """The HTTP status of an error: that of the nearest class in the table."""
    return next((STATUSES[kind] for kind in type(error).__mro__ if kind in STATUSES), 500)


def document(error: PondwatchError) -> dict[str, Any]:
    """The problem document of an error."""
    return _document(type(error).__name__, status_of(error), error.message, error.facts)


def _document(name: str, status: int, detail: str, facts: Mapping[str, Any] | None = None) -> dict[str, Any]:
    words = re.findall(r"[A-Z][a-z]*", name)
    slug, title = "-".join(words).lower(), " ".join(words).capitalize()
    return {**(facts or {}), "type": BASE + slug, "title": title, "status": status, "detail": detail}


def answer(body: dict[str, Any], headers: Mapping[str, str] | None = None) -> JSONResponse:
    """A problem document as a response."""
    status: int = body["status"]
    retry = {"Retry-After": _RETRY_AFTER[status]} if status in _RETRY_AFTER else {}
    return JSONResponse(body, status, {**retry, **(headers or {})}, MEDIA_TYPE)


def install(app: FastAPI) -> None:
    """Make every error of the application a problem document."""
    app.add_exception_handler(PondwatchError, _pondwatch)
    app.add_exception_handler(RequestValidationError, _validation)
    app.add_exception_handler(HTTPException, _http)
    app.add_middleware(Border)


async def _pondwatch(_request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, PondwatchError)
    return answer(document(error))


async def _validation(_request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, RequestValidationError)
    return answer(document(invalid_request(error.errors())))


def invalid_request(faults: Any) -> InvalidRequest:
    """The error for what pydantic found wrong: it names the first field, and never repeats what was sent."""
    fault = faults[0]
    field = ".".join(str(part) for part in fault["loc"] if part not in ("body", "query", "path")) or "body"
    return InvalidRequest(f"{field}: {fault['msg']}.", field=field)


async def _http(_request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, HTTPException)
    if isinstance(error.__cause__, PondwatchError):  # raised while the framework read the body
        return answer(document(error.__cause__))
    phrase = HTTPStatus(error.status_code).phrase
    name = "".join(word.capitalize() for word in re.findall("[A-Za-z]+", phrase))
    detail = error.detail if error.detail and error.detail != phrase else f"{phrase}."
    return answer(_document(name, error.status_code, detail), error.headers)


class Border:
    """ASGI middleware: what nobody foresaw is logged with an id and answered with it; the connection lives on."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, and answer for what it raises."""
        started = False

        async def noted(message: Message) -> None:
            nonlocal started
            started = True
            await send(message)

        try:
            await self._app(scope, receive, noted)
        except Exception as error:
            if started or scope["type"] != "http":
                raise
            await _unforeseen(scope["path"], error)(scope, receive, send)


def _unforeseen(path: str, error: Exception) -> JSONResponse:
    fault = uuid.uuid4().hex
    structlog.get_logger().error("request_failed", fault=fault, path=path, exc_info=error)
    detail = f"Something went wrong here. It was logged as {fault}."
    return answer(_document("InternalError", 500, detail, {"fault": fault}))
