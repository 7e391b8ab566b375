"""Where one snapshot lies among its neighbours, and how sure that is.

Pure. Map frame of `posegraph.py`, px, px, rad. The search on the neighbours' map names the places
(`registration.search`); where it is decisive the best is checked, else each is. A check refines the place at full
scale against the neighbours that share most with it and weighs each agreement as `agreement.py` has learned to; floor
that two neighbours both see counts once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy import fft

from . import posegraph as se2
from .agreement import NULL_NATS, Agreement, agreement
from .pairfit import Fit, refine
from .registration import HALF, Place, View, Whitener, draw_map, search, turned_half
from .values import Bool, Float, Float32

SURE_NATS = 9.0  # odds above which a place is taken for settled
REACH_SIGMAS = 3.5
LEAST_REACH = 0.25  # of a snapshot's width: the claimed noise may be too small
MOST_REACH = 1.2
LEAST_TURN_RAD = 0.2
MOST_FITS = 6
CHECKED_FITS = 4
CHECKED_PLACES = 6
LEAST_SHARED = 0.08
SAME_PLACE_PX = 3.0
ELSEWHERE_NATS = -4.0  # prior log-odds that the true place is not among those named
CONTRADICTED_NATS = -6.0
LEAST_TEXTURE = 0.02  # of a picture that is not flat


@dataclass(frozen=True, slots=True, eq=False)
class Neighbours:
    """Placed views to lie among: poses (N, 3), map frame."""

    views: Sequence[View]
    poses: Float


@dataclass(frozen=True, slots=True, eq=False)
class Decision:
    """pose: (3,), map frame; odds: nats for it against all else; fits: (neighbour, fit), none where it is not to be
    believed."""

    pose: Float
    odds: float
    fits: tuple[tuple[int, Fit], ...] = ()


@dataclass(slots=True, eq=False)
class _Check:
    """A place under test: what its fits so far say."""

    pose: Float
    nats: float = 0.0
    fits: list[tuple[int, Fit]] = field(default_factory=list)


def seen_by(size_px: tuple[int, int], pose: Float, poses: Float) -> Bool:
    """(N, 63): which of a grid of points of a snapshot at `pose` each of the snapshots at `poses` sees."""
    width, height = size_px
    u, v = (np.linspace(-0.5 + 0.5 / n, 0.5 - 0.5 / n, n) for n in (9, 7))
    grid = np.stack(np.meshgrid(u * width, v * height), axis=-1).reshape(-1, 2)
    floor = pose[:2] + se2.rotate(pose[2], grid)
    there = se2.rotate(-poses[:, 2:], floor[None] - poses[:, None, :2])
    return np.asarray((np.abs(there) < np.array([width, height]) / 2).all(axis=-1))


def mean_pose(neighbours: Neighbours, fits: Sequence[tuple[int, Fit]]) -> tuple[Float, Float]:
    """Where a snapshot lies by its fits, (3,), and each fit's information in the map frame, (F, 3, 3)."""
    tails = neighbours.poses[[n for n, _ in fits]]
    said = se2.compose(tails, np.array([f.relative for _, f in fits]))
    c, s = np.cos(tails[:, 2]), np.sin(tails[:, 2])
    turn = np.zeros((len(fits), 3, 3))
    turn[:, 0, 0], turn[:, 0, 1], turn[:, 1, 0], turn[:, 1, 1], turn[:, 2, 2] = c, -s, s, c, 1
    weight = turn @ np.array([f.information for _, f in fits]) @ turn.transpose(0, 2, 1)
    apart = said - said[0]
    apart[:, 2] = (apart[:, 2] + np.pi) % (2 * np.pi) - np.pi
    return said[0] + np.linalg.solve(weight.sum(axis=0), (weight @ apart[..., None]).sum(axis=0))[:, 0], weight


class Placer:
    """Decides places in one session and learns from them.

    size_px: width and height of a snapshot. floor: the session's views at their noisy poses, for the spectrum.
    """

    def __init__(self, size_px: tuple[int, int]) -> None:
        self.size_px = size_px
        self.floor = Neighbours([], np.zeros((0, 3)))
        self.agreement = Agreement()
        self._gains: dict[int, tuple[int, Float32]] = {}

    def decide(
        self, view: View, guess: Float, sigmas: Float, near: Neighbours, sure: float, widening: float = 1.0
    ) -> Decision:
        """The place of a view expected at guess (3,) with sigmas (3,); its fits are empty below odds of `sure`."""
        places = self._places(view, guess, sigmas, near, widening) if view.texture > LEAST_TEXTURE else []
        if not places:
            return Decision(guess, -np.inf)
        odds = self._search_odds(places)
        if self.agreement.true_fits() is None:
            self._try(view, places, near)
        if self.agreement.true_fits() is None:
            return Decision(guess, -np.inf)
        if odds >= SURE_NATS:
            best = self._check(view, places[0], near)
        else:
            best, odds = self._contest(view, places, near)
        fits = self._agreeing(best, near)
        if odds < sure or best.nats <= 0 or not fits:
            return Decision(best.pose, min(odds, best.nats))
        for _, fit in fits:
            self.agreement.tell_right(agreement(fit.rho))
        return Decision(mean_pose(near, fits)[0], odds, fits)

    def learn_wrong(self, view: View, phi: float, beside: View, phi_beside: float) -> None:
        """Learn from a search that cannot be right: a view turned by half a turn against another, each at its own
        heading, rad, so that rows stay parallel to rows."""
        wide = self.size_px[0]
        sigmas = np.array([wide / 6, wide / 6, 0.1])
        here = Neighbours([beside], np.array([[0.0, 0.0, phi_beside]]))
        guess = np.array([wide / 5, wide / 8, phi])
        turned = turned_half(view)
        places = self._places(turned, guess, sigmas, here, 1.0)
        told = []
        for place in places:
            fit = refine(beside, turned, se2.between(here.poses[0], place.pose))
            if fit is not None:
                told.append((agreement(fit.rho), fit.shared_px / float(np.prod(self.size_px))))
        self.agreement.tell_wrong(max((p.nats for p in places), default=0.0), told)

    def _gain(self, size: int) -> Float32:
        """The whitening gain for squares of `size`, learned anew while the views double in number up to 64."""
        views, phis = self.floor.views, self.floor.poses[:, 2]
        known = self._gains.get(size)
        if known is None or min(len(views), 64) >= 2 * known[0]:
            whitener = Whitener(size)
            for n in range(0, len(views), max(1, len(views) // 64)):
                whitener.learn(views[n], float(phis[n]))
            known = self._gains[size] = (len(views), whitener.gain())
        return known[1]

    def _places(self, view: View, guess: Float, sigmas: Float, near: Neighbours, widening: float) -> list[Place]:
        width = self.size_px[0]
        reach = float(np.clip(REACH_SIGMAS * sigmas[0] * widening, LEAST_REACH * width, MOST_REACH * width))
        turn = max(REACH_SIGMAS * sigmas[2], LEAST_TURN_RAD) * widening
        size = fft.next_fast_len(int((np.hypot(*self.size_px) + 2 * reach) / HALF) + 4, real=True)
        size += size % 2
        local = draw_map(near.views, near.poses, guess[:2], size)
        return search(view, local, self._gain(size), guess, sigmas, reach, turn, CHECKED_PLACES)

    def _search_odds(self, places: Sequence[Place]) -> float:
        """Log-odds of the first place by the search alone, in nats of which wrong places score NULL_NATS."""
        prior = [p.score - p.nats for p in places]
        scores = [p.nats / self.agreement.repeats + q for p, q in zip(places, prior, strict=True)]
        return float(scores[0] - np.logaddexp.reduce([*scores[1:], NULL_NATS + prior[0]]))

    def _try(self, view: View, places: Sequence[Place], near: Neighbours) -> None:
        """Note how well the best place agrees with the neighbour that shares most."""
        best = -1.0
        for place in places:
            seen = seen_by(self.size_px, place.pose, near.poses).mean(axis=1)
            k = int(seen.argmax())
            fit = refine(near.views[k], view, se2.between(near.poses[k], place.pose)) if seen[k] > 0.25 else None
            best = max(best, agreement(fit.rho) if fit else -1.0)
        if best > -1:
            self.agreement.tell_best(best)

    def _contest(self, view: View, places: Sequence[Place], near: Neighbours) -> tuple[_Check, float]:
        checks = [self._check(view, p, near, CHECKED_FITS) for p in places]
        totals = [c.nats + p.score - p.nats for c, p in zip(checks, places, strict=True)]
        best = int(np.argmax(totals))
        others = [t for n, t in enumerate(totals) if n != best]
        odds = float(totals[best] - np.logaddexp.reduce([*others, ELSEWHERE_NATS]))
        return checks[best], odds

    def _check(self, view: View, place: Place, near: Neighbours, most: int = MOST_FITS) -> _Check:
        """Refine a place against the neighbours that share most; each fit starts where the last ended."""
        check = _Check(place.pose)
        seen = seen_by(self.size_px, place.pose, near.poses)
        shared = seen.mean(axis=1)
        counted = np.zeros(seen.shape[1], dtype=bool)
        for k in np.argsort(-shared, kind="stable")[: most + 2].tolist():
            if shared[k] < LEAST_SHARED or len(check.fits) == most or check.nats < CONTRADICTED_NATS:
                break
            fit = refine(near.views[k], view, se2.between(near.poses[k], check.pose))
            fresh = float((seen[k] & ~counted).sum() / seen[k].sum())
            ratio = self.agreement.log_ratio(agreement(fit.rho) if fit else -0.5, float(shared[k]))
            check.nats += ratio * (fresh if ratio > 0 else 1.0)
            counted |= seen[k]
            if fit is not None and ratio > 0:
                check.fits.append((k, fit))
                check.pose = mean_pose(near, check.fits)[0]
        return check

    def _agreeing(self, check: _Check, near: Neighbours) -> tuple[tuple[int, Fit], ...]:
        """The fits that name the place which most of the evidence names; none where they are in two minds."""
        if not check.fits:
            return ()
        said = se2.compose(near.poses[[n for n, _ in check.fits]], np.array([f.relative for _, f in check.fits]))
        apart = np.hypot(*(said[:, None, :2] - said[None, :, :2]).transpose(2, 0, 1))
        support = np.array([f.shared_px for _, f in check.fits])
        same = apart < SAME_PLACE_PX
        best = int(np.argmax(same @ support))
        if support[same[best]].sum() < 0.67 * support.sum():
            return ()
        return tuple(f for f, keep in zip(check.fits, same[best], strict=True) if keep)
