"""Sending many snapshots at once."""

from __future__ import annotations

import json
import math
from typing import Any

import httpx

from tests.fakes.robot import Shot

from .conftest import Api
from .test_upload import problem, stored


def batch(api: Api, session: str, items: list[dict[str, Any]], pictures: dict[str, bytes]) -> httpx.Response:
    files: list[Any] = [("poses", (None, json.dumps(items), "application/json"))]
    files += [(name, ("picture.png", content, "image/png")) for name, content in pictures.items()]
    return api.http.post(f"/api/sessions/{session}/snapshots/batch", files=files)


def test_a_batch_answers_each_item_in_order_and_one_bad_item_fails_no_other(api: Api) -> None:
    session = api.open()
    api.send(session, Shot(1))
    shots = [Shot(0), Shot(1), Shot(2).but(x_m=math.nan), Shot(3), Shot(4, image=b"nothing"), Shot(5)]
    items = [{**shot.pose(), "image": f"part{i}"} for i, shot in enumerate(shots)]

    answer = batch(api, session, items, {f"part{i}": s.content for i, s in enumerate(shots) if i != 3})

    assert answer.status_code == 200
    results = answer.json()["results"]
    assert [r["status"] for r in results] == [201, 200, 422, 422, 422, 201]
    assert results[1] == {"status": 200, **api.send(session, Shot(1)).json()}
    assert [r["type"].rpartition("/")[2] for r in results[2:5]] == ["invalid-pose", "invalid-request", "invalid-image"]
    assert stored(api, session) == 3


def test_the_same_key_twice_in_a_batch_is_stored_once(api: Api) -> None:
    session = api.open()
    items = [
        {**Shot(1).pose(), "image": "a"},
        {**Shot(1).pose(), "image": "a"},
        {**Shot(1).pose(), "x_m": 0.1, "image": "a"},
    ]

    statuses = sorted(r["status"] for r in batch(api, session, items, {"a": Shot(1).content}).json()["results"])

    assert statuses in ([200, 201, 409], [201, 409, 409])  # which of the two contents came first is a race
    assert stored(api, session) == 1


def test_a_batch_that_is_no_list_or_too_long_is_refused(api: Api) -> None:
    session = api.open()
    item = {**Shot(1).pose(), "image": "a"}

    too_many = batch(api, session, [item] * 9, {"a": Shot(1).content})
    no_list = api.http.post(f"/api/sessions/{session}/snapshots/batch", files={"poses": (None, "{}")})

    assert problem(too_many, 422, "invalid-request")["field"] == "poses"
    assert "array" in problem(no_list, 422, "invalid-request")["detail"]
    assert stored(api, session) == 0
