"""The uploader against a server in memory that loses, refuses and forgets; time and chance are given."""

from __future__ import annotations

import hashlib
import json
import random
import re

import httpx
import pytest

from pondwatch.basestation.uploader import BATCH_ITEMS, Patience, Refused, Uploader, item_of
from pondwatch.core.errors import Unavailable
from pondwatch.core.values import SnapshotKey

BOUNDARY = re.compile(rb"boundary=(.+)$")
NAME = re.compile(rb'name="([^"]*)"')


def parts(request):
    """The parts of a multipart body, by name; written down from RFC 7578, not from the uploader."""
    boundary = BOUNDARY.search(request.headers["content-type"].encode()).group(1)
    found = {}
    for part in request.content.split(b"--" + boundary)[1:-1]:
        head, _, body = part.partition(b"\r\n\r\n")
        found[NAME.search(head).group(1).decode()] = body[:-2]
    return found


class Pond:
    """A server: keeps snapshots by key, checks digests, and first answers whatever `script` holds."""

    def __init__(self, script=(), finished=False, batch_limit=1000):
        self.script, self.finished, self.batch_limit = list(script), finished, batch_limit
        self.kept, self.requests, self.finishes = {}, [], 0

    def __call__(self, request):
        self.requests.append(request.url.path)
        if self.script:
            first = self.script.pop(0)
            if isinstance(first, Exception):
                raise first
            if first is not None:
                return first
        path = request.url.path
        if path == "/api/sessions":
            return httpx.Response(201, json={"id": "s1"})
        if not path.startswith("/api/sessions/s1"):
            return httpx.Response(404, json={"detail": "There is no such session."})
        if path.endswith("/finish"):
            self.finishes += 1
            return httpx.Response(202, json={"state": "finishing"} if self.finishes < 3 else {"state": "finished"})
        sent = parts(request)
        if path.endswith("/batch"):
            poses = json.loads(sent["poses"])
            if len(poses) > self.batch_limit:
                return httpx.Response(413, json={"detail": "too large"})
            results = [self.take(pose, sent[pose["image"]]) for pose in poses]
            return httpx.Response(200, json={"results": results})
        result = self.take(json.loads(sent["pose"]), sent["image"])
        return httpx.Response(result["status"], json=result)

    def take(self, pose, image):
        key = pose["robot"], pose["boot"], pose["sequence"]
        if self.finished:
            return {"status": 409, "type": "https://p/problems/session-finished", "detail": "The session is finished."}
        if pose["digest"] != "sha256:" + hashlib.sha256(image).hexdigest():
            return {"status": 422, "type": "https://p/problems/digest-mismatch", "detail": "damaged"}
        if self.kept.get(key, image) != image:
            return {"status": 409, "type": "https://p/problems/snapshot-conflict", "detail": "other content"}
        status = 200 if key in self.kept else 201
        self.kept[key] = image
        return {"status": status}


class World:
    """Time that passes only by sleeping."""

    def __init__(self):
        self.now, self.slept = 0.0, []

    def clock(self):
        return self.now

    def sleep(self, seconds):
        self.slept.append(seconds)
        self.now += seconds


def item(n, content=None):
    picture = f"picture {n}".encode() if content is None else content
    return item_of(SnapshotKey("bubble-1", 0, n), "2026-01-01T08:00:00.000Z", (0.1, 0.2, 0.3), picture, ".png")


def uploader_of(pond, world, **patience):
    client = httpx.Client(base_url="http://pond", transport=httpx.MockTransport(pond))
    kind = Patience(**patience)
    return Uploader(client, kind, clock=world.clock, sleep=world.sleep, rng=random.Random(1))


def test_everything_arrives_once_with_its_pose_and_digest():
    pond = Pond()
    uploader = uploader_of(pond, World())

    outcomes = list(uploader.upload(uploader.open_session({}), (item(n) for n in range(100))))

    assert [o.key.sequence for o in outcomes] == list(range(100))
    assert {o.status for o in outcomes} == {201}
    assert pond.kept == {("bubble-1", 0, n): f"picture {n}".encode() for n in range(100)}
    assert len(pond.requests) == 1 + -(-100 // BATCH_ITEMS)


def test_sending_all_again_doubles_nothing():
    pond = Pond()
    uploader = uploader_of(pond, World())
    list(uploader.upload("s1", map(item, range(40))))

    again = list(uploader.upload("s1", map(item, range(50))))

    assert [o.status for o in again] == [200] * 40 + [201] * 10
    assert len(pond.kept) == 50


@pytest.mark.parametrize(
    "failure",
    [
        httpx.ConnectError("refused"),
        httpx.ReadTimeout("late"),
        httpx.RemoteProtocolError("cut"),
        httpx.Response(500),
        httpx.Response(503, json={"detail": "starting"}),
        httpx.Response(507, json={"detail": "full"}),
        httpx.Response(429),
    ],
)
def test_what_may_pass_is_tried_again(failure):
    pond, world = Pond([failure, failure, failure]), World()

    outcome = uploader_of(pond, world).send("s1", item(1))

    assert outcome.status == 201
    assert len(pond.requests) == 4
    assert len(world.slept) == 3


def test_waits_are_random_double_and_stay_below_their_bound():
    world = World()
    uploader = uploader_of(Pond([httpx.Response(503)] * 12), world, first_s=0.5, most_s=4.0)

    uploader.send("s1", item(1))

    bounds = [min(0.5 * 2**n, 4.0) for n in range(12)]
    assert all(0 <= wait <= bound for wait, bound in zip(world.slept, bounds, strict=True))
    assert len(set(world.slept)) == 12
    assert max(world.slept) > 2.0


def test_a_wait_that_the_server_asks_for_is_kept():
    world = World()

    uploader_of(Pond([httpx.Response(429, headers={"Retry-After": "7"})]), world).send("s1", item(1))

    assert world.slept == [7.0]


def test_it_gives_up_in_the_end_and_says_why():
    world = World()
    uploader = uploader_of(Pond([httpx.ConnectError("nobody is there")] * 500), world, give_up_s=60.0)

    with pytest.raises(Unavailable, match="gave up after 60 s: nobody is there"):
        uploader.send("s1", item(1))

    assert world.now <= 60.0


def test_a_refused_snapshot_does_not_stop_the_others():
    pond = Pond()
    pond.kept["bubble-1", 0, 2] = b"something else"

    outcomes = list(uploader_of(pond, World()).upload("s1", map(item, range(5))))

    assert [o.status for o in outcomes] == [201, 201, 409, 201, 201]
    assert outcomes[2].detail == "other content"
    assert not outcomes[2].stored


def test_an_item_of_a_batch_that_may_pass_is_sent_again_alone():
    results = {"results": [{"status": 201}, {"status": 507, "detail": "full"}, {"status": 201}]}
    pond = Pond([httpx.Response(200, json=results)])

    outcomes = list(uploader_of(pond, World()).upload("s1", map(item, range(3))))

    assert [o.status for o in outcomes] == [201, 201, 201]
    assert list(pond.kept) == [("bubble-1", 0, 1)]


def test_a_batch_that_is_too_large_is_halved():
    pond = Pond(batch_limit=5)

    outcomes = list(uploader_of(pond, World()).upload("s1", map(item, range(32))))

    assert [o.key.sequence for o in outcomes] == list(range(32))
    assert len(pond.kept) == 32


@pytest.mark.parametrize("session", ["s1", "s2"])
@pytest.mark.parametrize("count", [1, 3])
def test_a_session_that_takes_nothing_ends_the_upload(session, count):
    uploader = uploader_of(Pond(finished=True), World())

    with pytest.raises(Refused):
        list(uploader.upload(session, map(item, range(count))))


def test_a_rate_is_kept_one_by_one_while_the_server_keeps_up():
    pond, world = Pond(), World()

    list(uploader_of(pond, world).upload("s1", map(item, range(41)), rate=20))

    assert world.now == pytest.approx(2.0, abs=0.051)  # it looks once more for a next one
    assert len(pond.requests) == 41


def test_what_fell_behind_its_rate_goes_in_batches():
    pond, world = Pond(), World()
    slow = (world.sleep(1.0) or item(n) if n == 0 else item(n) for n in range(40))

    list(uploader_of(pond, world).upload("s1", slow, rate=20))

    assert len(pond.requests) < 25
    assert world.now == pytest.approx(39 / 20, abs=0.06)
    assert len(pond.kept) == 40


def test_finishing_waits_for_the_last_correction():
    pond = Pond()

    assert uploader_of(pond, World()).finish("s1")["state"] == "finished"
    assert pond.finishes == 3
