"""What the rooms above the core need of the world, as protocols. Adapters and fakes share these names."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from typing import Any, Protocol, TypeVar, cast

from .rodsight import RodsSeen
from .values import Image

T = TypeVar("T")
R = TypeVar("R")


class Clock(Protocol):
    """Seconds since the epoch, UTC."""

    def now_s(self) -> float: ...


class Executor(Protocol):
    """The part of `concurrent.futures.Executor` that is used; a Dask client gives one too."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]: ...


class Blobs(Protocol):
    """Immutable bytes by their SHA-256. `put` returns only once they would survive a power cut."""

    def put(self, content: bytes) -> str: ...
    def get(self, digest: str) -> bytes: ...
    def has(self, digest: str) -> bool: ...
    def __iter__(self) -> Iterator[str]: ...


class Bus(Protocol):
    """Tells whoever listens that a session is at a revision. Messages may be lost or merged: they carry no data."""

    def publish(self, session: str, revision: int) -> None: ...


class RodFinder(Protocol):
    """A learned detector of rods: image (H, W, 3), and the rods' outer radius in it, px, right within 20 %."""

    def __call__(self, image: Image, outer_px: float) -> RodsSeen: ...


class Spread(Protocol):
    """Does the same to many things, which do not know of one another, on as many cores as there are.

    shared: values that what is done may return, none of which ever changes; they need not be copied.
    large: each is much work, so that few of them are worth a core of their own too.
    """

    def __call__(
        self, work: Callable[[T], R], things: Sequence[T], shared: Sequence[object], large: bool = False
    ) -> list[R]: ...


def one_by_one(work: Callable[[T], R], things: Sequence[T], shared: Sequence[object], large: bool = False) -> list[R]:
    """On this core alone."""
    return [work(thing) for thing in things]


def both(spread: Spread, first: Callable[[], T], second: Callable[[], R]) -> tuple[T, R]:
    """Two pieces of work that do not know of one another."""

    def half(which: int) -> tuple[T | None, R | None]:
        return (first(), None) if which == 0 else (None, second())

    (a, _), (_, b) = spread(half, (0, 1), (), large=True)
    return cast(T, a), cast(R, b)
