"""A snapshot to rods found: where their centres lie in the image, whatever the rods look like.

A rod is a stack of concentric circles of known radii. Around its centre every edge, dark to light or light to dark,
has its gradient along the radius. So the doubled angle of the gradient (which forgets the sign) is correlated with
the doubled angle of the radius over the ring band of the layout: one for a perfect stack, near zero elsewhere,
negative between rods. No colour, contrast, ring width or renderer comes in. (The idea is that of the structure
tensor's rotational symmetries, doi 10.1016/0165-1684(84)90012-9, with the band of radii known.)

The support is the share of the band that lies inside the image, so rods cut by the border, and rods whose centre
lies just outside, are found too.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from scipy import fft

from .ports import RodFinder
from .ranks import median, median_of_many
from .rodsight import joined
from .values import Float, Float32, Image

MIN_SUPPORT = 0.22  # of the ring band inside the image
PEAK_SHARE = 0.4  # of the best responses in the snapshot
ALIKE = 0.4  # of the best response: less is not that of another rod, but of what lies between rods
PEAK_FLOOR = 0.12  # correlation under which nothing is called a rod
WEAK = 0.45  # typical response under which a learned finder is asked too; in clear water nearly all are above
SMOOTHING_PX = 1.0
MOST_AT_ONCE = 32_000  # points, that `cv2.remap` takes in one column


@dataclass(frozen=True, slots=True, eq=False)
class RingBand:
    """The correlation kernels for rods of given radii in pixels; made once a session. pad: px around the image.

    cosine, sine: spectra (`rfft2`) of the kernels; they are even, so convolution and correlation are one, and the
    spectra are real. support: the share of the band that lies in the image, for each padded pixel; scale: one over it,
    or 0 where it is under MIN_SUPPORT.
    """

    cosine: Float32
    sine: Float32
    support: Float32
    scale: Float32
    size: tuple[int, int]  # of the transform: nothing reaches round to the other side
    pad: int
    outer_px: float
    inner_px: float

    @classmethod
    def of(cls, inner_px: float, outer_px: float, width_px: int, height_px: int) -> RingBand:
        """Kernels for an image of that size; radii in px."""
        reach = int(np.ceil(1.15 * outer_px)) + 1
        y, x = np.mgrid[-reach : reach + 1, -reach : reach + 1].astype(np.float32)
        r = np.hypot(x, y)
        band = ((r > 0.85 * inner_px) & (r < 1.12 * outer_px)) / np.maximum(r, 1)
        band = (band / band.sum()).astype(np.float32)
        square = np.maximum(r * r, 1)
        pad = int(np.ceil(outer_px)) + 2
        inside = np.zeros((height_px + 2 * pad, width_px + 2 * pad), np.float32)
        inside[pad:-pad, pad:-pad] = 1
        support = np.asarray(cv2.filter2D(inside, -1, band, borderType=cv2.BORDER_CONSTANT), np.float32)
        high, wide = (fft.next_fast_len(n + max(0, reach - pad), real=True) for n in inside.shape)
        size = (high, wide)
        cosine, sine = (_spectrum(k, size) for k in ((x * x - y * y) / square * band, 2 * x * y / square * band))
        scale = (support > MIN_SUPPORT) / np.maximum(support, np.float32(MIN_SUPPORT))
        return cls(cosine, sine, support, scale.astype(np.float32), size, pad, outer_px, inner_px)

    def correlated(self, cosine: Float32, sine: Float32) -> Float32:
        """(H, W) doubled angles, times their weights, to (H + 2 pad, W + 2 pad): with the kernels at each pixel."""
        padded = np.zeros((2, *self.size), np.float32)
        height, width = cosine.shape
        p = self.pad
        padded[0, p : p + height, p : p + width], padded[1, p : p + height, p : p + width] = cosine, sine
        spectrum = fft.rfft2(padded, overwrite_x=True)
        both = fft.irfft2(spectrum[0] * self.cosine + spectrum[1] * self.sine, self.size, overwrite_x=True)
        return np.asarray(both[: height + 2 * p, : width + 2 * p], np.float32)


def _spectrum(kernel: Float, size: tuple[int, int]) -> Float32:
    """Of an even kernel, its middle moved to the first pixel."""
    wide = np.zeros(size)
    half = len(kernel) // 2
    wide[: len(kernel), : len(kernel)] = kernel
    return np.asarray(fft.rfft2(np.roll(wide, (-half, -half), (0, 1))).real, np.float32)


@dataclass(frozen=True, slots=True, eq=False)
class RodsFound:
    """Rod candidates of one snapshot.

    centres_px: (K, 2), px, image frame, may lie just outside the image. response: (K,), correlation, up to 1.
    support: (K,), share of the ring band in the image. field: the whole response, px frame shifted by `pad`.
    """

    centres_px: Float
    response: Float
    support: Float
    field: Float32
    pad: int
    typical: float


def response_field(image: Image, band: RingBand) -> Float32:
    """The correlation of the doubled gradient angle with rods centred at each pixel.

    The gradients of the colour channels are summed as doubled angles, where their signs do not cancel, so an outline
    that differs from its ground in hue alone counts as much as one in brightness.

    Args:
        image: (H, W, 3).

    Returns:
        (H + 2 pad, W + 2 pad), at most 1; zero where the support is under MIN_SUPPORT.
    """
    smooth = cv2.GaussianBlur(image.astype(np.float32), (0, 0), SMOOTHING_PX)
    gx = cv2.Sobel(smooth, cv2.CV_32F, 1, 0, ksize=3)
    gy = cv2.Sobel(smooth, cv2.CV_32F, 0, 1, ksize=3)
    across, down, both = (_summed(cv2.multiply(a, b)) for a, b in ((gx, gx), (gy, gy), (gx, gy)))
    energy = across + down
    weight = np.asarray(1 / (energy + np.float32(4 * median_of_many(energy) + 1e-9)), np.float32)
    return band.correlated((across - down) * weight, 2 * both * weight) * band.scale


def _summed(channels: cv2.typing.MatLike) -> Float32:
    """(H, W, 3) to (H, W)."""
    return np.asarray(cv2.transform(channels, np.ones((1, 3), np.float32)), np.float32)


def find_rods(image: Image, band: RingBand, finder: RodFinder | None = None) -> RodsFound:
    """Rod candidates, best first: local maxima of the response, to a fraction of a pixel by a parabola.

    `finder`: a learned one, whose word is joined with the response where that is weak.
    """
    field = response_field(image, band)
    found = _maxima(field, band)
    if finder is None or found.typical >= WEAK:
        return found
    both = joined(field, band.pad, finder(image, band.outer_px), band.outer_px)
    return _maxima(np.where(band.support > MIN_SUPPORT, both, 0).astype(np.float32), band)


def _maxima(field: Float32, band: RingBand) -> RodsFound:
    size = 2 * round(0.75 * band.outer_px) + 1
    top = field >= cv2.dilate(field, np.ones((size, size), np.uint8))
    v, u = np.divmod(np.flatnonzero(top & (field > PEAK_FLOOR)), field.shape[1])  # cheaper than `nonzero`
    order = np.argsort(-field[v, u], kind="stable")
    u, v = u[order], v[order]
    typical = _typical(field[v, u])
    strong = field[v, u] > PEAK_SHARE * typical
    u, v = u[strong], v[strong]
    centres = np.stack([u + _vertex(field, u, v, 0, 1), v + _vertex(field, u, v, 1, 0)], axis=1) - band.pad
    return RodsFound(
        centres, field[v, u].astype(np.float64), band.support[v, u].astype(np.float64), field, band.pad, typical
    )


def _typical(response: Float32) -> float:
    """Of the best responses, falling: the median of four, those left out that next to the best show no rod."""
    best = response[:4]
    return float(median(best[best > ALIKE * best[0]])) if len(best) else 0.0


def _vertex(field: Float32, u: np.ndarray, v: np.ndarray, dv: int, du: int) -> Float:
    """Offset of a parabola's top through a maximum and its two neighbours, px, in -0.5..0.5."""
    h, w = field.shape
    before = field[np.clip(v - dv, 0, h - 1), np.clip(u - du, 0, w - 1)].astype(np.float64)
    after = field[np.clip(v + dv, 0, h - 1), np.clip(u + du, 0, w - 1)].astype(np.float64)
    curve = before - 2 * field[v, u] + after
    return np.clip(np.where(curve < -1e-9, 0.5 * (before - after) / np.minimum(curve, -1e-9), 0), -0.5, 0.5)


def sample(field: Float32, points_px: Float, pad: int = 0, outside: float = 0.0) -> Float:
    """Bilinear values of an image at (..., 2) points, px; `outside` beyond it."""
    shape = np.shape(points_px)[:-1]
    u, v = np.asarray(points_px, dtype=np.float32).reshape(-1, 2).T + np.float32(pad)
    if not len(u):
        return np.zeros(shape)
    rows = [slice(k, k + MOST_AT_ONCE) for k in range(0, len(u), MOST_AT_ONCE)]
    parts: list[Any] = [
        cv2.remap(field, u[r], v[r], cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=outside)
        for r in rows
    ]
    flat = [np.reshape(part, (-1, *field.shape[2:])) for part in parts]
    return np.reshape(flat[0] if len(flat) == 1 else np.concatenate(flat), (*shape, *field.shape[2:]))
