"""The method `lattice`: poses by the layout's geometry and the code that the rods' fill states write on it.

observe → places → joint decision → refinement → rods. See `observe`, `hypotheses`, `decision`, `inference`, `refine`
and `fill`. `add` decides new snapshots against what is known, and all together again whenever their number has grown
by a third; `settle` decides everything from the start, in the order of keys, so it does not depend on arrival.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from . import decision as dec
from .evidence import Evidence, Setting, gather, lean, widen
from .fill import read_rods
from .frames import wrap_angle
from .hypotheses import Reach, propose
from .inference import Decision, Problem, decide
from .noise import NoiseModel
from .placement import UNFITTED_TRUST, Placed, Placing, doubted, looks_of
from .pond import Layout
from .quality import judge
from .refine import Profile
from .values import CorrectedPose, Correction, Float, Inspection, Int, Quality, RodReading, Snapshot, SnapshotKey

GROWTH = 1.4  # snapshots since the last joint decision, over those in it, that call for another
PLACED_ABOVE = 0.99  # probability
MISFIT = 2.5  # times the typical residual, above which a place is doubted
MOVED_PX = 0.02  # poses that move less than this are not reported again
FULL_RESTARTS = 24  # of the search, when all is decided from the start
AGREE, AGREE_FEW = 3, 8  # runs that reach the best score, from which the search ends; few snapshots have more optima
LIVE_WORK = 900  # snapshots times restarts, while uploads go on
ENOUGH_TAUGHT = 60  # snapshots, from which the profile stays until all is decided from the start
NOISE_ROUNDS = 3
LOST_NATS = -4.0  # a place that is contradicted by this much may be none
FAR_NATS = -6.0  # log prior of a place, below which the noisy pose may be a gross error
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


class LatticeCorrector:
    """Corrects the poses of a pond with a layout."""

    method = "lattice"

    def __init__(self, inspection: Inspection, seed: int = 0) -> None:
        self._camera = inspection.camera
        self._setting = Setting.of(Layout.of(inspection.pond), inspection.camera)
        self._pitch = self._setting.layout.pitch
        self._stated = NoiseModel.stated(inspection.pose_noise, self._pitch)
        self._turns = dec.turns_of(self._setting)
        self._seed = seed
        self._placing = Placing(self._setting)
        self._evidence: dict[SnapshotKey, Evidence] = {}
        self._joint: Joint | None = None
        self._decided = 0
        self._poses: dict[SnapshotKey, CorrectedPose] = {}
        self._placed: dict[SnapshotKey, Placed] = {}
        self._rods = read_rods(self._setting.layout.ids, looks_of([], self._setting))
        self._log_state: Float | None = None
        self._profile: Profile | None = None
        self._typical = np.inf  # residual, grey levels
        self._taught = 0

    def add(self, snapshots: Sequence[Snapshot]) -> Correction:
        """Decide new snapshots at once; earlier ones may move when all are decided together again."""
        reach = (self._joint.noise if self._joint else self._stated).reach(self._pitch)
        new = [lean(gather(s, reach, self._setting)) for s in snapshots]
        self._evidence.update({e.snapshot.key: e for e in new})
        if self._joint is None or len(self._evidence) >= GROWTH * self._decided:
            return self._decide_all(list(self._evidence.values()), live=True)
        return self._publish([self._decide_one(e, self._joint) for e in new])

    def settle(self) -> Correction:
        """Decide everything from the start."""
        self._joint, self._profile = None, None
        reach = self._stated.reach(self._pitch)
        self._evidence = {k: self._afresh(self._evidence[k], reach) for k in sorted(self._evidence)}
        if not self._evidence:
            return Correction((), (), self.quality())
        return self._decide_all(list(self._evidence.values()), live=False)

    def _afresh(self, e: Evidence, reach: Reach) -> Evidence:
        """The evidence as it was before anything was learned."""
        return e if e.reach == reach else lean(gather(e.snapshot, reach, self._setting))

    def poses(self) -> Mapping[SnapshotKey, CorrectedPose]:
        """Every pose as it stands."""
        return self._poses

    def rods(self) -> tuple[RodReading, ...]:
        """Every rod as it stands."""
        return self._rods

    def quality(self) -> Quality:
        """How well it stands."""
        noise = self._joint.noise if self._joint else self._stated
        return judge(list(self._placed.values()), list(self._poses.values()), noise, self._camera, self._pitch)

    def _decide_all(self, evidence: list[Evidence], live: bool) -> Correction:
        joint, evidence = self._solve(evidence, live)
        self._evidence = {e.snapshot.key: e for e in evidence}
        self._joint, self._decided = joint, len(evidence)
        states = joint.decision.states
        self._log_state = np.log(np.maximum(states, 1e-30))
        kinds = self._placing.kinds(joint.vocabulary, states)
        chosen = [self._chosen(e, i, joint) for i, e in enumerate(evidence)]
        before = self._profile
        if before is None or not live or self._taught < ENOUGH_TAUGHT:
            self._profile = self._placing.learn(evidence, chosen, joint.trust, kinds, before.axis if before else None)
            self._taught = len(evidence)
        placed = [
            self._replaced(e, pose, float(t), kinds, joint, before is self._profile)
            for e, pose, t in zip(evidence, chosen, joint.trust, strict=True)
        ]
        residuals = [p.residual for p in placed if np.isfinite(p.residual)]
        self._typical = float(np.median(residuals)) if residuals else np.inf
        return self._publish(placed)

    def _replaced(self, e: Evidence, pose: Float | None, trust: float, kinds: Int, joint: Joint, same: bool) -> Placed:
        """Refined again, unless it lies at the place where it was refined before by the same profile."""
        old = self._placed.get(e.snapshot.key)
        if (
            same
            and old is not None
            and old.start is not None
            and pose is not None
            and old.start.tobytes() == pose.tobytes()
        ):
            return replace(old, evidence=e, trust=min(trust, 1.0 if old.fitted else UNFITTED_TRUST))
        return self._placing.place(e, pose, trust, kinds, self._profile, joint.noise)

    def _solve(self, evidence: list[Evidence], live: bool) -> tuple[Joint, list[Evidence]]:
        """Decide, learn the noise from the decision, look further for what found no place; until nothing changes."""
        noise = self._joint.noise if self._joint else self._stated
        first, second = dec.chains(evidence)
        restarts = int(np.clip(LIVE_WORK / len(evidence), 3, FULL_RESTARTS)) if live else FULL_RESTARTS
        joint = self._decide(evidence, noise, restarts if noise is not self._stated else 2, first, second)
        for _ in range(1 if live and noise is not self._stated else NOISE_ROUNDS):
            errors = np.array(
                [e.snapshot.pose_pond - p for e, p in zip(evidence, self._all(evidence, joint), strict=True)]
            )
            learned = noise.learned(errors, joint.trust, first, second, _spread(evidence, joint))
            evidence, widened = self._look_further(evidence, joint, learned)
            settled = _similar(noise, learned) and not widened
            if settled and (live or noise is not self._stated):
                break
            noise = learned
            joint = self._decide(evidence, noise, restarts, first, second)
            if settled:
                break
        return joint, evidence

    def _all(self, evidence: list[Evidence], joint: Joint) -> Iterable[Float]:
        for i, e in enumerate(evidence):
            pose = self._chosen(e, i, joint)
            yield e.snapshot.pose_pond if pose is None else pose

    def _decide(
        self, evidence: list[Evidence], noise: NoiseModel, restarts: int, first: np.ndarray, second: np.ndarray
    ) -> Joint:
        vocabulary = dec.Vocabulary.learn(evidence)
        tables = [dec.tabulate(e, vocabulary, noise, self._setting, self._turns) for e in evidence]
        ties = dec.tie_errors(evidence, noise, self._setting, first, second)
        problem = dec.assemble(tables, vocabulary, len(self._setting.layout.ids), ties)
        agree = AGREE if len(evidence) > 100 else AGREE_FEW
        decisions = decide(problem, self._seed, restarts, agree)
        return Joint(vocabulary, noise, problem, decisions[0], dec.trust(problem, decisions), len(decisions))

    def _chosen(self, e: Evidence, i: int, joint: Joint) -> Float | None:
        """The pose of the place decided for snapshot i; None for none of them."""
        at = int(joint.decision.choice[i] - joint.problem.start[i])
        return e.places.poses[at] if at < len(e.places) else None

    def _look_further(self, evidence: list[Evidence], joint: Joint, noise: NoiseModel) -> tuple[list[Evidence], bool]:
        """Snapshots that found no convincing place are looked for in the whole pond, against the rods as decided."""
        state = joint.decision.states
        out, widened = [], False
        for i, e in enumerate(evidence):
            if not e.far.any() and self._lost(e, i, joint):
                e = self._widened(e, joint, noise, state)
                widened = widened or bool(e.far.any())
            out.append(e)
        return out, widened

    def _lost(self, e: Evidence, i: int, joint: Joint) -> bool:
        """Whether a place is none, far from the noisy pose, or contradicted by what others say of its rods."""
        choice, problem = int(joint.decision.choice[i]), joint.problem
        at = choice - int(problem.start[i])
        if at >= len(e.places):
            return True
        nearest = float(problem.log_prior[problem.start[i] : problem.start[i + 1] - 1].max())
        if problem.log_prior[choice] - e.places.geometry[at] < min(FAR_NATS, nearest):
            return True
        edges = problem.edge_hypothesis == choice
        own = problem.look[problem.edge_look[edges]]
        others = joint.decision.states[problem.edge_rod[edges]] / np.maximum(own, 1e-12)
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
        gain = _gains(table, state)
        score = table.prior[:-1] + np.bincount(table.hypothesis, gain, len(everywhere))
        best = np.argsort(-score, kind="stable")[:FAR_PLACES]
        fresh = [h for h in np.sort(best) if not _known(everywhere.poses[h], full.places.poses, self._pitch)]
        return lean(widen(full, everywhere.poses[np.array(fresh, dtype=np.int64)], self._setting))

    def _decide_one(self, e: Evidence, joint: Joint) -> Placed:
        """Against the rods as they stand."""
        table = dec.tabulate(e, joint.vocabulary, joint.noise, self._setting, self._turns)
        assert self._log_state is not None
        state = np.exp(self._log_state)
        gain = _gains(table, state)
        score = table.prior + np.bincount(table.hypothesis, gain, len(table.prior))
        weight = np.exp(score - score.max())
        best = int(np.argmax(score))
        trust = float(weight[best] / weight.sum())
        pose = e.places.poses[best] if best < len(e.places) else None
        if pose is not None and trust > PLACED_ABOVE:
            self._learn_rods(table, best)
        kinds = self._placing.kinds(joint.vocabulary, np.exp(self._log_state))
        return self._placing.place(e, pose, trust, kinds, self._profile, joint.noise)

    def _learn_rods(self, table: dec.Table, place: int) -> None:
        assert self._log_state is not None
        rows = table.hypothesis == place
        np.add.at(self._log_state, table.rod[rows], np.log(np.maximum(table.values[table.look[rows]], 1e-30)))
        self._log_state -= self._log_state.max(axis=1, keepdims=True)
        self._log_state -= np.log(np.exp(self._log_state).sum(axis=1, keepdims=True))

    def _publish(self, placed: list[Placed]) -> Correction:
        moved = []
        for p in (doubted(p, MISFIT * self._typical) for p in placed):
            pose = self._placing.corrected(p, PLACED_ABOVE, self._joint.noise if self._joint else self._stated)
            if _differs(self._poses.get(pose.key), pose, MOVED_PX * self._camera.metres_per_pixel):
                moved.append(pose)
                self._poses[pose.key] = pose
            self._placed[p.evidence.snapshot.key] = p
        words = self._joint.vocabulary if self._joint else None
        looks = looks_of(
            [self._placed[k] for k in sorted(self._placed)], self._setting, words.palette if words else None
        )
        known = bool(words and words.palette.two_levels)
        rods = read_rods(self._setting.layout.ids, looks, words.full_prior() if words else None, known)
        changed = tuple(r for r, before in zip(rods, self._rods, strict=True) if r != before)
        self._rods = rods
        return Correction(tuple(moved), changed, self.quality())


def _gains(table: dec.Table, state: Float) -> Float:
    """(E,): nats that each look speaks for its place, given what its rod is known to hold."""
    return np.asarray(np.log(np.maximum(np.einsum("ek,ek->e", state[table.rod], table.values[table.look]), 1e-30)))


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
    )


def _known(pose: Float, poses: Float, pitch: float) -> bool:
    near = np.hypot(*(poses[:, :2] - pose[:2]).T) < 0.25 * pitch
    return bool((near & (np.abs(wrap_angle(poses[:, 2] - pose[2])) < 0.2)).any())


def _differs(before: CorrectedPose | None, after: CorrectedPose, reach_m: float) -> bool:
    if before is None or before.status != after.status or (before.pose_pond is None) != (after.pose_pond is None):
        return True
    if before.pose_pond is None or after.pose_pond is None:
        return False
    d = after.pose_pond - before.pose_pond
    return bool(np.hypot(d[0], d[1]) > reach_m or abs(wrap_angle(d[2])) > 1e-3)
