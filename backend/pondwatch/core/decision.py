"""From the evidence of many snapshots to one factor graph, and from its solution back to places and trust."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise

import numpy as np

from . import states
from .codes import Palette, learn_palette, read_codes
from .evidence import SITE_REACH_PX, Evidence, Setting
from .factorgraph import Decision, Problem, Tie
from .frames import wrap_angle
from .mouths import log_odds_hollow, look_into
from .noise import NoiseModel
from .observe import RingBand
from .ports import Spread, both, one_by_one
from .values import Bool, Float, Int

NONE_NATS = -9.0  # log prior of lying at no place that was proposed, at least
HEADING_CLASS_RAD = 0.05  # places whose headings are this near share the likelihood of their looks
JUDGES = 48  # snapshots that hollow and filled rods are told apart by
EVEN = 0.35  # a rod whose sectors differ by less from one level is of that level
IN_VIEW = 0.12  # share of a rod's sectors in view, from which its look counts


@dataclass(frozen=True, slots=True, eq=False)
class Vocabulary:
    """How looks are read in a session: the palette, which states are in use, and how often."""

    palette: Palette
    states: Int
    prior: Float

    @classmethod
    def learn(cls, evidence: Sequence[Evidence], setting: Setting, spread: Spread = one_by_one) -> Vocabulary:
        """From all looks at rods found and wholly in view, each under its snapshot's first heading."""
        seen = [(e, _on_rods(e)) for e in evidence if len(e.places)]
        ratio = [e.codes.ratio[whole] for e, whole in seen]
        flat = np.concatenate(ratio).reshape(-1, 3) if ratio else np.zeros((0, 3))
        palette, mouths = both(spread, lambda: learn_palette(flat), lambda: _mouths(evidence, setting))
        palette = palette.judged(_mouths_nats(mouths, palette, setting.band))
        like = [np.zeros((0, states.COUNT))]
        for e, whole in seen:
            theta = np.full(int(whole.sum()), e.places.poses[0, 2])
            like.append(states.log_likelihood(palette.share(e.codes.ratio[whole]), e.codes.valid[whole], theta))
        stacked = np.concatenate(like)
        used, prior = states.prior_from(stacked, np.ones((len(stacked), 1), dtype=bool))
        return cls(palette, used, prior)

    def full_prior(self) -> Float:
        """(states.COUNT,): how frequent each state is; states not in use have a little."""
        prior = np.full(states.COUNT, 2e-4)
        prior[self.states] = np.maximum(self.prior, 2e-4)
        return np.asarray(prior / prior.sum())

    def looks(self, e: Evidence, theta_rad: float) -> Float:
        """(S, K): likelihood of what each site shows under each state, over its likelihood under the prior."""
        share = self.palette.share(e.codes.ratio)
        theta = np.full(len(share), theta_rad)
        like = np.asfortranarray(np.exp(states.log_likelihood(share, e.codes.valid, theta, kept=self.states)))
        return np.asarray(like / (like @ self.prior)[:, None])


def _on_rods(e: Evidence) -> Bool:
    """(S,): which sites lie on a rod that was found, wholly in view; places beyond the lattice have others too."""
    apart = np.hypot(*(e.sites_px[:, None] - e.found.centres_px[None]).transpose(2, 0, 1))
    return np.asarray(e.codes.valid.all(axis=1) & (apart.min(axis=1, initial=np.inf) < SITE_REACH_PX))


def _mouths(evidence: Sequence[Evidence], setting: Setting) -> list[tuple[Float, Float]]:
    """Of some snapshots, what their rods show along the radius, and their sectors."""
    band = setting.band
    few = np.unique(np.linspace(0, len(evidence) - 1, min(len(evidence), JUDGES)).round().astype(int))
    out = []
    for e in (evidence[i] for i in few):
        mouth = look_into(e.snapshot.image, e.found, band)
        codes = read_codes(e.snapshot.image, mouth.centres_px, band.inner_px, band.outer_px, setting.camera)
        out.append((mouth.along, codes.ratio))
    return out


def _mouths_nats(mouths: Sequence[tuple[Float, Float]], palette: Palette, band: RingBand) -> float:
    """Log odds that rods read as hollow are so and filled ones filled, by whether mouths show the ring's material."""
    kinds: tuple[list[Float], list[Float]] = ([], [])
    for mouth, ratio in mouths:
        share = palette.share(ratio)
        for along, sectors, level in zip(mouth, share, np.median(share, axis=1), strict=True):
            kind = round(float(level))
            if kind in (0, 1) and np.abs(sectors - kind).max() < EVEN:
                kinds[kind].append(along)
    hollow, filled = (log_odds_hollow(k, band.inner_px, band.outer_px) for k in kinds)
    return hollow - filled


@dataclass(frozen=True, slots=True, eq=False)
class Table:
    """One snapshot's part of the graph. prior: (H + 1,), nats, the last for no place. hypothesis, rod, look: (E,).
    values: (L, K)."""

    prior: Float
    hypothesis: Int
    rod: Int
    look: Int
    values: Float


def turns_of(setting: Setting) -> int:
    """How many headings map the layout's neighbour vectors onto themselves: six, four, or one."""
    steps = setting.layout.steps
    for turns in (6, 4, 2):
        a = 2 * np.pi / turns
        turned = steps @ np.array([[np.cos(a), np.sin(a)], [-np.sin(a), np.cos(a)]])
        gap = np.hypot(*(turned[:, None] - steps[None]).transpose(2, 0, 1)).min(axis=1, initial=np.inf)
        if len(steps) and (gap < 0.1 * setting.layout.pitch).all():
            return turns
    return 1


def tabulate(
    e: Evidence, vocabulary: Vocabulary, noise: NoiseModel, setting: Setting, turns: int, known: Table | None = None
) -> Table:
    """The factors of one snapshot.

    Args:
        known: the same under another noise, which only the prior knows of.
    """
    pond_m2, cell_m2 = _areas(setting)
    near = noise.log_prior(e.places.poses, e.snapshot.pose_pond, cell_m2, pond_m2, turns) + e.places.geometry
    prior = np.append(near, _none_nats(e, noise))
    return Table(prior, *_seen(e, vocabulary)) if known is None else replace(known, prior=prior)


def _seen(e: Evidence, vocabulary: Vocabulary) -> tuple[Int, Int, Int, Float]:
    """hypothesis, rod, look and values of a table. Headings under which all states look alike share their looks."""
    places, count = e.places, len(e.places)
    visible = (e.codes.valid.mean(axis=1) > IN_VIEW) if len(e.sites_px) else np.zeros(0, bool)
    group = np.round(wrap_angle(places.poses[:, 2]) / HEADING_CLASS_RAD).astype(np.int64) if count else np.zeros(0, int)
    step = states.heading_steps(places.poses[:, 2])
    hypothesis, rod, look, values = list[Int](), list[Int](), list[Int](), list[Float]()
    offset: dict[int, int] = {}  # of a heading's looks
    for g in sorted(set(group.tolist())):
        rows = np.flatnonzero(group == g)
        heading = int(step[rows[0]])
        if heading not in offset:
            offset[heading] = len(values) * len(e.sites_px)
            values.append(vocabulary.looks(e, float(places.poses[rows[0], 2])))
        site = e.site[rows]
        h, k = np.nonzero((site >= 0) & visible[site]) if len(visible) else np.nonzero(site >= 0)
        hypothesis.append(rows[h])
        rod.append(places.rods[rows[h], k])
        look.append(offset[heading] + site[h, k])
    none = np.zeros((0, len(vocabulary.prior)))
    return _joined(hypothesis), _joined(rod), _joined(look), np.concatenate(values) if values else none


def _none_nats(e: Evidence, noise: NoiseModel) -> float:
    """Log prior of lying at no place that was proposed: a gross error, and then whatever its rods show is as likely as
    not; rods that no place explains speak for none as little as for any. Once looked for in the whole pond a snapshot
    hardly lies elsewhere."""
    if e.far.any() or not len(e.places):
        return NONE_NATS
    return float(max(NONE_NATS, np.log(noise.gross) + e.places.geometry.max()))


@lru_cache(maxsize=8)
def _areas(setting: Setting) -> tuple[float, float]:
    """(pond, cell), square metres: the hull of the layout, and one rod's share of it."""
    size = np.ptp(setting.layout.centres, axis=0) + setting.layout.pitch
    pond = float(size[0] * size[1])
    return pond, min(pond / len(setting.layout.ids), setting.layout.pitch**2)


def _joined(parts: Sequence[Int]) -> Int:
    return np.concatenate(parts) if parts else np.zeros(0, dtype=np.int64)


def assemble(tables: Sequence[Table], vocabulary: Vocabulary, rods: int, ties: Sequence[Tie] = ()) -> Problem:
    """One graph of all snapshots' tables, in their order."""
    start = np.concatenate([[0], np.cumsum([len(t.prior) for t in tables])]).astype(np.int64)
    look_start = np.concatenate([[0], np.cumsum([len(t.values) for t in tables])])
    return Problem(
        start,
        np.concatenate([t.prior for t in tables]),
        _joined([t.hypothesis + start[i] for i, t in enumerate(tables)]),
        _joined([t.rod for t in tables]),
        _joined([t.look + look_start[i] for i, t in enumerate(tables)]).astype(np.int64),
        np.concatenate([t.values for t in tables]),
        vocabulary.prior,
        rods,
        ties,
    )


def chains(evidence: Sequence[Evidence]) -> tuple[Int, Int]:
    """(T,), (T,): consecutive snapshots of one robot and boot, by sequence."""
    order = sorted(range(len(evidence)), key=lambda i: evidence[i].snapshot.key)
    first, second = [], []
    for a, b in pairwise(order):
        ka, kb = evidence[a].snapshot.key, evidence[b].snapshot.key
        if (ka.robot, ka.boot) == (kb.robot, kb.boot):
            first.append(a)
            second.append(b)
    return np.array(first, dtype=np.int64), np.array(second, dtype=np.int64)


def tie_errors(evidence: Sequence[Evidence], noise: NoiseModel, setting: Setting, first: Int, second: Int) -> list[Tie]:
    """Ties by a first-order autoregressive error of the pose, for robots whose drift is smooth.

    The factor is the density of the second error given the first over its density alone, so that the priors of the
    two still count. Either may be a gross error, which says nothing of the other.
    """
    if noise.correlation <= 0:
        return []
    rho, left = noise.correlation, 1 - noise.correlation**2
    anywhere = np.log(noise.gross) + np.log(2 * np.pi * noise.sigma_xy_m**2 / _areas(setting)[0])
    sound = np.log1p(-noise.gross)
    errors = [_errors(e) / noise.sigma_xy_m for e in evidence]
    alone = [np.logaddexp(sound - (x**2).sum(axis=1) / 2, anywhere) for x in errors]
    regular = [sound - (x**2).sum(axis=1) / 2 - u for x, u in zip(errors, alone, strict=True)]
    ties = []
    for a, b in zip(first, second, strict=True):
        ea, eb = errors[a], errors[b]
        factor = np.zeros((len(ea) + 1, len(eb) + 1))
        step = -((eb[None] - rho * ea[:, None]) ** 2).sum(axis=-1) / (2 * left) - np.log(left)
        fresh = np.log(np.maximum(-np.expm1(np.minimum(regular[a], -1e-12)), 1e-12))
        near = np.logaddexp(regular[a][:, None] + step, fresh[:, None] - (eb**2).sum(axis=1) / 2)
        factor[:-1, :-1] = np.logaddexp(sound + near, anywhere) - alone[b]
        ties.append(Tie(int(a), int(b), factor))
    return ties


def _errors(e: Evidence) -> Float:
    return np.asarray(e.snapshot.pose_pond[:2] - e.places.poses[:, :2])


def known_states(problem: Problem, decision: Decision, sure: Float) -> Float:
    """(R, K): what is known of every rod's state, each snapshot's looks from all its places, as likely as these are.

    `Decision.states` takes the places chosen for granted. A new snapshot must not: held against looks that lie
    elsewhere it would agree with them at the wrong place, and be sure of it.

    Args:
        sure: (N,), probability of the chosen places; the others of a snapshot share what is left.
    """
    owner = problem.owner
    chosen = np.zeros(len(owner), dtype=bool)
    chosen[decision.choice] = True
    others = np.where(chosen, 0.0, decision.belief)
    rest = np.add.reduceat(others, problem.start[:-1])
    share = np.where(chosen, sure[owner], others * ((1 - sure) / np.maximum(rest, 1e-12))[owner])
    weight = share[problem.edge_hypothesis]
    pairs, pair = np.unique(owner[problem.edge_hypothesis] * problem.rods + problem.edge_rod, return_inverse=True)
    count, kinds = len(pairs), len(problem.state_prior)
    told = np.repeat(np.maximum(1.0 - np.bincount(pair, weight, count), 0.0)[:, None], kinds, axis=1)
    for k in range(kinds):
        told[:, k] += np.bincount(pair, weight * problem.look[problem.edge_look, k], count)
    log_state = np.tile(np.log(problem.state_prior), (problem.rods, 1))
    np.add.at(log_state, pairs % problem.rods, np.log(np.maximum(told, 1e-300)))
    state = np.exp(log_state - log_state.max(axis=1, keepdims=True))
    return np.asarray(state / state.sum(axis=1, keepdims=True))
