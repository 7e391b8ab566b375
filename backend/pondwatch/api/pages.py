"""The front end as static files, and the headers that keep a page from doing what it should not."""

from __future__ import annotations

import gzip
import json
import mimetypes
import os
from pathlib import Path

from starlette.datastructures import Headers as RequestHeaders
from starlette.datastructures import MutableHeaders
from starlette.responses import Response
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp, Message, Receive, Scope, Send

POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; connect-src 'self'; "
    "font-src 'self'; base-uri 'none'; form-action 'self'; frame-ancestors 'none'"
)
HEADERS = {
    "Content-Security-Policy": POLICY,
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
}
_SERVED = {".html", ".js", ".css", ".svg", ".png", ".ico", ".woff2", ".webmanifest"}
_COMPRESSED = {".html", ".js", ".css", ".svg"}


class SafeHeaders:
    """ASGI middleware: every response carries `HEADERS`."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Add the headers as a response starts."""

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in HEADERS.items():
                    headers.setdefault(name, value)
            await send(message)

        await self._app(scope, receive, send_with_headers if scope["type"] == "http" else send)


class FrontEnd(StaticFiles):
    """The files of a page: what a browser needs, and nothing of the workshop. Text goes out compressed.

    `vendor.json`, where there is one, says where a checkout has the vendored files that an installed front end has in
    `vendor/`.
    """

    def __init__(self, folder: Path) -> None:
        super().__init__(directory=folder, html=True, check_dir=False)
        listing = folder / "vendor.json"
        vendored: dict[str, str] = json.loads(listing.read_text(encoding="utf-8")) if listing.is_file() else {}
        self._vendored = {address.lstrip("/"): folder / name for address, name in vendored.items()}
        self._packed: dict[tuple[str, float], bytes] = {}

    def lookup_path(self, path: str) -> tuple[str, os.stat_result | None]:
        """The file behind an address."""
        vendored = self._vendored.get(path)
        if vendored is not None and vendored.is_file():
            return str(vendored), vendored.stat()
        inside = Path(path)
        is_workshop = "node_modules" in inside.parts or inside.name.endswith(".test.js")
        if is_workshop or (path != "." and inside.suffix not in _SERVED):
            return "", None
        return super().lookup_path(path)

    def file_response(
        self, full_path: str | os.PathLike[str], stat_result: os.stat_result, scope: Scope, status_code: int = 200
    ) -> Response:
        """Checked again at each use, compressed where that helps."""
        response = super().file_response(full_path, stat_result, scope, status_code)
        response.headers["Cache-Control"] = "no-cache"
        accepted = RequestHeaders(scope=scope).get("accept-encoding", "")
        suffix = Path(full_path).suffix
        if response.status_code != 200 or suffix not in _COMPRESSED or "gzip" not in accepted:
            return response
        content = self._pack(str(full_path), stat_result.st_mtime)
        headers = {name: response.headers[name] for name in ("etag", "last-modified", "cache-control")}
        headers |= {"Content-Encoding": "gzip", "Vary": "Accept-Encoding"}
        media_type = mimetypes.types_map.get(suffix, "text/plain")
        return Response(b"" if scope["method"] == "HEAD" else content, 200, headers, media_type)

    def _pack(self, path: str, changed_s: float) -> bytes:
        key = path, changed_s
        if key not in self._packed:
            self._packed[key] = gzip.compress(Path(path).read_bytes(), 9, mtime=0)
        return self._packed[key]
