"""A pond's floor cut into cells: what is nearer to a rod than to any other, a patch with the rod's place in its middle.

Pure: arrays in, arrays out. Sites that the lattice leaves vacant have their cells too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from .consensus import Consensus
from .frames import pond_to_raster
from .pond import neighbour_steps, tree_of
from .values import Bool, Float, Float32, Image, Int, Pond, RodReading, RodState

EMPTY, FULL, OTHER, VACANT = range(4)  # kinds: hollow, filled, anything else inside; a lattice site without a rod
LEAST_LOOKS = 3  # at a pixel: of two, one cannot say which is wrong
_OF_SIX, _OF_FOUR = 0.6, 0.72  # pitches that a cell of a hexagonal and of a square lattice reaches, and a little more
_RIM_PX = 4  # half a line that is drawn between two sites, and what it is smoothed over
_MOST_CELLS = 400  # at a time: bounds the memory at some hundred megabytes


@dataclass(frozen=True, slots=True, eq=False)
class Cells:
    """K cells, each (P, P) px. rod: (K,), index in the layout, -1 where there is none. kind: (K,). centre_px: (K, 2),
    raster frame. value: (K, P, P, 3). seen: (K, P, P), own floor, seen often enough. burnt: (K, P, P), as of the
    consensus. looks: (K,), the median."""

    rod: Int
    kind: Int
    centre_px: Float
    value: Float32
    seen: Bool
    burnt: Bool
    looks: Float

    @property
    def reach(self) -> int:
        """From the middle of a patch to its border, px."""
        return int(self.value.shape[1] - 1) // 2


@dataclass(frozen=True, slots=True, eq=False)
class Sites:
    """Where cells are: place (S, 2), m, pond frame; rod (S,), index in the layout, -1 where there is none; kind (S,);
    pitch, m, between neighbours. reach: pitches from a site to the farthest corner of its cell. steps: (M, 2), m, to
    neighbours."""

    place: Float
    rod: Int
    kind: Int
    pitch: float
    reach: float
    steps: Float

    def parts(self) -> list[Int]:
        """All sites, row by row from the top, in parts whose cells fit into some hundred megabytes."""
        order = np.lexsort((self.place[:, 0], -np.round(self.place[:, 1] / (0.3 * self.pitch))))
        return [part for part in np.array_split(order, -(-len(order) // _MOST_CELLS)) if len(part)]


def pitch_of(pond: Pond) -> float:
    """Metres between neighbouring rods of a layout; where there is one rod alone, four outer radii."""
    steps = neighbour_steps(np.array([(r.x_m, r.y_m) for r in pond.rods]))
    return float(np.hypot(*steps.T).min()) if len(steps) else 4 * pond.rods[0].outer_radius_m


def sites_of(pond: Pond, rods: Sequence[RodReading]) -> Sites:
    """The sites of a pond with a layout, and those that its lattice leaves vacant."""
    places = np.array([(r.x_m, r.y_m) for r in pond.rods])
    pitch, steps = pitch_of(pond), neighbour_steps(places)
    vacant = vacant_sites(places, steps, pitch, pond)
    kind = np.concatenate([[_kind(r) for r in rods], np.full(len(vacant), VACANT)]).astype(np.int64)
    rod = np.concatenate([np.arange(len(places)), np.full(len(vacant), -1)]).astype(np.int64)
    reach = _OF_SIX if len(steps) >= 6 else _OF_FOUR
    return Sites(np.concatenate([places, vacant]), rod, kind, pitch, reach, steps)


def cut(found: Consensus, pond: Pond, sites: Sites, which: Int) -> Cells:
    """The cells of some sites."""
    reach = max(4, int(np.ceil(sites.reach * sites.pitch / found.metres_per_pixel)))
    centre = pond_to_raster(sites.place[which], pond, found.metres_per_pixel)
    size = (2 * reach + 1, 2 * reach + 1)
    value = np.stack([_patch(found.image, c, size) for c in centre.tolist()])
    whole = np.round(centre).astype(int).tolist()
    count = np.stack([_eroded(_whole_patch(found.count, c, reach)) for c in whole])
    burnt = np.stack([_whole_patch(found.burnt.astype(np.uint8), c, reach) for c in whole]) > 0
    own = _nearest_to_own(sites, which, reach, found.metres_per_pixel)
    seen = own & (count >= LEAST_LOOKS)
    looks = np.array([float(np.median(c[o])) if o.any() else 0.0 for c, o in zip(count, own, strict=True)])
    return Cells(sites.rod[which], sites.kind[which], centre, value, seen, burnt, looks)


def _patch(image: Image, centre: Sequence[float], size: tuple[int, int]) -> Float32:
    """(P, P, 3) around a point between pixels, its border repeated beyond the raster."""
    x, y = (int(v) for v in np.round(centre))
    reach = size[0] // 2 + 1
    x0, y0 = max(0, min(x - reach, image.shape[1] - 1)), max(0, min(y - reach, image.shape[0] - 1))
    part = image[y0 : max(y0 + 1, y + reach + 1), x0 : max(x0 + 1, x + reach + 1)].astype(np.float32)
    return np.asarray(cv2.getRectSubPix(part, size, (centre[0] - x0, centre[1] - y0)), np.float32)


def vacant_sites(places: Float, steps: Float, pitch: float, pond: Pond) -> Float:
    """(V, 2), m: where the lattice would have a rod, inside the pond, and has none."""
    if not len(steps):
        return np.zeros((0, 2))
    margin = 1.1 * pond.rods[0].outer_radius_m
    near = (places[:, None] + steps[None]).reshape(-1, 2)
    inside = ((near > margin) & (near < np.array([pond.width_m, pond.height_m]) - margin)).all(axis=1)
    near = near[inside]
    free = near[np.asarray(tree_of(places).query(near)[0]) > 0.7 * pitch]
    kept: list[Float] = []
    for site in free[np.lexsort(np.round(free / (0.1 * pitch)).T)]:
        if all(np.hypot(*(site - other)) > 0.3 * pitch for other in kept):
            kept.append(site)
    return np.array(kept).reshape(-1, 2)


def _kind(reading: RodReading) -> int:
    sure = reading.confidence > 0.9 and not reading.conflicting
    return {RodState.EMPTY: EMPTY, RodState.FULL: FULL}.get(reading.state, OTHER) if sure else OTHER


def _whole_patch(raster: np.ndarray, centre: Sequence[int], reach: int) -> np.ndarray:
    """(P, P): a raster of bytes around a pixel, 0 beyond it."""
    x, y = centre
    out = np.zeros((2 * reach + 1, 2 * reach + 1), np.uint8)
    x0, y0 = max(0, x - reach), max(0, y - reach)
    x1, y1 = min(raster.shape[1], x + reach + 1), min(raster.shape[0], y + reach + 1)
    if x0 < x1 and y0 < y1:
        out[y0 - y + reach : y1 - y + reach, x0 - x + reach : x1 - x + reach] = raster[y0:y1, x0:x1]
    return out


def _eroded(count: np.ndarray) -> np.ndarray:
    """The least of each pixel's neighbours, for patches lie between pixels."""
    return np.asarray(cv2.erode(count, np.ones((3, 3), np.uint8), borderType=cv2.BORDER_CONSTANT, borderValue=0))


def _nearest_to_own(sites: Sites, which: Int, reach: int, metres_per_pixel: float) -> Bool:
    """(K, P, P): which pixels of each patch are nearer to its own site than to any other, and within reach. What lies
    between two sites belongs to both: where there is no second one a rim looks otherwise, and beyond it all does."""
    steps = np.arange(-reach, reach + 1, dtype=np.float64)
    right, down = steps[None, :], steps[:, None]
    out = np.broadcast_to(np.hypot(right, down) <= reach, (len(which), len(steps), len(steps))).copy()
    near = np.asarray(
        tree_of(sites.place).query_ball_point(sites.place[which], 2.2 * sites.reach * sites.pitch), object
    )
    for k, (i, others) in enumerate(zip(which.tolist(), near, strict=True)):
        for j in others:
            u, v = (sites.place[j] - sites.place[i]) / metres_per_pixel * (1, -1)
            out[k] &= u * right + v * down <= (u * u + v * v) / 2
        for u, v in (_lacking(sites, i) / metres_per_pixel * (1, -1)).tolist():
            out[k] &= u * right + v * down <= (u * u + v * v) / 2 - _RIM_PX * np.hypot(u, v)
    return out


def _lacking(sites: Sites, i: int) -> Float:
    """(N, 2), m: steps from a site to where a neighbour would be, and none is."""
    if not len(sites.steps):
        return np.zeros((0, 2))
    apart = sites.place[None] - (sites.place[i] + sites.steps)[:, None]
    return np.asarray(sites.steps[np.hypot(apart[..., 0], apart[..., 1]).min(axis=1) > 0.5 * sites.pitch])
