"""Writes docs/reference.md: every setting, command, endpoint and metric, as the program itself tells them.

`tests/test_docs.py` holds it to that.
"""

from __future__ import annotations

import asyncio
import re
import sys
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import httpx
import typer
from fastapi import FastAPI
from fastapi.routing import APIWebSocketRoute
from pydantic_core import PydanticUndefined

from pondwatch import cli
from pondwatch.app import create_app
from pondwatch.config import Settings

PAGE = Path(__file__).parent.parent / "docs" / "reference.md"
Rows = Iterable[tuple[str, ...]]


def settings_rows() -> Iterator[tuple[str, str, str]]:
    """Environment variable, default, what it sets."""
    for name, field in Settings.model_fields.items():
        default = "by the machine" if field.default is PydanticUndefined else f"`{_plain(field.default)}`"
        yield f"`PONDWATCH_{name.upper()}`", default, field.description or ""


def _plain(default: object) -> str:
    if default is None or default == ():
        return "none"
    return str(default)


def command_rows() -> Iterator[tuple[str, str, str]]:
    """Command, its arguments and options, what it does."""
    for name, command in _commands(typer.main.get_command(cli.app)):
        told = [_parameter(p) for p in command.params if p.name != "help" and not getattr(p, "hidden", False)]
        yield f"`pondwatch {name}`", ", ".join(told) or "none", _sentence(command.help or "")


def _commands(group: Any, before: str = "") -> Iterator[tuple[str, Any]]:
    """Every command by name, those of groups with the group's name before theirs."""
    for name, command in sorted(group.commands.items()):
        if hasattr(command, "commands"):
            yield from _commands(command, f"{before}{name} ")
        else:
            yield f"{before}{name}", command


def _parameter(parameter: Any) -> str:
    if parameter.param_type_name == "argument":
        return f"`{parameter.metavar or parameter.name.upper()}`"
    return f"`{parameter.opts[0]}`"


def endpoint_rows(app: FastAPI) -> Iterator[tuple[str, str]]:
    """Method and path, what it does; websockets, which the API's own document leaves out, last."""
    for path, methods in app.openapi()["paths"].items():
        for method, told in methods.items():
            yield f"`{method.upper()} {path}`", _sentence(told.get("description", ""))
    for socket in _sockets(app.routes):
        yield f"`websocket {socket.path}`", _sentence(socket.endpoint.__doc__ or "")


def _sockets(routes: Iterable[Any]) -> Iterator[APIWebSocketRoute]:
    for route in routes:
        if isinstance(route, APIWebSocketRoute):
            yield route
        elif included := getattr(route, "original_router", None):
            yield from _sockets(included.routes)


def _sentence(text: str) -> str:
    return " ".join(text.split("\n\n")[0].split())


def metric_rows(text: str) -> Iterator[tuple[str, str, str]]:
    """Name, kind, what it counts, from what `/metrics` answers. Times of creation are left out."""
    kinds = dict(re.findall(r"^# TYPE (\S+) (\S+)$", text, re.MULTILINE))
    for name, told in re.findall(r"^# HELP (\S+) (.*)$", text, re.MULTILINE):
        if not name.endswith("_created"):
            yield f"`{name}`", kinds[name], told


def table(head: tuple[str, ...], rows: Rows) -> str:
    """A Markdown table."""
    every = [head, ("---",) * len(head), *rows]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in every)


async def _metrics(app: FastAPI) -> str:
    transport = httpx.ASGITransport(app)
    async with (
        app.router.lifespan_context(app),
        httpx.AsyncClient(transport=transport, base_url="http://here") as client,
    ):
        return (await client.get("/metrics")).text


def render() -> str:
    """The whole page."""
    with tempfile.TemporaryDirectory() as data:
        app = create_app(Settings(data=Path(data), workers=1))
        metrics = asyncio.run(_metrics(app))
    parts = [
        "# Reference",
        "Written by `make reference` from the program itself.",
        "## Settings\n\nEnvironment variables; sizes in bytes, times in seconds.",
        table(("setting", "default", "what it sets"), settings_rows()),
        "## Commands",
        table(("command", "arguments and options", "what it does"), command_rows()),
        "## Endpoints\n\nErrors are problem documents (RFC 9457). A server describes itself at `/api/openapi.json`.",
        table(("call", "what it does"), endpoint_rows(app)),
        "## Metrics",
        table(("metric", "kind", "what it counts"), metric_rows(metrics)),
    ]
    return "\n\n".join(parts) + "\n"


if __name__ == "__main__":
    PAGE.write_text(render(), encoding="utf-8")
    sys.stdout.write(f"{PAGE.name} written\n")
