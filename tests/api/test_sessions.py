"""Opening, listing and the outside of the server: health, headers, origins, files."""

from __future__ import annotations

import json
from typing import Any

import httpx
import pytest

from tests.fakes.robot import Shot, document

from .conftest import Api
from .test_upload import problem


def test_sessions_are_listed_newest_first_page_by_page(api: Api) -> None:
    opened = [api.open(name=f"Session {i}") for i in range(5)]

    seen: list[str] = []
    query: dict[str, Any] = {"limit": 2}
    while len(seen) < 5:
        page = api.http.get("/api/sessions", params=query).json()
        seen += [s["id"] for s in page["sessions"]]
        query["before"] = page["next"]

    assert seen[:5] == opened[::-1]


def test_sessions_are_searched_by_a_part_of_their_name(api: Api) -> None:
    found = api.open(name="North 100%_bay")
    api.open(name="North 100 bay")

    listed = api.http.get("/api/sessions", params={"q": "100%_BAY"}).json()["sessions"]

    assert [s["id"] for s in listed] == [found]


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"format": "pond-session/9"}, "format"),
        ({"camera": None}, "camera"),
        ({"camera": {"width_px": 48, "height_px": 0, "metres_per_pixel": 0.001}}, "camera.height_px"),
        ({"camera": {"width_px": 48, "height_px": 32, "metres_per_pixel": float("nan")}}, "camera.metres_per_pixel"),
        ({"pond": {"width_m": 0.2}}, "pond.height_m"),
        ({"pond": {"width_m": 0.2, "height_m": 0.1, "rods": [{}]}}, "pond.rods[0].id"),
        ({"method": 7}, "method"),
        ({"name": "\ud800"}, "name"),
    ],
)
def test_a_session_that_contradicts_itself_is_refused_by_field(api: Api, changes: dict[str, Any], field: str) -> None:
    body = json.dumps(document(**changes))

    answer = api.http.post("/api/sessions", content=body, headers={"content-type": "application/json"})

    assert problem(answer, 422, "invalid-layout")["field"] == field


def test_an_unknown_method_is_refused(api: Api) -> None:
    answer = api.http.post("/api/sessions", json=document(method="magic"))

    assert problem(answer, 422, "invalid")["method"] == "magic"


@pytest.mark.parametrize(
    "body", [b"", b"{", b"[" * 100_000, b'{"a": ' + b"9" * 10_000 + b"}", b"\xff\xfe", b"[]", b"7"]
)
def test_a_body_that_is_no_session_is_refused(api: Api, body: bytes) -> None:
    answer = api.http.post("/api/sessions", content=body, headers={"content-type": "application/json"})

    assert answer.status_code in (400, 422)
    assert answer.headers["content-type"] == "application/problem+json"


def test_a_pond_without_a_layout_is_taken(api: Api) -> None:
    session = api.open(pond={"width_m": 0.2, "height_m": 0.1})

    assert api.get(session, "/rods").json()["rods"] == []


@pytest.mark.parametrize(
    ("method", "path", "status"),
    [("GET", "/api/nothing", 404), ("DELETE", "/api/sessions", 405), ("GET", "/x.json", 404)],
)
def test_what_is_not_there_is_a_problem_document_too(api: Api, method: str, path: str, status: int) -> None:
    answer = api.http.request(method, path)

    assert answer.status_code == status
    assert answer.headers["content-type"] == "application/problem+json"


def test_health_is_told(api: Api) -> None:
    assert api.http.get("/healthz").json() == {"status": "alive"}
    assert api.http.get("/readyz").json() == {"status": "ready"}
    api.send(api.open(), Shot(1))
    assert 'pondwatch_uploads_total{status="201"}' in api.http.get("/metrics").text


def test_every_answer_forbids_what_a_page_should_not_do(api: Api) -> None:
    for path in ("/", "/api/sessions", "/healthz", "/api/nothing"):
        headers = api.http.get(path).headers
        assert "unsafe" not in headers["content-security-policy"]
        assert "default-src 'none'" in headers["content-security-policy"]
        assert headers["x-content-type-options"] == "nosniff"


def test_a_page_of_another_origin_changes_nothing(api: Api) -> None:
    session = api.open()
    own = f"http://{api.http.base_url.host}:{api.http.base_url.port}"

    def send(origin: str) -> httpx.Response:
        url = f"/api/sessions/{session}/snapshots"
        return api.http.post(url, files=Shot(1).parts(), headers={"origin": origin})

    problem(send("https://evil.example"), 403, "forbidden")
    problem(send("null"), 403, "forbidden")
    assert send(own).status_code == 201


def test_the_page_is_served_and_the_workshop_is_not(api: Api) -> None:
    page = api.http.get("/")

    assert page.headers["content-type"].startswith("text/html")
    assert page.headers["content-encoding"] == "gzip"
    assert "<title>Pondwatch</title>" in page.text
    etag = page.headers["etag"]
    assert api.http.get("/", headers={"if-none-match": etag}).status_code == 304
    for path in (
        "/package.json",
        "/package-lock.json",
        "/node_modules/ol/ol.css",
        "/types.d.ts",
        "/../pyproject.toml",
        "/.npmrc",
    ):
        assert api.http.get(path).status_code == 404, path


def test_the_api_describes_itself_without_asking_another_host(api: Api) -> None:
    description = api.http.get("/api/openapi.json").json()

    assert "/api/sessions/{session_id}/snapshots" in description["paths"]
    assert api.http.get("/docs").status_code == 404
