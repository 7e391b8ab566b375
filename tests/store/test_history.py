"""What rods read as before."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from pondwatch.core.values import RodReading, RodState
from pondwatch.store import history, revisions
from pondwatch.store.revisions import NewRevision
from tests.fakes.house import House


@pytest.fixture
def house(tmp_path: Path) -> Iterator[House]:
    made = House(tmp_path)
    yield made
    made.store.close()


def read(house: House, at_ms: int, *readings: RodReading) -> None:
    base = house.found().revision
    new = NewRevision(house.session, base, 0, at_ms, rods=readings)
    house.store.write(lambda c: revisions.write(c, new))


def rod(fill: float = 0.5, confidence: float = 0.9, views: int = 3, rod_id: str = "R1") -> RodReading:
    return RodReading(rod_id, RodState.PARTIAL, fill, confidence, views)


def kept(house: House, rod_id: str = "R1") -> list[tuple[Any, ...]]:
    rows = house.store.read(lambda c: history.of_rod(c, house.session, rod_id))
    return [(r["revision"], r["at_ms"], r["fill"]) for r in rows]


def test_every_reading_that_a_person_would_see_change_is_kept_in_order(house: House) -> None:
    read(house, 100, rod(), rod(rod_id="R2"))
    read(house, 200, rod(fill=0.51))
    read(house, 300, rod(fill=0.51, views=4))

    assert kept(house) == [(1, 100, 0.5), (2, 200, 0.51), (3, 300, 0.51)]
    assert kept(house, "R2") == [(1, 100, 0.5)]


def test_what_nobody_would_see_is_not_kept(house: House) -> None:
    read(house, 100, RodReading("R1", RodState.UNSEEN, None, 0.0, 0))
    assert kept(house) == []
    read(house, 200, rod())
    read(house, 300, rod(fill=0.5001, confidence=0.9001))

    assert kept(house) == [(2, 200, 0.5)]
    assert house.found().revision == 3
