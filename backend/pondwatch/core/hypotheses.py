"""All the places where a snapshot may lie: the poses that put its rods on rods of the layout.

Headings first: the vectors between neighbouring rods found in the image, turned by the heading, must be neighbour
vectors of the layout; every heading that the prior allows is kept (six a turn on a hexagonal lattice, four on a
square one). Then positions: one rod found is laid on each rod of the layout within reach, the rest follow, and the
pose is fitted by least squares to all that match (Kabsch, doi 10.1107/S0567739476001873). Rods that the layout
has and the image lacks, or the reverse, count against a place: so do the lattice's edge and its missing rods.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from .frames import centre_px, image_to_pond, wrap_angle
from .observe import MIN_SUPPORT, RodsFound, sample
from .pond import Layout
from .values import Bool, Camera, Float, Int

MATCH = 0.16  # in pitches: a rod found this near to a rod of the layout is that rod
ABSENT_NATS = 4.0  # against a place, for a whole rod that is missing or unexplained
SECOND_ROD = 0.4  # precision of the rods found beside the best, from which they fix the heading
ILL_NATS = 1.0  # of the best place, from which it is asked whether the rods found show a heading at all
WIDE_RAD = 0.6  # reach of the heading, from which the noisy one says little
STIFF = 0.08  # pitches: what a heading is held by where one good rod leaves it open
KEEP_NATS = 9.0  # places worse than the best by more than this are dropped


@dataclass(frozen=True, slots=True)
class Reach:
    """How far from its noisy pose a snapshot is looked for: metres, radians; infinite for anywhere."""

    xy_m: float
    theta_rad: float


@dataclass(frozen=True, slots=True, eq=False)
class Places:
    """The places of one snapshot.

    poses: (H, 3), pond frame. geometry: (H,), nats, 0 for a perfect match, negative otherwise.
    rods: (H, K) indices into the layout of the rods in view, and real: (H, K) which of them count.
    centres_px: (H, K, 2) where each place puts them in the image.
    """

    poses: Float
    geometry: Float
    rods: Int
    real: Bool
    centres_px: Float

    def __len__(self) -> int:
        return len(self.poses)

    def take(self, index: Int | Bool) -> Places:
        """Some of them."""
        return Places(
            self.poses[index], self.geometry[index], self.rods[index], self.real[index], self.centres_px[index]
        )


def propose(found: RodsFound, prior: Float, reach: Reach, layout: Layout, camera: Camera) -> Places:
    """Every place within reach that the layout allows.

    Args:
        found: what `observe.find_rods` saw.
        prior: (3,), the noisy pose, pond frame.

    Returns:
        Places, the best geometry first; empty where no rod was found or none fits.
    """
    q = _metric(found.centres_px, camera)
    places = _fitting(q, found, _headings(q, found, prior, reach.theta_rad, layout), prior, reach, layout, camera)
    if one_rod(found) and reach.theta_rad < WIDE_RAD and _best(places) < -ILL_NATS:  # the others show no heading
        by_prior = _fitting(q, found, prior[2:3], prior, reach, layout, camera)
        places = max(places, by_prior, key=_best)
    return places.take(np.flatnonzero(places.geometry >= _best(places) - KEEP_NATS))


def _best(places: Places) -> float:
    return float(places.geometry.max(initial=-np.inf))


def _fitting(
    q: Float, found: RodsFound, headings: Float, prior: Float, reach: Reach, layout: Layout, camera: Camera
) -> Places:
    """The places at some headings, fitted to the rods found, those within reach."""
    poses = [_positions(q, found, theta, prior, reach, layout) for theta in headings if len(q)]
    together = np.concatenate(poses) if poses else np.zeros((0, 3))
    if not len(together):
        return _describe(np.zeros((0, 3)), found, layout, camera)
    fitted = _distinct(_fit(_fit(together, q, found, layout), q, found, layout), layout.pitch)
    near = np.hypot(*(fitted[:, :2] - prior[:2]).T) <= reach.xy_m + 0.1 * layout.pitch
    return _describe(fitted[near], found, layout, camera)


def describe(poses: Float, found: RodsFound, layout: Layout, camera: Camera) -> Places:
    """The same for poses that come from elsewhere, in their order."""
    return _describe(np.asarray(poses, dtype=np.float64).reshape(-1, 3), found, layout, camera)


def _metric(points_px: Float, camera: Camera) -> Float:
    """Image points to metres from the image centre, x right, y up."""
    return (points_px - centre_px(camera)) * [camera.metres_per_pixel, -camera.metres_per_pixel]


def _headings(q: Float, found: RodsFound, prior: Float, reach_rad: float, layout: Layout) -> Float:
    """Headings within reach that turn vectors between neighbouring rods found into the layout's neighbour vectors."""
    if len(q) < 2 or not len(layout.steps):
        return prior[2:3] if len(q) else np.zeros(0)
    a, b = np.triu_indices(len(q), 1)
    d = q[b] - q[a]
    lengths, angles = np.hypot(*d.T), np.arctan2(d[:, 1], d[:, 0])
    step_lengths, step_angles = np.hypot(*layout.steps.T), np.arctan2(layout.steps[:, 1], layout.steps[:, 0])
    fits = np.abs(lengths[:, None] - step_lengths) < MATCH * layout.pitch
    turn = wrap_angle(step_angles[None] - angles[:, None])[fits]
    weight = np.broadcast_to(np.sqrt(found.support[a] * found.support[b])[:, None], fits.shape)[fits]
    near = np.abs(wrap_angle(turn - prior[2])) <= reach_rad + 0.05
    return _modes(turn[near], weight[near])


def _modes(angles: Float, weight: Float, width_rad: float = 0.12) -> Float:
    """Weighted modes of angles, strongest first, those with at least half of the strongest's weight."""
    modes: list[float] = []
    first = 0.0
    while len(angles):
        close = np.abs(wrap_angle(angles[:, None] - angles)) < width_rad
        mass = close @ weight
        best = int(np.argmax(mass))
        if mass[best] < 0.5 * first:
            break
        first = first or float(mass[best])
        c = close[best]
        modes.append(float(angles[best] + np.average(wrap_angle(angles[c] - angles[best]), weights=weight[c])))
        away = np.abs(wrap_angle(angles - angles[best])) >= 2 * width_rad
        angles, weight = angles[away], weight[away]
    return np.array(modes)


def _positions(q: Float, found: RodsFound, theta: float, prior: Float, reach: Reach, layout: Layout) -> Float:
    """(H, 3): poses at one heading that lay the anchor, a rod well in view, on a rod of the layout within reach."""
    anchors = np.argsort(-(found.support * found.response), kind="stable")[:2]
    turned = q @ np.array([[np.cos(theta), np.sin(theta)], [-np.sin(theta), np.cos(theta)]])
    xy = np.concatenate([layout.centres - turned[k] for k in anchors])
    xy = xy[np.hypot(*(xy - prior[:2]).T) <= reach.xy_m + 0.3 * layout.pitch]
    return np.column_stack([xy, np.full(len(xy), theta)])


def _turn(poses: Float, points: Float) -> Float:
    """(H, 3) poses on (K, 2) metric image points: (H, K, 2), pond frame."""
    c, s = np.cos(poses[:, 2, None]), np.sin(poses[:, 2, None])
    x, y = points[:, 0], points[:, 1]
    return np.stack([poses[:, 0, None] + c * x - s * y, poses[:, 1, None] + s * x + c * y], axis=-1)


def _fit(poses: Float, q: Float, found: RodsFound, layout: Layout) -> Float:
    """One least-squares fit of each pose to the rods that it matches; poses that match nothing stay."""
    at = _turn(poses, q)
    distance, index = layout.tree.query(at)
    w = np.where(distance < 2 * MATCH * layout.pitch, precision(found), 0.0)
    total = np.maximum(w.sum(axis=1, keepdims=True), 1e-12)
    target = layout.centres[index]
    mean_q = (w @ q) / total
    mean_t = (w[..., None] * target).sum(axis=1) / total
    a, b = q[None] - mean_q[:, None], target - mean_t[:, None]
    cross = (w * (a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])).sum(axis=1)
    dot = (w * (a * b).sum(axis=-1)).sum(axis=1)
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    stiff = np.where(_one(w), (STIFF * layout.pitch) ** 2, 0.0)
    theta = poses[:, 2] + np.arctan2(c * cross - s * dot, c * dot + s * cross + stiff)
    c, s = np.cos(theta), np.sin(theta)
    xy = mean_t - np.stack([c * mean_q[:, 0] - s * mean_q[:, 1], s * mean_q[:, 0] + c * mean_q[:, 1]], axis=1)
    matched = (w.sum(axis=1) > 0)[:, None]
    return np.where(matched, np.column_stack([xy, theta]), poses)


def precision(found: RodsFound) -> Float:
    """Weight of each centre. An arc alone places a rod badly along its radius, so the share of the ring band in view
    counts, and so does the response: a smeared maximum is a low one."""
    sharp = np.clip((found.response / max(found.typical, 1e-6) - 0.5) / 0.4, 0.03, 1)
    return np.asarray(np.clip((found.support - 0.3) / 0.5, 0.001, 1.0) ** 2 * sharp**2)


def one_rod(found: RodsFound) -> bool:
    """Whether one rod at most was found precisely: the others do not fix the heading."""
    return bool(_one(precision(found)))


def _one(weight: Float) -> Bool:
    """(..., K) to (...)."""
    return np.asarray(weight.sum(axis=-1) - weight.max(axis=-1, initial=0) <= SECOND_ROD)


def explained(found: RodsFound, pose: Float, layout: Layout, camera: Camera) -> RodsFound:
    """Those of the rods found that a pose puts on rods of the layout."""
    distance = layout.tree.query(image_to_pond(found.centres_px, pose, camera))[0]
    near = distance < 2 * MATCH * layout.pitch
    return replace(found, centres_px=found.centres_px[near], response=found.response[near], support=found.support[near])


def _distinct(poses: Float, pitch: float) -> Float:
    """One of each group of poses that agree within a quarter of a pitch and 0.15 rad, in a fixed order."""
    cell = np.round(np.column_stack([poses[:, :2] / (0.02 * pitch), wrap_angle(poses[:, 2]) / 0.02]))
    poses = poses[np.lexsort(cell.T)]
    turn = np.column_stack([np.cos(poses[:, 2]), np.sin(poses[:, 2])]) / 0.15
    pairs = cKDTree(np.column_stack([poses[:, :2] / (0.25 * pitch), turn])).query_pairs(1.0, output_type="ndarray")
    again = np.zeros(len(poses), dtype=bool)
    again[pairs.max(axis=1, initial=0)] = len(pairs) > 0
    return np.asarray(poses[~again])


def _describe(poses: Float, found: RodsFound, layout: Layout, camera: Camera) -> Places:
    m = camera.metres_per_pixel
    margin = found.pad * m
    half = np.array([camera.width_px, camera.height_px]) * m / 2 + margin
    rods, real = layout.within(poses[:, :2], float(np.hypot(*half)))
    d = layout.centres[rods] - poses[:, None, :2]
    c, s = np.cos(poses[:, 2, None]), np.sin(poses[:, 2, None])
    a, b = c * d[..., 0] + s * d[..., 1], -s * d[..., 0] + c * d[..., 1]
    real = real & (np.abs(a) < half[0]) & (np.abs(b) < half[1])
    centres = np.stack([a, -b], axis=-1) / m + centre_px(camera)
    return Places(poses, _geometry(poses, centres, real, found, layout, camera), rods, real, centres)


def _geometry(poses: Float, centres_px: Float, real: Bool, found: RodsFound, layout: Layout, camera: Camera) -> Float:
    """Nats against each place: for rods of the layout that the image lacks, and rods found that the layout lacks."""
    response = sample(found.field, centres_px, found.pad)
    support = np.where(real, _support_of(found, centres_px, camera), 0.0)
    lacking = np.clip((0.55 - response / max(found.typical, 1e-6)) / 0.35, 0, 1)
    missing = (lacking * np.where(support > MIN_SUPPORT + 0.1, support, 0)).sum(axis=1)
    if not len(found.centres_px):
        return np.asarray(-ABSENT_NATS * missing)
    distance = layout.tree.query(_turn(poses, _metric(found.centres_px, camera)))[0]
    excess = np.clip((found.response / max(found.typical, 1e-6) - 0.45) / 0.35, 0, 1) * found.support
    stray = (
        np.clip((found.support - 0.3) / 0.2, 0, 1) * np.clip(distance / (MATCH * layout.pitch) - 1, 0, 1) * excess
    ).sum(axis=1)
    return np.asarray(-ABSENT_NATS * (missing + stray))


def _support_of(found: RodsFound, centres_px: Float, camera: Camera) -> Float:
    """About which share of a rod's ring band lies in the image: from the distance of its centre to the border."""
    reach = max(found.pad - 2.0, 1.0)
    u, v = centres_px[..., 0], centres_px[..., 1]
    into = np.minimum(np.minimum(u, camera.width_px - 1 - u), np.minimum(v, camera.height_px - 1 - v))
    return np.clip(0.5 + into / (2 * reach), 0, 1)
