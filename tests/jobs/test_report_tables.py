"""What a report tells beside the session: discrepancies with what was declared, changes since the baseline."""

from __future__ import annotations

import csv
import io
import json
import zipfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from pondwatch.core.inventory import parse_inventory
from pondwatch.core.layouts import lattice
from pondwatch.jobs.dossiertables import changes, discrepancies
from pondwatch.jobs.forms import write_form
from pondwatch.store import alarms, inventories, sessions
from pondwatch.store.store import Store
from tests.fakes.inspections import finished

POND = lattice("square", 0.05, columns=4, rows=3, outer_m=0.018, inner_m=0.012)
BEFORE = "EEEEFFFFPPP?"
NOW = "EEFEFFFFPPPF"
DECLARED = "EEEEFFFFPPEE"
STATES = {"E": "empty", "P": "partial", "F": "full"}


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with Store(tmp_path, f"sqlite:///{tmp_path}/t.sqlite") as opened:
        yield opened


def declare(store: Store, session: str) -> None:
    rows = [
        f"FA-{n},{rod.id},{STATES[x]},2026-01-31" for n, (rod, x) in enumerate(zip(POND.rods, DECLARED, strict=True))
    ]
    lines = parse_inventory("\n".join(["item,position,state,date", *rows]).encode(), {rod.id for rod in POND.rods})
    pond_id = str(store.read(lambda c: sessions.get(c, session)).pond_id)
    store.write(lambda c: inventories.add(c, pond_id, "declared.csv", "ab" * 32, 1, lines, 20_000))


def test_lines_that_the_observation_contradicts_are_discrepancies(store: Store) -> None:
    session = finished(store, POND, NOW, 9_000)
    declare(store, session)

    table = discrepancies(store, session)

    assert [(row[2], row[3], row[4]) for row in table.rows] == [
        ("R0002", "empty", "full"), ("R0010", "empty", "partly filled"), ("R0011", "empty", "full"),
    ]  # fmt: skip
    assert table.headline == "3 of 12 lines"
    assert set(table.marks) == {"R0002", "R0010", "R0011"}
    assert "9 agree, 3 disagree, 0 were not observed, 0 are ambiguous" in table.note.replace("\n", " ")


def test_changes_are_told_against_the_inspection_before_or_the_one_that_was_chosen(store: Store) -> None:
    first = finished(store, POND, "F" * 12, 1_000, name="First")
    finished(store, POND, BEFORE, 5_000, name="Before")
    now = finished(store, POND, NOW, 9_000)

    table = changes(store, now)
    store.write(lambda c: alarms.set_baseline(c, now, first, 10_000))
    chosen = changes(store, now)

    assert [row[:5] for row in table.rows] == [("R0002", "filled", "added", "empty, 0 %", "full, 100 %")]
    assert (table.headline, dict(table.marks)) == ("1 of 11 rods", {"R0002": "C"})
    assert "Held against Before" in table.note
    assert "Held against First" in chosen.note
    assert chosen.headline == "6 of 12 rods"  # three empty, three partly filled, of twelve that were full


def test_without_a_baseline_or_an_inventory_the_tables_say_so(store: Store) -> None:
    session = finished(store, POND, NOW, 9_000)

    assert (changes(store, session).headline, discrepancies(store, session).headline) == ("no baseline", "no inventory")


def test_tables_and_document_carry_discrepancies_and_changes(store: Store) -> None:
    finished(store, POND, BEFORE, 1_000)
    session = finished(store, POND, NOW, 9_000)
    declare(store, session)
    tables, document = io.BytesIO(), io.BytesIO()

    write_form(store, session, "csv", tables, 30_000)
    write_form(store, session, "json", document, 30_000)

    with zipfile.ZipFile(tables) as archive:
        rows = list(csv.DictReader(archive.read("discrepancies.csv").decode().splitlines()))
        changed = list(csv.DictReader(archive.read("changes.csv").decode().splitlines()))
    assert [row["position"] for row in rows] == ["R0002", "R0010", "R0011"]
    assert [row["rod"] for row in changed] == ["R0002"]
    told = {table["title"]: table for table in json.loads(document.getvalue())["tables"]}
    assert told["Changes"]["rows"][0][0] == "R0002"
    assert told["Discrepancies"]["headline"] == "3 of 12 lines"
