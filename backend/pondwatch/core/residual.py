"""What a rod's surroundings look like in this pond, learned from all of them, and where one looks otherwise.

Pure: arrays in, arrays out. Cells of one kind look alike but for the light, which may slope across a cell: each is
fitted by the median of all (a gain that slopes and a level, for each colour), and what is left is the residual. How
large residuals are where nothing lies is measured too, place by place in the cell and at several widths: at the edges
of a ring they are larger than on a plain, in bad water larger than in clear.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import cv2
import numpy as np

from .cells import EMPTY, FULL, OTHER, VACANT, Cells
from .ports import Spread, one_by_one
from .values import Bool, Float32, Int

WIDTHS_PX = (0.0, 1.5, 3.5, 8.0)  # sigma over which residuals are summed: things are of any size
_TOGETHER = ((EMPTY, FULL, OTHER), (VACANT,))  # kinds whose residuals are alike
_LEAST_TO_LEARN = 6  # cells of a kind
_MOST_TO_LEARN = 60
_LEAST_OF_CELL = 0.65  # of what is seen of the one that most is seen of, to learn from it
_LEAST_TO_FIT = 0.3  # of a whole cell
_LEAST_SIGMA = 0.8  # grey levels
_ROUNDS = 2
_STIFF = np.array([20.0, 20.0, 20.0, 1e-3], np.float32)  # holds a light that a cell says nothing of
_FIVE = np.ones((5, 5), np.uint8)
_BRIGHT = 200.0  # grey levels, from which a colour may be burnt in some of the looks
_LEAST_INSIDE = 0.6  # of the inside of a rod that must be seen to say how bright it is
_RIM_PX = 1.5  # round the inner circle, which belongs to neither side


@dataclass(frozen=True, slots=True, eq=False)
class Residuals:
    """What the layout and the learned look do not explain. z: (K, P, P), the greatest over widths, in standard
    deviations of what is left where nothing lies; 0 where not examined. grey: (K, P, P, 3), levels. examined: (K, P,
    P). expected: (K, P, P, 3), the learned look in the cell's light."""

    z: Float32
    grey: Float32
    examined: Bool
    expected: Float32


def residuals(cells: Cells, inner_px: float, spread: Spread = one_by_one) -> Residuals:
    """Learn how cells look, and where each looks otherwise.

    Args:
        inner_px: the rods' inner radius, px of the raster.
    """
    learned = _Learned.of(cells, inner_px)
    explained = spread(lambda k: learned.explained(cells, k), range(len(cells.kind)), (), large=True)
    expected = np.array([e for e, _ in explained], np.float32).reshape(cells.value.shape)
    examined = np.array([e for _, e in explained], bool).reshape(cells.seen.shape)
    for kinds in _TOGETHER:
        mine = _of_kinds(cells, examined, kinds)
        if len(mine) < _LEAST_TO_LEARN:
            examined[mine] = False
    grey = np.where(examined[..., None], cells.value - expected, np.float32(0))
    most = spread(lambda width: _significance(cells, grey, examined, width), WIDTHS_PX, (), large=True)
    z = np.where(examined, np.sqrt(np.max(most, axis=0)), np.float32(0))
    return Residuals(z, grey, examined, expected)


@dataclass(frozen=True, slots=True, eq=False)
class _Learned:
    """How cells of each kind look: looks (P, P, 3), known in areas (P, P); none where too little was seen. inside,
    outside: (P, P), of the inner circle. whole: (P, P), what any cell shows. light: (P, P, 3)."""

    looks: dict[int, Float32]
    areas: dict[int, Bool]
    inside: Bool
    outside: Bool
    whole: Bool
    light: Float32

    @classmethod
    def of(cls, cells: Cells, inner_px: float) -> _Learned:
        """Of all cells together."""
        steps = np.arange(-cells.reach, cells.reach + 1, dtype=np.float32)
        radius = np.hypot(steps[None, :], steps[:, None])
        inside, outside = radius < inner_px - _RIM_PX, radius > inner_px + _RIM_PX
        learned = cls({}, {}, inside, outside, np.asarray(cells.seen.any(axis=0)), _light(steps))
        around = np.flatnonzero((cells.kind != VACANT) & _well_seen(cells, outside))
        look, known = _learn(cells, around, outside, learned.light)
        if look is not None:
            learned.looks.update(dict.fromkeys((EMPTY, FULL, OTHER), look))
            learned.areas.update(dict.fromkeys((EMPTY, FULL, OTHER), outside & known))
            learned._learn_insides(cells, look, known)
            vacant = np.flatnonzero((cells.kind == VACANT) & _well_seen(cells, radius >= 0))
            bare, known = _learn(cells, vacant, radius >= 0, learned.light)
            if bare is not None:
                learned.looks[VACANT], learned.areas[VACANT] = bare, known
        return learned

    def _learn_insides(self, cells: Cells, look: Float32, known: Bool) -> None:
        """What empty and full rods look like inside, in the light of what is around all."""
        for kind in (EMPTY, FULL):
            mine = _spread_evenly(np.flatnonzero((cells.kind == kind) & _well_seen(cells, self.outside)))
            if len(mine) >= _LEAST_TO_LEARN:
                fitted = _in_common_light(cells, mine, look, self.outside, self.light)
                within = _median_seen(fitted, cells.seen[mine])
                self.looks[kind] = np.where(self.inside[..., None], within, look)
                self.areas[kind] = (self.inside | self.outside) & known

    def explained(self, cells: Cells, k: int) -> tuple[Float32, Bool]:
        """(P, P, 3), how cell k should look, in its light; and (P, P), where that can be said of it."""
        kind, value, nothing = int(cells.kind[k]), cells.value[k], np.zeros(cells.seen[k].shape, bool)
        if kind not in self.looks:
            return np.zeros_like(value), nothing
        told_by = self.outside | (kind == VACANT)
        examined = cells.seen[k] & self.areas[kind]
        fit_area = examined & told_by & ~cells.burnt[k]
        if fit_area.sum() < _LEAST_TO_FIT * (self.areas[kind] & told_by & self.whole).sum():
            return np.zeros_like(value), nothing  # the light of a cell is not told by a corner of it
        expected = _relit(value, self.looks[kind], fit_area, self.light)
        if kind in (EMPTY, FULL):
            _level(value, expected, examined & self.inside, self.inside)
        return expected, _less_burnt(examined, cells.burnt[k], expected)


def _level(value: Float32, expected: Float32, area: Bool, inside: Bool) -> None:
    """Take the inside of a rod to be as bright as it is: how dark it is as a whole, its reading tells. In place."""
    if area.sum() > _LEAST_INSIDE * inside.sum():
        expected[inside] += np.median(value[area] - expected[area], axis=0)


def _less_burnt(area: Bool, burnt: Bool, expected: Float32) -> Bool:
    """(P, P): an area without the places where looks are burnt as they should be, for how bright it is there is not
    known; nor what lies next to them, nor slivers between them."""
    bright = burnt & (expected > _BRIGHT).any(axis=2)
    if not bright.any():
        return area
    left = area & (cv2.dilate(bright.astype(np.uint8), _FIVE) == 0)
    return np.asarray(cv2.morphologyEx(left.astype(np.uint8), cv2.MORPH_OPEN, _FIVE) > 0)


def _well_seen(cells: Cells, area: Bool) -> Bool:
    """(K,): of which cells enough was seen of an area to be learned from, next to the one that most was seen of."""
    own = (cells.seen & area).reshape(len(cells.seen), -1).sum(axis=1)
    return np.asarray(own > _LEAST_OF_CELL * max(1, int(own.max(initial=0))))


def _light(steps: Float32) -> Float32:
    """(P, P, 3): a level and two slopes."""
    across = steps / np.float32(max(1.0, float(steps[-1])))
    shape = (len(steps), len(steps))
    parts = np.ones(shape, np.float32), np.broadcast_to(across, shape), np.broadcast_to(across[:, None], shape)
    return np.asarray(np.stack(parts, axis=-1), np.float32)


def _learn(cells: Cells, which: Int, area: Bool, light: Float32) -> tuple[Float32 | None, Bool]:
    """(P, P, 3), the median of cells in a common light, None where they are too few; and (P, P), of which places of a
    cell it is known: beyond the outermost rods of a pond a cell has floor that few others have."""
    if len(which) < _LEAST_TO_LEARN:
        return None, np.zeros(area.shape, bool)
    which = _spread_evenly(which)
    look = _median_seen(cells.value[which], cells.seen[which])
    for _ in range(_ROUNDS):
        look = _median_seen(_in_common_light(cells, which, look, area, light), cells.seen[which])
    return look, cells.seen[which].sum(axis=0) >= _LEAST_TO_LEARN


def _spread_evenly(which: Int) -> Int:
    """At most `_MOST_TO_LEARN` of them."""
    some = np.linspace(0, len(which) - 1, min(len(which), _MOST_TO_LEARN)).round().astype(int)
    return np.asarray(which[np.unique(some)])


def _median_seen(value: Float32, seen: Bool) -> Float32:
    """(P, P, 3), the median of (K, P, P, 3) over those that saw a pixel; 0 where none did."""
    ordered = np.sort(np.where(seen[..., None], value, np.float32(np.inf)), axis=0)
    middle = np.maximum(seen.sum(axis=0) - 1, 0) // 2
    found = np.take_along_axis(ordered, np.broadcast_to(middle[..., None], value.shape[1:])[None], axis=0)[0]
    return np.where(np.isfinite(found), found, np.float32(0))


def _in_common_light(cells: Cells, which: Int, look: Float32, area: Bool, light: Float32) -> Float32:
    """Cells as they would look in the light of `look`."""
    out = np.empty((len(which), *look.shape), np.float32)
    for n, k in enumerate(which.tolist()):
        gain, level = _fit_light(cells.value[k], look, cells.seen[k] & area, light)
        out[n] = (cells.value[k] - level) / np.maximum(gain, np.float32(0.2))
    return out


def _relit(value: Float32, look: Float32, area: Bool, light: Float32) -> Float32:
    gain, level = _fit_light(value, look, area, light)
    return np.asarray(gain * look + level, np.float32)


def _fit_light(value: Float32, look: Float32, area: Bool, light: Float32) -> tuple[Float32, Float32]:
    """(P, P, 3) gain and (3,) level by which `look` becomes `value`: least squares, reweighted so that it lets go of
    what does not fit, over every third pixel each way; a gain that slopes, and a level, for each colour."""
    rows = _every_third(area)
    if len(rows) < 40:
        return np.ones_like(look), np.zeros(3, np.float32)
    model, target = (np.ascontiguousarray(part.reshape(-1, 3)[rows].T) for part in (look, value))
    design = np.ones((3, 4, len(rows)), np.float32)
    design[:, :3] = model[:, None] * light.reshape(-1, 3)[rows].T
    say, x = np.ones_like(model), np.zeros((3, 4), np.float32)
    for _ in range(2):
        weighted = design * say[:, None]
        normal = weighted @ design.transpose(0, 2, 1) + np.diag(_STIFF)
        x = np.linalg.solve(normal, weighted @ (target - model)[..., None])[..., 0]
        off = np.abs(target - model - (x[:, None] @ design)[:, 0])
        scale = 4 * np.maximum(_LEAST_SIGMA, 1.4826 * np.partition(off, len(rows) // 2, axis=1)[:, len(rows) // 2])
        say = np.clip(1 - (off / scale[:, None]) ** 2, 0, 1) ** 2
    return light @ x[:, :3].T + np.array(1, np.float32), x[:, 3]


def _every_third(area: Bool) -> Int:
    """Flat indices of every third pixel each way of a patch that lies in an area."""
    down, right = np.nonzero(area[::3, ::3])
    return np.asarray(3 * (down * area.shape[1] + right))


def _of_kinds(cells: Cells, examined: Bool, kinds: tuple[int, ...]) -> Int:
    """The cells of some kinds of which anything was examined."""
    return np.flatnonzero(np.isin(cells.kind, kinds) & examined.any(axis=(1, 2)))


def _significance(cells: Cells, grey: Float32, examined: Bool, width: float) -> Float32:
    """(K, P, P): the residual over a width in its standard deviations, the colours together, squared."""
    out = np.zeros(examined.shape, np.float32)
    fewer = np.sqrt(np.maximum(1.0, np.median(cells.looks) / np.maximum(cells.looks, 1)))[:, None, None, None]
    smooth, share = _smoothed(grey, examined, width)
    for kinds in _TOGETHER:
        mine = _of_kinds(cells, examined, kinds)
        if len(mine):
            some = _spread_evenly(mine)
            sigma = _spread(smooth[some], examined[some], width)
            z = smooth[mine] / (sigma * fewer[mine].astype(np.float32)) * _steadiness(share[mine], examined[mine])
            out[mine] = _together(z, examined[mine])
    return out


def _together(z: Float32, examined: Bool) -> Float32:
    """(K, P, P): three colours' deviations as one, squared. What light does to all colours alike counts for little,
    what one colour does alone for much (Mahalanobis' distance, by the correlation of what is left where nothing
    lies)."""
    usual = np.clip(z[examined][:: max(1, int(examined.sum()) // 20_000)], -3, 3).astype(np.float64)
    shared = np.corrcoef(usual.T) if len(usual) > 100 else np.eye(3)
    whitened = np.linalg.cholesky(np.linalg.inv(0.98 * np.nan_to_num(shared) + 0.02 * np.eye(3))).T / np.sqrt(3)
    alone = cv2.transform(z.reshape(1, -1, 3), whitened.astype(np.float32))
    return np.asarray(cv2.transform(alone * alone, np.ones((1, 3), np.float32)), np.float32).reshape(z.shape[:3])


def _smoothed(grey: Float32, examined: Bool, width: float) -> tuple[Float32, Float32]:
    """(K, P, P, 3), residuals summed over a width; and (K, P, P), of what share of that they could be."""
    if not width:
        return grey, examined.astype(np.float32)
    out, shares = np.empty_like(grey), np.empty(examined.shape, np.float32)
    for k in range(len(grey)):
        shares[k] = cv2.GaussianBlur(examined[k].astype(np.float32), (0, 0), width, borderType=cv2.BORDER_CONSTANT)
        total = cv2.GaussianBlur(grey[k], (0, 0), width, borderType=cv2.BORDER_CONSTANT)
        out[k] = total / np.maximum(shares[k], np.float32(0.25))[..., None]
    return out, shares


def _steadiness(share: Float32, examined: Bool) -> Float32:
    """(K, P, P, 1): by how much a residual summed over less of a width than in other cells deviates more for that."""
    usual = np.where(examined, share, np.float32(np.nan))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # places that no cell shows
        middle = np.nanmedian(usual, axis=0)
    return np.asarray(np.sqrt(np.clip(share / np.maximum(middle, np.float32(1e-3)), 0.05, 1)))[..., None]


def _spread(smooth: Float32, examined: Bool, width: float) -> Float32:
    """(P, P, 3): the standard deviation over cells of what is left, robustly; never under that of a plain."""
    sigma = np.float32(1.4826) * _median_seen(np.abs(smooth), examined)
    plain = float(np.median(sigma[sigma > 0])) if (sigma > 0).any() else 1.0
    soft = np.asarray(cv2.GaussianBlur(sigma, (0, 0), 1.0), np.float32)
    return np.maximum(soft, np.float32(max(0.5 * plain, _LEAST_SIGMA / (1 + width))))
