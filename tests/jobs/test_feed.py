"""What viewers are told: wherever they come from, they end with the mosaic that is stored."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from pondwatch.core.errors import Missing
from pondwatch.jobs import tiles
from pondwatch.jobs.feed import Feed, News
from tests.fakes.house import House
from tests.fakes.robot import Shot


@pytest.fixture
def house(tmp_path: Path) -> Iterator[House]:
    made = House(tmp_path)
    yield made
    made.store.close()


def paint(canvas: np.ndarray[Any, Any], news: News) -> None:
    for picture in news.pictures:
        image = cv2.imdecode(np.frombuffer(picture.content, np.uint8), cv2.IMREAD_UNCHANGED)
        assert image is not None
        r = picture.rect
        assert image.shape[:2] == (r.height, r.width)
        canvas[r.y : r.y + r.height, r.x : r.x + r.width] = image


@pytest.mark.parametrize("most_bytes", [0, 8_000, 1 << 20], ids=["tiles", "some", "patches"])
def test_a_viewer_that_is_told_what_changed_ends_with_the_whole_mosaic(house: House, most_bytes: int) -> None:
    feed = Feed(house.store, 1000, most_bytes)
    canvas, since = np.zeros((120, 200, 4), np.uint8), None
    for i in range(8):
        house.send(Shot(i))
        house.drain()
        feed.remember(house.session, house.heard.steps[-1])
        if i % 3 == 0:
            news = feed.news(house.session, since)
            assert (news.revision, news.full) == (i + 1, since is None)
            assert len(news.poses) == (i + 1 if since is None else i + 1 - since)
            paint(canvas, news)
            since = news.revision
    paint(canvas, feed.news(house.session, since))

    np.testing.assert_array_equal(canvas, tiles.whole(house.store, house.session)[1])


def test_a_viewer_from_a_future_that_never_came_is_told_everything(house: House) -> None:
    feed = Feed(house.store, 10, 1000)
    house.send(Shot(0))
    house.drain()

    news = feed.news(house.session, 99)

    assert (news.full, len(news.poses)) == (True, 1)
    assert feed.news(house.session, 1).pictures == []
    with pytest.raises(Missing):
        feed.news("nosuch", None)
