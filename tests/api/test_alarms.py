"""Alarms over REST and the live feed: told, acted upon, refused where that makes no sense; and baselines."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from typing import Any

import httpx
import pytest
from websockets.sync.client import connect

from tests.fakes.robot import Shot, document
from tests.fakes.whole import whole

from .conftest import Api
from .test_upload import problem

SILENT_S = 0.4


@pytest.fixture(scope="module")
def quick(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Api]:
    """A server that calls a robot silent after less than a second."""
    data = tmp_path_factory.mktemp("alarms")
    with (
        whole(data, alarm_silent_s=SILENT_S, alarm_disk_bytes=0) as server,
        httpx.Client(base_url=server.url, timeout=40) as http,
    ):
        yield Api(http, data)


def ringing(api: Api, session: str, holds: Callable[[list[dict[str, Any]]], bool]) -> list[dict[str, Any]]:
    """The alarms once something holds of them."""
    deadline = time.monotonic() + 20
    while not holds(rows := api.get(session, "/alarms").json()["alarms"]):
        assert time.monotonic() < deadline, rows
        time.sleep(0.03)
    found: list[dict[str, Any]] = rows
    return found


def silent(api: Api, *robots: str) -> tuple[str, list[dict[str, Any]]]:
    """A session whose robots have fallen silent, and its alarms."""
    session = api.open()
    for i, robot in enumerate(robots):
        api.send(session, Shot(i, robot))
    return session, ringing(api, session, lambda rows: len(rows) == len(robots))


@pytest.fixture(scope="module")
def quiet(quick: Api) -> tuple[str, list[dict[str, Any]]]:
    """One silent robot that nothing is done about."""
    return silent(quick, "bubble-1")


def act(api: Api, session: str, number: int, what: str, **body: Any) -> httpx.Response:
    body = {"comment": "why", "by": "Ada", **body}
    return api.http.post(f"/api/sessions/{session}/alarms/{number}/{what}", json=body)


def test_a_silent_robot_is_told_with_what_to_do_and_what_may_be_done(
    quick: Api, quiet: tuple[str, list[dict[str, Any]]]
) -> None:
    session, [row] = quiet

    view = quick.get(session, "/alarms").json()

    assert (row["kind"], row["subject"], row["severity"]) == ("robot-silent", "bubble-1", 500)
    assert row["advice"].startswith("Look where it was last")
    assert row["acts"] == ["acknowledge", "shelve", "suppress", "remove-from-service"]
    assert view["limits"]["robot_silent_s"] == SILENT_S
    assert [(g["kind"], g["count"], g["flood"]) for g in view["groups"]] == [("robot-silent", 1, False)]


def test_an_alarm_is_taken_through_its_states_and_every_step_is_kept(quick: Api) -> None:
    session, [row] = silent(quick, "bubble-1")
    number = row["id"]

    for what in ("acknowledge", "shelve", "unshelve", "suppress", "unsuppress"):
        assert act(quick, session, number, what).status_code == 200, what
    assert act(quick, session, number, "remove-from-service").json()["quiet"]
    assert act(quick, session, number, "return-to-service").json()["acts"][:1] == ["shelve"]

    events = quick.get(session, "/alarms/events").json()["events"]
    assert [(e["act"], e["by"], e["alarm"]) for e in events[::-1]] == [
        ("raise", None, number),
        *((what, "Ada", number) for what in ("acknowledge", "shelve", "unshelve", "suppress", "unsuppress")),
        ("remove-from-service", "Ada", number),
        ("return-to-service", "Ada", number),
    ]
    assert all(e["at"].endswith("Z") and e["text"] for e in events)


def test_history_comes_page_by_page_the_newest_first(quick: Api) -> None:
    session, rows = silent(quick, "a", "b", "c")
    assert act(quick, session, rows[0]["id"], "acknowledge").status_code == 200

    seen: list[int] = []
    query: dict[str, Any] = {"limit": 3}
    for _ in range(2):
        page = quick.get(session, "/alarms/events", **query).json()
        seen += [e["id"] for e in page["events"]]
        query["before"] = page["next"]

    assert seen == sorted(seen, reverse=True)
    assert (len(set(seen)), query["before"]) == (4, None)
    only = quick.get(session, "/alarms/events", alarm=rows[0]["id"]).json()["events"]
    assert [e["act"] for e in only] == ["acknowledge", "raise"]


def test_what_makes_no_sense_now_is_a_conflict(quick: Api) -> None:
    session, [row] = silent(quick, "bubble-1")

    for what in ("unshelve", "unsuppress", "return-to-service", "reset"):
        found = problem(act(quick, session, row["id"], what), 409, "conflict")
        assert found["act"] == what
    assert act(quick, session, row["id"], "acknowledge").status_code == 200
    assert "already" in problem(act(quick, session, row["id"], "acknowledge"), 409, "conflict")["detail"]


@pytest.mark.parametrize(
    ("what", "body", "status"),
    [
        ("acknowledge", {"comment": ""}, 422),
        ("acknowledge", {"comment": " \n"}, 422),
        ("acknowledge", {"comment": None}, 422),
        ("acknowledge", {"comment": "x" * 2001}, 422),
        ("acknowledge", {"by": ""}, 422),
        ("acknowledge", {"for_s": 60}, 422),
        ("shelve", {"for_s": 0}, 422),
        ("shelve", {"for_s": 30_000}, 422),
        ("shelve", {"for_s": "60"}, 422),
        ("forget", {}, 422),
    ],
)
def test_an_act_that_says_too_little_is_refused(
    quick: Api, quiet: tuple[str, list[dict[str, Any]]], what: str, body: dict[str, Any], status: int
) -> None:
    session, [row] = quiet

    answer = act(quick, session, row["id"], what, **body)

    assert answer.status_code == status
    assert answer.headers["content-type"] == "application/problem+json"
    assert len(quick.get(session, "/alarms/events").json()["events"]) == 1


def test_what_is_not_there_is_missing(quick: Api) -> None:
    _, [row] = silent(quick, "bubble-1")
    other = quick.open()

    problem(act(quick, other, row["id"], "acknowledge"), 404, "missing")
    problem(act(quick, "nobody", row["id"], "acknowledge"), 404, "missing")
    problem(quick.get("nobody", "/alarms"), 404, "missing")
    problem(quick.get("nobody", "/alarms/events"), 404, "missing")


def test_a_group_is_acknowledged_at_once_and_each_is_answered(quick: Api) -> None:
    session, rows = silent(quick, "a", "b", "c")
    act(quick, session, rows[2]["id"], "acknowledge")
    numbers = [row["id"] for row in rows]

    body = {"alarms": numbers, "comment": "power cut", "by": "Bo"}
    results = quick.http.post(f"/api/sessions/{session}/alarms/acknowledge", json=body).json()["results"]

    assert [r["status"] for r in results] == [200, 200, 409]
    assert not any(row["rings"] for row in quick.get(session, "/alarms").json()["alarms"])


def test_every_viewer_is_told_of_an_alarm_and_of_what_another_did(quick: Api) -> None:
    session = quick.open()
    url = f"ws://{quick.http.base_url.host}:{quick.http.base_url.port}/api/sessions/{session}/live"
    with connect(url) as one, connect(url) as two:
        quick.send(session, Shot(1))
        number = next_alarm(one)["id"]
        assert next_alarm(two)["rings"]

        act(quick, session, number, "acknowledge", comment="diver in the water")

        for viewer in (one, two):
            told = next_alarm(viewer)
            assert (told["rings"], told["comment"]["text"], told["comment"]["by"]) == (
                False,
                "diver in the water",
                "Ada",
            )
    with connect(f"{url}?since=1") as late:
        assert next_alarm(late)["acknowledged"]


def next_alarm(viewer: Any) -> dict[str, Any]:
    while True:
        frame = viewer.recv(timeout=20)
        if isinstance(frame, str) and (message := json.loads(frame))["type"] == "alarm":
            found: dict[str, Any] = message
            return found


def test_a_finished_inspection_has_no_silent_robot(quick: Api) -> None:
    session, [row] = silent(quick, "bubble-1")
    quick.finish(session)
    ringing(quick, session, lambda rows: not rows[0]["active"])

    act(quick, session, row["id"], "acknowledge")

    assert quick.get(session, "/alarms").json()["alarms"] == []
    assert [r["id"] for r in quick.get(session, "/alarms", past=True).json()["alarms"]] == [row["id"]]


def put_baseline(api: Api, session: str, baseline: Any) -> httpx.Response:
    return api.http.put(f"/api/sessions/{session}/baseline", json={"baseline": baseline})


def test_a_baseline_is_an_earlier_finished_session_of_the_same_pond(quick: Api) -> None:
    before, session = quick.open(), quick.open()
    other = quick.open(pond={"width_m": 0.2, "height_m": 0.12, "rods": []})
    quick.finish(before)
    quick.finish(other)
    late = quick.open()
    quick.finish(late)

    assert put_baseline(quick, session, before).json() == {"session": session, "baseline": before}
    assert quick.get(session).json()["baseline"] == before
    for wrong, word in ((session, "earlier"), (late, "earlier"), (other, "earlier")):
        found = problem(put_baseline(quick, session, wrong), 409, "wrong-baseline")
        assert word in found["detail"]
    assert "another pond" in problem(put_baseline(quick, late, other), 409, "wrong-baseline")["detail"]
    assert "open" in problem(put_baseline(quick, late, session), 409, "wrong-baseline")["detail"]
    problem(put_baseline(quick, session, "nobody"), 404, "missing")
    assert quick.get(session).json()["baseline"] == before, "what was refused changed nothing"
    assert put_baseline(quick, session, None).json()["baseline"] is None
    assert put_baseline(quick, session, 7).status_code == 422


def test_a_baseline_may_be_named_when_a_session_is_opened(quick: Api) -> None:
    before = quick.open()
    quick.finish(before)
    count = len(quick.http.get("/api/sessions").json()["sessions"])

    assert quick.get(quick.open(baseline=before)).json()["baseline"] == before

    refused = quick.http.post("/api/sessions", json={**document(), "baseline": "nobody"})
    problem(refused, 404, "missing")
    assert quick.http.post("/api/sessions", json={**document(), "baseline": 7}).status_code == 422
    assert len(quick.http.get("/api/sessions").json()["sessions"]) == count + 1, "nothing half opened"
