"""What the live feed needs of whoever keeps the revisions. The composition root hands one in.

Every method blocks and is called in threads, several at a time.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Protocol


@dataclass(frozen=True, slots=True)
class Raster:
    """The mosaic's grid. Its first pixel lies at the pond's upper left corner; x right, y down."""

    metres_per_pixel: float
    width_px: int
    height_px: int


@dataclass(frozen=True, slots=True)
class Patch:
    """A rectangle of the raster as an encoded image, in raster pixels. revision: the last one that it shows."""

    layer: str
    x: int
    y: int
    width: int
    height: int
    revision: int
    mime: str
    content: bytes


@dataclass(frozen=True, slots=True)
class Alarms:
    """A session's alarms as they stand, each with its `id` and whether it is still of interest (`retained`, `quiet`).
    version: grows with every change."""

    version: int = 0
    rows: tuple[dict[str, Any], ...] = ()


@dataclass(frozen=True, slots=True)
class Changes:
    """What is otherwise since a revision, as one consistent state.

    session: the fields of `GET /api/sessions/{id}`. revision: the newest, which all of this belongs to.
    full: this is the whole state, and replaces what a client holds. poses, rods, jobs: rows as in formats.md; a
    pose that was withdrawn comes with status `rejected`, a rod that no snapshot covers any more as `unseen`.
    notes: those that changed.
    """

    session: dict[str, Any]
    revision: int
    full: bool
    poses: list[dict[str, Any]]
    rods: list[dict[str, Any]]
    patches: list[Patch]
    jobs: list[dict[str, Any]]
    notes: list[dict[str, Any]] = field(default_factory=list)
    alarms: Alarms = Alarms()


class Source(Protocol):
    """Reads revisions."""

    def raster(self, session: str) -> Raster:
        """The grid of a session's mosaic; it does not change during a session.

        Raises:
            core.errors.Missing: there is no such session.
        """

    def changes(self, session: str, since: int | None) -> Changes:
        """What changed after revision `since`; everything where `since` is None, too old, or not known.

        Raises:
            core.errors.Missing: there is no such session.
        """
