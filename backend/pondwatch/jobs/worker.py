"""What a worker process does: it holds a few sessions' correctors and mosaics between calls.

What it holds is a cache of the store at a revision. A call that finds it missing or at another revision is answered
with None; the server then hands the session over as stored (`load`) and asks again. So a worker may be killed at any
moment, and what it did for a revision that was never committed is forgotten.
"""

from __future__ import annotations

import hashlib
import multiprocessing
import os
import signal
import sys
import threading
import traceback
from collections import OrderedDict
from collections.abc import Iterable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, field
from multiprocessing.connection import wait
from typing import Any

import cv2
import numpy as np

from pondwatch.core.corrector import Corrector, Deliberates, hold
from pondwatch.core.errors import Invalid
from pondwatch.core.images import decode
from pondwatch.core.mosaic import Mosaic
from pondwatch.core.values import (
    Camera,
    CorrectedPose,
    Image,
    Inspection,
    Rect,
    RodReading,
    RodState,
    Snapshot,
    SnapshotKey,
    Status,
)

from .papernets import make_corrector
from .raster import encode_patches, encode_tiles, seen_in, tiles_of
from .tasks import Base, Moved, Outcome, Shown, SnapshotRef

SESSIONS_HELD = 8
_LOAD_CHUNK = 256
_SWITCH_S = 0.0005  # a joint decision in its thread holds up what a snapshot needs by no more at a time
_NICER = 5  # whoever waits for an acknowledgement comes before the correction
_REJECTED = Shown(Status.REJECTED, None, None, None)


class Thought:
    """A joint decision in a thread of its own, so that snapshots that come meanwhile are shown at once."""

    def __init__(self, corrector: Deliberates) -> None:
        self._answer: Future[Any] = Future()
        threading.Thread(target=self._run, args=(corrector,), name="deliberation", daemon=True).start()

    @property
    def ready(self) -> bool:
        """Whether it is made."""
        return self._answer.done()

    def result(self) -> Any:
        """The decision; None where it failed."""
        return self._answer.result()

    def _run(self, corrector: Deliberates) -> None:
        answer = None
        try:
            answer = corrector.deliberate()
        except Exception:  # a border: the poses stay as they are until all is settled, which tells of it
            traceback.print_exc()
        self._answer.set_result(answer)


@dataclass(slots=True)
class Held:
    """One session. shown and rods: as stored at `revision`. stale: the corrector may say otherwise than stored.
    dirty: where the stored mosaic shows snapshots that cannot be read any more. thought: a joint decision that is
    being made beside. thoughtless: one failed, and none is begun again."""

    inspection: Inspection
    revision: int
    corrector: Corrector
    mosaic: Mosaic
    refs: dict[SnapshotKey, SnapshotRef] = field(default_factory=dict)
    images: dict[SnapshotKey, Image] = field(default_factory=dict)
    shown: dict[SnapshotKey, Shown] = field(default_factory=dict)
    rods: dict[str, RodReading] = field(default_factory=dict)
    faults: list[Moved] = field(default_factory=list)
    seen: dict[tuple[int, int], int] = field(default_factory=dict)
    dirty: list[Rect] = field(default_factory=list)
    stale: bool = False
    thought: Thought | None = None
    thoughtless: bool = False

    def take(self, refs: Iterable[SnapshotRef]) -> list[Snapshot]:
        """Read and decode snapshots; those that cannot be are faults, told with the next outcome."""
        taken = []
        for ref in refs:
            try:
                image = _read(ref, self.inspection)
            except (Invalid, FileNotFoundError) as error:
                self.faults.append(Moved(ref.id, _REJECTED, fault=f"The stored picture cannot be used: {error}"[:300]))
                continue
            self.refs[ref.key], self.images[ref.key] = ref, image
            taken.append(_snapshot(ref, image))
        return taken

    def outcome(self, poses: Iterable[CorrectedPose]) -> Outcome:
        """Paint what moved; what the next revision changes. Holds that revision afterwards."""
        moved, rects = [], self.dirty
        for corrected in poses:
            shown = Shown.of(corrected)
            before = self.shown.get(corrected.key)
            if shown != before:
                rects += self.paint(corrected.key, before, shown)
                self.shown[corrected.key] = shown
                moved.append(Moved(self.refs[corrected.key].id, shown, corrected.log_odds))
        moved += self.faults
        rods = self._changed_rods()
        touched = tiles_of(rects)
        self.seen |= seen_in(self.mosaic, touched)
        self.faults, self.dirty, self.stale, self.revision = [], [], False, self.revision + 1
        return Outcome(
            tuple(moved),
            rods,
            self.corrector.quality(),
            tuple(encode_patches(self.mosaic, rects)),
            tuple(encode_tiles(self.mosaic, touched)),
            sum(self.seen.values()) / (self.mosaic.size_px[0] * self.mosaic.size_px[1]),
            self.thought is not None,
        )

    def paint(self, key: SnapshotKey, before: Shown | None, now: Shown) -> list[Rect]:
        """Put a snapshot where it is shown now; the rectangles that changed."""
        if before is not None and before.pose == now.pose:
            return []
        if now.pose is None:
            return self.mosaic.drop(key)
        return self.mosaic.put(key, self.images[key], np.array(now.pose), self.refs[key].captured_s)

    def reflect(self) -> list[CorrectedPose] | None:
        """The poses that a joint decision moved, once it is made; begins one where it is due."""
        corrector = self.corrector
        if not isinstance(corrector, Deliberates):
            return None
        poses = None
        if self.thought is not None and self.thought.ready:
            answer, self.thought = self.thought.result(), None
            self.thoughtless = answer is None
            poses = list(corrector.adopt(answer).poses) if answer is not None else []
        if self.thought is None and not self.thoughtless and corrector.due():
            self.thought = Thought(corrector)
        return poses

    def _changed_rods(self) -> tuple[RodReading, ...]:
        changed = tuple(r for r in self.corrector.rods() if r != self.rods.get(r.rod_id, _unseen(r.rod_id)))
        self.rods |= {r.rod_id: r for r in changed}
        return changed


class Desk:
    """The sessions that one worker holds, the longest unused let go of first."""

    def __init__(self) -> None:
        self._held: OrderedDict[str, Held] = OrderedDict()

    def load(self, base: Base) -> None:
        """Take up a session as it is stored."""
        held, snapshots = _as_stored(base)
        for i in range(0, len(snapshots), _LOAD_CHUNK):
            held.corrector.add(snapshots[i : i + _LOAD_CHUNK])
        held.stale = True
        self._keep(base.session, held)

    def advance(self, session: str, revision: int, refs: Sequence[SnapshotRef]) -> Outcome | None:
        """Correct and assemble with further snapshots; None where the session is not held at this revision."""
        held = self._take(session, revision)
        if held is None:
            return None
        poses = list(held.corrector.add(held.take(refs)).poses) if refs else []
        poses += held.reflect() or []
        latest = {p.key: p for p in poses}  # a pose may have moved twice
        outcome = held.outcome(held.corrector.poses().values() if held.stale else latest.values())
        self._keep(session, held)
        return outcome

    def reflect(self, session: str, revision: int) -> Outcome | bool | None:
        """What a joint decision made beside changed; True while it is being made, False where there is none; None
        where the session is not held at this revision."""
        held = self._take(session, revision)
        if held is None:
            return None
        poses = held.reflect()
        outcome = held.outcome(poses) if poses is not None else held.thought is not None
        self._keep(session, held)
        return outcome

    def settle(self, base: Base) -> Outcome:
        """Decide all at once, in the order of the keys, so that nothing of the order of arrival is left."""
        self._take(base.session, base.revision)
        held, snapshots = _as_stored(base)
        hold(held.corrector, sorted(snapshots, key=lambda s: s.key))
        held.corrector.settle()
        return held.outcome(sorted(held.corrector.poses().values(), key=lambda p: p.key))

    def forget(self, session: str) -> None:
        """Let go of a session."""
        self._held.pop(session, None)

    def _take(self, session: str, revision: int) -> Held | None:
        """What fails half-way is not held any more."""
        held = self._held.pop(session, None)
        return held if held is not None and held.revision == revision else None

    def _keep(self, session: str, held: Held) -> None:
        self._held[session] = held
        while len(self._held) > SESSIONS_HELD:
            self._held.popitem(last=False)


def _as_stored(base: Base) -> tuple[Held, list[Snapshot]]:
    """A session with its mosaic drawn as it is stored, and its snapshots, which its corrector has not seen yet."""
    camera, pond = base.inspection.camera, base.inspection.pond
    held = Held(base.inspection, base.revision, make_corrector(base.inspection, base.method), Mosaic(camera, pond))
    snapshots = held.take(base.snapshots)
    rects: list[Rect] = []
    for ref in base.snapshots:
        if ref.shown is not None and ref.key in held.refs:
            held.shown[ref.key] = ref.shown
            rects += held.paint(ref.key, None, ref.shown)
        elif ref.shown is not None and ref.shown.pose is not None:
            held.dirty += held.mosaic.put(ref.key, _blank(camera), np.array(ref.shown.pose))
            held.mosaic.drop(ref.key)
    held.rods = {r.rod_id: r for r in base.rods}
    held.seen = seen_in(held.mosaic, tiles_of(rects))
    return held, snapshots


def _read(ref: SnapshotRef, inspection: Inspection) -> Image:
    content = ref.path.read_bytes()
    if hashlib.sha256(content).hexdigest() != ref.digest:
        raise Invalid("its bytes are not those that were stored")
    return decode(content, inspection.camera)


def _blank(camera: Camera) -> Image:
    return np.zeros((camera.height_px, camera.width_px, 3), np.uint8)


def _snapshot(ref: SnapshotRef, image: Image) -> Snapshot:
    return Snapshot(ref.key, ref.captured_s, np.array(ref.pose_pond), image)


def _unseen(rod_id: str) -> RodReading:
    return RodReading(rod_id, RodState.UNSEEN, None, 0.0, 0)


_desk = Desk()  # this process's own


@dataclass(frozen=True, slots=True)
class Failed:
    """An error as it travels to the server: what raised it may not be fit to."""

    message: str


def answered(desk: Desk, method: str, *args: Any) -> Any:
    """What a desk's method returns; `Failed` where it raises."""
    try:
        return getattr(desk, method)(*args)
    except Exception as error:  # a border: the server must hear of any error
        where = traceback.extract_tb(error.__traceback__)[-1]
        return Failed(f"{type(error).__name__}: {error} ({where.name}, line {where.lineno})"[:500])


def on_desk(method: str, *args: Any) -> Any:
    """Call a method of this process's desk."""
    return answered(_desk, method, *args)


def start() -> int:
    """Set up a new worker process; its id."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.nice(_NICER)
    sys.setswitchinterval(_SWITCH_S)
    cv2.setNumThreads(1)
    threading.Thread(target=_die_with_parent, name="parent-watch", daemon=True).start()
    return os.getpid()


def _die_with_parent() -> None:
    """A server that was killed leaves no worker behind."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)
