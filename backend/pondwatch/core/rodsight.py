"""What a learned finder of rods looks at, and how its answer is read.

The network sees a snapshot resampled so that the layout's outer radius is `CANONICAL_PX` long, with a margin of the
same width around it, since rods cut by the border have their centres there. It answers every `STRIDE` pixels:
whether a rod's centre is near, where exactly and how surely, and how large the rod is.

Frames
    image      pixels of the snapshot, the centre of the first one is (0, 0)
    canonical  pixels of the network's input, likewise
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from .values import Float, Float32, Image

CANONICAL_PX = 12.0
MARGIN_PX = 16
STRIDE = 4
CHANNELS = ("heat", "dx", "dy", "log_variance", "log_size", "fill", "wedge_x", "wedge_y")
PEAK = 0.3  # probability, from which a cell is called a rod
WORD = 0.5  # how much a learned finder's word counts, of 1
BUMP = 0.25  # outer radii, how wide its word is
LEAST_LEVEL = 0.2  # correlation
APART = 0.75  # outer radii, closer than which two centres are one rod


@dataclass(frozen=True, slots=True, eq=False)
class Sight:
    """A network's input: planes (4, h, w), BGR normalised and the share of each pixel that lies in the image; scale:
    (2,), canonical px an image px, of u and v."""

    planes: Float32
    scale: Float

    def to_canonical(self, points_px: Float) -> Float:
        """(N, 2) points of the image."""
        return np.asarray((points_px + 0.5) * self.scale - 0.5 + MARGIN_PX)

    def to_image(self, points_px: Float) -> Float:
        """(N, 2) points of the canonical frame."""
        return np.asarray((points_px - MARGIN_PX + 0.5) / self.scale - 0.5)


@dataclass(frozen=True, slots=True, eq=False)
class RodsSeen:
    """Rods as a network sees them, the surest first.

    centres_px: (K, 2), image frame, may lie just outside. probability: (K,). sigma_px: (K,), of u and of v.
    outer_px: (K,), radius.
    """

    centres_px: Float
    probability: Float
    sigma_px: Float
    outer_px: Float


def look(image: Image, outer_px: float) -> Sight:
    """Make a network's input.

    Args:
        image: (H, W, 3). outer_px: the rods' outer radius by the layout, image px.
    """
    height, width = image.shape[:2]
    size = [max(8, round(n * CANONICAL_PX / outer_px)) for n in (width, height)]
    shrinks = size[0] < width
    small = cv2.resize(image, size, interpolation=cv2.INTER_AREA if shrinks else cv2.INTER_LINEAR).astype(np.float32)
    light = (small - small.mean(axis=(0, 1))) / (small.std() + 2)
    padded = [n + 2 * MARGIN_PX for n in size]
    planes = np.zeros((4, *(-(-n // STRIDE) * STRIDE for n in padded[::-1])), np.float32)
    inside = planes[:, MARGIN_PX : MARGIN_PX + size[1], MARGIN_PX : MARGIN_PX + size[0]]
    inside[:3] = light.transpose(2, 0, 1)
    inside[3] = 1
    return Sight(planes, np.array(size) / [width, height])


def read(answer: Float32, sight: Sight) -> RodsSeen:
    """Rods of a network's answer: local maxima of the heat, each put where its neighbours agree that it lies.

    Args:
        answer: (8, h, w), by `CHANNELS`; heat as log odds, lengths in canonical px. The fill and the wedge are not
            read: the card tells why.
    """
    heat = 1 / (1 + np.exp(-np.clip(answer[0], -30, 30)))
    top = (heat >= cv2.dilate(heat, np.ones((3, 3), np.uint8))) & (heat > PEAK)
    v, u = np.nonzero(top)
    order = np.argsort(-heat[v, u], kind="stable")
    v, u = v[order], u[order]
    near_v, near_u, weight = _votes(heat, answer[3], v, u)
    cells = np.stack([near_u, near_v], axis=-1) * STRIDE + (STRIDE - 1) / 2
    centres = (weight[..., None] * (cells + answer[1:3, near_v, near_u].transpose(1, 2, 0))).sum(axis=1)
    mean = (weight * answer[3:5, near_v, near_u]).sum(axis=2)
    kept = _apart(centres)
    scale = float(sight.scale.mean())
    return RodsSeen(
        sight.to_image(centres)[kept],
        heat[v, u].astype(np.float64)[kept],
        np.exp(mean[0] / 2)[kept] / scale,
        np.exp(mean[1])[kept] * CANONICAL_PX / scale,
    )


def _votes(heat: Float32, log_variance: Float32, v: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray, Float]:
    """The 3 x 3 cells around each maximum, (K, 9) rows and columns, and what share each has in the result."""
    dv, du = (d.reshape(-1) for d in np.mgrid[-1:2, -1:2])
    h, w = heat.shape
    near_v, near_u = v[:, None] + dv, u[:, None] + du
    real = (near_v >= 0) & (near_v < h) & (near_u >= 0) & (near_u < w)
    near_v, near_u = np.clip(near_v, 0, h - 1), np.clip(near_u, 0, w - 1)
    weight = (real * heat[near_v, near_u] * np.exp(-log_variance[near_v, near_u])).astype(np.float64)
    return near_v, near_u, weight / np.maximum(weight.sum(axis=1, keepdims=True), 1e-12)


def _apart(centres: Float) -> list[int]:
    """Indices of those that no surer one lies too near to."""
    kept: list[int] = []
    for k, c in enumerate(centres):
        if all(np.hypot(*(c - centres[j])) > APART * CANONICAL_PX for j in kept):
            kept.append(k)
    return kept


def joined(field: Float32, pad: int, seen: RodsSeen, outer_px: float, word: float = WORD) -> Float32:
    """A response field of `observe` with what a learned finder saw: the mean of both, on the field's own level.

    Args:
        field: (H + 2 pad, W + 2 pad), correlation. word: how much the finder's word counts, 0 to 1.
    """
    if not len(seen.centres_px):
        return np.asarray((1 - word) * field, np.float32)
    at = seen.centres_px + pad
    v, u = (np.clip(np.round(at[:, k]).astype(int), 0, field.shape[1 - k] - 1) for k in (1, 0))
    sure = seen.probability >= min(0.6, float(seen.probability[0]))
    level = max(float(np.median(field[v, u][sure])), LEAST_LEVEL)
    down, right = np.arange(field.shape[0])[:, None], np.arange(field.shape[1])[None]
    bumps = np.zeros(field.shape)
    for (x, y), p in zip(at, seen.probability, strict=True):
        square = ((right - x) ** 2 + (down - y) ** 2) / (BUMP * outer_px) ** 2
        np.maximum(bumps, p * np.exp(-square / 2), out=bumps)
    return np.asarray((1 - word) * field + word * level * bumps, np.float32)
