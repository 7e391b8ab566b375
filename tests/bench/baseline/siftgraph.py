"""Baseline: SIFT, matches guided by the prior, RANSAC, and a robust pose graph; all of it from libraries.

SIFT on every snapshot (doi 10.1023/B:VISI.0000029664.99615.94); for every snapshot and its nearest by the prior,
matches that lie within three sigma of where the prior puts them and pass the ratio test; a similarity by RANSAC
(`cv2.estimateAffinePartial2D`); the poses by `scipy.optimize.least_squares` with a Cauchy loss, tied to the priors.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from scipy.optimize import least_squares
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from pondwatch.core.frames import centre_px, image_to_pond, pond_to_image, wrap_angle
from pondwatch.core.values import Bool, Camera, Float, Float32, Image, Inspection

NEIGHBOURS = 14  # snapshots that each is compared with
RATIO, REACH_PX, INLIERS, SCALE_WITHIN = 0.8, 2.0, 10, 0.04
EDGE_SIGMA_PX, ARM_PX = 0.5, 50.0  # of an edge; pixels that a radian is worth
SCALES = (15.0, 5.0)  # of the loss, in sigmas: from far off, all of a sharp loss is a plateau
CLAIMED = (20.0, 0.1)  # px, rad: of the priors, where nothing is said


@dataclass(frozen=True, slots=True, eq=False)
class Edges:
    """Which snapshots were registered, first and second: (E,), and where the second's centre lies in the first's frame
    (right, up, px), and how it is turned: (E, 3)."""

    first: np.typing.NDArray[np.int64]
    second: np.typing.NDArray[np.int64]
    motion: Float


def sift_graph(inspection: Inspection, images: Sequence[Image], noisy: Float) -> tuple[Float, Bool]:
    """Poses (N, 3), pond frame, and which of them some pair ties to another (N,)."""
    m, noise = inspection.camera.metres_per_pixel, inspection.pose_noise
    sigma = np.array([noise.sigma_xy_m / m, noise.sigma_theta_rad] if noise else CLAIMED)
    edges = _edges(inspection.camera, images, noisy, sigma)
    tied = np.zeros(len(noisy), bool)
    tied[edges.first] = tied[edges.second] = True
    unit = np.array([m, m, 1.0])
    poses = _solved(edges, noisy / unit, np.array([sigma[0], sigma[0], sigma[1]])) * unit
    return np.where(tied[:, None], poses, noisy), tied


def _edges(camera: Camera, images: Sequence[Image], noisy: Float, sigma: Float) -> Edges:
    features = [_features(image) for image in images]
    rows = []
    for i, j in _pairs(noisy):
        motion = _registered(camera, features[i], features[j], noisy[i], noisy[j], sigma)
        if motion is not None:
            rows.append((i, j, *motion))
    table = np.array(rows, dtype=np.float64).reshape(-1, 5)
    return Edges(table[:, 0].astype(np.int64), table[:, 1].astype(np.int64), table[:, 2:])


def _features(image: Image) -> tuple[Float32, Float32]:
    """(K, 2), px, and (K, 128)."""
    sift = cv2.SIFT.create(nfeatures=250, contrastThreshold=0.02)
    points, descriptors = sift.detectAndCompute(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), None)
    at = np.array([p.pt for p in points], np.float32).reshape(-1, 2)
    return at, np.zeros((0, 128), np.float32) if descriptors is None else np.asarray(descriptors, np.float32)


def _pairs(noisy: Float) -> Iterator[tuple[int, int]]:
    """Every snapshot with its nearest by the prior, each pair once."""
    count = min(NEIGHBOURS + 1, len(noisy))
    near = np.asarray(cKDTree(noisy[:, :2]).query(noisy[:, :2], count)[1]).reshape(len(noisy), count)
    yield from sorted({(min(i, j), max(i, j)) for i, row in enumerate(near.tolist()) for j in row if j != i})


def _registered(
    camera: Camera, a: tuple[Float32, Float32], b: tuple[Float32, Float32], at: Float, to: Float, sigma: Float
) -> tuple[float, float, float] | None:
    """Where b's centre lies from a's, right and up, px, and b's turn, rad; None where too little fits."""
    if len(b[1]) < 2:
        return None
    guess = pond_to_image(image_to_pond(a[0].astype(np.float64), at, camera), to, camera)
    apart = np.linalg.norm(guess[:, None] - b[0][None], axis=-1)
    allowed = 3 * np.sqrt(2) * (sigma[0] + ARM_PX * sigma[1])
    unlike = np.maximum(0, 2 * 512.0**2 - 2 * (a[1] @ b[1].T))  # SIFT's descriptors have a length of 512
    unlike = np.where(apart < allowed, unlike, np.inf)
    order = np.argsort(unlike, axis=1)[:, :2]
    best, next_best = np.take_along_axis(unlike, order, axis=1).T
    good = np.isfinite(best) & (best < RATIO**2 * next_best)
    if good.sum() < INLIERS:
        return None
    motion = _similarity(a[0][good], b[0][order[good, 0]], camera)
    return motion if motion is not None and _likely(motion, at, to, camera, sigma) else None


def _likely(motion: tuple[float, float, float], at: Float, to: Float, camera: Camera, sigma: Float) -> bool:
    """Whether the prior allows it: within three sigma of the difference of two poses."""
    unit = np.array([camera.metres_per_pixel, camera.metres_per_pixel, 1.0])
    off = np.array(motion) - _between((at / unit)[None], (to / unit)[None])[0]
    far, turned = np.hypot(off[0], off[1]), abs(float(wrap_angle(off[2])))
    return bool(far < 3 * np.sqrt(2) * sigma[0] and turned < 3 * np.sqrt(2) * sigma[1])


def _similarity(a_px: Float32, b_px: Float32, camera: Camera) -> tuple[float, float, float] | None:
    """By RANSAC, from b's pixels to a's; None where few agree or the scale is not one."""
    found, inliers = cv2.estimateAffinePartial2D(b_px, a_px, method=cv2.RANSAC, ransacReprojThreshold=REACH_PX)
    if found is None or inliers.sum() < INLIERS or abs(np.hypot(found[0, 0], found[1, 0]) - 1) > SCALE_WITHIN:
        return None
    centre = centre_px(camera)
    du, dv = found[:, :2] @ centre + found[:, 2] - centre
    return float(du), float(-dv), float(-np.arctan2(found[1, 0], found[0, 0]))


def _solved(edges: Edges, noisy: Float, sigma: Float) -> Float:
    """(N, 3): x and y in px, theta in rad, by robust least squares from the priors."""
    weight = np.array([1 / EDGE_SIGMA_PX, 1 / EDGE_SIGMA_PX, ARM_PX / EDGE_SIGMA_PX])

    def residuals(flat: Float) -> Float:
        poses = flat.reshape(-1, 3)
        off = _between(poses[edges.first], poses[edges.second]) - edges.motion
        off[:, 2] = wrap_angle(off[:, 2])
        return np.concatenate([(off * weight).ravel(), ((poses - noisy) / sigma).ravel()])

    def jacobian(flat: Float) -> csr_array:
        return _jacobian(edges, flat.reshape(-1, 3), weight, sigma)

    flat = noisy.ravel()
    for scale in SCALES:
        flat = least_squares(
            residuals,
            flat,
            jac=jacobian,
            loss=_Loss(edges.motion.size),
            f_scale=scale,
            tr_solver="lsmr",
            x_scale="jac",
            max_nfev=100,
        ).x
    return np.asarray(flat.reshape(-1, 3))


@dataclass(frozen=True, slots=True)
class _Loss:
    """Cauchy's for the first `edges` residuals; none for the priors, which would let go of the pond altogether."""

    edges: int

    def __call__(self, z: Float, /, *, cost_only: bool | None = None) -> Float:
        t = 1 + z[: self.edges]
        robust, plain = np.array([np.log(t), 1 / t, -1 / t**2]), np.zeros((3, len(z) - self.edges))
        plain[0], plain[1] = z[self.edges :], 1.0
        return np.concatenate([robust, plain], axis=1)


def _between(a: Float, b: Float) -> Float:
    """(E, 3): b in the frame of a."""
    c, s = np.cos(a[:, 2]), np.sin(a[:, 2])
    x, y = b[:, 0] - a[:, 0], b[:, 1] - a[:, 1]
    return np.stack([c * x + s * y, c * y - s * x, b[:, 2] - a[:, 2]], axis=1)


def _jacobian(edges: Edges, poses: Float, weight: Float, sigma: Float) -> csr_array:
    a, b = poses[edges.first], poses[edges.second]
    c, s, zero, one = np.cos(a[:, 2]), np.sin(a[:, 2]), np.zeros(len(a)), np.ones(len(a))
    moved = _between(a, b)
    by_b = np.array([[c, s, zero], [-s, c, zero], [zero, zero, one]]).transpose(2, 0, 1)
    by_a = -by_b
    by_a[:, 0, 2], by_a[:, 1, 2] = moved[:, 1], -moved[:, 0]
    count, n = len(a), poses.size
    row = np.broadcast_to(np.arange(3 * count).reshape(-1, 3, 1), (count, 3, 3))
    columns = [3 * k[:, None, None] + np.arange(3)[None, None, :] + np.zeros((1, 3, 1), int)
               for k in (edges.first, edges.second)]  # fmt: skip
    value = [block * weight[:, None] for block in (by_a, by_b)]
    priors = np.arange(n)
    values = np.concatenate([value[0].ravel(), value[1].ravel(), np.tile(1 / sigma, n // 3)])
    rows = np.concatenate([row.ravel(), row.ravel(), 3 * count + priors])
    return csr_array((values, (rows, np.concatenate([columns[0].ravel(), columns[1].ravel(), priors]))),
                     shape=(3 * count + n, n))  # fmt: skip
