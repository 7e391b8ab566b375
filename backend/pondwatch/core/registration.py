"""Where one snapshot may lie on what others saw: search by whitened correlation.

Pure: arrays in, arrays out. Poses are in the map frame of `posegraph.py`, px, px, rad; a `View` is what is kept of a
snapshot: its local detail (local mean taken away, local contrast made one), at full and at half scale.

Search. The snapshot is turned to each heading and correlated by FFT with a local map, both whitened by the floor's own
mean spectrum. That is the matched filter for a known picture on a floor of that spectrum: what repeats (crop rows, a
lattice) has a peaked spectrum and counts little, what is unique counts fully. The correlation rho over an overlap of A
independent pixels is worth -A/2 log(1 - rho^2) nats against no relation; A is measured from the scatter of rho over
places that cannot all be right, as ASHLAR takes its threshold from pairs known not to overlap (doi
10.1093/bioinformatics/btac544).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy import fft

from .values import Float, Float32, Image

Int8 = NDArray[np.int8]
Complex64 = NDArray[np.complex64]

HALF = 2  # the search runs on every second pixel
STEP = 1 / 28.0  # of the stored detail: 127 is 4.5 standard deviations
HEADING_STEP_RAD = 0.05
FEATHER_PX = 3  # half-scale pixels over which a snapshot's border fades
MIN_SHARED = 0.06  # of a snapshot's area: less is not searched
PEAK_APART_PX = 5.0


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """What is kept of a snapshot: detail (H, W) and half (H/2, W/2), in units of STEP local standard deviations.

    texture: share of the image that is not flat, 0 to 1.
    """

    detail: Int8
    half: Int8
    texture: float

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height, px."""
        return self.detail.shape[1], self.detail.shape[0]


@dataclass(frozen=True, slots=True)
class Place:
    """One place that a snapshot may have. pose: (3,), map frame. nats: log-likelihood ratio against no relation.
    score: nats with the prior's added. rho: correlation. shared_px: overlap with the map, full-scale pixels."""

    pose: Float
    nats: float
    score: float
    rho: float
    shared_px: float


def make_view(image: Image) -> View:
    """The detail of a snapshot (H, W, 3) or (H, W), 8 bits."""
    grey = (cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) if image.ndim == 3 else image).astype(np.float32)
    smooth = cv2.GaussianBlur(grey, (0, 0), 0.7)
    detail = smooth - cv2.GaussianBlur(grey, (0, 0), 7.0)
    power = cv2.GaussianBlur(detail * detail, (0, 0), 12.0)
    detail = detail / np.sqrt(power + 0.6**2 + 0.05 * float(power.mean()))
    half = cv2.resize(cv2.GaussianBlur(detail, (0, 0), 0.8), None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
    flat = float((power < 0.5**2).mean())
    return View(_pack(detail), _pack(half), 1.0 - flat)


def turned_half(view: View) -> View:
    """The same view turned by half a turn: a picture of nowhere, with the floor's rows, lattice and spectrum."""
    return View(
        np.ascontiguousarray(view.detail[::-1, ::-1]), np.ascontiguousarray(view.half[::-1, ::-1]), view.texture
    )


def _pack(detail: Float32) -> Int8:
    return np.asarray(np.clip(np.rint(detail / STEP), -127, 127), dtype=np.int8)


def unpack(detail: Int8) -> Float32:
    """Detail in local standard deviations."""
    return detail.astype(np.float32) * np.float32(STEP)


@lru_cache(maxsize=64)
def feather(shape: tuple[int, int], width: float) -> Float32:
    """(H, W): 1 inside, falling to 0 over the outermost `width` pixels. Shared: not to be written to."""
    y = np.minimum(np.arange(shape[0]) + 1, np.arange(shape[0], 0, -1)) / (width + 1)
    x = np.minimum(np.arange(shape[1]) + 1, np.arange(shape[1], 0, -1)) / (width + 1)
    return np.outer(y.clip(max=1), x.clip(max=1)).astype(np.float32)


def _onto(shape: tuple[int, int], pose: Float, centre: Float, size: int) -> Float:
    """(2, 3): pixels of an image of `shape` at `pose` to those of a square of `size` around `centre`, one scale."""
    c, s = np.cos(pose[2]), np.sin(pose[2])
    turn = np.array([[c, -s], [s, c]])
    middle = np.array([(shape[1] - 1) / 2, (shape[0] - 1) / 2])
    return np.column_stack([turn, pose[:2] - centre + (size - 1) / 2 - turn @ middle])


def _halved(pose: Float) -> Float:
    return np.asarray(pose * [1 / HALF, 1 / HALF, 1.0])


@dataclass(frozen=True, slots=True, eq=False)
class LocalMap:
    """A square of half-scale pixels around centre (px, map frame), drawn from placed views: their mean detail where
    weight > 0, and the number of views."""

    centre: Float
    detail: Float32
    weight: Float32


def draw_map(views: Sequence[View], poses: Float, centre: Float, size: int) -> LocalMap:
    """The mean detail of the views at poses (N, 3), in a square of `size` half-scale pixels around centre, px."""
    total, weight = np.zeros((size, size), np.float32), np.zeros((size, size), np.float32)
    for view, pose in zip(views, poses, strict=True):
        fade = feather(view.half.shape, FEATHER_PX)
        onto = _onto(view.half.shape, _halved(pose), centre / HALF, size)
        total += cv2.warpAffine(unpack(view.half) * fade, onto, (size, size))
        weight += cv2.warpAffine(fade, onto, (size, size))
    return LocalMap(centre, np.asarray(total / np.maximum(weight, 0.5), dtype=np.float32), weight)


class Whitener:
    """The floor's mean power spectrum in the map frame, learned from the views as they lie. size: of the squares."""

    def __init__(self, size: int) -> None:
        self.size = size
        self._sum = np.zeros((size, size // 2 + 1), np.float32)
        self._count = 0

    def learn(self, view: View, phi: float) -> None:
        """Take one view's spectrum, turned to its heading."""
        turned = _turned(view, np.array([phi]), self.size)[0][0]
        spectrum = fft.rfft2(turned)
        self._sum += np.abs(spectrum).astype(np.float32) ** 2
        self._count += 1

    def gain(self) -> Float32:
        """(size, size / 2 + 1): 1 / (P + noise), smoothed a little; the noise floor is a share of the mean."""
        power = cv2.GaussianBlur(self._sum / max(self._count, 1), (0, 0), 1.0)
        return np.asarray(1.0 / (power + 0.05 * power.mean() + 1e-9), dtype=np.float32)


def _turned(view: View, phis: Float, size: int) -> tuple[Float32, Float32]:
    """The half-scale detail at each heading, and its weight at the middle heading, in squares of `size`."""
    fade = feather(view.half.shape, FEATHER_PX)
    faded = unpack(view.half) * fade
    out = np.empty((len(phis), size, size), np.float32)
    zero = np.zeros(2)
    for k, phi in enumerate(phis):
        onto = _onto(view.half.shape, np.array([0.0, 0.0, phi]), zero, size)
        cv2.warpAffine(faded, onto, (size, size), dst=out[k])
    middle = _onto(view.half.shape, np.array([0.0, 0.0, phis[len(phis) // 2]]), zero, size)
    return out, np.asarray(cv2.warpAffine(fade, middle, (size, size)), dtype=np.float32)


def search(
    view: View,
    local: LocalMap,
    gain: Float32,
    guess: Float,
    sigmas: Float,
    reach_px: float,
    reach_rad: float,
    most: int = 6,
) -> list[Place]:
    """The places that a snapshot may have on a map, the best first.

    Args:
        view: the snapshot.
        local: the map, drawn around the guess, at least the snapshot's diagonal and twice the reach wide.
        gain: from a `Whitener` of the map's size.
        guess: (3,), map frame: where it is expected.
        sigmas: (3,), px, px, rad: of the guess.
        reach_px, reach_rad: how far from the guess to look.
        most: how many places to return at most.

    Returns:
        Places at least PEAK_APART_PX apart, by falling score; none where the map shows nothing there.
    """
    size = local.detail.shape[0]
    steps = int(np.ceil(min(reach_rad, np.pi) / HEADING_STEP_RAD))
    turns: Float = np.asarray(
        np.arange(-steps, steps + 1) * min(HEADING_STEP_RAD, np.pi / max(steps, 1)), dtype=np.float64
    )
    turned, weight = _turned(view, guess[2] + turns, size)
    reach = int(reach_px / HALF)
    rho, shared = _correlate(turned, weight, local, gain, reach)
    enough = shared > MIN_SHARED * weight.sum()
    if not enough.any():
        return []
    rho *= enough
    scatter = np.median(np.abs(rho[:, enough][:, ::3]) * np.sqrt(shared[enough][::3])) / 0.6745
    effective = shared / max(scatter, 1e-6) ** 2
    nats = -0.5 * effective * np.log1p(-np.square(rho.clip(0, 0.995)))
    shift = np.arange(-reach, reach + 1) * float(HALF)
    offset: Float = np.asarray(shift + local.centre[:, None] - guess[:2, None], dtype=np.float64)
    prior = -0.5 * (offset[0][None, :] ** 2 + offset[1][:, None] ** 2) / sigmas[0] ** 2
    score = nats + prior - 0.5 * np.square(turns / sigmas[2])[:, None, None]
    return [
        Place(_sub_pixel(score, peak, guess, turns, offset), float(nats[peak]), float(score[peak]), float(rho[peak]),
              float(shared[peak[1:]]) * HALF**2)
        for peak in _peaks(score, most)
    ]  # fmt: skip


def _correlate(turned: Float32, weight: Float32, local: LocalMap, gain: Float32, reach: int) -> tuple[Float32, Float32]:
    """Whitened correlation coefficients (K, S, S) by the shift of the snapshot's centre from the map's, -reach to
    reach half-scale pixels, and the overlap (S, S) in half-scale pixels."""
    size = local.detail.shape[0]
    shifts = np.arange(-reach, reach + 1) % size
    seen = np.minimum(local.weight, 1.0)
    of_map = fft.rfft2(local.detail * seen)
    of_views = fft.rfft2(turned)
    power_map = _power(of_map, gain) / max(float(seen.sum()), 1.0)
    power_view = _power(of_views[len(turned) // 2], gain) / max(float(weight.sum()), 1.0)
    np.conjugate(of_views, out=of_views)
    of_views *= of_map * gain
    cross = fft.irfft2(of_views, s=(size, size), overwrite_x=True)[:, shifts[:, None], shifts]
    shared = fft.irfft2(fft.rfft2(seen) * fft.rfft2(weight).conj(), s=(size, size))[shifts[:, None], shifts]
    scale = np.maximum(shared, 1.0) * np.float32(np.sqrt(power_map * power_view))
    return cross / scale, shared


def _power(spectrum: Complex64, gain: Float32) -> float:
    """Energy of a whitened picture by Parseval."""
    energy = (spectrum.real**2 + spectrum.imag**2) * gain
    ends = energy[:, 0].sum() + (energy[:, -1].sum() if spectrum.shape[0] % 2 == 0 else 0)
    return float((2 * energy.sum() - ends) / spectrum.shape[0] ** 2) + 1e-12


def _peaks(score: Float32, most: int) -> list[tuple[int, int, int]]:
    best = score.max(axis=0)
    which = score.argmax(axis=0)
    apart = int(PEAK_APART_PX / HALF)
    tops = cv2.dilate(best.astype(np.float32), np.ones((2 * apart + 1, 2 * apart + 1), np.uint8))
    rows, cols = np.nonzero(best.astype(np.float32) >= tops)
    order = np.argsort(-best[rows, cols], kind="stable")[:most]
    return [(int(which[rows[o], cols[o]]), int(rows[o]), int(cols[o])) for o in order]


def _vertex(before: float, at: float, after: float) -> float:
    """Where a parabola through three points one apart has its top, from the middle one, within half a step."""
    bend = before - 2 * at + after
    return 0.0 if bend >= 0 else float(np.clip(0.5 * (before - after) / bend, -0.5, 0.5))


def _sub_pixel(score: Float, peak: tuple[int, int, int], guess: Float, turns: Float, offset: Float) -> Float:
    k, r, c = peak
    inside = [0 < i < n - 1 for i, n in zip(peak, score.shape, strict=True)]
    dk = _vertex(score[k - 1, r, c], score[k, r, c], score[k + 1, r, c]) if inside[0] else 0.0
    dr = _vertex(score[k, r - 1, c], score[k, r, c], score[k, r + 1, c]) if inside[1] else 0.0
    dc = _vertex(score[k, r, c - 1], score[k, r, c], score[k, r, c + 1]) if inside[2] else 0.0
    step = turns[1] - turns[0] if len(turns) > 1 else 0.0
    x, y = guess[0] + offset[0][c] + dc * HALF, guess[1] + offset[1][r] + dr * HALF
    return np.array([x, y, guess[2] + turns[k] + dk * step])
