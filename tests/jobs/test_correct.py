"""A finished session corrected again by another method: both results are kept, and neither disturbs the other."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pondwatch.core.errors import Conflict, Missing
from pondwatch.core.identity import IdentityCorrector
from pondwatch.core.values import Correction, Inspection, RodReading, RodState
from pondwatch.jobs import correct, held
from pondwatch.jobs.lanes import WorkerLost
from pondwatch.store import corrections, sessions
from tests.fakes.house import House
from tests.fakes.robot import Shot

MOVED_M = 0.003


class Mover(IdentityCorrector):
    """Moves all to the right when it settles, and reads one rod."""

    def settle(self) -> Correction:
        for pose in self._poses.values():
            assert pose.pose_pond is not None
            pose.pose_pond[0] += MOVED_M  # its own copy, from the decoded snapshot
        return super().settle()

    def rods(self) -> tuple[RodReading, ...]:
        first, *others = super().rods()
        return RodReading(first.rod_id, RodState.FULL, 1.0, 0.9, 2), *others


def made(inspection: Inspection, method: str, *_: object) -> IdentityCorrector:
    return IdentityCorrector(inspection) if method == "identity" else Mover(inspection)


@pytest.fixture
def house(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[House]:
    monkeypatch.setattr(held, "make_corrector", made)
    built = House(tmp_path)
    yield built
    built.store.close()


def ask(house: House, method: str = "mover") -> str:
    return correct.begin(house.store, house.session, method, 3_000).state


def found(house: House, method: str = "mover") -> corrections.Correction:
    return house.store.read(lambda c: corrections.get(c, house.session, method))


def rows(house: House, method: str = "mover") -> list[dict[str, Any]]:
    correction = found(house, method)
    return house.store.read(lambda c: corrections.pose_rows(c, correction))


def test_both_results_are_kept(house: House) -> None:
    house.send(*(Shot(i) for i in range(4)))
    house.finish()
    before, revision = house.result(), house.found().revision

    assert ask(house) == "queued"
    house.drain()

    assert (found(house).state, house.job("correct")["state"]) == ("done", "done")
    by_mover = rows(house)
    assert [row["sequence"] for row in by_mover] == [0, 1, 2, 3]
    np.testing.assert_allclose([r["x_m"] - r["raw_x_m"] for r in by_mover], [MOVED_M] * 4, atol=1e-12)
    readings = house.store.read(lambda c: corrections.rod_rows(c, found(house)))
    assert [(r["rod_id"], r["state"], r["views"]) for r in readings] == [("R0", "full", 2)]
    assert (house.result(), house.found().revision, house.found().state) == (before, revision, "finished")


def test_asking_again_is_as_good_as_once(house: House) -> None:
    house.finish()
    ask(house)
    house.drain()
    calls = house.lane.calls.count("settle")

    assert ask(house) == "done"
    house.drain()

    assert house.lane.calls.count("settle") == calls


def test_several_methods_are_made_one_after_the_other(house: House) -> None:
    house.send(Shot(0))
    house.finish()
    ask(house, "mover")
    ask(house, "shaker")

    house.drain()

    assert [len(rows(house, method)) for method in ("mover", "shaker")] == [1, 1]
    assert house.job("correct")["progress"] == 1.0


def test_only_a_finished_session_is_corrected_again_and_not_by_its_own_method(house: House) -> None:
    with pytest.raises(correct.NotFinished):
        ask(house)
    house.finish()
    with pytest.raises(correct.SameMethod):
        ask(house, "identity")
    with pytest.raises(Missing):
        found(house)
    assert issubclass(correct.NotFinished, Conflict)


def test_a_correction_that_was_cut_off_is_made_after_the_next_start(house: House) -> None:
    house.finish()
    ask(house)
    house.store.write(lambda c: corrections.mark(c, found(house).id, state="running"))

    assert house.store.read(sessions.unfinished) == [house.session]
    house.drain()

    assert house.store.read(sessions.unfinished) == []


def test_a_correction_that_fails_says_so_leaves_the_session_alone_and_may_be_asked_for_again(house: House) -> None:
    def fault(method: str, args: tuple[Any, ...]) -> None:
        if method == "settle" and args[0].method == "mover":
            raise WorkerLost("The worker process was lost.")

    house.send(Shot(0))
    house.finish()
    house.lane.fault = fault
    ask(house, "mover")
    ask(house, "shaker")

    house.drain()

    assert (found(house).state, found(house).error) == ("failed", "The worker process was lost.")
    assert (house.found().state, found(house, "shaker").state) == ("finished", "done")
    house.lane.fault = None
    assert ask(house) == "queued"
    house.drain()
    assert (found(house).state, found(house).error, len(rows(house))) == ("done", None, 1)


def test_a_snapshot_whose_picture_is_damaged_is_rejected_there_too(house: House) -> None:
    house.send(Shot(0), Shot(1))
    house.finish()
    house.store.blobs.path(Shot(1).digest).write_bytes(b"")
    ask(house)

    house.drain()

    assert [(r["sequence"], r["status"], r["x_m"] is None) for r in rows(house)] == [
        (0, "placed", False),
        (1, "rejected", True),
    ]
