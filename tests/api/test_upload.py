"""Sending snapshots: what is acknowledged, what is refused, and with which words."""

from __future__ import annotations

import errno
import hashlib
import json
import math
import struct
import zlib
from typing import Any

import cv2
import httpx
import numpy as np
import pytest
from structlog.testing import capture_logs

from pondwatch.store.blobs import FolderBlobs
from tests.fakes.robot import HEIGHT_PX, WIDTH_PX, Shot, picture

from .conftest import Api

PARTS = {"content-type": "multipart/form-data; boundary=parts"}


def problem(answer: httpx.Response, status: int, slug: str) -> dict[str, Any]:
    """The problem document, checked for what RFC 9457 and our own table ask."""
    assert answer.status_code == status, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    body: dict[str, Any] = answer.json()
    assert body["type"] == f"https://pondwatch.invalid/problems/{slug}"
    assert body["status"] == status
    assert body["title"]
    assert body["detail"]
    return body


def stored(api: Api, session: str) -> int:
    count: int = api.get(session).json()["counts"]["snapshots"]
    return count


def bomb() -> bytes:
    """A PNG of 292 kB that would decode to 17,000 x 17,000 pixels."""

    def chunk(name: bytes, body: bytes) -> bytes:
        return struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))

    rows = zlib.compress(bytes(17_000 * 17_001), 9)
    header = struct.pack(">IIBBBBB", 17_000, 17_000, 8, 0, 0, 0, 0)
    padding = chunk(b"tEXt", b"x" * (292_000 - len(rows) - 100))
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + padding + chunk(b"IDAT", rows) + chunk(b"IEND", b"")


def test_a_snapshot_is_acknowledged_and_its_bytes_come_back_as_they_were(api: Api) -> None:
    session, shot = api.open(), Shot(1)

    answer = api.send(session, shot)

    assert answer.status_code == 201
    body = answer.json()
    assert (body["robot"], body["boot"], body["sequence"]) == ("bubble-1", 0, 1)
    assert body["digest"] == "sha256:" + hashlib.sha256(shot.content).hexdigest()
    assert body["received_at"].endswith("Z")
    back = api.get(session, "/snapshots/bubble-1/0/1/image")
    assert (back.content, back.headers["content-type"]) == (shot.content, "image/png")


def test_what_a_robot_says_of_itself_is_told_with_its_pose_and_nothing_is_refused_for_it(api: Api) -> None:
    session = api.open()
    said = Shot(1).but(battery=0.84, link_loss=0, image_quality=1)
    odd = Shot(2).but(battery=84, link_loss="bad", image_quality=True)
    for shot in (said, odd, Shot(3)):
        assert api.send(session, shot).status_code == 201
    assert api.send(session, said.but(battery=0.83)).status_code == 200, "the same snapshot, whatever is said beside it"
    api.until(session, lambda found: found["counts"]["pending"] == 0)

    poses = api.get(session, "/poses").json()["poses"]

    names = ("battery", "link_loss", "image_quality")
    told = {pose["sequence"]: {name: pose[name] for name in names if name in pose} for pose in poses}
    assert told == {1: {"battery": 0.84, "link_loss": 0.0, "image_quality": 1.0}, 2: {}, 3: {}}


def test_the_same_snapshot_again_is_answered_as_the_first_time_and_stored_once(api: Api) -> None:
    session = api.open()
    first = api.send(session, Shot(1))

    again = api.send(session, Shot(1))

    assert (first.status_code, again.status_code) == (201, 200)
    assert again.json() == first.json()
    assert stored(api, session) == 1


@pytest.mark.parametrize(
    "altered",
    [Shot(1, image=picture(99)), Shot(1).but(x_m=0.1234), Shot(1).but(captured_at="2026-01-01T09:00:00.000Z")],
)
def test_the_same_key_with_other_content_is_a_conflict(api: Api, altered: Shot) -> None:
    session = api.open()
    api.send(session, Shot(1))

    body = problem(api.send(session, altered), 409, "snapshot-conflict")

    assert (body["robot"], body["sequence"]) == ("bubble-1", 1)
    assert body["stored_digest"] == f"sha256:{Shot(1).digest}"
    assert api.get(session, "/snapshots/bubble-1/0/1/image").content == Shot(1).content


def test_a_robot_that_was_restarted_may_begin_again_at_zero(api: Api) -> None:
    session = api.open()

    answers = [api.send(session, Shot(0, boot=boot, image=picture(boot))).status_code for boot in (0, 1)]

    assert answers == [201, 201]
    assert stored(api, session) == 2


def test_a_digest_that_does_not_match_stores_nothing(api: Api) -> None:
    session = api.open()

    body = problem(api.send(session, Shot(1).but(digest="sha256:" + "0" * 64)), 422, "digest-mismatch")

    assert body["found"] == f"sha256:{Shot(1).digest}"
    assert stored(api, session) == 0


@pytest.mark.parametrize(
    ("image", "says"),
    [
        (b"", "empty"),
        (b"not a picture at all", "Not a PNG, JPEG or WebP"),
        (b"\x89PNG\r\n\x1a\n", "no header"),
        (picture(1, 64, 32), "64 x 32"),
        (picture(1)[:-40], "cut short"),
        (picture(1, kind=".jpg")[:-200], "cut short"),
        (picture(1)[:60] + b"\0" + picture(1)[61:], "checksum"),
        (cv2.imencode(".png", np.zeros((HEIGHT_PX, WIDTH_PX), np.uint16))[1].tobytes(), "16 bits"),
        (bomb(), "17000 x 17000"),
    ],
    ids=["empty", "text", "stub", "size", "cut png", "cut jpeg", "flipped byte", "16 bits", "bomb"],
)
def test_what_is_no_picture_of_this_camera_is_refused_and_not_stored(api: Api, image: bytes, says: str) -> None:
    session = api.open()

    body = problem(api.send(session, Shot(1, image=image)), 422, "invalid-image")

    assert says in body["detail"]
    assert stored(api, session) == 0


@pytest.mark.parametrize("kind", [".png", ".jpg", ".webp"])
def test_png_jpeg_and_webp_are_taken(api: Api, kind: str) -> None:
    assert api.send(api.open(), Shot(1, image=picture(1, kind=kind))).status_code == 201


@pytest.mark.parametrize("field", ["x_m", "y_m", "theta_rad"])
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_pose_that_is_not_finite_is_refused(api: Api, field: str, value: float) -> None:
    session = api.open()

    body = problem(api.send(session, Shot(1).but(**{field: value})), 422, "invalid-pose")

    assert body["field"] == field
    assert stored(api, session) == 0


@pytest.mark.parametrize("field", ["robot", "sequence", "captured_at", "x_m", "y_m", "theta_rad"])
def test_a_missing_field_is_named(api: Api, field: str) -> None:
    session = api.open()

    body = problem(api.send(session, Shot(1).but(**{field: ...})), 422, "invalid-request")

    assert body["field"] == field
    assert "required" in body["detail"]


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("sequence", -1),
        ("sequence", 2**70),
        ("sequence", 1.5),
        ("sequence", "1"),
        ("boot", -1),
        ("robot", ""),
        ("robot", "a/b"),
        ("robot", "a\0b"),
        ("robot", "\ud800"),
        ("robot", "x" * 65),
        ("captured_at", "yesterday"),
        ("captured_at", "2026-01-01T08:00:00"),
        ("captured_at", 0),
        ("captured_at", "0001-01-01T00:00:00+14:00"),
        ("digest", "md5:0"),
    ],
)
def test_a_field_that_is_not_as_agreed_is_named(api: Api, field: str, value: object) -> None:
    body = problem(api.send(api.open(), Shot(1).but(**{field: value})), 422, "invalid-request")

    assert body["field"] in (field, "body")  # a text that is not Unicode is no JSON at all


@pytest.mark.parametrize("pose", ["", "{", "[]", "null", "[" * 5000, '{"robot": 1' + " " * 70_000 + "}"])
def test_a_pose_part_that_is_no_pose_is_refused(api: Api, pose: str) -> None:
    files: dict[str, Any] = {"image": ("a.png", picture(1)), "pose": (None, pose)}
    answer = api.http.post(f"/api/sessions/{api.open()}/snapshots", files=files)

    assert answer.status_code in (400, 422)
    assert answer.headers["content-type"] == "application/problem+json"


def test_missing_parts_are_named(api: Api) -> None:
    url = f"/api/sessions/{api.open()}/snapshots"

    no_pose = api.http.post(url, files={"image": ("a.png", picture(1))})
    no_image = api.http.post(url, files={"pose": (None, json.dumps(Shot(1).pose()))})
    no_parts = api.http.post(url, content=b"hello")

    assert problem(no_pose, 422, "invalid-request")["field"] == "pose"
    assert problem(no_image, 422, "invalid-request")["field"] == "image"
    assert problem(no_parts, 422, "invalid-request")["field"] == "pose"


def test_an_unknown_session_is_not_found(api: Api) -> None:
    body = problem(api.send("0123", Shot(1)), 404, "missing")

    assert (body["kind"], body["id"]) == ("session", "0123")


def test_a_finished_session_takes_nothing_new_but_still_knows_what_it_has(api: Api) -> None:
    session = api.open()
    api.send(session, Shot(1))
    api.finish(session)

    problem(api.send(session, Shot(2)), 409, "session-finished")

    assert api.send(session, Shot(1)).status_code == 200
    assert stored(api, session) == 1


def test_a_full_disk_is_told_harms_nothing_and_is_over_when_there_is_room(api: Api, monkeypatch: Any) -> None:
    session, unknown = api.open(), Shot(1, image=picture(7_777))  # bytes that no other test has stored
    api.send(session, Shot(0))

    def full(*_: Any) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(FolderBlobs, "_write", full)
        refused = api.send(session, unknown)

    assert "stored" in problem(refused, 507, "storage-full")["detail"]
    assert int(refused.headers["retry-after"]) > 0
    assert stored(api, session) == 1
    assert api.send(session, unknown).status_code == 201


def test_what_nobody_foresaw_is_a_problem_with_an_id_and_without_a_trace(api: Api, monkeypatch: Any) -> None:
    session = api.open()

    def broken(*_: Any) -> None:
        raise RuntimeError("a secret path: /var/lib/pond")

    with monkeypatch.context() as patch, capture_logs() as logs:
        patch.setattr(FolderBlobs, "put", broken)
        answer = api.send(session, Shot(1))

    body = problem(answer, 500, "internal-error")
    assert body["fault"] in body["detail"]
    assert [log["fault"] for log in logs if log["event"] == "request_failed"] == [body["fault"]]
    assert "secret" not in answer.text
    assert "content-security-policy" in answer.headers


def test_a_body_of_100_megabytes_is_refused_before_it_is_parsed(api: Api) -> None:
    session = api.open()
    huge = b"--parts\r\nContent-Disposition: form-data; name=image; filename=a\r\n\r\n" + bytes(100_000_000)

    declared = api.send(session, Shot(1, image=huge))
    counted = api.http.post(f"/api/sessions/{session}/snapshots", content=iter([huge[:20_000_000]]), headers=PARTS)
    layout = api.http.post("/api/sessions", content=iter([huge[:20_000_000]]))

    assert problem(declared, 413, "too-large")["limit_bytes"] == (1 << 20) + 256 * 1024
    problem(counted, 413, "too-large")
    problem(layout, 413, "too-large")
    assert stored(api, session) == 0


def test_a_picture_over_the_limit_is_refused(api: Api) -> None:
    problem(api.send(api.open(), Shot(1, image=bytes((1 << 20) + 1))), 413, "too-large")
