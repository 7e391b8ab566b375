"""Rigid motions in the image plane, and the least-squares graph of poses that unmapped ponds are solved by.

Pure: arrays in, arrays out. Everything here is in the map frame: pixels of the snapshots, right and down, so that a
pose (x, y, phi) takes an offset q from an image's centre to `(x, y) + R(phi) q`, R clockwise on the screen. It is the
pond frame with y and theta negated (`pond_to_map`, `map_to_pond`).

The graph: nodes are poses; an edge says where one snapshot lies as seen from another, with an information matrix; each
node has a weak prior, the noisy pose that came with it. Solved by Gauss-Newton with the analytic Jacobian on sparse
normal equations; priors are weighted by a Student-t law, so a grossly wrong pose does not pull the frame (Lange,
Little and Taylor 1989, doi 10.1080/01621459.1989.10478852). Do not use it to choose between look-alike places: no
robust loss survives many aliased edges; `graph.py` settles the places first.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from .frames import wrap_angle
from .values import Bool, Float, Int

DENSE_NODES = 700  # up to here covariances come from the whole inverse
STUDENT_DOF = 5.0


def pond_to_map(poses: Float, metres_per_pixel: float) -> Float:
    """(..., 3) poses, m, m, rad, pond frame, to px, px, rad, map frame."""
    return np.asarray(poses, dtype=np.float64) * [1 / metres_per_pixel, -1 / metres_per_pixel, -1.0]


def map_to_pond(poses: Float, metres_per_pixel: float) -> Float:
    """Undoes `pond_to_map`; theta in [-pi, pi)."""
    out = np.asarray(poses, dtype=np.float64) * [metres_per_pixel, -metres_per_pixel, -1.0]
    out[..., 2] = wrap_angle(out[..., 2])
    return out


def rotate(phi: Float | float, points: Float) -> Float:
    """(..., 2) points turned by phi (...) in the map frame."""
    c, s = np.cos(phi), np.sin(phi)
    x, y = points[..., 0], points[..., 1]
    return np.stack([c * x - s * y, s * x + c * y], axis=-1)


def compose(a: Float, b: Float) -> Float:
    """a * b: first b, then a. (..., 3) each, broadcast."""
    a, b = np.broadcast_arrays(np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64))
    xy = a[..., :2] + rotate(a[..., 2], b[..., :2])
    return np.concatenate([xy, wrap_angle(a[..., 2:] + b[..., 2:])], axis=-1)


def inverse(a: Float) -> Float:
    """The motion that undoes a, (..., 3)."""
    a = np.asarray(a, dtype=np.float64)
    return np.concatenate([rotate(-a[..., 2], -a[..., :2]), -a[..., 2:]], axis=-1)


def between(a: Float, b: Float) -> Float:
    """b as seen from a: inverse(a) * b."""
    return compose(inverse(a), b)


@dataclass(frozen=True, slots=True, eq=False)
class Edges:
    """E measured relative poses: `relative[e]` is where `head[e]` lies as seen from `tail[e]`.

    tail, head: (E,), node numbers. relative: (E, 3), px, px, rad. information: (E, 3, 3), inverse covariances.
    """

    tail: Int
    head: Int
    relative: Float
    information: Float

    def where(self, keep: Bool | Int) -> Edges:
        """The edges that `keep` picks."""
        return Edges(self.tail[keep], self.head[keep], self.relative[keep], self.information[keep])


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """poses: (N, 3), map frame. covariances: (N, 3, 3). edge_chi2: (E,), squared Mahalanobis residuals (3 degrees of
    freedom each). prior_weight: (N,), 1 for an ordinary noisy pose, near 0 for a grossly wrong one."""

    poses: Float
    covariances: Float
    edge_chi2: Float
    prior_weight: Float


def edge_residuals(poses: Float, edges: Edges) -> Float:
    """(E, 3): measured less predicted relative pose, in the tail's image frame; zero where they agree."""
    error = between(poses[edges.tail], poses[edges.head]) - edges.relative
    error[:, 2] = wrap_angle(error[:, 2])
    return error


def edge_jacobians(poses: Float, edges: Edges) -> tuple[Float, Float]:
    """(E, 3, 3) twice: how `edge_residuals` changes with the tail's and with the head's (x, y, phi)."""
    tail, head = poses[edges.tail], poses[edges.head]
    c, s = np.cos(tail[:, 2]), np.sin(tail[:, 2])
    zero, one = np.zeros_like(c), np.ones_like(c)
    dx, dy = (head - tail)[:, 0], (head - tail)[:, 1]
    at_head = np.stack([c, s, zero, -s, c, zero, zero, zero, one], axis=-1).reshape(-1, 3, 3)
    turn = np.stack([-s * dx + c * dy, -c * dx - s * dy, -one], axis=-1)
    at_tail = -at_head
    at_tail[:, :, 2] = turn
    return at_tail, at_head


def student_weights(residuals: Float, sigmas: Float) -> Float:
    """(N,): 1 at zero residual, falling as (sigma / residual)^2 far out; residuals (N, 3), sigmas (3,)."""
    chi2 = np.square(residuals / sigmas).sum(axis=-1)
    return np.asarray((STUDENT_DOF + 3) / (STUDENT_DOF + chi2)).clip(max=1.0)


def _normal_matrix(count: int, edges: Edges, jac: tuple[Float, Float], prior: Float) -> sparse.csc_matrix:
    blocks, rows, cols = [], [], []
    ends = (edges.tail, edges.head)
    for a in (0, 1):
        for b in (0, 1):
            blocks.append(np.einsum("eji,ejk,ekl->eil", jac[a], edges.information, jac[b]))
            rows.append(ends[a])
            cols.append(ends[b])
    diagonal = np.zeros((count, 3, 3))
    diagonal[:, [0, 1, 2], [0, 1, 2]] = prior
    block = np.concatenate([*blocks, diagonal])
    row = np.concatenate([*rows, np.arange(count)])
    col = np.concatenate([*cols, np.arange(count)])
    i = (row[:, None, None] * 3 + np.arange(3)[None, :, None]) + np.zeros((1, 1, 3), dtype=np.int64)
    j = (col[:, None, None] * 3 + np.arange(3)[None, None, :]) + np.zeros((1, 3, 1), dtype=np.int64)
    return sparse.csc_matrix((block.ravel(), (i.ravel(), j.ravel())), shape=(3 * count, 3 * count))


def solve(
    start: Float, edges: Edges, priors: Float, sigmas: Float, *, prior_inflation: float = 1.0, iterations: int = 5
) -> Solution:
    """The poses that fit the edges and the noisy poses best.

    Args:
        start: (N, 3), map frame; already within the right places.
        edges: what was measured between them; every node hangs on its prior, so the graph need not be connected.
        priors: (N, 3), map frame, the noisy poses.
        sigmas: (3,), px, px, rad, one standard deviation of a noisy pose.
        prior_inflation: how many times fewer independent noisy poses there are than poses (drifting robots).
        iterations: of Gauss-Newton; it stops earlier where nothing moves by 1e-6.

    Returns:
        Poses and their covariances, that of the frame included.
    """
    poses = np.array(start, dtype=np.float64)
    count = len(poses)
    for _ in range(iterations):
        to_prior = poses - priors
        to_prior[:, 2] = wrap_angle(to_prior[:, 2])
        weight = student_weights(to_prior, sigmas)
        prior = weight[:, None] / np.square(sigmas) / prior_inflation
        residual, jac = edge_residuals(poses, edges), edge_jacobians(poses, edges)
        gradient = prior * to_prior
        for end, at_end in zip((edges.tail, edges.head), jac, strict=True):
            np.add.at(gradient, end, np.einsum("eji,ejk,ek->ei", at_end, edges.information, residual))
        matrix = _normal_matrix(count, edges, jac, prior)
        step = splu(matrix).solve(-gradient.ravel()).reshape(-1, 3)
        poses = poses + step
        if np.abs(step).max(initial=0.0) < 1e-6:
            break
    poses[:, 2] = wrap_angle(poses[:, 2])
    final = edge_residuals(poses, edges)
    chi2 = np.einsum("ei,eij,ej->e", final, edges.information, final)
    return Solution(poses, _covariances(matrix, poses, prior), chi2, weight)


def _covariances(matrix: sparse.csc_matrix, poses: Float, prior: Float) -> Float:
    """(N, 3, 3): the diagonal blocks of the inverse; of large graphs the frame's share and each node's own."""
    count = len(poses)
    nodes = np.arange(count)
    if count <= DENSE_NODES:
        dense = np.linalg.inv(matrix.toarray())
        return np.asarray(dense.reshape(count, 3, count, 3)[nodes, :, nodes, :])
    frame, centre = frame_covariance(poses, prior)
    own = np.linalg.inv(_diagonal_blocks(matrix, count))
    return carried_covariance(frame, centre, poses) + 4 * own


def _diagonal_blocks(matrix: sparse.csc_matrix, count: int) -> Float:
    entries = matrix.tocoo()
    same = entries.row // 3 == entries.col // 3
    out = np.zeros((count, 3, 3))
    np.add.at(out, (entries.row[same] // 3, entries.row[same] % 3, entries.col[same] % 3), entries.data[same])
    return out


def frame_covariance(poses: Float, prior: Float) -> tuple[Float, Float]:
    """How well the noisy poses fix a rigid group of snapshots.

    Args:
        poses: (N, 3), map frame. prior: (N, 3), inverse variances of their noisy poses.

    Returns:
        (3, 3) covariance of a motion (dx, dy, dphi) about the centre, and the centre (2,), px.
    """
    weight = prior[:, 0]
    centre = np.average(poses[:, :2], axis=0, weights=weight)
    arm = np.square(poses[:, :2] - centre).sum(axis=1)
    information = np.diag([weight.sum(), weight.sum(), prior[:, 2].sum() + (weight * arm).sum()])
    return np.linalg.inv(information), centre


def carried_covariance(frame: Float, centre: Float, poses: Float) -> Float:
    """(N, 3, 3): what an uncertain frame (`frame_covariance`) means for each pose."""
    jac = np.broadcast_to(np.eye(3), (len(poses), 3, 3)).copy()
    jac[:, 0, 2] = -(poses[:, 1] - centre[1])
    jac[:, 1, 2] = poses[:, 0] - centre[0]
    return np.asarray(jac @ frame @ jac.transpose(0, 2, 1))


def align(poses: Float, priors: Float, sigmas: Float, weight: Float) -> Float:
    """The rigid motion (3,) that carries a rigid group of poses onto its noisy poses, composed from the left.

    weight: (N,), how far each noisy pose is believed. Positions by Procrustes, with the headings' mean as one more
    witness of the turn (von Mises), in closed form.
    """
    turn_by = wrap_angle(priors[:, 2] - poses[:, 2])
    mean = np.arctan2((weight * np.sin(turn_by)).sum(), (weight * np.cos(turn_by)).sum())
    p, q = (np.average(x[:, :2], axis=0, weights=weight) for x in (poses, priors))
    a, b = poses[:, :2] - p, priors[:, :2] - q
    cross = (weight * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])).sum() / sigmas[0] ** 2
    dot = (weight * (a * b).sum(axis=1)).sum() / sigmas[0] ** 2
    heading = weight.sum() / sigmas[2] ** 2
    phi = np.arctan2(cross + heading * np.sin(mean), dot + heading * np.cos(mean))
    return np.append(q - rotate(phi, p), phi)
