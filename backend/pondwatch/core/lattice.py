"""The method `lattice`: poses by the layout's geometry and the code that the rods' fill states write on it.

observe → places → joint decision → refinement → rods. See `observe`, `hypotheses`, `joint`, `inference`, `appearance`,
`refine` and `fill`. `add` decides new snapshots against what is known. All together are decided again when their number
has grown by some: at once while they are few; later `due` says so, and `deliberate` may run beside further calls of
`add`, its result taken over by `adopt`. `settle` decides everything from the start, in the order of keys, so it does
not depend on arrival.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from .appearance import Profile
from .decision import Table
from .evidence import Evidence, Setting, all_of, gather, lean
from .hypotheses import Reach
from .joint import Joint, Solver, gains
from .moves import differs, same
from .noise import NoiseModel
from .placement import UNFITTED_TRUST, Placed, Placing, doubted, elsewhere
from .pond import Layout
from .ports import RodFinder, Spread, one_by_one
from .quality import Tally
from .rodbook import Entry, RodBook
from .values import Bool, CorrectedPose, Correction, Float, Inspection, Int, Quality, RodReading, Snapshot, SnapshotKey

GROWTH = 1.4  # snapshots, over those in the last joint decision, that call for another
GROWTH_IN_DOUBT = 1.1  # the same, where many of the new ones are in doubt, as where robots enter new floor
DOUBTFUL, DOUBTFUL_SHARE = 8, 0.08  # new snapshots in doubt: at least so many, and this share of those decided
AT_ONCE = 40  # snapshots, up to which `add` decides all together itself
AT_ONCE_BESIDE = 6  # the same, where somebody calls `deliberate` beside
ENOUGH_TAUGHT = 60  # snapshots, from which the profile stays until all is decided from the start
PLACED_ABOVE = 0.998  # probability
MISFIT = 2.5  # times the typical residual, above which a place is doubted
RODS_EACH = 8  # rods that are read again for each snapshot that is decided again
MOVED_PX = 0.02  # poses that move less than this are not reported again


@dataclass(frozen=True, slots=True, eq=False)
class Deliberation:
    """A joint decision with everything that follows from it, ready to be adopted."""

    joint: Joint
    evidence: tuple[Evidence, ...]
    placed: tuple[Placed, ...]
    profile: Profile | None
    taught: int
    kinds: Int
    typical: float


class LatticeCorrector:
    """Corrects the poses of a pond with a layout."""

    method = "lattice"

    def __init__(
        self, inspection: Inspection, seed: int = 0, finder: RodFinder | None = None, spread: Spread = one_by_one
    ) -> None:
        self._camera, self._spread = inspection.camera, spread
        self._setting = Setting.of(Layout.of(inspection.pond), inspection.camera, finder)
        self._pitch = self._setting.layout.pitch
        self._stated = NoiseModel.stated(inspection.pose_noise, self._pitch)
        self._solver = Solver(self._setting, self._stated, seed)
        self._placing = Placing(self._setting)
        self._evidence: dict[SnapshotKey, Evidence] = {}
        self._poses: dict[SnapshotKey, CorrectedPose] = {}
        self._placed: dict[SnapshotKey, Placed] = {}
        self._book = RodBook(self._setting.layout.ids)
        self._tally = Tally()
        self._joint: Joint | None = None
        self._decided, self._doubtful = 0, 0
        self._log_state = np.zeros((0, 0))
        self._kinds = np.zeros(0, dtype=np.int64)
        self._profile: Profile | None = None
        self._taught, self._at_once = 0, AT_ONCE
        self._first: int | None = None  # snapshots that are decided together before any other; all where None
        self._again: list[SnapshotKey] = []  # decided before the last joint decision, still to be held against it
        self._typical = np.inf  # residual, grey levels

    def add(self, snapshots: Sequence[Snapshot]) -> Correction:
        """Decide new snapshots at once; earlier ones may move when all are decided together again."""
        new = self.hold(snapshots)
        if self._joint is None or (self.due() and len(self._evidence) <= self._at_once):
            held = list(self._evidence.values())
            return self.adopt(self._deliberate(held[: self._first], live=True))
        return self._publish([self._decide_one(e, self._joint) for e in new])

    def hold(self, snapshots: Sequence[Snapshot]) -> list[Evidence]:
        """Take snapshots without deciding them; `settle` will."""
        reach = (self._joint.noise if self._joint else self._stated).reach(self._pitch)
        images = [*snapshots, *(s.image for s in snapshots)]
        new = self._spread(lambda s: lean(gather(s, reach, self._setting)), snapshots, images)
        self._evidence.update({e.snapshot.key: e for e in new})
        return new

    def due(self) -> bool:
        """Whether all should be decided together again."""
        held, enough = len(self._evidence), GROWTH
        if self._doubtful >= max(DOUBTFUL, DOUBTFUL_SHARE * self._decided):
            enough = GROWTH_IN_DOUBT
        return held >= max(self._decided + 1, enough * self._decided)

    def deliberate(self) -> Deliberation:
        """Decide all together that are held now. Changes nothing; may run in another thread, beside `add`."""
        return self._deliberate(list(self._evidence.values()), live=True)

    def beside(self) -> None:
        """`add` leaves joint decisions, but for the very first ones, to whoever asks for them when they are due."""
        self._at_once = self._first = AT_ONCE_BESIDE

    def held(self) -> Sequence[object]:
        """The evidence, which a deliberation mostly leaves as it is, and all pictures."""
        return all_of(list(self._evidence.values()))

    def adopt(self, d: Deliberation) -> Correction:
        """Take over a deliberation. What came since it began is decided against it, and rods are read anew: at once, or
        by `catch_up` where somebody calls `deliberate` beside."""
        return self._adopt(d, at_once=self._first is None)

    def _adopt(self, d: Deliberation, at_once: bool) -> Correction:
        known = {e.snapshot.key for e in d.evidence}
        later = [k for k in self._evidence if k not in known]
        self._again = [] if at_once else [k for k in later if k in self._placed]
        now = [self._evidence[k] for k in later if at_once or k not in self._placed]
        self._evidence.update({e.snapshot.key: e for e in d.evidence})
        self._joint, self._decided, self._doubtful = d.joint, len(d.evidence), 0
        self._profile, self._taught, self._kinds, self._typical = d.profile, d.taught, d.kinds.copy(), d.typical
        self._log_state = np.log(np.maximum(d.joint.known(), 1e-30))
        words = d.joint.vocabulary
        self._book.read_by(words.palette, words.full_prior())
        return self._publish([*d.placed, *(self._decide_one(e, d.joint) for e in now)], put_off=not at_once)

    @property
    def behind(self) -> bool:
        """Whether something still stands as it did before the last deliberation was taken over."""
        return bool(self._again) or self._book.behind

    def catch_up(self, most: int) -> Correction:
        """Decide up to so many such snapshots again, and read some rods again."""
        now, self._again = self._again[:most], self._again[most:]
        assert self._joint is not None
        placed = [self._decide_one(self._evidence[key], self._joint) for key in now]
        return self._publish(placed, rods=RODS_EACH * most)

    def settle(self) -> Correction:
        """Decide everything from the start."""
        self._joint, self._profile = None, None
        reach = self._stated.reach(self._pitch)
        self._evidence = {k: self._afresh(self._evidence[k], reach) for k in sorted(self._evidence)}
        if not self._evidence:
            return Correction((), (), self.quality())
        before, self._poses, self._tally = self._poses, {}, Tally()
        said = self._adopt(self._deliberate(list(self._evidence.values()), live=False), at_once=True)
        return replace(said, poses=tuple(p for p in said.poses if not same(before.get(p.key), p)))

    def poses(self) -> Mapping[SnapshotKey, CorrectedPose]:
        """Every pose as it stands."""
        return self._poses

    def rods(self) -> tuple[RodReading, ...]:
        """Every rod as it stands."""
        return self._book.readings()

    def quality(self) -> Quality:
        """How well it stands."""
        noise = self._joint.noise if self._joint else self._stated
        palette = self._joint.vocabulary.palette if self._joint else None
        return self._tally.quality(noise, self._camera, self._pitch, palette)

    def _afresh(self, e: Evidence, reach: Reach) -> Evidence:
        """The evidence as it was before anything was learned."""
        return e if e.reach == reach else lean(gather(e.snapshot, reach, self._setting))

    def _deliberate(self, held: list[Evidence], live: bool) -> Deliberation:
        before = self._profile if live else None
        spread = one_by_one if live else self._spread  # live, the other cores have work of their own
        joint, evidence = self._solver.solve(held, self._joint if live else None, live, spread)
        kinds = self._placing.kinds(joint.vocabulary, joint.decision.states)
        chosen = [joint.chosen(e, i) for i, e in enumerate(evidence)]
        profile, taught = before, self._taught
        if before is None or taught < ENOUGH_TAUGHT:
            profile = self._placing.teaching.learn(
                evidence, chosen, joint.trust, kinds, before.axis if before else None, spread
            )
            taught = len(evidence)

        def place(i: int) -> Placed:
            trust = float(joint.trust[i])
            placed = self._place(evidence[i], chosen[i], trust, kinds, joint, profile, profile is before, live)
            at = int(joint.decision.choice[i] - joint.problem.start[i])
            return self._with_others(placed, joint.belief(i), at)

        placed = tuple(spread(place, range(len(evidence)), all_of(evidence)))
        residuals = [p.residual for p in placed if np.isfinite(p.residual)]
        typical = float(np.median(residuals)) if residuals else np.inf
        return Deliberation(joint, tuple(evidence), placed, profile, taught, kinds, typical)

    def _place(
        self,
        e: Evidence,
        pose: Float | None,
        trust: float,
        kinds: Int,
        joint: Joint,
        profile: Profile | None,
        same: bool,
        live: bool,
    ) -> Placed:
        """Refined, unless it lies where it was refined before by the same profile, with no less care.

        live: a pose whose place is in doubt anyway need not be as good as it can.
        """
        hasty = live and trust <= PLACED_ABOVE
        old = self._placed.get(e.snapshot.key) if same else None
        if (
            old is not None
            and old.hasty <= hasty
            and old.start is not None
            and pose is not None
            and np.array_equal(old.start, pose)
        ):
            return replace(old, evidence=e, trust=min(trust, 1.0 if old.fitted else UNFITTED_TRUST))
        return self._placing.place(e, pose, trust, kinds, profile, joint.noise, hasty)

    def _decide_one(self, e: Evidence, joint: Joint) -> Placed:
        """Against the rods as they stand; a sure place adds to what is known of its rods."""
        table = self._solver.tabulate(e, joint)
        gain = gains(table, np.exp(self._log_state))
        score = table.prior + np.bincount(table.hypothesis, gain, len(table.prior))
        weight = np.exp(score - score.max())
        best = int(np.argmax(score))
        rows = table.hypothesis == best
        trust = self._backed(float(weight[best] / weight.sum()), table, best, rows)
        pose = e.places.poses[best] if best < len(e.places) else None
        if pose is not None and trust > PLACED_ABOVE:
            self._learn(table.rod[rows], table.values[table.look[rows]], joint)
        self._doubtful += trust <= PLACED_ABOVE
        placed = self._place(e, pose, trust, self._kinds, joint, self._profile, same=True, live=True)
        return self._with_others(placed, weight / weight.sum(), best)

    def _backed(self, trust: float, table: Table, best: int, rows: Bool) -> float:
        """Trust in a place that rests on rods which other snapshots saw: no more than theirs, should they lie elsewhere
        all together; then its prior alone speaks for it."""
        seen_by = self._book.seen_by(table.rod[rows].tolist())
        backing = max((self._placed[key].trust for key in seen_by if key in self._placed), default=1.0)
        alone = np.exp(table.prior - table.prior.max())
        return float(backing * trust + (1 - backing) * alone[best] / alone.sum())

    def _with_others(self, p: Placed, belief: Float, chosen: int) -> Placed:
        """With its looks from other places, where its own is in doubt."""
        sure = p.trust > PLACED_ABOVE
        return replace(p, others=() if sure else elsewhere(p.evidence, belief, chosen, self._setting))

    def _learn(self, rods: Int, looks: Float, joint: Joint) -> None:
        log_state = self._log_state[rods] + np.log(np.maximum(looks, 1e-30))
        log_state -= log_state.max(axis=1, keepdims=True)
        self._log_state[rods] = log_state - np.log(np.exp(log_state).sum(axis=1, keepdims=True))
        self._kinds[rods] = self._placing.kinds(joint.vocabulary, np.exp(self._log_state[rods]))

    def _publish(self, placed: Sequence[Placed], rods: int = 0, put_off: bool = False) -> Correction:
        """Record where snapshots lie; what changed by that. rods: that were put off and are read now, at most."""
        moved = []
        noise = self._joint.noise if self._joint else self._stated
        for p in (doubted(p, MISFIT * self._typical) for p in placed):
            pose = self._placing.corrected(p, PLACED_ABOVE, noise)
            before = self._poses.get(pose.key)
            if differs(before, pose, MOVED_PX * self._camera.metres_per_pixel):
                moved.append(pose)
                self._poses[pose.key] = pose
                self._tally.count(before, pose, p.residual)
            self._placed[pose.key] = p
            theta = 0.0 if p.pose is None else float(p.pose[2])
            self._book.enter(pose.key, (Entry(p.rods, p.ratio, theta, p.trust), *p.others))
        if put_off:
            self._book.put_off()
        return Correction(tuple(moved), self._book.changed(rods), self.quality())
