"""Findings of a session over REST: as they were stored with its last correction."""

from __future__ import annotations

import csv

import cv2
import numpy as np
import pytest

from pondwatch.core.findings import Condition, Finding, Kind
from pondwatch.core.layouts import lattice
from pondwatch.core.offsets import Offsets
from pondwatch.jobs.dossiertables import findings
from pondwatch.jobs.findingviews import document
from pondwatch.jobs.sealing import records
from pondwatch.store import conditions
from pondwatch.store.store import Store
from tests.api.conftest import Api
from tests.fakes.inspections import finished

POND = lattice("square", 0.05, columns=4, rows=3, outer_m=0.018, inner_m=0.0125)  # a pond that no other test has
OBJECT = Finding(Kind.FOREIGN_OBJECT, 0.076, 0.11, 0.006, 0.9, 40.0, 8, 8, "R0001")
DISPLACED = Finding(
    Kind.ROD_DISPLACED, 0.1512, 0.1, 0.036, 0.999, 30.0, 6, 6, "R0006", (0.0012, 0.0), 0.00013
)  # fmt: skip


@pytest.fixture(scope="module")
def session(api: Api) -> str:
    """A finished inspection with an object on the floor and a rod off its place; one rod was not measured."""
    assert api.store is not None
    made = finished(api.store, POND, "EFEF" * 3, 5_000)
    offsets = np.zeros((12, 2))
    offsets[6], offsets[11] = (0.0012, 0.0), np.nan
    told = Condition((OBJECT, DISPLACED), Offsets(offsets, np.full(12, 2e-5), np.full(12, 6.0)), 0.75)
    api.store.write(lambda c: conditions.write(c, made, 1, document(told, POND)))
    return made


def test_findings_are_told_with_place_size_and_confidence(api: Api, session: str) -> None:
    told = api.get(session, "/findings").json()

    assert (told["looked"], told["examined"], len(told["positions"])) == (True, 0.75, 11)
    thing, rod = told["findings"]
    assert (thing["kind"], thing["x_m"], thing["y_m"], thing["size_mm"]) == ("foreign-object", 0.076, 0.11, 6.0)
    assert (thing["confidence"], thing["looks"], thing["agreeing"], thing["offset_x_mm"]) == (0.9, 8, 8, None)
    assert (rod["rod_id"], rod["offset_x_mm"], rod["offset_y_mm"], rod["sigma_mm"]) == ("R0006", 1.2, 0.0, 0.13)


def test_findings_are_a_table_too(api: Api, session: str) -> None:
    answer = api.get(session, "/findings", format="csv")

    rows = list(csv.DictReader(answer.text.splitlines()))
    assert answer.headers["content-type"].startswith("text/csv")
    assert [(row["number"], row["kind"], row["offset_x_mm"]) for row in rows] == [
        ("1", "foreign-object", ""), ("2", "rod-displaced", "1.2"),
    ]  # fmt: skip


def test_a_finding_has_a_picture_with_its_place_in_the_middle(api: Api, session: str) -> None:
    content = api.get(session, "/findings/1/picture.png").content
    whole = cv2.imdecode(np.frombuffer(api.get(session, "/mosaic.png").content, np.uint8), cv2.IMREAD_UNCHANGED)

    image = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED)

    half = image.shape[0] // 2
    row, column = round((POND.height_m - 0.11) * 1000 - 0.5), round(0.076 * 1000 - 0.5)
    np.testing.assert_array_equal(image[half, half], whole[row, column])
    assert api.get(session, "/findings/3/picture.png").status_code == 404


def test_before_the_end_nothing_was_looked_at(api: Api) -> None:
    told = api.get(api.open(), "/findings").json()

    assert (told["looked"], told["findings"]) == (False, [])
    assert api.get("nothing", "/findings").status_code == 404


def test_a_report_tells_findings_with_pictures_and_marks_them(api: Api, session: str) -> None:
    store = api.store
    assert isinstance(store, Store)

    table = findings(store, session)

    assert (table.headline, dict(table.marks)) == ("2", {"R0006": "O"})
    assert [text for _, _, text in table.places] == ["1", "2"]
    assert table.rows[1][5] == "+1.20, +0.00 ± 0.13"
    assert len(table.pictures) == 2
    assert "1 foreign object, 0 stains, 1 rod displaced" in table.note


def test_findings_are_sealed_with_the_session(api: Api, session: str) -> None:
    assert api.store is not None

    bodies = [body for body, _ in api.store.read(lambda c: list(records(c, session)))]

    assert [(b["what"], b["number"]) for b in bodies if b["kind"] == "finding"] == [
        ("foreign-object", 1), ("rod-displaced", 2),
    ]  # fmt: skip
