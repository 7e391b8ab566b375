"""What every rod is read as, from all looks at it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from . import states
from .codes import SECTORS
from .ranks import median
from .values import Bool, Float, Int, RodReading, RodState

EMPTY_BELOW, FULL_ABOVE = 0.05, 0.95
SECTOR_SIGMA = 0.15  # of one sector: water, caustics, blur, wedge edges
SECTOR_CAP = 4.0  # nats that one sector can cost a state
SEEN_ABOVE = 0.5  # probability that a rod was in view at all, under which it is not observed
LEAST_SEEN, SAME_ANYWHERE = 0.1, 0.95  # a rod less likely in view, where its state is this probable, seen or not
CONFLICT_SPREAD = 0.25  # of single looks about their median
FIRM = 0.99  # trust of looks that may conflict: one that may lie elsewhere contradicts nobody yet
STRANGE = 0.15  # share of a rod's sectors that show no known level, from which it is not like the others
ENOUGH_TAUGHT = 30  # rods that the levels were learned from; with fewer a strange rod is not read


@dataclass(frozen=True, slots=True, eq=False)
class Looks:
    """L looks at rods. rod: (L,). share: (L, SECTORS), pond orientation, 0 hollow to 1 filled. trust: (L,),
    probability that the snapshot lies where it was placed. strange: (L,), share of sectors that show no level known in
    the session; none where not given."""

    rod: Int
    share: Float
    trust: Float
    strange: Float | None = None


def to_pond(share: Float, theta_rad: Float) -> Float:
    """Turn (L, SECTORS) sectors from the image's orientation to the pond's, by linear interpolation.

    Args:
        theta_rad: (L,), headings. Sectors must all be in view.
    """
    shift = np.asarray(theta_rad) / (2 * np.pi / SECTORS)
    x = (np.arange(SECTORS) - shift[:, None]) % SECTORS
    k = np.floor(x).astype(np.int64) % SECTORS
    f = x - np.floor(x)
    rows = np.arange(len(share))[:, None]
    return np.asarray(share[rows, k] * (1 - f) + share[rows, (k + 1) % SECTORS] * f)


def read_rods(
    ids: tuple[str, ...], looks: Looks, prior: Float | None = None, certainty: float = 1.0, taught: int = ENOUGH_TAUGHT
) -> tuple[RodReading, ...]:
    """The reading of every rod; those without a look, or whose looks are more likely than not of other rods, are
    `unseen`, but where nearly all rods of the pond hold the same: then it is read, with no more confidence than that it
    was seen.

    All looks at a rod vote, sector by sector, for what it may hold (`states`); a sector hidden by something that
    drifts through the view costs a state only so much. A hollow or filled rod is then the mean of the sectors that
    bear it out; a partly filled one the mean of each sector's median over the looks.

    Args:
        prior: (states.COUNT,), how frequent each state is in this session; even where not given.
        certainty: the probability that hollow and filled are not taken for one another in this session.
        taught: rods that these levels were learned from. A rod that shows neither is not read while they are few, and
            conflicting where they are many.
    """
    n = len(ids)
    if not len(looks.rod):
        return tuple(_unseen(i) for i in ids)
    prior = np.full(states.COUNT, 1 / states.COUNT) if prior is None else prior
    views = np.bincount(looks.rod, looks.trust >= SEEN_ABOVE, n)
    missed = np.bincount(looks.rod, np.log1p(-np.minimum(looks.trust, 1 - 1e-9)), n)
    seen = -np.expm1(missed)  # by any of the looks
    order = np.argsort(looks.rod, kind="stable")
    start = np.searchsorted(looks.rod[order], np.arange(n + 1))
    templates = states.sector_templates()
    cost = sector_costs(looks.share, templates) * looks.trust[:, None]
    votes = np.zeros((n, states.COUNT))
    np.add.at(votes, looks.rod, -cost)
    votes += np.log(np.maximum(prior, 1e-9))
    chance = np.exp(votes - votes.max(axis=1, keepdims=True))
    chance /= chance.sum(axis=1, keepdims=True)
    surest = np.zeros(n)  # of its looks: snapshots that lie elsewhere may do so all together
    np.maximum.at(surest, looks.rod, looks.trust)
    readable = (surest >= SEEN_ABOVE) | ((seen >= LEAST_SEEN) & (_anyhow(chance, seen, prior) > SAME_ANYWHERE))
    strange = _strange(looks, n)
    if taught < ENOUGH_TAUGHT:
        readable &= ~strange
    readings = []
    for j in range(n):
        mine = order[start[j] : start[j + 1]]
        likely = mine[looks.trust[mine] >= SEEN_ABOVE]
        mine = likely if len(likely) else mine
        trust = float(surest[j]) * certainty
        if not readable[j]:
            readings.append(_unseen(ids[j]))
        else:
            firm = looks.trust[mine] >= FIRM
            read = _reading(ids[j], looks.share[mine], firm, chance[j], templates, trust, max(1, int(views[j])))
            odd = bool(strange[j] and surest[j] >= FIRM) and not read.conflicting
            readings.append(replace(read, confidence=read.confidence / 2, conflicting=True) if odd else read)
    return tuple(readings)


def _strange(looks: Looks, n: int) -> Bool:
    """(R,): rods that show no level known in the session, in the mean of their looks."""
    if looks.strange is None:
        return np.zeros(n, dtype=bool)
    weight = np.bincount(looks.rod, looks.trust, n)
    return np.asarray(np.bincount(looks.rod, looks.trust * looks.strange, n) > STRANGE * np.maximum(weight, 1e-9))


def _anyhow(chance: Float, seen: Float, prior: Float) -> Float:
    """(R,): probability of each rod's likeliest state, be it the rod that was looked at or any of the pond's."""
    likeliest = chance.argmax(axis=1)
    return np.asarray(seen * chance[np.arange(len(chance)), likeliest] + (1 - seen) * prior[likeliest])


def sector_costs(share: Float, templates: Float) -> Float:
    """(L, SECTORS) looks against (S, SECTORS) templates: (L, S) nats, each sector's squared error capped."""
    parts = [
        np.minimum((part[:, None] - templates[None]) ** 2 / (2 * SECTOR_SIGMA**2), SECTOR_CAP).sum(axis=-1)
        for part in np.array_split(np.clip(share, -0.5, 1.5), len(share) // 256 + 1)  # so that memory stays small
    ]
    return np.asarray(states.INDEPENDENT * np.concatenate(parts))


def _unseen(rod_id: str) -> RodReading:
    return RodReading(rod_id, RodState.UNSEEN, None, 0.0, 0)


def _reading(
    rod_id: str, share: Float, firm: Bool, chance: Float, templates: Float, trust: float, views: int
) -> RodReading:
    """One rod from (V, SECTORS) looks, (V,) which of them lie surely there, and (COUNT,) probabilities of its states.
    Looks that differ halve its confidence, and conflict where those differ that are firm."""
    likeliest = int(np.argmax(chance))
    p_empty, p_full = float(chance[states.EMPTY]), float(chance[states.FULL])
    if likeliest in (states.EMPTY, states.FULL):
        off = share - templates[likeliest]
        weight = 1 / (1 + (off / SECTOR_SIGMA) ** 4)
        fill = float((weight * share).sum() / weight.sum())
    else:
        fill = float(np.clip(median(share), 0, 1).mean())
    state = _state_of(likeliest, fill)
    sure = {RodState.EMPTY: p_empty, RodState.FULL: p_full}.get(state, max(0.0, 1 - p_empty - p_full))
    single = np.clip(share, 0, 1).mean(axis=1)
    apart, conflicting = _differ(single), bool(firm.any()) and _differ(single[firm])
    low, high = {RodState.EMPTY: (0.0, 0.0499), RodState.FULL: (0.9501, 1.0)}.get(state, (0.05, 0.95))
    confidence = min(sure * trust * (0.5 if apart or conflicting else 1.0), 0.9999)
    return RodReading(rod_id, state, float(np.clip(fill, low, high)), confidence, views, conflicting)


def _differ(single: Float) -> bool:
    """Whether enough of some looks' shares (V,) lie far from the others."""
    apart = np.abs(single - median(single)) > CONFLICT_SPREAD
    return bool(np.count_nonzero(apart) >= max(2, 0.3 * len(single)))


def _state_of(likeliest: int, fill: float) -> RodState:
    """Empty and full by the vote; a wedge by its measured share, should that be next to nothing or all."""
    if likeliest == states.EMPTY or fill < EMPTY_BELOW:
        return RodState.EMPTY
    return RodState.FULL if likeliest == states.FULL or fill > FULL_ABOVE else RodState.PARTIAL


def wholly_in_view(centres_px: Float, outer_px: float, width_px: int, height_px: int) -> Bool:
    """(...,): whether a rod's outer circle lies inside the image."""
    u, v = centres_px[..., 0] + 0.5, centres_px[..., 1] + 0.5
    return np.asarray((u >= outer_px) & (v >= outer_px) & (u <= width_px - outer_px) & (v <= height_px - outer_px))
