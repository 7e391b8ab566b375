"""Correcting a finished session again by another method, over REST."""

from __future__ import annotations

import csv
import io
from typing import Any

import pytest

from tests.fakes.robot import Shot

from .conftest import Api
from .test_upload import problem


@pytest.fixture(scope="module")
def finished(api: Api) -> str:
    session = api.open()
    for i in range(5):
        api.send(session, Shot(i))
    api.finish(session)
    return session


def ask(api: Api, session: str, body: Any) -> Any:
    return api.http.post(f"/api/sessions/{session}/corrections", json=body)


def listed(view: dict[str, Any]) -> dict[str, str]:
    return {c["method"]: c["state"] for c in view["corrections"]}


def test_a_finished_session_is_corrected_by_another_method_and_both_results_are_given(api: Api, finished: str) -> None:
    own = api.get(finished, "/poses").json()

    answer = ask(api, finished, {"method": "graph"})

    assert (answer.status_code, answer.json()["method"], answer.json()["state"]) == (202, "graph", "queued")
    view = api.until(finished, lambda v: listed(v) == {"graph": "done"})
    assert view["corrections"][0]["quality"]["sentence"]
    assert view["corrections"][0]["finished_at"].endswith("Z")
    poses = api.get(finished, "/poses", method="graph").json()
    assert (own["method"], poses["method"]) == ("identity", "graph")
    assert [p["sequence"] for p in poses["poses"]] == [0, 1, 2, 3, 4]
    assert api.get(finished, "/poses").json() == api.get(finished, "/poses", method="identity").json() == own
    table = list(csv.DictReader(io.StringIO(api.get(finished, "/poses", method="graph", format="csv").text)))
    assert [row["status"] for row in table] == [p["status"] for p in poses["poses"]]
    rods = api.get(finished, "/rods", method="graph").json()
    assert (rods["method"], len(rods["rods"])) == ("graph", 6)
    kinds = {
        job["kind"]: job["state"] for job in api.http.get("/api/jobs", params={"session": finished}).json()["jobs"]
    }
    assert kinds["correct"] == "done"
    assert ask(api, finished, {"method": "graph"}).status_code == 200


def test_a_correction_that_nobody_asked_for_is_not_found(api: Api, finished: str) -> None:
    problem(api.get(finished, "/poses", method="lattice"), 404, "missing")
    problem(api.get(finished, "/rods", method="magic"), 404, "missing")


@pytest.mark.parametrize(
    ("body", "status", "kind"),
    [
        ({"method": "identity"}, 409, "same-method"),
        ({"method": "magic"}, 422, "invalid"),
        ({"method": 7}, 422, "invalid-request"),
        ({}, 422, "invalid-request"),
    ],
)
def test_a_correction_that_cannot_be_made_is_refused(
    api: Api, finished: str, body: Any, status: int, kind: str
) -> None:
    problem(ask(api, finished, body), status, kind)


def test_an_open_or_missing_session_is_not_corrected_again(api: Api) -> None:
    problem(ask(api, api.open(), {"method": "graph"}), 409, "not-finished")
    problem(ask(api, "0" * 28, {"method": "graph"}), 404, "missing")


def test_only_methods_that_the_server_has_for_the_session_are_named(api: Api, finished: str) -> None:
    told = api.get(finished, "/corrections").json()
    bare = api.open(pond={"width_m": 0.4, "height_m": 0.3, "rods": []})

    assert told["own"] == "identity"
    assert {"identity", "lattice", "graph"} <= set(told["methods"])
    assert "auto" not in told["methods"]
    assert "lattice" not in api.get(bare, "/corrections").json()["methods"], "it needs a layout"
