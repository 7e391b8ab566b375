"""Tiles are drawn a little later than the revisions that change them, once for many, and nobody is shown less by it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from pondwatch.jobs import tiles
from pondwatch.jobs.drawing import AFTER_S, QUIET_S
from pondwatch.jobs.feed import Feed, News
from pondwatch.jobs.lanes import WorkerLost
from pondwatch.jobs.steps import BUSY_PATIENCE
from pondwatch.store import behind, sessions
from tests.fakes.house import House
from tests.fakes.robot import Shot

Canvas = np.ndarray[Any, Any]


@pytest.fixture
def house(tmp_path: Path) -> Iterator[House]:
    made = House(tmp_path)
    yield made
    made.store.close()


def take_in(house: House, *shots: Shot) -> None:
    """Each a revision of its own, while the clock stands still."""
    for shot in shots:
        house.send(shot)
        house.take()


def lacking(house: House) -> set[tuple[int, int]]:
    """Since and until which revision tiles are behind."""
    return {(t.since, t.until) for t in house.store.read(lambda c: behind.of(c, house.session))}


def painted(canvas: Canvas, news: News) -> Canvas:
    for picture in news.pictures:
        image = cv2.imdecode(np.frombuffer(picture.content, np.uint8), cv2.IMREAD_UNCHANGED)
        assert image is not None
        r = picture.rect
        part = canvas[r.y : r.y + r.height, r.x : r.x + r.width]
        part[..., : image.shape[2]] = image
        part[..., 3] = image[..., 3] if image.shape[2] == 4 else 255
    return canvas


def blank() -> Canvas:
    return np.zeros((120, 200, 4), np.uint8)


def whole(house: House) -> Canvas:
    return tiles.whole(house.store, house.session)[1]


def test_a_tile_that_three_revisions_touch_is_drawn_once(house: House) -> None:
    take_in(house, Shot(0), Shot(1), Shot(2))
    assert lacking(house) == {(1, 3)}
    assert whole(house)[..., 3].max() == 0

    house.drain()

    assert house.lane.calls.count("draw") == 1
    assert lacking(house) == set()
    assert whole(house)[..., 3].max() == 255
    assert house.found().revision == 3  # drawing is no revision


@pytest.mark.parametrize(("after_s", "drawn"), [(QUIET_S - 0.01, False), (QUIET_S, True)])
def test_tiles_are_drawn_when_no_revision_came_for_a_while(house: House, after_s: float, drawn: bool) -> None:
    take_in(house, Shot(0))

    house.time_s = after_s
    house.take()

    assert (lacking(house) == set()) is drawn


def test_tiles_are_drawn_in_time_though_revisions_never_stop(house: House) -> None:
    drawn_at = []
    for tenth in range(0, 40, 2):  # a snapshot waits at every step, five times a second
        house.time_s = tenth / 10
        before = house.lane.calls.count("draw")
        take_in(house, Shot(tenth))
        drawn_at += [tenth] * (house.lane.calls.count("draw") - before)

    assert drawn_at == [10 * AFTER_S * BUSY_PATIENCE]


def test_once_a_session_has_ended_nothing_of_it_is_waited_for(house: House) -> None:
    take_in(house, Shot(0))
    assert house.steps.waits(house.session)

    house.finish()

    assert lacking(house) == set()
    assert not house.steps.waits(house.session)


def test_what_was_behind_when_the_server_ended_is_drawn_by_the_next(house: House, tmp_path: Path) -> None:
    take_in(house, Shot(0), Shot(1))
    house.restart()
    assert house.store.read(sessions.unfinished) == [house.session]

    house.take()

    assert lacking(house) == set()
    assert house.store.read(sessions.unfinished) == []
    calm = House(tmp_path / "calm")
    calm.send(Shot(0), Shot(1))
    calm.drain()
    np.testing.assert_array_equal(whole(house), whole(calm))
    calm.store.close()


def test_a_viewer_that_comes_while_tiles_are_behind_is_shown_the_newest_all_the_same(house: House) -> None:
    feed = Feed(house.store, 100, 1 << 20)
    take_in(house, Shot(0))
    house.drain()
    take_in(house, Shot(1), Shot(2))
    for step in house.heard.steps:
        feed.remember(house.session, step)

    news = feed.news(house.session, None)

    assert (news.full, news.revision) == (True, 3)
    canvas = painted(blank(), news)
    house.drain()
    np.testing.assert_array_equal(canvas, whole(house))


def test_a_viewer_whose_patches_are_forgotten_is_told_an_earlier_revision_until_they_are_drawn(
    house: House,
) -> None:
    take_in(house, Shot(0))
    house.drain()
    take_in(house, Shot(1), Shot(2))
    house.restart()
    feed = Feed(house.store, 100, 1 << 20)

    first = feed.news(house.session, None)
    assert (first.revision, len(first.poses)) == (1, 3)  # poses may be newer
    house.drain()
    then = feed.news(house.session, first.revision)

    assert (then.full, then.revision) == (False, 3)
    np.testing.assert_array_equal(painted(painted(blank(), first), then), whole(house))


def test_a_viewer_that_holds_more_than_is_drawn_loses_nothing_of_it(house: House) -> None:
    take_in(house, Shot(0), Shot(1))
    house.restart()

    news = Feed(house.store, 100, 1 << 20).news(house.session, 2)

    assert (news.full, news.revision, news.pictures) == (False, 2, [])


def test_a_tile_says_which_revision_it_shows(house: House) -> None:
    take_in(house, Shot(0))
    house.drain()
    take_in(house, Shot(1), Shot(2))
    assert tiles.tile(house.store, house.session, "mosaic", 0, 0, 0)[1] == 1

    house.drain()

    assert tiles.tile(house.store, house.session, "mosaic", 0, 0, 0)[1] == 3


def test_finishing_draws_what_is_behind(house: House) -> None:
    take_in(house, Shot(0), Shot(1))

    house.finish()

    assert lacking(house) == set()
    assert whole(house)[..., 3].max() == 255


def test_tiles_that_cannot_be_drawn_wait_and_stop_no_snapshot(house: House) -> None:
    take_in(house, Shot(0))

    def lost(method: str, _: Any) -> None:
        if method == "draw":
            raise WorkerLost("The worker was lost.")

    house.lane.fault = lost
    house.drain()
    take_in(house, Shot(1))
    assert (house.facts().placed, house.found().revision) == (2, 2)
    assert lacking(house) == {(1, 2)}

    house.lane.fault = None
    house.drain()
    assert lacking(house) == set()


def test_who_asks_for_the_mosaic_need_not_wait_for_the_clock(house: House) -> None:
    take_in(house, Shot(0))

    house.steps.hurry(house.session)
    house.take()

    assert lacking(house) == set()
