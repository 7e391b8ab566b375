"""Groups of snapshots that grow by what they share: the places of an unmapped pond, settled one by one.

Pure. All poses are in the map frame of `posegraph.py`, px, px, rad. Every snapshot belongs to one group; inside a
group the relative poses come from pictures, the group as a whole lies where the noisy poses of its members say. A
snapshot joins a group where its picture fits the group's map far better than at any other place within reach, and
better than chance; a snapshot that fits two groups joins them into one. Growing against the map of many neighbours,
instead of pair by pair, is what keeps look-alike places apart: the evidence of all of them is in one score.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from . import posegraph as se2
from .neighbours import LEAST_REACH, REACH_SIGMAS, SURE_NATS, Neighbours, Placer, mean_pose
from .pairfit import Fit
from .registration import View
from .values import Bool, Float, Int

FIRST_SEARCHES = 10  # that cannot be right, before any place is believed
MORE_SEARCHES = 40  # on a floor that repeats
REPEATS = 4.0
SURE_STEPS = ((1.0, SURE_NATS + 4), (1.0, SURE_NATS), (1.0, 6.0), (2.0, SURE_NATS), (1.0, 4.0))  # widening, odds
MAP_VIEWS = 40
GROUPS_TRIED = 3
SIGMA_RANGE = 4.0  # how many times too small or too great the claimed noise may be
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
        self.frame_slack_px = self.frame_slack_sigmas = 0.0
        self.placer = Placer(size_px)
        self._last_odds = -np.inf

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
        self.placer.floor = Neighbours(self.views, self.priors)
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
        self._learn_pairs(closeness)
        support = closeness.sum(axis=1)
        settled = np.zeros(count, dtype=bool)
        tried = {widening: np.full((count, 2), -1.0) for widening, _ in SURE_STEPS}
        while not settled.all():
            seed = int(np.argmax(np.where(settled, -1.0, support)))
            settled[seed] = True
            for widening, sure in SURE_STEPS:
                self._spread(settled, closeness, sure, widening, tried[widening])

    def _learn_pairs(self, closeness: Float) -> None:
        """Learn how well true and wrong pairs agree, from pairs that lie close by their noisy poses."""
        for number in range(0, len(self), max(1, len(self) // MORE_SEARCHES)):
            self.learn_floor(number)
        nearest = closeness.argmax(axis=1)
        best = np.argsort(-closeness.max(axis=1), kind="stable")
        for number in best[: 4 * FIRST_SEARCHES : 2].tolist():
            if closeness[number, nearest[number]] == 0 or self.placer.agreement.true_fits() is not None:
                break
            self._against(number, nearest[number : number + 1], int(self.group[nearest[number]]), np.inf, 1.0)

    def _spread(self, settled: Bool, closeness: Float, sure: float, widening: float, tried: Float) -> None:
        """Place what is ready, the best supported first; again only with more support, or where less odds will do.

        tried: (N, 2), the support and the odds at the last try; updated.
        """
        while True:
            backing = closeness[:, settled].sum(axis=1)
            ready = ~settled & (backing > 0.2) & ((backing > 1.3 * tried[:, 0]) | (tried[:, 1] >= sure))
            if not ready.any():
                return
            number = int(np.argmax(np.where(ready, backing, -1.0)))
            self._last_odds = -np.inf
            settled[number] = self.place(number, settled, sure, widening)
            tried[number] = backing[number], min(self._last_odds, np.nextafter(sure, -np.inf))

    def _closeness(self, numbers: Int) -> Float:
        """(N, N): about which share of floor two snapshots have in common, by their noisy poses."""
        xy = self.priors[numbers, :2]
        squared = np.square(xy[:, None] - xy[None]).sum(axis=-1)
        near = np.exp(-squared / (2 * (0.45 * np.mean(self.size_px)) ** 2))
        np.fill_diagonal(near, 0.0)
        return np.where(near > 0.02, near, 0.0)

    def place(self, number: int, among: Bool, sure: float = SURE_NATS, widening: float = 1.0) -> bool:
        """Join a snapshot to the groups that its picture fits; True where it fits one.

        among: (N,), the snapshots that may be joined. sure: the least log-odds. widening: of the reach.
        """
        near = self._near(number, among, widening)
        near = near[self.group[near] != self.group[number]]
        groups, first, sizes = np.unique(self.group[near], return_index=True, return_counts=True)
        joined = False
        for group in groups[np.lexsort((first, -sizes))][:GROUPS_TRIED]:
            fits, odds = self._against(number, near[self.group[near] == group], int(group), sure, widening)
            if fits:
                self.odds[number] = max(odds, self.odds[number])
                self._join(number, fits)
                joined = True
        return joined

    def _near(self, number: int, among: Bool, widening: float) -> Int:
        candidates = np.flatnonzero(among)
        apart = np.hypot(*(self.poses[candidates, :2] - self.poses[number, :2]).T)
        reach = max(REACH_SIGMAS * self.sigmas[0] * widening, LEAST_REACH * self.size_px[0])
        limit = 0.85 * np.mean(self.size_px) + reach
        order = np.lexsort((candidates, apart))
        near = candidates[order[apart[order] < limit]][:MAP_VIEWS]
        return np.asarray(near[near != number], dtype=np.int64)

    def _against(self, number: int, near: Int, group: int, sure: float, widening: float) -> tuple[list[Edge], float]:
        """The fits to a group's snapshots near it, and the odds of the place; no fits where none stands out."""
        alone, together = (len(self.members(g)) for g in (int(self.group[number]), group))
        sigmas = self.sigmas * np.sqrt(1 / alone + 1 / together)
        among = self._neighbours(near)
        decision = self.placer.decide(self.views[number], self.poses[number], sigmas, among, sure, widening)
        self._last_odds = max(self._last_odds, decision.odds)
        return [Edge(int(near[n]), number, fit) for n, fit in decision.fits], decision.odds

    def _neighbours(self, numbers: Int) -> Neighbours:
        return Neighbours([self.views[n] for n in numbers], self.poses[numbers])

    def learn_floor(self, number: int) -> None:
        """Learn from this snapshot how much the floor repeats, while that is not known well enough."""
        known = self.placer.agreement
        wanted = MORE_SEARCHES if known.repeats > REPEATS else FIRST_SEARCHES
        if number and known.searches < wanted:
            phi, phi_beside = self.priors[number, 2], self.priors[number - 1, 2]
            self.placer.learn_wrong(self.views[number], float(phi), self.views[number - 1], float(phi_beside))

    def _join(self, number: int, edges: list[Edge]) -> None:
        """Carry the smaller group to where the edges say, and make one group of the two."""
        own, other = int(self.group[number]), int(self.group[edges[0].tail])
        here, there = self.members(own), self.members(other)
        pose, weight = mean_pose(Neighbours(self.views, self.poses), [(e.tail, e.fit) for e in edges])
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
        if np.abs(aligned - self.poses[members])[:, :2].max() > self._slack_px(members):
            self.poses[members] = aligned
        if len(members) >= 5 and group == self.main_group():
            self.sigmas = self._learned_sigmas(members)

    def _slack_px(self, members: Int) -> float:
        """How far a group's frame may lie from where the noisy poses say."""
        if not self.frame_slack_sigmas:
            return self.frame_slack_px
        sigma_xy, sigma_phi = self.sigmas[0], self.sigmas[2]
        places = self.poses[members, :2]
        off = ((places - places.mean(axis=0)) ** 2).sum(axis=1)
        turn = 1 / (len(members) / sigma_phi**2 + off.sum() / sigma_xy**2)
        sigma_px = np.sqrt(sigma_xy**2 / len(members) + turn * off.max())
        return max(self.frame_slack_px, float(self.frame_slack_sigmas * sigma_px))

    def _learned_sigmas(self, members: Int) -> Float:
        residuals = np.abs(self.prior_residuals(members))
        count = len(members) - 1.5
        xy = np.median(residuals[:, :2]) / 0.6745
        phi = np.median(residuals[:, 2]) / 0.6745
        found = np.array([xy, xy, phi]) * np.sqrt(len(members) / count)
        share = count / (SIGMA_STRENGTH + count)  # of logarithms: a claim ten times too great must not outweigh
        blend = self.claimed ** (1 - share) * np.maximum(found, self.claimed / SIGMA_RANGE) ** share
        return np.asarray(np.minimum(blend, self.claimed * SIGMA_RANGE))

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
