"""Groups of snapshots that grow by what they share: the places of an unmapped pond, settled one by one.

Pure. All poses are in the map frame of `posegraph.py`, px, px, rad. Every snapshot belongs to one group; inside a
group the relative poses come from pictures, the group as a whole lies where the noisy poses of its members say. A
snapshot joins a group where its picture fits the group's map far better than at any other place within reach, and
better than chance; a snapshot that fits two groups joins them into one. Growing against the map of many neighbours,
instead of pair by pair, is what keeps look-alike places apart: the evidence of all of them is in one score.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import fft

from . import posegraph as se2
from .registration import HALF, Fit, Place, View, Whitener, draw_map, refine, search
from .values import Bool, Float, Float32, Int

CHANCE_NATS = 12.0  # what the best of some 100,000 wrong places scores on noise
SURE_NATS = 9.0  # odds above which a place is taken for settled
FIRST_SURE_NATS = 40.0  # while it is not yet known how well two pictures of one floor agree
FIRST_EDGES = 12
LEAST_AGREEMENT = 0.12  # of atanh(rho): how far true fits scatter at the least
AGREEMENT_SIGMAS = 5.0
SAME_PLACE_PX = 3.0
REACH_SIGMAS = 3.5
LEAST_REACH = 0.25  # of a snapshot's width: the claimed noise may be too small
LEAST_TURN_RAD = 0.2
MAP_VIEWS = 40
GROUPS_TRIED = 3
EDGES_PER_VIEW = 6
LEAST_SHARED = 0.08
SIGMA_STRENGTH = 6.0  # the claimed noise counts as so many snapshots'


@dataclass(frozen=True, slots=True, eq=False)
class Edge:
    """A fit between two snapshots, by number."""

    tail: int
    head: int
    fit: Fit


class Atlas:
    """Snapshots, their groups and what was measured between them.

    sigmas: (3,), px, px, rad, what the localisation claims.
    """

    def __init__(self, size_px: tuple[int, int], sigmas: Float) -> None:
        self.size_px = size_px
        self.claimed = np.asarray(sigmas, dtype=np.float64)
        self.sigmas = self.claimed.copy()
        self.views: list[View] = []
        self.edges: list[Edge] = []
        self.priors = np.zeros((0, 3))
        self.poses = np.zeros((0, 3))
        self.group = np.zeros(0, dtype=np.int64)
        self.odds = np.zeros(0)
        self.precision = np.zeros((0, 3, 3))
        self.frame_slack_px = 0.0
        self.first_sure_nats = FIRST_SURE_NATS
        self._whiteners: dict[int, Whitener] = {}

    def __len__(self) -> int:
        return len(self.views)

    def take(self, view: View, prior: Float) -> int:
        """A new snapshot, in a group of its own; returns its number."""
        number = len(self.views)
        self.views.append(view)
        self.priors = np.vstack([self.priors, prior])
        self.poses = np.vstack([self.poses, prior])
        self.group = np.append(self.group, number)
        self.odds = np.append(self.odds, 0.0)
        self.precision = np.concatenate([self.precision, np.zeros((1, 3, 3))])
        return number

    def members(self, group: int) -> Int:
        """The numbers of a group's snapshots."""
        return np.flatnonzero(self.group == group)

    def main_group(self) -> int:
        """The group with the most snapshots; of equals, the one with the lowest number."""
        return int(np.bincount(self.group).argmax())

    # --- growing

    def grow(self) -> None:
        """Settle every snapshot from nothing, the best supported first; the order of arrival does not count."""
        count = len(self)
        self.group = np.arange(count)
        self.poses, self.odds, self.edges = self.priors.copy(), np.zeros(count), []
        self.precision = np.zeros((count, 3, 3))
        self.sigmas = self.claimed.copy()
        closeness = self._closeness(np.arange(count))
        support = closeness.sum(axis=1)
        settled = np.zeros(count, dtype=bool)
        while not settled.all():
            seed = int(np.argmax(np.where(settled, -1.0, support)))
            settled[seed] = True
            for widening, self.first_sure_nats in ((1.0, FIRST_SURE_NATS), (1.0, SURE_NATS), (2.0, SURE_NATS)):
                self._spread(settled, closeness, widening)

    def _spread(self, settled: Bool, closeness: Float, widening: float) -> None:
        tried_at = np.full(len(self), -1.0)
        while True:
            backing = closeness[:, settled].sum(axis=1)
            ready = ~settled & (backing > 0.2) & (backing > 1.3 * tried_at)
            if not ready.any():
                return
            number = int(np.argmax(np.where(ready, backing, -1.0)))
            tried_at[number] = backing[number]
            settled[number] = self.place(number, settled, widening)

    def _closeness(self, numbers: Int) -> Float:
        """(N, N): about which share of floor two snapshots have in common, by their noisy poses."""
        xy = self.priors[numbers, :2]
        squared = np.square(xy[:, None] - xy[None]).sum(axis=-1)
        near = np.exp(-squared / (2 * (0.45 * np.mean(self.size_px)) ** 2))
        np.fill_diagonal(near, 0.0)
        return np.where(near > 0.02, near, 0.0)

    def place(self, number: int, among: Bool, widening: float = 1.0) -> bool:
        """Join a snapshot to the groups that its picture fits; True where it fits one.

        among: (N,), the snapshots that may be joined.
        """
        near = self._near(number, among, widening)
        near = near[self.group[near] != self.group[number]]
        groups, first, sizes = np.unique(self.group[near], return_index=True, return_counts=True)
        joined = False
        for group in groups[np.lexsort((first, -sizes))][:GROUPS_TRIED]:
            fits, odds = self._against(number, near[self.group[near] == group], int(group), widening)
            if fits:
                self.odds[number] = max(odds, self.odds[number])
                self._join(number, fits)
                joined = True
        return joined

    def _reach(self, widening: float) -> float:
        return float(max(REACH_SIGMAS * self.sigmas[0], LEAST_REACH * self.size_px[0]) * widening)

    def _near(self, number: int, among: Bool, widening: float) -> Int:
        candidates = np.flatnonzero(among)
        apart = np.hypot(*(self.poses[candidates, :2] - self.poses[number, :2]).T)
        limit = 0.85 * np.mean(self.size_px) + self._reach(widening)
        order = np.lexsort((candidates, apart))
        near = candidates[order[apart[order] < limit]][:MAP_VIEWS]
        return near[near != number]

    def _against(self, number: int, near: Int, group: int, widening: float) -> tuple[list[Edge], float]:
        """The fits to a group's snapshots near it, and the odds of the place; no fits where none stands out."""
        guess = self.poses[number]
        members = len(self.members(group))
        own = len(self.members(int(self.group[number])))
        sigmas = self.sigmas * np.sqrt(1 / own + 1 / members)
        reach = max(REACH_SIGMAS * sigmas[0], LEAST_REACH * self.size_px[0]) * widening
        turn = max(REACH_SIGMAS * sigmas[2], LEAST_TURN_RAD) * widening
        size = fft.next_fast_len(int((np.hypot(*self.size_px) + 2 * reach) / HALF) + 4, real=True)
        size += size % 2
        local = draw_map([self.views[n] for n in near], self.poses[near], guess[:2], size)
        places = search(self.views[number], local, self._gain(size), guess, sigmas, reach, turn)
        odds = margin(places)
        if odds < (SURE_NATS if len(self.edges) >= FIRST_EDGES else self.first_sure_nats):
            return [], odds
        return self._fits(number, near, places[0].pose), odds

    def _gain(self, size: int) -> Float32:
        whitener = self._whiteners.get(size)
        if whitener is None:
            whitener = self._whiteners[size] = Whitener(size)
            chosen = range(0, len(self), max(1, len(self) // 60))
            for n in chosen:
                whitener.learn(self.views[n], self.poses[n, 2])
        return whitener.gain()

    def _fits(self, number: int, near: Int, pose: Float) -> list[Edge]:
        """Refine a place against the neighbours that share most with it; each fit starts where the last ended.

        None where more of what they share contradicts the place than bears it out.
        """
        shared = self.shared(pose, near)
        order = np.lexsort((near, -shared))[: EDGES_PER_VIEW + 2]
        least = self._least_agreement()
        edges: list[Edge] = []
        against = 0.0
        for k in order[shared[order] >= LEAST_SHARED]:
            tail = int(near[k])
            fit = refine(self.views[tail], self.views[number], se2.between(self.poses[tail], pose))
            if fit is None or fit.nats < CHANCE_NATS or np.arctanh(min(fit.rho, 0.9999)) < least:
                against += float(shared[k])
                continue
            edges.append(Edge(tail, number, fit))
            pose = self._mean_pose(edges)[0]
            if len(edges) == EDGES_PER_VIEW:
                break
        agreeing = self._agreeing(edges)
        borne_out = sum(e.fit.shared_px for e in agreeing) / np.prod(self.size_px)
        against += sum(e.fit.shared_px for e in edges if e not in agreeing) / np.prod(self.size_px)
        return agreeing if borne_out > 2 * against else []

    def _least_agreement(self) -> float:
        """atanh(rho) that a fit must reach to be like those known; far below 0 while too few are known."""
        if len(self.edges) < FIRST_EDGES:
            return -np.inf
        known = np.arctanh(np.minimum([e.fit.rho for e in self.edges[-300:]], 0.9999))
        middle = float(np.median(known))
        scatter = float(np.median(np.abs(known - middle))) / 0.6745
        return middle - AGREEMENT_SIGMAS * max(scatter, LEAST_AGREEMENT)

    def _agreeing(self, edges: list[Edge]) -> list[Edge]:
        """The edges that name the place most of the evidence names."""
        if not edges:
            return []
        said = np.array([se2.compose(self.poses[e.tail], e.fit.relative) for e in edges])
        apart = np.hypot(*(said[:, None, :2] - said[None, :, :2]).transpose(2, 0, 1))
        same = apart < SAME_PLACE_PX
        best = int(np.argmax(same @ np.array([e.fit.nats for e in edges])))
        return [e for e, keep in zip(edges, same[best], strict=True) if keep]

    def shared(self, pose: Float, others: Int) -> Float:
        """(len(others),): the share of a snapshot at `pose` that each of the others sees."""
        width, height = self.size_px
        u, v = (np.linspace(-0.5 + 0.5 / n, 0.5 - 0.5 / n, n) for n in (9, 7))
        grid = np.stack(np.meshgrid(u * width, v * height), axis=-1).reshape(-1, 2)
        floor = pose[:2] + se2.rotate(pose[2], grid)
        poses = self.poses[others]
        seen = se2.rotate(-poses[:, 2:], floor[None] - poses[:, None, :2])
        return np.asarray((np.abs(seen) < np.array([width, height]) / 2).all(axis=-1).mean(axis=1))

    def _mean_pose(self, edges: Sequence[Edge]) -> tuple[Float, Float]:
        """Where a snapshot lies by its edges to placed ones, (3,), and each edge's information there, (E, 3, 3)."""
        tails = self.poses[[e.tail for e in edges]]
        said = se2.compose(tails, np.array([e.fit.relative for e in edges]))
        turn = np.zeros((len(edges), 3, 3))
        turn[:, 2, 2] = 1
        c, s = np.cos(tails[:, 2]), np.sin(tails[:, 2])
        turn[:, 0, 0], turn[:, 0, 1], turn[:, 1, 0], turn[:, 1, 1] = c, -s, s, c
        weight = turn @ np.array([e.fit.information for e in edges]) @ turn.transpose(0, 2, 1)
        apart = said - said[0]
        apart[:, 2] = (apart[:, 2] + np.pi) % (2 * np.pi) - np.pi
        return said[0] + np.linalg.solve(weight.sum(axis=0), (weight @ apart[..., None]).sum(axis=0))[:, 0], weight

    def _join(self, number: int, edges: list[Edge]) -> None:
        """Carry the smaller group to where the edges say, and make one group of the two."""
        own, other = int(self.group[number]), int(self.group[edges[0].tail])
        here, there = self.members(own), self.members(other)
        pose, weight = self._mean_pose(edges)
        np.add.at(self.precision, [number] * len(edges), weight)
        np.add.at(self.precision, [e.tail for e in edges], weight)
        motion = se2.compose(pose, se2.inverse(self.poses[number]))
        if len(here) > len(there):
            self.poses[there] = se2.compose(se2.inverse(motion), self.poses[there])
        else:
            self.poses[here] = se2.compose(motion, self.poses[here])
        for group in (here, there):  # a lone snapshot is as sure as what it was joined by
            if len(group) == 1:
                self.odds[group] = np.maximum(self.odds[group], self.odds[number])
        self.group[here] = self.group[there] = min(own, other)
        self.edges.extend(edges)
        self.realign(min(own, other))

    def waiting_near(self, number: int) -> Int:
        """Snapshots of other groups that may share floor with this one, the nearest first."""
        others = self.group != self.group[number]
        return self._near(number, others, 1.0) if others.any() else np.zeros(0, dtype=np.int64)

    # --- the frame

    def prior_residuals(self, members: Int) -> Float:
        """(M, 3): pose less noisy pose."""
        out = self.poses[members] - self.priors[members]
        out[:, 2] = (out[:, 2] + np.pi) % (2 * np.pi) - np.pi
        return out

    def realign(self, group: int) -> None:
        """Lay a group where the noisy poses of its members say, and learn from it how noisy they are."""
        members = self.members(group)
        weight = se2.student_weights(self.prior_residuals(members), self.sigmas)
        motion = se2.align(self.poses[members], self.priors[members], self.sigmas, weight)
        aligned = se2.compose(motion, self.poses[members])
        if np.abs(aligned - self.poses[members])[:, :2].max() > self.frame_slack_px:
            self.poses[members] = aligned
        if len(members) >= 5 and group == self.main_group():
            self.sigmas = self._learned_sigmas(members)

    def _learned_sigmas(self, members: Int) -> Float:
        residuals = np.abs(self.prior_residuals(members))
        count = len(members) - 1.5
        xy = np.median(residuals[:, :2]) / 0.6745
        phi = np.median(residuals[:, 2]) / 0.6745
        found = np.array([xy, xy, phi]) * np.sqrt(len(members) / count)
        blend = (SIGMA_STRENGTH * self.claimed**2 + count * found**2) / (SIGMA_STRENGTH + count)
        return np.sqrt(blend)


    def covariances(self, numbers: Int, prior_inflation: float, local_inflation: float) -> Float:
        """(len(numbers), 3, 3): the frame's share of each pose's covariance, and its own by its edges."""
        out = np.broadcast_to(np.diag(self.sigmas**2), (len(numbers), 3, 3)).copy()
        for group in np.unique(self.group[numbers]):
            members = self.members(int(group))
            if len(members) < 2:
                continue
            weight = se2.student_weights(self.prior_residuals(members), self.sigmas)
            prior = weight[:, None] / self.sigmas**2 / prior_inflation
            frame, centre = se2.frame_covariance(self.poses[members], prior)
            here = np.flatnonzero(self.group[numbers] == group)
            own = np.linalg.inv(self.precision[numbers[here]])
            out[here] = se2.carried_covariance(frame, centre, self.poses[numbers[here]]) + local_inflation * own
        return out


def margin(places: Sequence[Place]) -> float:
    """Log-odds of the first place against the others and against chance; -inf where there is none."""
    if not places:
        return -np.inf
    others = [p.score for p in places[1:]] + [CHANCE_NATS + (places[0].score - places[0].nats)]
    return float(places[0].score - np.logaddexp.reduce(others))
