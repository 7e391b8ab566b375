"""Readings that are put off: none waits for ever, and nothing of the order is left in what they say."""

from __future__ import annotations

import numpy as np

from pondwatch.core import states
from pondwatch.core.codes import SECTORS, Palette
from pondwatch.core.rodbook import Entry, RodBook
from pondwatch.core.values import RodState, SnapshotKey

IDS = tuple(f"R{n}" for n in range(9))
PALETTE = Palette(np.array([1.0, 0.0, 0.0]), 0.0, 1.0, 0.05, None, 9.0, taught=99)
PRIOR = np.full(states.COUNT, 1 / states.COUNT)


def a_book(*seen: int) -> RodBook:
    """One snapshot, which shows these rods full, read by nobody yet."""
    book = RodBook(IDS)
    book.read_by(PALETTE, PRIOR)
    book.enter(SnapshotKey("bubble-1", 0, 1), [an_entry(*seen)])
    return book


def an_entry(*rods: int) -> Entry:
    ratio = np.zeros((len(rods), SECTORS, 3))
    ratio[..., 0] = 1.0
    return Entry(np.array(rods, dtype=np.int64), ratio, 0.0, 0.999)


def full(book: RodBook) -> list[str]:
    return [r.rod_id for r in book.readings() if r.state is RodState.FULL]


def test_what_was_put_off_is_read_a_few_at_a_time_until_nothing_is_left() -> None:
    book = a_book(0, 1, 2, 3, 4)
    book.put_off()

    assert book.changed(0) == ()
    assert book.behind
    assert [r.rod_id for r in book.changed(2)] == ["R0", "R1"]
    assert [r.rod_id for r in book.changed(2)] == ["R2", "R3"]
    assert [r.rod_id for r in book.changed(2)] == ["R4"]
    assert not book.behind


def test_what_is_touched_after_it_is_read_at_once() -> None:
    book = a_book(0, 1, 2)
    book.put_off()
    book.enter(SnapshotKey("bubble-1", 0, 2), [an_entry(2, 7)])

    assert {r.rod_id for r in book.changed(0)} == {"R2", "R7"}
    assert {r.rod_id for r in book.changed()} == {"R0", "R1"}


def test_what_waits_longest_comes_first_however_often_more_is_put_off() -> None:
    book = a_book(6, 7, 8)
    book.put_off()
    for again in range(3):
        book.enter(SnapshotKey("bubble-2", 0, again), [an_entry(0, 1)])
        book.put_off()
        book.changed(1)

    assert full(book) == ["R6", "R7", "R8"]
    assert book.behind
