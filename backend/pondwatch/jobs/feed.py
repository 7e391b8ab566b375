"""What changed since a revision, for viewers. Rows come from the store; the latest exact patches from memory."""

from __future__ import annotations

import threading
from collections import OrderedDict, deque
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Connection, RowMapping

from pondwatch.core.values import Rect
from pondwatch.store import behind, jobs, judgements, notes, revisions, sessions
from pondwatch.store.sessions import Session
from pondwatch.store.store import Store

from . import views
from .advance import Step
from .raster import tile_rect
from .tasks import EncodedRect


@dataclass(frozen=True, slots=True)
class Picture:
    """A rectangle of the mosaic as it was at a revision."""

    rect: Rect
    revision: int
    content: bytes


@dataclass(frozen=True, slots=True)
class News:
    """What is otherwise since a revision, or everything (`full`). All of it is as of `revision` or newer."""

    session: dict[str, Any]
    revision: int
    full: bool
    poses: list[dict[str, Any]]
    rods: list[dict[str, Any]]
    pictures: list[Picture]
    jobs: list[dict[str, Any]]
    notes: list[dict[str, Any]]


class Feed:
    """Remembers the patches of the latest revisions, within bounds, and tells what changed."""

    def __init__(self, store: Store, most_revisions: int, most_bytes: int) -> None:
        self._store = store
        self._most_revisions, self._most_bytes = most_revisions, most_bytes
        self._lock = threading.Lock()
        self._patches: OrderedDict[str, deque[tuple[int, tuple[EncodedRect, ...]]]] = OrderedDict()
        self._order: deque[tuple[str, int]] = deque()
        self._bytes = 0

    def remember(self, session_id: str, step: Step) -> None:
        """Keep the patches of a revision that was committed; forget the oldest of all sessions where over bounds."""
        with self._lock:
            self._patches.setdefault(session_id, deque()).append((step.revision, step.patches))
            self._order.append((session_id, sum(len(p.content) for p in step.patches)))
            self._bytes += self._order[-1][1]
            while len(self._order) > self._most_revisions or self._bytes > self._most_bytes:
                oldest, size = self._order.popleft()
                self._patches[oldest].popleft()
                self._bytes -= size
                if not self._patches[oldest]:
                    del self._patches[oldest]

    def news(self, session_id: str, since: int | None) -> News:
        """What changed after revision `since`; everything where that is None or was never reached.

        Raises:
            Missing: there is no such session.
        """
        return self._store.read(lambda c: self._news(c, session_id, since))

    def _news(self, connection: Connection, session_id: str, since: int | None) -> News:
        session = sessions.get(connection, session_id)
        full = since is None or since < 0 or since > session.revision
        after = -1 if full or since is None else since
        patches = None if full else self._remembered(session_id, after, session.revision)
        shown = session.revision
        if patches is None:
            patches, shown = self._drawn(connection, session, after)
        facts = sessions.facts(connection, session_id)
        return News(
            views.session(session, facts),
            shown,
            full,
            [views.pose(row) for row in revisions.pose_rows(connection, session_id, after)],
            _rods(connection, session_id, after, judgements.newest(connection, session_id) if facts.judgements else {}),
            patches,
            [views.job(row) for row in jobs.rows(connection, session_id)],
            [views.note(row) for row in (notes.of(connection, session_id, after) if facts.notes else ())],
        )

    def _drawn(self, connection: Connection, session: Session, after: int) -> tuple[list[Picture], int]:
        """Tiles drawn after a revision, and over them the patches that they may lack; the revision that is shown so.
        It is an earlier one than the newest where those patches are forgotten."""
        size_px, newest = views.raster_size(session), session.revision
        pictures = [_tile(row, size_px) for row in revisions.tile_rows(connection, session.id, "mosaic", after)]
        lacking = [t.since for t in behind.of(connection, session.id) if t.until > after]
        if not lacking:
            return pictures, newest
        shown = max(after, min(lacking) - 1)
        later = self._remembered(session.id, shown, newest)
        return (pictures, shown) if later is None else (pictures + later, newest)

    def _remembered(self, session_id: str, since: int, until: int) -> list[Picture] | None:
        """The patches of revisions after `since` up to `until`; None unless every one is remembered."""
        with self._lock:
            kept = [(r, p) for r, p in self._patches.get(session_id, ()) if since < r <= until]
        if len(kept) != until - since:
            return None
        return [Picture(patch.rect, revision, patch.content) for revision, patches in kept for patch in patches]


def _rods(
    connection: Connection, session_id: str, after: int, judged: Mapping[str, RowMapping]
) -> list[dict[str, Any]]:
    """Readings that changed after a revision, and those that people judged at it or later: what people say makes no
    revision of its own, so it is told again until the next one."""
    changed = {row["rod_id"]: row for row in revisions.rod_rows(connection, session_id, after)}
    fresh = {rod_id for rod_id, row in judged.items() if row["revision"] >= after} - changed.keys()
    if fresh:
        changed |= {r["rod_id"]: r for r in revisions.rod_rows(connection, session_id) if r["rod_id"] in fresh}
    unread = [views.rod(views.unseen(rod_id), judged[rod_id]) for rod_id in sorted(fresh - changed.keys())]
    return [views.rod(row, judged.get(rod_id)) for rod_id, row in changed.items()] + unread


def _tile(row: RowMapping, size_px: tuple[int, int]) -> Picture:
    return Picture(tile_rect(row["x"], row["y"], size_px), row["revision"], row["content"])
