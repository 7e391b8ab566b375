"""Send snapshots to a server over REST, through whatever the network does.

A snapshot is sent until the server has said that it is on disk (201, or 200 where it was there before) or that it
will never take it. Sending twice is harmless: robot, boot and sequence are its key. Lost connections, answers from 500
up (507: the disk is full) and 429 are tried again after a random wait that doubles (full jitter), or after what the
server asks for.
"""

from __future__ import annotations

import json
import random
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import islice
from typing import Any

import httpx

from pondwatch.core.errors import PondwatchError, Unavailable
from pondwatch.core.images import digest_of
from pondwatch.core.values import NO_REPORT, RobotReport, SnapshotKey

BATCH_ITEMS = 32
BATCH_BYTES = 16 << 20
_AGAIN = frozenset((408, 425, 429))
_MEDIA_TYPES = {".png": "image/png", ".jpg": "image/jpeg", ".jpeg": "image/jpeg", ".webp": "image/webp"}


class Refused(PondwatchError):
    """The server will not take it, and never will. facts: status."""


@dataclass(frozen=True, slots=True)
class Item:
    """A snapshot to send. pose: x m, y m, theta rad. digest: of the picture's bytes, made where it was made."""

    key: SnapshotKey
    captured_at: str
    pose: tuple[float, float, float]
    content: bytes
    suffix: str
    digest: str
    report: RobotReport = NO_REPORT

    def document(self) -> dict[str, Any]:
        """The part `pose` of an upload."""
        x, y, theta = self.pose
        return {
            "robot": self.key.robot,
            "boot": self.key.boot,
            "sequence": self.key.sequence,
            "captured_at": self.captured_at,
            "x_m": x,
            "y_m": y,
            "theta_rad": theta,
            "digest": self.digest,
            **{name: value for name, value in asdict(self.report).items() if value is not None},
        }

    def file(self) -> tuple[str, bytes, str]:
        """The picture as an HTTP client takes it: name, bytes, media type."""
        media_type = _MEDIA_TYPES.get(self.suffix.lower(), "application/octet-stream")
        return f"{self.key.sequence:06d}{self.suffix}", self.content, media_type


def item_of(key: SnapshotKey, captured_at: str, pose: Iterable[float], content: bytes, suffix: str) -> Item:
    """An item with the digest of its picture."""
    x, y, theta = (float(v) for v in pose)
    return Item(key, captured_at, (x, y, theta), content, suffix, digest_of(content))


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of one snapshot: 201 stored now, 200 there before, anything else refused and why."""

    key: SnapshotKey
    status: int
    detail: str = ""

    @property
    def stored(self) -> bool:
        """Whether it is on the server's disk."""
        return self.status in (200, 201)


@dataclass(frozen=True, slots=True)
class Patience:
    """How long to go on. The n-th wait is random, up to `first_s` doubled n times, `most_s` at most."""

    first_s: float = 0.2
    most_s: float = 10.0
    give_up_s: float = 300.0


class Uploader:
    """A client of one server.

    Args:
        client: its `base_url` is the server's.
        clock, sleep, rng: the world, for tests to replace.
    """

    def __init__(
        self,
        client: httpx.Client,
        patience: Patience | None = None,
        *,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
        rng: random.Random | None = None,
    ) -> None:
        self._client, self._patience = client, patience or Patience()
        self._clock, self._sleep, self._rng = clock, sleep, rng or random.Random()

    def open_session(self, document: object) -> str:
        """A new session of the content of a `session.json`; its id. Raises Refused, Unavailable."""
        return str(self._checked("POST", "/api/sessions", json=document)["id"])

    def session(self, session: str) -> Mapping[str, Any]:
        """A session as the server describes it. Raises Refused, Unavailable."""
        return self._checked("GET", f"/api/sessions/{session}")

    def sessions(self) -> Sequence[Mapping[str, Any]]:
        """The newest sessions. Raises Refused, Unavailable."""
        return list(self._checked("GET", "/api/sessions")["sessions"])

    def finish(self, session: str) -> Mapping[str, Any]:
        """No more uploads; returns once the last full correction is done. Raises Refused, Unavailable."""
        while True:
            view = self._checked("POST", f"/api/sessions/{session}/finish")
            if view.get("state") != "finishing":
                return view
            self._sleep(0.2)

    def send(self, session: str, item: Item) -> Outcome:
        """One snapshot. Raises Refused: the session takes none. Unavailable: no answer for too long."""
        response = self._answer(
            "POST",
            f"/api/sessions/{session}/snapshots",
            data={"pose": json.dumps(item.document())},
            files={"image": item.file()},
        )
        problem = {} if response.is_success else _problem(response)
        _check_session(response.status_code, problem)
        return Outcome(item.key, response.status_code, str(problem.get("detail", "")))

    def send_batch(self, session: str, items: Sequence[Item]) -> list[Outcome]:
        """Many snapshots in one request; their outcomes in order. Raises as `send`."""
        if len(items) == 1:
            return [self.send(session, items[0])]
        documents = [item.document() | {"image": f"image{n}"} for n, item in enumerate(items)]
        response = self._answer(
            "POST",
            f"/api/sessions/{session}/snapshots/batch",
            data={"poses": json.dumps(documents)},
            files=[(f"image{n}", item.file()) for n, item in enumerate(items)],
        )
        if response.status_code == 413:
            half = len(items) // 2
            return self.send_batch(session, items[:half]) + self.send_batch(session, items[half:])
        if not response.is_success:
            raise _refused(response.status_code, _problem(response))
        results = response.json()["results"]
        return [self._outcome(session, item, result) for item, result in zip(items, results, strict=True)]

    def upload(self, session: str, items: Iterable[Item], rate: float | None = None) -> Iterator[Outcome]:
        """Send items as they come, `rate` a second at most, or as fast as they are taken. What fell behind goes in
        batches.

        Raises:
            Refused, Unavailable: as `send`.
        """
        coming, start, sent = iter(items), self._clock(), 0
        while True:
            if rate:
                self._sleep(max(0.0, start + sent / rate - self._clock()))
            due = int((self._clock() - start) * rate) + 1 - sent if rate else BATCH_ITEMS
            batch = _batch(coming, max(1, min(due, BATCH_ITEMS)))
            if not batch:
                return
            yield from self.send_batch(session, batch)
            sent += len(batch)

    def _outcome(self, session: str, item: Item, result: Mapping[str, Any]) -> Outcome:
        status = int(result["status"])
        if _may_pass(status):
            return self.send(session, item)
        _check_session(status, result)
        return Outcome(item.key, status, str(result.get("detail", "")))

    def _checked(self, method: str, path: str, **request: Any) -> Mapping[str, Any]:
        response = self._answer(method, path, **request)
        if not response.is_success:
            raise _refused(response.status_code, _problem(response))
        body: Mapping[str, Any] = response.json()
        return body

    def _answer(self, method: str, path: str, **request: Any) -> httpx.Response:
        """The answer to a request, asked again for as long as it may yet pass."""
        deadline, wait_s = self._clock() + self._patience.give_up_s, self._patience.first_s
        while True:
            asked_s, fault = 0.0, ""
            try:
                response = self._client.request(method, path, **request)
                if not _may_pass(response.status_code):
                    return response
                asked_s, fault = _retry_after(response), f"it answers {response.status_code}"
            except httpx.TransportError as error:
                fault = str(error) or type(error).__name__
            pause_s = max(asked_s, self._rng.uniform(0, wait_s))
            if self._clock() + pause_s > deadline:
                raise Unavailable(f"{self._client.base_url}: gave up after {self._patience.give_up_s:g} s: {fault}.")
            self._sleep(pause_s)
            wait_s = min(2 * wait_s, self._patience.most_s)


def connect(url: str, timeout_s: float = 30.0) -> httpx.Client:
    """A client of the server at a URL, whatever proxies the environment names: a pond's network has none."""
    return httpx.Client(base_url=url, timeout=httpx.Timeout(timeout_s, connect=5.0), trust_env=False)


def _batch(coming: Iterator[Item], most: int) -> list[Item]:
    batch: list[Item] = []
    size = 0
    for item in islice(coming, most):
        batch.append(item)
        size += len(item.content)
        if size > BATCH_BYTES:
            break
    return batch


def _may_pass(status: int) -> bool:
    return status >= 500 or status in _AGAIN


def _retry_after(response: httpx.Response) -> float:
    text = response.headers.get("Retry-After", "")
    return min(float(text), 60.0) if text.isascii() and text.isdigit() else 0.0


def _problem(response: httpx.Response) -> Mapping[str, Any]:
    """What the server says is wrong, where it says so in JSON."""
    try:
        body = response.json()
    except ValueError:
        body = None
    return body if isinstance(body, Mapping) else {"detail": response.reason_phrase}


def _check_session(status: int, problem: Mapping[str, Any]) -> None:
    """Raises Refused where it is the session that takes nothing."""
    if status == 404 or (status == 409 and str(problem.get("type", "")).endswith("/session-finished")):
        raise _refused(status, problem)


def _refused(status: int, problem: Mapping[str, Any]) -> Refused:
    return Refused(f"The server refused ({status}): {problem.get('detail', 'no reason given')}", status=status)
