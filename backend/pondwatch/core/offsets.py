"""How far every rod stands off its place in the layout, from the floor that all looks agree on.

Pure: arrays in, arrays out. A rod's ring is fitted by what rings of this pond look like (`residual.py`), moved: first
to whole pixels, then by least squares (Gauss-Newton), reweighted so that a thing that lies on the ring loses its say.

Poses come from the same rods. A rod that stands off draws every snapshot that shows it along, unless the refinement
lets go of what does not fit (`refine.py`): it does in clear water, and in bad water not. Then the rod seems to stand
off by less than it does, and its neighbours the other way. A pose is, to first order, the least-squares motion of the
rods in it, so what an offset gives to each neighbour is known but for one factor, from 0 (let go of) to 1 and a
little over. The factor is taken that leaves the neighbours where they should be, and the offsets are made whole with
it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from .cells import Cells
from .consensus import Look
from .frames import pond_to_image
from .residual import Residuals
from .values import Bool, Camera, Float, Float32, Int, Pond

_RING = 1.12  # outer radii: how far a ring is looked at
_CLEAR_PX = 5  # round a ring: what interpolation and slopes reach for
_LEAST_SEEN = 0.4  # of a ring's pixels
_ROUNDS = 15
_MISFIT, _MISFIT_SHARE = 4.0, 0.1  # standard deviations, of so much of a ring: then it is looked for in whole pixels
_GRID_PX = 1 / 32  # warps are no finer: a step is taken from where the model really is
_CLOSE_PX = 0.05  # the error that such a step leaves is of its second order
_LEAST_EXPLAINED = 0.5  # of what is seen at its place: less, and it is no ring
_SURE_SIGMA = 6.0  # from which a rod is taken to stand off when its neighbours are judged
_MOST_OFF = 100  # rods that may stand off at once
_ECHO = 0.1  # of the greatest offset: below it what a rod seems to be off may be another's doing
_FACTORS = np.linspace(0, 1.3, 14)
_FLOOR_PX = 0.01  # no ring is measured better


@dataclass(frozen=True, slots=True, eq=False)
class Offsets:
    """offset_m: (R, 2), m, pond frame, NaN where not measured. sigma_m: (R,), one standard deviation of x and of y.
    looks: (R,), at the rod."""

    offset_m: Float
    sigma_m: Float
    looks: Float


def measured(cells: Cells, found: Residuals, pond: Pond, metres_per_pixel: float) -> tuple[Float, Float]:
    """How far the ring of each cell lies from its place, and what that explains.

    Returns:
        (K, 2), m, pond frame, NaN where it cannot be told; and (K,), the share of what a ring at its place leaves
        unexplained that one there explains: a stain or glare on a ring moves the fit, and is not explained by it.
    """
    out, mended = np.full((len(cells.rod), 2), np.nan), np.zeros(len(cells.rod))
    for k, rod in enumerate(cells.rod.tolist()):
        if rod >= 0:
            inner, outer = (getattr(pond.rods[rod], n) for n in ("inner_radius_m", "outer_radius_m"))
            ring = _ring(cells.reach, inner / metres_per_pixel, outer / metres_per_pixel)
            out[k], mended[k] = _moved(cells.value[k], found.expected[k], found.examined[k], found.z[k], ring)
    return np.asarray(out * (metres_per_pixel, -metres_per_pixel)), mended


@lru_cache(maxsize=8)
def _ring(reach: int, inner_px: float, outer_px: float) -> Bool:
    """(P, P): which pixels of a patch a ring in its middle covers."""
    steps = np.arange(-reach, reach + 1)
    radius = np.hypot(steps[None, :], steps[:, None])
    ring = (radius > inner_px + 1.5) & (radius < _RING * outer_px)
    ring.flags.writeable = False
    return np.asarray(ring)


def settled(
    moved: Float, at_rod: Float, looks: Sequence[Look], camera: Camera, pond: Pond, metres_per_pixel: float
) -> Offsets:
    """Offsets of all rods, of what was measured of each.

    Args:
        moved: (R, 2), from `measured`. at_rod: (R,), how many looks each is of.
    """
    if np.isfinite(moved).any():
        moved = moved - np.nanmedian(moved, axis=0)  # an offset of all is not a rod's
    sigma = _sigma(moved, at_rod, _FLOOR_PX * metres_per_pixel)
    return Offsets(_made_whole(moved, sigma, looks, camera, pond), sigma, at_rod)


def _moved(value: Float32, expected: Float32, examined: Bool, z: Float32, ring: Bool) -> tuple[Float, float]:
    """(2,), px right and down: how far a ring lies from the middle of its patch, NaN where it cannot be told; and what
    share of the rest that explains."""
    usable, nowhere = examined & ring, (np.full(2, np.nan), 0.0)
    if usable.sum() < _LEAST_SEEN * ring.sum():
        return nowhere
    starts = [np.zeros(2)]
    if (z[usable] > _MISFIT).mean() > _MISFIT_SHARE:
        starts.append(_whole_pixels(value, expected, examined, ring))
    ends = [_settled_from(start, value, expected, examined, ring) for start in starts]
    explained = [_explained(value, expected, examined, ring, at) for at in ends]
    best = int(np.argmax(explained))
    if not explained[best] > _LEAST_EXPLAINED:
        return nowhere
    still = 1 - _explained(value, expected, examined, ring, np.zeros(2))
    return ends[best], 1 - (1 - explained[best]) / max(still, 1e-6)


def _settled_from(at: Float, value: Float32, expected: Float32, examined: Bool, ring: Bool) -> Float:
    """(2,), px: where the steps from a start end."""
    reach = len(ring) // 2
    half = int(np.abs(np.argwhere(ring.any(axis=0)) - reach).max()) + _CLEAR_PX
    for _ in range(_ROUNDS):
        from_there = np.round(at / _GRID_PX) * _GRID_PX
        near = _around(reach, half + int(np.abs(at).max()))
        step = np.clip(_step(value[near], expected[near], examined[near], ring[near], from_there), -1, 1)
        at = from_there + step
        if np.abs(step).max() < _CLOSE_PX:
            break
    return np.asarray(at)


def _explained(value: Float32, expected: Float32, seen: Bool, ring: Bool, at: Float) -> float:
    """The share, 0 to 1, of what is seen at a ring's place that the ring there explains, light apart."""
    if not np.hypot(*at) < len(ring) // 2:
        return 0.0
    there = np.array([[1, 0, at[0]], [0, 1, at[1]]], np.float64)
    size = (value.shape[1], value.shape[0])
    rows = np.flatnonzero(((cv2.warpAffine(ring.astype(np.float32), there, size) > 0.99) & seen).ravel())
    if len(rows) < max(40, _LEAST_SEEN * int(ring.sum())):
        return 0.0
    model = cv2.warpAffine(expected, there, size, flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    m, v = (_levelled(part, rows).astype(np.float64) for part in (model, value))
    alike = np.maximum((m * v).sum(axis=1), 0) ** 2 / np.maximum((m * m).sum(axis=1), 1e-3)
    return float(alike.sum() / max(float((v * v).sum()), 1e-3))


def _around(reach: int, half: int) -> tuple[slice, slice]:
    """The middle of a patch, `half` px each way."""
    part = slice(max(0, reach - half), reach + half + 1)
    return part, part


def _whole_pixels(value: Float32, expected: Float32, seen: Bool, ring: Bool) -> Float:
    """(2,), px: the whole step at which the ring fits best."""
    half = int(np.abs(np.argwhere(ring) - len(ring) // 2).max())
    room = len(ring) // 2 - half
    if room < 1:
        return np.zeros(2)
    cut = slice(room, len(ring) - room)
    mask = ring[cut, cut].astype(np.float32)
    have = np.where(seen[..., None], value, expected)
    cost = cv2.matchTemplate(have, np.ascontiguousarray(expected[cut, cut]), cv2.TM_SQDIFF, mask=cv2.merge([mask] * 3))
    row, column = np.unravel_index(int(np.argmin(cost)), cost.shape)
    best, here = float(cost[row, column]), float(cost[room, room])
    return np.array([column - room, row - room], np.float64) if best < 0.7 * here else np.zeros(2)


def _step(value: Float32, expected: Float32, seen: Bool, ring: Bool, at: Float) -> Float:
    """(2,), px: one Gauss-Newton step of the ring from `at`, with a gain and a level a colour."""
    there = np.array([[1, 0, at[0]], [0, 1, at[1]]], np.float64)
    size = (value.shape[1], value.shape[0])
    ring_here = cv2.warpAffine(ring.astype(np.float32), there, size) > 0.99
    rows = np.flatnonzero((ring_here & seen).ravel())
    if len(rows) < 40:
        return np.zeros(2)
    model = cv2.warpAffine(expected, there, size, flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    slopes = (cv2.Scharr(model, cv2.CV_32F, *way) for way in ((1, 0), (0, 1)))
    m, v, *slope = (_levelled(part, rows) for part in (model, value, *slopes))
    gain = np.clip((m * v).sum(axis=1) / np.maximum((m * m).sum(axis=1), 1e-3), 0.3, 3)[:, None]
    off = (v - gain * m).ravel()
    design = np.stack([(gain / -32 * s).ravel() for s in slope])  # (2, N): 32 is Scharr's own factor
    step = np.zeros(2)
    for _ in range(2):
        left = off - step @ design
        scale = max(0.5, 1.4826 * float(np.partition(np.abs(left), len(left) // 2)[len(left) // 2]))
        weighted = design / (1 + (left / (2 * scale)) ** 2)
        step = np.linalg.solve(weighted @ design.T + 1e-3 * np.eye(2), weighted @ off)
    return np.asarray(step, np.float64)


def _levelled(part: NDArray[Any], rows: Int) -> Float32:
    """(3, N): some pixels of (P, P, 3), less their mean, colour by colour."""
    chosen = np.ascontiguousarray(part.reshape(-1, 3)[rows].T)
    return np.asarray(chosen - chosen.mean(axis=1, keepdims=True))


def _sigma(moved: Float, looks: Float, least_m: float) -> Float:
    """(R,): by how far rods scatter that stand where they should, more where fewer looks agree."""
    if not np.isfinite(moved).any():
        return np.full(len(moved), np.nan)
    spread = max(1.4826 * float(np.nanmedian(np.abs(moved))), least_m)
    usual = float(np.median(looks[np.isfinite(moved[:, 0])]))
    return np.asarray(spread * np.sqrt(np.maximum(1.0, usual / np.maximum(looks, 1.0))))


def _made_whole(moved: Float, sigma: Float, looks: Sequence[Look], camera: Camera, pond: Pond) -> Float:
    """(R, 2): offsets with what the poses took of them given back, and taken from the neighbours. Rods that stand off
    are found one by one, the surest first, for each explains away some of what its neighbours seem to."""
    true, known = moved, np.isfinite(moved[:, 0])
    off: list[int] = []
    share = np.zeros((2 * len(moved), 0))
    while len(off) < _MOST_OFF:
        size = np.nan_to_num(np.hypot(*true.T))
        sure = np.where(size > _ECHO * size.max(), size / sigma, 0.0)
        sure[off] = 0.0
        if not sure.max() > _SURE_SIGMA:
            break
        off.append(int(np.argmax(sure)))
        share = np.hstack([share, _given_by(off[-1], looks, camera, pond)])
        rest = known & ~np.isin(np.arange(len(moved)), off)
        tries = [_undone(moved, off, factor * share) for factor in _FACTORS]
        true = tries[int(np.argmin([np.abs(t[rest]).sum() for t in tries]))]
    return np.where(known[:, None], true, np.nan)


def _undone(moved: Float, off: Sequence[int], share: Float) -> Float:
    """(R, 2): offsets where those of `off` (K) gave `share` (2 R, 2 K) of themselves to each rod."""
    rows = (2 * np.array(off)[:, None] + np.arange(2)).ravel()
    causes = np.linalg.lstsq(np.eye(len(rows)) - share[rows], moved[off].ravel(), rcond=None)[0]
    true = moved + (share @ causes).reshape(-1, 2)
    true[list(off)] = causes.reshape(-1, 2)
    return true


def _given_by(rod: int, looks: Sequence[Look], camera: Camera, pond: Pond) -> Float:
    """(2 R, 2): what an offset of a rod moves each other by, in the mean over the looks at that, where every look's
    pose is the least-squares motion of the rods in it."""
    places = np.array([(r.x_m, r.y_m) for r in pond.rods])
    size = np.array([camera.width_px, camera.height_px])
    reach = float(np.hypot(*size)) / 2 * camera.metres_per_pixel
    total, count = np.zeros((len(places), 2, 2)), np.zeros(len(places))
    for look in looks:
        if np.hypot(*(places[rod] - look.pose_pond[:2])) > 3 * reach:
            continue  # no rod of this look is near enough to have been drawn along
        near = np.flatnonzero(np.hypot(*(places - look.pose_pond[:2]).T) < reach)
        at = pond_to_image(places[near], look.pose_pond, camera)
        mine: Int = near[((at > 0) & (at < size - 1)).all(axis=1)]
        count[mine] += 1
        if rod in mine:
            arm = places[mine] - places[mine].mean(axis=0)
            across = np.stack([-arm[:, 1], arm[:, 0]], axis=1)
            turn = across[:, :, None] * across[mine == rod][:, None, :] / max(float((arm**2).sum()), 1e-12)
            total[mine] += np.eye(2) / len(mine) + turn
    return np.asarray(total / np.maximum(count, 1)[:, None, None]).reshape(-1, 2)
