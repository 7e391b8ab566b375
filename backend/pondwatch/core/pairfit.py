"""Where one snapshot lies as seen from another, to a fraction of a pixel.

Pure. Inverse compositional Gauss-Newton over (dx, dy, dphi), gain and offset (Baker and Matthews 2004, doi
10.1023/B:VISI.0000011205.11775.fd) on the pixels that both see. Poses are in the map frame of `posegraph.py`, px, px,
rad. Not for finding a place: it needs a start within about 2 px (`registration.search` gives one).
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from . import posegraph as se2
from .registration import View, feather, unpack
from .values import Float, Float32

LEAST_PX = 500
CORRELATED_PX = 6.0  # residuals of neighbouring pixels are alike: so many count as one
FADE_PX = 10.0  # near a border the local mean and contrast are not those that the other view has
CONVERGED_PX = 0.003
FURTHEST_PX = 5.0
FURTHEST_RAD = 0.1


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """Where `b` lies as seen from `a`. relative: (3,). information: (3, 3). rho: correlation over shared_px pixels."""

    relative: Float
    information: Float
    rho: float
    shared_px: float

    @property
    def nats(self) -> float:
        """Log-likelihood ratio against no relation."""
        return -0.5 * self.shared_px / CORRELATED_PX * float(np.log1p(-(min(max(self.rho, 0.0), 0.999) ** 2)))


def refine(a: View, b: View, relative: Float, iterations: int = 8) -> Fit | None:
    """Where b lies as seen from a, to a fraction of a pixel.

    Args:
        a, b: two views that share floor.
        relative: (3,), within about 2 px of the truth over the shared floor.
        iterations: of Gauss-Newton at most; it stops where a step is below 0.003 px.

    Returns:
        The fit, its information scaled by the residual; None where too little is shared, what is shared has no
        texture in some direction, or it ran away from the start by more than 5 px.
    """
    template = _Template.of(a, b.size_px, relative)
    if template is None:
        return None
    picture = unpack(b.detail)
    found = np.asarray(relative, dtype=np.float64)
    normal = None  # changes little with the overlap: made once
    for _ in range(iterations):
        compared = template.compare(picture, found)
        if compared is None or compared[2] <= 0.05:
            return None
        normal = template.normal(compared[1]) if normal is None else normal
        step = np.asarray(np.linalg.solve(normal, template.gradient(compared[0], compared[1])), dtype=np.float64)
        found = se2.compose(step, found)
        if np.hypot(step[0], step[1]) + abs(step[2]) * a.size_px[0] / 2 < CONVERGED_PX:
            break
    if np.hypot(*(found - relative)[:2]) > FURTHEST_PX or abs(found[2] - relative[2]) > FURTHEST_RAD:
        return None
    return template.fit(picture, found)


@dataclass(frozen=True, slots=True, eq=False)
class _Template:
    """The part of `a` that `b` covers: its pixels, their Jacobian (3, H, W), their offset from the image's centre."""

    pixels: Float32
    jacobian: Float32
    corner: Float  # (2,), px: the middle of a's image as seen from the part's first pixel
    fade: Float32
    other_fade: Float32

    @staticmethod
    def of(a: View, other_px: tuple[int, int], relative: Float) -> _Template | None:
        width, height = a.size_px
        middle = np.array([(width - 1) / 2, (height - 1) / 2])
        reach = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * (np.array(other_px) - 1) / 2
        corners = se2.rotate(relative[2], reach) + relative[:2] + middle
        low = np.floor(corners.min(axis=0)).clip(0, [width, height]).astype(int)
        high = np.ceil(corners.max(axis=0)).clip(0, [width, height]).astype(int) + 1
        if (high - low).min() < 12:
            return None
        x, y = slice(low[0], high[0]), slice(low[1], high[1])
        part = unpack(a.detail[y, x])
        dx = cv2.Sobel(part, cv2.CV_32F, 1, 0, ksize=3, scale=1 / 8)
        dy = cv2.Sobel(part, cv2.CV_32F, 0, 1, ksize=3, scale=1 / 8)
        u = np.arange(low[0], low[0] + dx.shape[1], dtype=np.float32) - np.float32(middle[0])
        v = np.arange(low[1], low[1] + dx.shape[0], dtype=np.float32) - np.float32(middle[1])
        jacobian = np.stack([dx, dy, u[None, :] * dy - v[:, None] * dx])
        fade = feather((height, width), FADE_PX)[y, x]
        return _Template(part, jacobian, middle - low, fade, feather((other_px[1], other_px[0]), FADE_PX))

    def compare(self, picture: Float32, found: Float) -> tuple[Float32, Float32, float] | None:
        """The other view laid over this part, less this part (gain and offset fitted), the weights, and the
        correlation."""
        c, s = np.cos(found[2]), np.sin(found[2])
        turn = np.array([[c, -s], [s, c]])
        middle = np.array([(picture.shape[1] - 1) / 2, (picture.shape[0] - 1) / 2])
        onto = np.column_stack([turn, found[:2] + self.corner - turn @ middle])
        size = (self.pixels.shape[1], self.pixels.shape[0])
        over = cv2.warpAffine(picture, onto, size, flags=cv2.INTER_CUBIC)
        weight = cv2.warpAffine(self.other_fade, onto, size) * self.fade
        total = float(weight.sum())
        if total < LEAST_PX:
            return None
        p = self.pixels - (weight * self.pixels).sum() / total
        q = over - (weight * over).sum() / total
        pp, qq, pq = (float((weight * m).sum()) for m in (p * p, q * q, p * q))
        rho = pq / max(np.sqrt(pp * qq), 1e-9)
        return q * np.float32(max(pq, 0.0) / max(qq, 1e-9)) - p, weight, rho

    def gradient(self, difference: Float32, weight: Float32) -> Float:
        flat = self.jacobian.reshape(3, -1)
        return np.asarray(flat @ (weight * difference).ravel(), dtype=np.float64)

    def normal(self, weight: Float32) -> Float:
        flat = self.jacobian.reshape(3, -1)
        return (flat * weight.ravel() @ flat.T).astype(np.float64) + np.diag([1e-3, 1e-3, 1e-1])

    def fit(self, picture: Float32, found: Float) -> Fit | None:
        compared = self.compare(picture, found)
        if compared is None:
            return None
        difference, weight, rho = compared
        total = float(weight.sum())
        variance = float((weight * difference**2).sum()) / total
        return Fit(found, self.normal(weight) / (variance * CORRELATED_PX + 1e-6), rho, total)
