"""One session as a worker holds it: its corrector, its mosaic, and what of both is stored.

What a joint decision moved is painted over several revisions, the newest snapshots first, so that none is so large
that a snapshot waits for it.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from pondwatch.core.consensus import Look
from pondwatch.core.corrector import Corrector, Deliberates
from pondwatch.core.errors import Invalid
from pondwatch.core.findings import Condition, find
from pondwatch.core.images import decode
from pondwatch.core.mosaic import Mosaic
from pondwatch.core.ports import Spread, one_by_one
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
from .raster import encode_patches, seen_in, tiles_of
from .tasks import Base, Moved, Outcome, Shown, SnapshotRef
from .thought import Begin, Thought, ThreadThought

MOVED_AT_ONCE, MOVED_BESIDE = 12, 3  # snapshots that were shown before; the same beside new ones
AGAIN_AT_ONCE, AGAIN_BESIDE = 12, 3  # snapshots decided again after a joint decision; the same
MANY_ARRIVED, BACKLOG_GROWTH = 16, 3.0  # in a step; snapshots over those in the last joint decision
_REJECTED = Shown(Status.REJECTED, None, None, None)


@dataclass(slots=True)
class Held:
    """One session. shown and rods: as stored at `revision`. stale: the corrector may say otherwise than stored.
    unshown: poses that moved and are still to be painted. dirty: where the stored mosaic shows snapshots that cannot
    be read any more. thought: a joint decision that is being made beside, begun by `begin`; thought_of: of how many
    snapshots it, or the last one, was. thoughtless: one failed, and none is begun again."""

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
    unshown: dict[SnapshotKey, CorrectedPose] = field(default_factory=dict)
    begin: Begin = ThreadThought
    thought: Thought | None = None
    thought_of: int = 0
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

    def outcome(self, poses: Iterable[CorrectedPose], most_moved: int | None = MOVED_AT_ONCE) -> Outcome:
        """Paint what is new and what moved, of that `most_moved` at most; what the next revision changes. Holds that
        revision afterwards."""
        moved, rects = [], self.dirty
        for corrected in self._in_turn(poses, most_moved):
            shown = Shown.of(corrected)
            rects += self.paint(corrected.key, self.shown.get(corrected.key), shown)
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
            tuple(touched),
            sum(self.seen.values()) / (self.mosaic.size_px[0] * self.mosaic.size_px[1]),
            self.thought is not None,
            bool(self.unshown) or self.behind,
        )

    def _in_turn(self, poses: Iterable[CorrectedPose], most_moved: int | None) -> list[CorrectedPose]:
        """Those to be shown now; the others wait."""
        waiting = self.unshown | {p.key: p for p in poses}  # a pose may have moved again
        new = [p for key, p in waiting.items() if key not in self.shown]
        moved = [p for key, p in waiting.items() if key in self.shown and Shown.of(p) != self.shown[key]]
        moved.sort(key=lambda p: self.refs[p.key].id, reverse=True)
        now = len(moved) if most_moved is None else most_moved
        self.unshown = {p.key: p for p in moved[now:]}
        return new + moved[:now]

    def paint(self, key: SnapshotKey, before: Shown | None, now: Shown) -> list[Rect]:
        """Put a snapshot where it is shown now; the rectangles that changed."""
        if before is not None and before.pose == now.pose:
            return []
        if now.pose is None:
            return self.mosaic.drop(key)
        return self.mosaic.put(key, self.images[key], np.array(now.pose), self.refs[key].captured_s)

    def reflect(self, arrived: int = 0) -> list[CorrectedPose] | None:
        """The poses that a joint decision moved, once it is made; begins one where it is due. arrived: how many
        snapshots the step took in; many wait where they are many, and decisions are made more rarely."""
        corrector = self.corrector
        if not isinstance(corrector, Deliberates):
            return None
        poses = None
        if self.thought is not None and self.thought.ready:
            answer, self.thought = self.thought.result(), None
            self.thoughtless = answer is None
            poses = list(corrector.adopt(answer).poses) if answer is not None else []
        elif corrector.behind:
            poses = list(corrector.catch_up(AGAIN_BESIDE if arrived else AGAIN_AT_ONCE).poses)
        if self.thought is None and not self.thoughtless and corrector.due() and self._is_worth(arrived):
            self.thought, self.thought_of = self.begin(corrector), len(self.images)
        return poses

    @property
    def behind(self) -> bool:
        """Whether a joint decision was taken over that not all follows yet."""
        return isinstance(self.corrector, Deliberates) and self.corrector.behind

    def abandon(self) -> None:
        """Nobody asks for what is held any more."""
        if self.thought is not None:
            self.thought.drop()

    def _is_worth(self, arrived: int) -> bool:
        """What comes while a joint decision is made is decided again after it: much of it, in a backlog."""
        return arrived < MANY_ARRIVED or len(self.images) >= BACKLOG_GROWTH * self.thought_of

    def condition(self, spread: Spread = one_by_one) -> Condition:
        """What the floor shows that no layout explains, by the snapshots that lie surely where they do."""
        looks = [
            Look(self.images[key], np.array(shown.pose))
            for key, shown in sorted(self.shown.items())
            if shown.status is Status.PLACED and key in self.images
        ]
        return find(looks, self.inspection.camera, self.inspection.pond, self.corrector.rods(), spread)

    def _changed_rods(self) -> tuple[RodReading, ...]:
        changed = []
        for reading in self.corrector.rods():
            before = self.rods.get(reading.rod_id)
            if reading is not before and reading != (before or _unseen(reading.rod_id)):
                changed.append(reading)
            self.rods[reading.rod_id] = reading  # so that it is the same object next time
        return tuple(changed)


def as_stored(base: Base, spread: Spread = one_by_one) -> tuple[Held, list[Snapshot]]:
    """A session with its mosaic drawn as it is stored, and its snapshots, which its corrector has not seen yet."""
    camera, pond = base.inspection.camera, base.inspection.pond
    corrector = make_corrector(base.inspection, base.method, spread)
    held = Held(base.inspection, base.revision, corrector, Mosaic(camera, pond))
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
