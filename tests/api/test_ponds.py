"""Ponds over REST: layouts, the past, declared inventories; and two inspections compared."""

from __future__ import annotations

import csv
import io
import time
from typing import Any

import cv2
import numpy as np
import pytest

from pondwatch.core.layouts import csv_of, document_of, lattice
from tests.fakes.inspections import finished
from tests.fakes.robot import Shot, document

from .conftest import Api
from .test_upload import problem

POND = lattice("square", 0.05, columns=4, rows=3, outer_m=0.018, inner_m=0.012)
FIRST, SECOND, THIRD = "EEEEFFFFPPP?", "EFEEFFFFPPPF", "EFEEFFEF?PPF"


@pytest.fixture(scope="module")
def surveyed(api: Api) -> list[str]:
    """Three finished inspections of one pond, and one of another between them."""
    other = lattice("square", 0.05, columns=3, rows=3, outer_m=0.018, inner_m=0.012)
    ids = [finished(api.store, POND, FIRST, 1_000, name="First")]
    finished(api.store, other, "E" * 9, 1_500_000, name="Elsewhere")
    ids.append(finished(api.store, POND, SECOND, 2_000_000, name="Second"))
    return [*ids, finished(api.store, POND, THIRD, 3_000_000, name="Third")]


def pond_of(api: Api, session: str) -> str:
    return str(api.get(session).json()["pond"]["id"])


def post_csv(api: Api, path: str, text: str | bytes, **query: Any) -> Any:
    return api.http.post(path, content=text, params=query, headers={"content-type": "text/csv"})


def test_inspections_of_one_layout_belong_to_one_pond(api: Api, surveyed: list[str]) -> None:
    pond = api.http.get(f"/api/ponds/{pond_of(api, surveyed[0])}").json()

    assert [i["name"] for i in pond["inspections"]] == ["Third", "Second", "First"]
    assert (pond["name"], pond["layout_version"], pond["rods"]) == ("First", 1, 12)
    assert pond["layout"] == document_of(POND)
    listed = {p["name"]: p for p in api.http.get("/api/ponds").json()["ponds"]}
    assert listed["First"]["inspections"] == 3
    assert listed["First"]["last"] == surveyed[2]


def test_a_session_may_say_which_pond_it_is_of_and_take_its_layout(api: Api) -> None:
    made = api.http.post("/api/ponds", params={"name": "North"}, json=document_of(POND)).json()
    camera = document()["camera"]

    session = api.http.post(
        "/api/sessions", json={"format": "pond-session/1", "name": "s", "camera": camera, "pond": {"id": made["id"]}}
    ).json()
    named = api.open(pond={**document()["pond"], "name": "South"})

    assert len(session["pond"]["rods"]) == 12
    assert session["pond"]["id"] == made["id"]
    assert (
        api.get(named).json()["pond"]["id"]
        == api.get(api.open(pond={**document()["pond"], "name": "South"})).json()["pond"]["id"]
    )
    problem(api.http.post("/api/sessions", json=document(pond={**document()["pond"], "id": "x"})), 404, "missing")
    problem(api.http.post("/api/sessions", json=document(pond={**document()["pond"], "id": 7})), 422, "invalid-layout")


def test_a_layout_gets_versions_and_inspections_keep_theirs(api: Api) -> None:
    made = api.http.post("/api/ponds", params={"name": "Versions"}, json=document_of(POND)).json()
    path = f"/api/ponds/{made['id']}/layouts"
    fewer = "\n".join(csv_of(POND).splitlines()[:-1]) + "\n"

    again = api.http.post(path, json=document_of(POND))
    second = post_csv(api, path, fewer)

    assert (again.status_code, again.json()["layout_version"]) == (201, 1)
    assert [(v["version"], v["rods"], v["source"]) for v in second.json()["versions"]] == [
        (2, 11, "CSV"),
        (1, 12, "JSON"),
    ]
    assert api.http.get(f"{path}/1", params={"format": "csv"}).text == csv_of(POND)
    assert len(api.http.get(f"{path}/2").json()["rods"]) == 11
    problem(api.http.get(f"{path}/3"), 404, "missing")
    error = problem(post_csv(api, path, fewer + "X,a,b,c,d\n"), 422, "invalid-layout")
    assert error["line"] == 13
    problem(post_csv(api, "/api/ponds", fewer, name="No size"), 422, "invalid-layout")
    assert api.http.get(f"/api/ponds/{made['id']}").json()["layout_version"] == 2


def test_a_pond_is_made_of_an_earlier_inspection_and_renamed(api: Api, surveyed: list[str]) -> None:
    made = api.http.post("/api/ponds", params={"name": "Copied", "session": surveyed[0]})

    assert made.status_code == 201
    assert made.json()["layout"] == document_of(POND)
    path = made.headers["location"]
    assert api.http.patch(path, json={"name": "Renamed"}).json()["name"] == "Renamed"
    problem(api.http.patch(path, json={"name": "First"}), 409, "conflict")
    problem(api.http.post("/api/ponds", params={"name": "Renamed"}, json=document_of(POND)), 409, "conflict")
    problem(api.http.get("/api/ponds/none"), 404, "missing")


def test_a_rods_past_has_gaps_where_it_was_not_observed(api: Api, surveyed: list[str]) -> None:
    pond = pond_of(api, surveyed[0])

    last = api.http.get(f"/api/ponds/{pond}/rods/R0011/history").json()["history"]
    eighth = api.http.get(f"/api/ponds/{pond}/rods/R0008/history").json()["history"]

    assert [(m["name"], m["state"], m["reason"]) for m in last] == [
        ("First", None, "not_observed"), ("Second", "full", None), ("Third", "full", None),
    ]  # fmt: skip
    assert [m["fill"] for m in eighth] == [0.5, 0.5, None]
    problem(api.http.get(f"/api/ponds/{pond}/rods/R99/history"), 404, "missing")


def test_a_ponds_trend_counts_every_rod_of_every_inspection(api: Api, surveyed: list[str]) -> None:
    trend = api.http.get(f"/api/ponds/{pond_of(api, surveyed[0])}/trends").json()["inspections"]

    order = ("empty", "partial", "full", "not_observed")
    counts = [tuple(m["counts"][state] for state in order) for m in trend]
    assert counts == [(4, 3, 4, 1), (3, 3, 6, 0), (4, 2, 5, 1)]
    assert all(sum(m["counts"].values()) == m["rods"] == 12 for m in trend)


def test_the_last_inspection_is_compared_with_one_word_and_exported(api: Api, surveyed: list[str]) -> None:
    query = {"base": "last", "with": surveyed[2], "sort": "rod_id", "order": "desc"}
    told = api.http.get("/api/compare", params=query).json()

    assert told["base"]["session"] == surveyed[1]
    assert [(r["rod_id"], r["change"]) for r in told["rods"]] == [("R0006", "emptied")]
    assert told["residual"]["median_px"] < 0.1
    text = api.http.get("/api/compare", params={**query, "format": "csv"}).text
    assert [r["rod_id"] for r in csv.DictReader(io.StringIO(text))] == ["R0008", "R0006"]
    problem(api.http.get("/api/compare", params={**query, "sort": "x"}), 422, "invalid-request")
    problem(api.http.get("/api/compare", params={"base": "last", "with": surveyed[0]}), 404, "missing")


def test_a_rods_picture_is_the_mosaic_around_it(api: Api, surveyed: list[str]) -> None:
    content = api.get(surveyed[0], "/rods/R0000/picture.png").content
    picture = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED)

    assert picture is not None
    assert picture.shape == (73, 73, 4)  # two outer radii of 18 px each way, and the middle
    assert picture[36, 36, 3] == 255
    unseen = cv2.imdecode(
        np.frombuffer(api.get(surveyed[0], "/rods/R0011/picture.png").content, np.uint8), cv2.IMREAD_UNCHANGED
    )
    assert unseen is not None
    assert unseen[36, 36].tolist() == [0, 0, 0, 0]
    problem(api.get(surveyed[0], "/rods/none/picture.png"), 404, "missing")


def inventory(letters: str) -> str:
    words = {"E": "empty", "F": "full", "P": "partial", "?": "full"}
    lines = [f"FA-{i},R{i:04d},{words[x]},2026-01-31" for i, x in enumerate(letters)]
    return "item,position,state,date\n" + "\n".join(lines) + "\n"


def test_a_declared_inventory_is_reconciled_line_by_line(api: Api, surveyed: list[str]) -> None:
    path = f"/api/ponds/{pond_of(api, surveyed[0])}/inventories"
    kept = post_csv(api, path, inventory("EEEEFFFFPPF"), name="January.csv")

    told = api.get(surveyed[0], "/reconcile").json()

    assert (kept.status_code, kept.json()["lines"], kept.json()["name"]) == (201, 11, "January.csv")
    assert told["counts"] == {"agree": 10, "disagree": 1, "not_observed": 0, "ambiguous": 0}
    assert told["total"] == 11
    (line,) = [line for line in told["lines"] if line["outcome"] == "disagree"]
    assert (line["position"], line["declared"], line["observed"]["state"]) == ("R0010", "full", "partial")
    assert [u["position"] for u in told["undeclared"]] == ["R0011"]
    assert told["same_pond"]
    third = api.get(surveyed[2], "/reconcile", inventory=kept.json()["id"]).json()["counts"]
    assert third == {"agree": 7, "disagree": 3, "not_observed": 1, "ambiguous": 0}
    rows = list(csv.DictReader(io.StringIO(api.get(surveyed[2], "/reconcile", format="csv").text)))
    assert len(rows) == 11
    assert [row["outcome"] for row in rows].count("disagree") == 3


FAULTY = {
    "an unknown position": (inventory("EE") + "X,R9999,full,2026-01-31\n", "4"),
    "an unknown state": (inventory("EE") + "X,R0005,brim,2026-01-31\n", "4"),
    "a date that is none": (inventory("EE") + "X,R0005,full,soon\n", "4"),
    "an item twice": (inventory("EE") + "FA-0,R0005,full,2026-01-31\n", "4"),
    "a position twice": (inventory("EE") + "X,R0001,full,2026-01-31\n", "4"),
    "no such column": ("item,place\nX,R0005\n", "1"),
    "not text": (b"\xff\xfe\x00", "1"),
}


@pytest.mark.parametrize("kind", FAULTY)
def test_of_a_faulty_inventory_nothing_is_kept(api: Api, surveyed: list[str], kind: str) -> None:
    path = f"/api/ponds/{pond_of(api, surveyed[0])}/inventories"
    before = api.http.get(path).json()

    error = problem(post_csv(api, path, FAULTY[kind][0]), 422, "invalid-inventory")

    assert error["lines"] == FAULTY[kind][1]
    assert "Nothing was imported" in error["detail"]
    assert api.http.get(path).json() == before


def test_without_an_inventory_there_is_nothing_to_reconcile(api: Api) -> None:
    session = finished(api.store, lattice("hex", 0.05, 3, 3), "E" * 9, 4_000_000)

    problem(api.get(session, "/reconcile"), 404, "missing")
    problem(api.get(session, "/reconcile", inventory="none"), 404, "missing")


def test_600_lines_are_imported_and_reconciled_and_add_up(api: Api) -> None:
    pond = lattice("hex", 0.05, columns=30, rows=20)
    letters = "".join(np.random.default_rng(6).choice(list("EPF?"), 600))
    session = finished(api.store, pond, letters, 5_000_000, scale_m=0.005)

    started = time.perf_counter()
    answer = post_csv(api, f"/api/ponds/{pond_of(api, session)}/inventories", inventory(letters))
    told = api.get(session, "/reconcile").json()

    print(f"{time.perf_counter() - started:.2f} s")
    assert answer.status_code == 201, answer.text
    assert told["total"] == 600 == sum(told["counts"].values())
    assert told["counts"]["not_observed"] == letters.count("?")
    assert told["counts"]["disagree"] == 0


def test_two_methods_of_one_session_are_held_against_each_other(api: Api) -> None:
    session = api.open()
    for i in range(5):
        api.send(session, Shot(i))
    api.finish(session)
    api.http.post(f"/api/sessions/{session}/corrections", json={"method": "graph"})
    api.until(session, lambda v: [c["state"] for c in v["corrections"]] == ["done"])

    told = api.get(session, "/corrections/verdicts", **{"with": "graph"}).json()

    assert (told["base"]["method"], told["with"]["method"]) == ("identity", "graph")
    assert told["same"] + len(told["rods"]) == 6
    assert sum(told["base"]["counts"].values()) == 6
    problem(api.get(session, "/corrections/verdicts", **{"with": "lattice"}), 404, "missing")
