"""The method `graph`: unmapped ponds. Poses come from the pictures and the noisy poses alone; no rods are read.

Snapshots are settled into groups by what they share (`atlas.py`), each group is solved as a pose graph with the noisy
poses as weak priors (`posegraph.py`). Within a group the poses are good to a fraction of a pixel; where the group lies
in the pond only the noisy poses know, and the covariances say so.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from . import posegraph as se2
from .atlas import Atlas
from .neighbours import SURE_NATS
from .registration import make_view
from .settled import Settled, settle_atlas
from .values import (
    CorrectedPose,
    Correction,
    Float,
    Inspection,
    Quality,
    RodReading,
    RodState,
    Snapshot,
    SnapshotKey,
    Status,
)

ASSUMED_SIGMA_WIDTHS = 0.12  # of a snapshot's width, where the session claims no noise
ASSUMED_SIGMA_RAD = 0.15
MOVED_PX = 0.05
MOVED_RAD = 0.001
FRAME_SLACK_PX = 0.5  # live, a group keeps its frame until the noisy poses ask for more than this
FRAME_SLACK_SIGMAS = 0.7  # and for more than this share of what they know of it: each move paints all of it anew
LOCAL_INFLATION = 4.0  # live: a neighbour's own error counts too
RETRIED = 2
REPEATS_MUCH = 12.0  # wrong places score so many times better than on a floor without repeats


class GraphCorrector:
    """Corrects a session without a layout. Deterministic; `settle` forgets the order of arrival."""

    method = "graph"

    def __init__(self, inspection: Inspection) -> None:
        self._inspection = inspection
        camera, noise = inspection.camera, inspection.pose_noise
        self._scale = camera.metres_per_pixel
        sigma_px, sigma_rad = ASSUMED_SIGMA_WIDTHS * camera.width_px, ASSUMED_SIGMA_RAD
        if noise is not None and noise.sigma_xy_m > 0 and noise.sigma_theta_rad > 0:
            sigma_px, sigma_rad = noise.sigma_xy_m / self._scale, noise.sigma_theta_rad
        self._sigmas = np.array([sigma_px, sigma_px, sigma_rad])
        self._atlas = self._new_atlas()
        self._settled: Settled | None = None
        self._keys: list[SnapshotKey] = []
        self._shown = np.zeros((0, 3))  # the map-frame pose behind each published one
        self._shown_status: list[Status | None] = []
        self._poses: dict[SnapshotKey, CorrectedPose] = {}

    def _new_atlas(self) -> Atlas:
        return Atlas((self._inspection.camera.width_px, self._inspection.camera.height_px), self._sigmas)

    def add(self, snapshots: Sequence[Snapshot]) -> Correction:
        """Places each new snapshot against those known. A group may move as a whole; a known key is left alone."""
        self._atlas.frame_slack_px, self._atlas.frame_slack_sigmas = FRAME_SLACK_PX, FRAME_SLACK_SIGMAS
        rejected = []
        for snapshot in self._new(snapshots):
            if self._usable(snapshot):
                self._place(self._take(snapshot))
            else:
                rejected.append(self._poses[snapshot.key])
        return Correction((*rejected, *self._publish_live()), (), self.quality())

    def hold(self, snapshots: Sequence[Snapshot]) -> None:
        """Take snapshots without placing them; `settle` will."""
        for snapshot in self._new(snapshots):
            if self._usable(snapshot):
                self._take(snapshot)

    def settle(self) -> Correction:
        """Grows and solves everything anew, in the order of the keys."""
        before = dict(self._poses)
        order = sorted(range(len(self._keys)), key=lambda n: self._keys[n])
        old, self._atlas = self._atlas, self._new_atlas()
        for n in order:
            self._atlas.take(old.views[n], old.priors[n])
        self._keys = [self._keys[n] for n in order]
        self._shown = np.full((len(order), 3), np.inf)
        self._shown_status = [None] * len(order)
        if order:
            self._settled = settle_atlas(self._atlas, [(k.robot, k.boot) for k in self._keys])
            self._publish(np.arange(len(order)), self._settled.covariances)
        moved = tuple(p for k, p in sorted(self._poses.items()) if self._differs(before[k], p))
        return Correction(moved, (), self.quality())

    def poses(self) -> Mapping[SnapshotKey, CorrectedPose]:
        """Every pose as it stands."""
        return self._poses

    def rods(self) -> tuple[RodReading, ...]:
        """All unseen: this method reads none."""
        return tuple(RodReading(r.id, RodState.UNSEEN, None, 0.0, 0) for r in self._inspection.pond.rods)

    def quality(self) -> Quality:
        """How well it stands.

        facts: groups, edges, how much the floor repeats; after `settle` also edges dropped, cycle sums in px, and how
        many snapshots of one robot share one error.
        """
        count = Counter(p.status for p in self._poses.values())
        facts: dict[str, Any] = {"groups": len(set(self._atlas.group.tolist())), "edges": len(self._atlas.edges)}
        facts["repeats"] = round(self._atlas.placer.agreement.repeats, 1)
        if self._settled is not None:
            facts |= self._settled.facts
        sigma = self._atlas.sigmas
        return Quality(
            len(self._poses),
            count[Status.PLACED],
            count[Status.UNCERTAIN],
            count[Status.REJECTED],
            sigma_xy_m=float(sigma[0]) * self._scale,
            sigma_theta_rad=float(sigma[2]),
            residual_px=facts.get("residual_px"),
            sentence=_sentence(count, facts),
            facts=facts,
        )

    def _usable(self, snapshot: Snapshot) -> bool:
        camera = self._inspection.camera
        right_size = snapshot.image.shape[:2] == (camera.height_px, camera.width_px)
        return right_size and bool(np.isfinite(snapshot.pose_pond).all())

    def _new(self, snapshots: Sequence[Snapshot]) -> Iterator[Snapshot]:
        """Those whose keys are not known, rejected until they are taken."""
        for snapshot in snapshots:
            if snapshot.key not in self._poses:
                self._poses[snapshot.key] = CorrectedPose(snapshot.key, None, None, Status.REJECTED)
                yield snapshot

    def _take(self, snapshot: Snapshot) -> int:
        """Its number in the atlas."""
        number = self._atlas.take(make_view(snapshot.image), se2.pond_to_map(snapshot.pose_pond, self._scale))
        self._keys.append(snapshot.key)
        self._shown = np.vstack([self._shown, np.full((1, 3), np.inf)])
        self._shown_status.append(None)
        return number

    def _place(self, number: int) -> None:
        atlas = self._atlas
        atlas.learn_floor(number)
        everyone = np.ones(len(atlas), dtype=bool)
        if atlas.place(number, everyone):
            for other in atlas.waiting_near(number)[:RETRIED]:
                atlas.place(int(other), atlas.group == atlas.group[number])

    def _statuses(self) -> list[Status]:
        main = self._atlas.main_group()
        alone = int((self._atlas.group == main).sum()) < 2
        sure = (self._atlas.group == main) & (self._atlas.odds >= SURE_NATS) & (not alone)
        return [Status.PLACED if s else Status.UNCERTAIN for s in sure]

    def _publish_live(self) -> list[CorrectedPose]:
        atlas = self._atlas
        if not len(atlas):
            return []
        status = self._statuses()
        moved = np.abs(atlas.poses - self._shown) > [MOVED_PX, MOVED_PX, MOVED_RAD]
        other = [a is not b for a, b in zip(status, self._shown_status, strict=True)]
        numbers = np.flatnonzero(moved.any(axis=1) | np.array(other))
        inflation = 1.0 if self._settled is None else self._settled.prior_inflation
        return self._publish(numbers, atlas.covariances(numbers, inflation, LOCAL_INFLATION))

    def _publish(self, numbers: Float | Any, covariances: Float) -> list[CorrectedPose]:
        poses = se2.map_to_pond(self._atlas.poses, self._scale)
        scale = np.array([self._scale, -self._scale, -1.0])
        status = self._statuses()
        out = []
        for n, covariance in zip(numbers.tolist(), covariances, strict=True):
            odds = float(self._atlas.odds[n]) if status[n] is Status.PLACED else 0.0
            pose = CorrectedPose(self._keys[n], poses[n], covariance * np.outer(scale, scale), status[n], odds)
            self._poses[self._keys[n]] = pose
            self._shown[n], self._shown_status[n] = self._atlas.poses[n], status[n]
            out.append(pose)
        return out

    def _differs(self, a: CorrectedPose, b: CorrectedPose) -> bool:
        if a.pose_pond is None or b.pose_pond is None or a.status is not b.status:
            return a.status is not b.status
        apart = np.abs(se2.pond_to_map(a.pose_pond - b.pose_pond, self._scale))
        return bool((apart > [MOVED_PX, MOVED_PX, MOVED_RAD]).any())


def _sentence(count: Counter[Status], facts: Mapping[str, Any]) -> str:
    total = sum(count.values())
    if not total:
        return "No snapshots yet."
    parts = [f"{count[Status.PLACED]} of {total} snapshots fit together"]
    if "residual_px" in facts:
        parts[0] += f" to {facts['residual_px']:.2f} px"
    if count[Status.UNCERTAIN]:
        parts.append(f"{count[Status.UNCERTAIN]} share too little with them and lie where their robots said")
    if count[Status.REJECTED]:
        parts.append(f"{count[Status.REJECTED]} could not be used")
    if facts.get("repeats", 1.0) > REPEATS_MUCH:
        parts.append("the floor repeats itself, so that a whole group may lie one step away")
    return "; ".join(parts) + "; where the whole lies in the pond only the robots' own poses say."
