"""What people say: kept beside what the machine reads, never in its place."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import httpx
import pytest

from pondwatch.core.values import RodReading, RodState
from tests.fakes.robot import Shot, document
from tests.fakes.robots import StillRobots
from tests.fakes.whole import whole

from .conftest import Api
from .test_upload import problem

FULL = {"state": "full", "reason": "The wedge is glare.", "by": "A. Person"}


def judge(api: Api, session: str, rod: str = "R2", **said: Any) -> dict[str, Any]:
    answer = api.http.post(f"/api/sessions/{session}/rods/{rod}/judgement", json={**FULL, **said})
    assert answer.status_code == 201, answer.text
    made: dict[str, Any] = answer.json()
    return made


def row(api: Api, session: str, rod: str = "R2") -> dict[str, Any]:
    return next(r for r in api.get(session, "/rods").json()["rods"] if r["rod_id"] == rod)


def test_a_judgement_stands_beside_the_reading_and_leaves_it_as_it_is(api: Api) -> None:
    session = api.open()
    before = row(api, session)
    assert before["by_hand"] is None

    said = judge(api, session)

    assert (said["state"], said["fill"], said["by"], said["machine"]["state"]) == ("full", 1.0, "A. Person", "unseen")
    assert row(api, session) == {**before, "by_hand": said}
    assert api.get(session, "/rods/R2").json()["by_hand"] == said
    assert row(api, session, "R3")["by_hand"] is None
    assert "by_hand" not in api.get(session, "/rods", format="csv").text


def test_the_last_word_holds_and_all_are_kept(api: Api) -> None:
    session = api.open()
    judge(api, session)
    judge(api, session, state="partial", fill=0.4)
    assert row(api, session)["by_hand"]["fill"] == 0.4

    judge(api, session, state=None, reason="It was right.")

    assert row(api, session)["by_hand"] is None
    said = api.get(session, "/rods/R2/history").json()["by_hand"]
    assert [(s["state"], s["reason"]) for s in said] == [
        ("full", "The wedge is glare."),
        ("partial", "The wedge is glare."),
        (None, "It was right."),
    ]


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"reason": "  "}, "reason"),
        ({"by": ""}, "by"),
        ({"state": "broken"}, "state"),
        ({"state": "partial"}, "body"),
        ({"state": "partial", "fill": 0.99}, "fill"),
        ({"state": "full", "fill": 0.5}, "body"),
    ],
)
def test_a_judgement_that_says_too_little_or_contradicts_itself_is_refused(
    api: Api, changes: dict[str, Any], field: str
) -> None:
    session = api.open()

    answer = api.http.post(f"/api/sessions/{session}/rods/R2/judgement", json=FULL | changes)

    assert problem(answer, 422, "invalid-request")["field"] == field
    assert row(api, session)["by_hand"] is None


def test_there_is_nothing_to_say_of_what_is_not_there(api: Api) -> None:
    session = api.open()

    for path, said in (("/rods/R9/judgement", FULL), ("/notes", {"text": "x", "by": "y", "rod_id": "R9"})):
        problem(api.http.post(f"/api/sessions/{session}{path}", json=said), 404, "missing")
        problem(api.http.post(f"/api/sessions/nobody{path}", json=said), 404, "missing")
    problem(api.get(session, "/rods/R9/history"), 404, "missing")
    problem(api.get("nobody", "/notes"), 404, "missing")


def test_viewers_hear_what_people_say_although_no_revision_is_made(api: Api) -> None:
    from websockets.sync.client import connect

    session = api.open()
    api.send(session, Shot(1))
    revision = api.until(session, lambda view: view["revision"] > 0)["revision"]
    url = f"ws://{api.http.base_url.host}:{api.http.base_url.port}/api/sessions/{session}/live?since={revision}"
    with connect(url) as viewer:
        judge(api, session)
        api.http.post(f"/api/sessions/{session}/notes", json={"text": "Lamp out", "by": "A. Person"})
        heard = ""
        while "Lamp out" not in heard or "glare" not in heard:
            frame = viewer.recv(timeout=10)
            heard += frame if isinstance(frame, str) else ""

    assert api.get(session).json()["revision"] == revision


def test_notes_are_of_a_rod_a_place_a_moment_or_all_and_are_closed_once(api: Api) -> None:
    session = api.open()
    about = [
        {"rod_id": "R1"},
        {"x_m": 0.1, "y_m": 0.05},
        {"moment": "2026-01-01T08:00:00.500Z"},
        {},
    ]
    for i, more in enumerate(about):
        said = {"text": f"Note {i}", "by": "A. Person", **more}
        assert api.http.post(f"/api/sessions/{session}/notes", json=said).status_code == 201

    listed = api.get(session, "/notes").json()["notes"]
    assert [{k: note[k] for k in more} for note, more in zip(listed, about, strict=True)] == about
    assert [n["text"] for n in api.get(session, "/rods/R1/history").json()["notes"]] == ["Note 0"]

    close = f"/api/sessions/{session}/notes/{listed[0]['id']}/close"
    assert api.http.post(close, json={"by": "B. Person"}).json()["closed_by"] == "B. Person"
    problem(api.http.post(close, json={"by": "C. Person"}), 409, "conflict")
    problem(api.http.post(f"/api/sessions/{session}/notes/0/close", json={"by": "x"}), 404, "missing")
    half = {"text": "x", "by": "y", "x_m": 0.1}
    problem(api.http.post(f"/api/sessions/{session}/notes", json=half), 422, "invalid-request")


def test_the_next_shift_is_told_of_all_that_is_open_and_of_what_was_said(api: Api) -> None:
    session = api.open(name="Handed over")
    judge(api, session)
    note = {"text": "Lamp out", "by": "A. Person"}
    api.http.post(f"/api/sessions/{session}/notes", json=note)

    told = api.http.get("/api/handover", params={"hours": 0.5}).json()

    assert (told["notes"][0]["text"], told["notes"][0]["session_name"]) == ("Lamp out", "Handed over")
    assert (told["judgements"][0]["rod_id"], told["judgements"][0]["session"]) == ("R2", session)
    problem(api.http.get("/api/handover", params={"hours": 0}), 422, "invalid-request")


def test_what_all_rods_read_as_is_told_in_the_order_in_which_it_changed(tmp_path: Path) -> None:
    with whole(tmp_path, StillRobots()) as server:
        session = httpx.post(f"{server.url}/api/sessions", json=document()).json()["id"]
        for rod, state in (("R2", RodState.EMPTY), ("R1", RodState.FULL), ("R2", RodState.FULL)):
            server.read(session, RodReading(rod, state, 1.0 if state is RodState.FULL else 0.0, 0.9, 1))

        told = httpx.get(f"{server.url}/api/sessions/{session}/readings").json()

        assert told["revision"] == 3
        rows = [(row["revision"], row["rod_id"], row["state"]) for row in told["readings"]]
        assert rows == [(1, "R2", "empty"), (2, "R1", "full"), (3, "R2", "full")]
        assert httpx.get(f"{server.url}/api/sessions/none/readings").status_code == 404
