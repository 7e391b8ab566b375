"""The joint decision over a set of snapshots: decide, learn the noise from it, look further for what found no place.

Pure: what it is given it leaves as it was, so it may run beside a corrector that goes on taking snapshots.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from . import decision as dec
from .crossover import recombined, trust
from .evidence import Evidence, Setting, all_of, gather, lean, widen
from .factorgraph import Decision, Problem
from .frames import wrap_angle
from .hypotheses import Reach, propose
from .inference import decide, nudged
from .noise import NoiseModel
from .ports import Spread, one_by_one
from .values import Float, Int

FULL_RESTARTS = 24  # of the search, when all is decided from the start
AGREE, AGREE_FEW = 3, 8  # runs that reach the best score, from which the search ends; few snapshots have more optima
FEW = 100  # snapshots
LIVE_WORK = 900  # snapshots times restarts, while uploads go on
NOISE_ROUNDS = 3
THIN = 5.0  # looks a rod has, under which whole groups of snapshots may lie aside together
FAVOURS = 0.7, 2.0, 5.0  # nats, for places one lattice vector aside, in the search for such groups
BESIDE = 0.2  # pitches and rad, from exactly there
LOST_NATS = -4.0  # a place that is contradicted by this much may be none
FAR_NATS = -6.0  # log prior of a place, below which the noisy pose may be a gross error
OFTEN, CONVINCING = 0.03, 0.9995  # share of gross errors, from which every place under this probability may be none
FAR_PLACES = 24  # kept when a snapshot is looked for in the whole pond


@dataclass(frozen=True, slots=True, eq=False)
class Joint:
    """A joint decision over a set of snapshots."""

    vocabulary: dec.Vocabulary
    noise: NoiseModel
    problem: Problem
    decision: Decision
    trust: Float
    search: int  # runs of the search; how many assignments it weighed

    def chosen(self, e: Evidence, i: int) -> Float | None:
        """The pose of the place decided for snapshot i; None for none of its places."""
        at = int(self.decision.choice[i] - self.problem.start[i])
        return e.places.poses[at] if at < len(e.places) else None

    def known(self) -> Float:
        """(R, K): what is known of every rod's state, doubtful places counted as such."""
        return dec.known_states(self.problem, self.decision, self.trust)

    def belief(self, i: int) -> Float:
        """(H + 1,): the marginal of each place of snapshot i, the last for none."""
        return self.decision.belief[self.problem.start[i] : self.problem.start[i + 1]]


class Solver:
    """Decides in one setting."""

    def __init__(self, setting: Setting, stated: NoiseModel, seed: int) -> None:
        self._setting, self._stated, self._seed = setting, stated, seed
        self._camera, self._pitch = setting.camera, setting.layout.pitch
        self._turns = dec.turns_of(setting)

    def tabulate(self, e: Evidence, joint: Joint) -> dec.Table:
        """The factors of one snapshot, read as a joint decision reads them."""
        return dec.tabulate(e, joint.vocabulary, joint.noise, self._setting, self._turns)

    def solve(
        self, evidence: list[Evidence], before: Joint | None, live: bool, spread: Spread = one_by_one
    ) -> tuple[Joint, list[Evidence]]:
        """Decide, learn the noise from the decision, look further for what found no place; until nothing changes."""
        noise = before.noise if before else self._stated
        first, second = dec.chains(evidence)
        restarts = int(np.clip(LIVE_WORK / len(evidence), 3, FULL_RESTARTS)) if live else FULL_RESTARTS
        thorough = before is not None
        words, known = dec.Vocabulary.learn(evidence, self._setting, spread), dict[Evidence, dec.Table]()
        apart = None if live else spread
        joint = self._decide(evidence, words, noise, restarts if thorough else 2, first, second, known, apart)
        for _ in range(1 if live and thorough else NOISE_ROUNDS):
            errors = np.array(
                [e.snapshot.pose_pond - p for e, p in zip(evidence, self._all(evidence, joint), strict=True)]
            )
            learned = noise.learned(errors, joint.trust, first, second, _spread(evidence, joint))
            evidence, widened = self._look_further(evidence, joint, learned, spread)
            settled = _similar(noise, learned) and not widened
            if settled and thorough:
                break
            noise, thorough = learned, True  # what was found by two runs is never the last word
            joint = self._decide(evidence, words, noise, restarts, first, second, known, apart)
            if settled:
                break
        return joint, evidence

    def _all(self, evidence: list[Evidence], joint: Joint) -> Iterable[Float]:
        for i, e in enumerate(evidence):
            pose = joint.chosen(e, i)
            yield e.snapshot.pose_pond if pose is None else pose

    def _decide(
        self,
        evidence: list[Evidence],
        vocabulary: dec.Vocabulary,
        noise: NoiseModel,
        restarts: int,
        first: Int,
        second: Int,
        known: dict[Evidence, dec.Table],
        spread: Spread | None,
    ) -> Joint:
        """known: tables of before, under another noise; takes up those made."""
        make = one_by_one if known or spread is None else spread

        def table(e: Evidence) -> dec.Table:
            return dec.tabulate(e, vocabulary, noise, self._setting, self._turns, known.get(e))

        tables = make(table, evidence, ())
        known.update(zip(evidence, tables, strict=True))
        ties = dec.tie_errors(evidence, noise, self._setting, first, second)
        problem = dec.assemble(tables, vocabulary, len(self._setting.layout.ids), ties)
        agree = AGREE if len(evidence) > FEW else AGREE_FEW
        decisions = decide(problem, self._seed, restarts, agree, spread=spread)
        best, rivals = recombined(problem, decisions)
        if _looks_a_rod(problem, best) < THIN:
            aside = nudged(problem, self._favours(evidence, problem, best))
            best, rivals = recombined(problem, [best, *decisions, *aside])
        return Joint(vocabulary, noise, problem, best, trust(problem, best, rivals), len(decisions))

    def _favours(self, evidence: list[Evidence], problem: Problem, best: Decision) -> list[Float]:
        """For each vector between neighbouring rods, nats for what lies that far from the best."""
        nowhere = np.full((1, 3), np.nan)
        poses = np.concatenate([part for e in evidence for part in (e.places.poses, nowhere)])
        off = poses - poses[best.choice][problem.owner]  # no number where either is no place
        at = np.flatnonzero(np.abs(wrap_angle(off[:, 2])) < BESIDE)
        out = []
        for step in self._setting.layout.steps:
            beside = np.zeros(len(problem.log_prior))
            beside[at] = np.hypot(*(off[at, :2] - step).T) < BESIDE * self._pitch
            out += [nats * beside for nats in (FAVOURS if len(evidence) <= FEW else FAVOURS[1:2])]
        return out

    def _look_further(
        self, evidence: list[Evidence], joint: Joint, noise: NoiseModel, spread: Spread
    ) -> tuple[list[Evidence], bool]:
        """Snapshots that found no convincing place are looked for in the whole pond, against the rods as decided."""
        edges = [slice(a, b) for a, b in pairwise(joint.problem.first_edges.tolist())]
        lost = [i for i, e in enumerate(evidence) if not e.far.any() and self._lost(e, i, joint, noise, edges[i])]
        out, state = list(evidence), joint.decision.states
        wider = spread(lambda i: self._widened(evidence[i], joint, noise, state), lost, all_of(evidence), large=True)
        for i, e in zip(lost, wider, strict=True):
            out[i] = e
        return out, any(e.far.any() for e in wider)

    def _lost(self, e: Evidence, i: int, joint: Joint, noise: NoiseModel, edges: slice) -> bool:
        """Whether a place is none, doubtful where poses are often grossly wrong, far from the noisy pose, or
        contradicted by what others say of its rods. edges: the snapshot's."""
        choice, problem = int(joint.decision.choice[i]), joint.problem
        at = choice - int(problem.start[i])
        if at >= len(e.places) or (noise.gross > OFTEN and joint.trust[i] < CONVINCING):
            return True
        nearest = float(problem.log_prior[problem.start[i] : problem.start[i + 1] - 1].max())
        if problem.log_prior[choice] - e.places.geometry[at] < min(FAR_NATS, nearest):
            return True
        of_choice = edges.start + np.flatnonzero(problem.edge_hypothesis[edges] == choice)
        own = problem.look[problem.edge_look[of_choice]]
        others = joint.decision.states[problem.edge_rod[of_choice]] / np.maximum(own, 1e-12)
        gains = -np.log(np.maximum(others.sum(axis=1), 1e-30))
        return float(np.minimum(gains, 0).sum() + e.places.geometry[at]) < LOST_NATS

    def _widened(self, e: Evidence, joint: Joint, noise: NoiseModel, state: Float) -> Evidence:
        full = gather(e.snapshot, noise.reach(self._pitch), self._setting)
        everywhere = propose(full.found, e.snapshot.pose_pond, Reach(np.inf, np.pi), self._setting.layout, self._camera)
        if not len(everywhere):
            return e
        wide = widen(
            replace(full, places=everywhere.take(np.zeros(0, dtype=np.int64)), far=full.far[:0]),
            everywhere.poses,
            self._setting,
        )
        table = dec.tabulate(wide, joint.vocabulary, noise, self._setting, self._turns)
        gain = gains(table, state)
        score = table.prior[:-1] + np.bincount(table.hypothesis, gain, len(everywhere))
        best = np.argsort(-score, kind="stable")[:FAR_PLACES]
        fresh = [h for h in np.sort(best) if not _known(everywhere.poses[h], full.places.poses, self._pitch)]
        return lean(widen(full, everywhere.poses[np.array(fresh, dtype=np.int64)], self._setting))


def gains(table: dec.Table, state: Float) -> Float:
    """(E,): nats that each look speaks for its place, given what its rod is known to hold."""
    return np.asarray(np.log(np.maximum(np.einsum("ek,ek->e", state[table.rod], table.values[table.look]), 1e-30)))


def _looks_a_rod(problem: Problem, decision: Decision) -> float:
    """How many snapshots see a rod that any sees, on the mean."""
    chosen = np.zeros(len(problem.log_prior), dtype=bool)
    chosen[decision.choice] = True
    rods = problem.edge_rod[chosen[problem.edge_hypothesis]]
    return len(rods) / max(len(np.unique(rods)), 1)


def _spread(evidence: list[Evidence], joint: Joint) -> tuple[Float, Float, Float]:
    """Squared errors of every place within reach, m² and rad², and their beliefs."""
    xy, theta, belief = [], [], []
    for e, start in zip(evidence, joint.problem.start, strict=False):
        near = np.flatnonzero(e.far == 0)
        d = e.places.poses[near] - e.snapshot.pose_pond
        xy.append((d[:, :2] ** 2).sum(axis=1))
        theta.append(wrap_angle(d[:, 2]) ** 2)
        belief.append(joint.decision.belief[start + near])
    return np.concatenate(xy), np.concatenate(theta), np.concatenate(belief)


def _similar(a: NoiseModel, b: NoiseModel) -> bool:
    return (
        abs(np.log(a.sigma_xy_m / b.sigma_xy_m)) < 0.2
        and abs(np.log(a.sigma_theta_rad / b.sigma_theta_rad)) < 0.3
        and abs(a.correlation - b.correlation) < 0.1
        and abs(np.log(a.gross / b.gross)) < 1.0
    )


def _known(pose: Float, poses: Float, pitch: float) -> bool:
    near = np.hypot(*(poses[:, :2] - pose[:2]).T) < 0.25 * pitch
    return bool((near & (np.abs(wrap_angle(poses[:, 2] - pose[2])) < 0.2)).any())
