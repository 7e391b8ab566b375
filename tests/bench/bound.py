"""The least error that a snapshot's own pixels allow: the Cramér-Rao bound of its pose, from the simulator's truth.

What is known to the bound: the floor as it was rendered, stains and walls with it, the water's light and what drifts
in it. What is noise to it: all by which the picture that arrived differs from that expectation, so the sensor's, the
rounding and the packing, taken as white. No method knows as much, so none reaches it; a method is judged by how near
it comes. The bound (doi 10.1007/978-1-4612-0919-5_16) is that of an unbiased estimate; x and y, theta unknown beside.
"""

from __future__ import annotations

import numpy as np

from pondwatch.core.images import decode
from pondwatch.core.values import Float
from pondwatch.simulator.simulation import Simulation

STEP_PX, STEP_RAD = 0.25, 0.004  # of the central differences


def bound_px(simulation: Simulation, n: int) -> float:
    """Root mean square of the error of snapshot n's centre, px, at its Cramér-Rao bound."""
    pose, m = simulation.truth_poses[n], simulation.spec.camera.metres_per_pixel
    arrived = decode(simulation.snapshot(n).content, simulation.spec.camera)
    noise = float(np.mean((arrived.astype(np.float64) - simulation.noiseless(n, pose)) ** 2))
    steps = np.diag([STEP_PX * m, STEP_PX * m, STEP_RAD])
    jacobian = np.stack([_slope(simulation, n, pose, step) for step in steps], axis=1)
    covariance = noise * np.linalg.inv(jacobian.T @ jacobian)
    return float(np.sqrt(covariance[0, 0] + covariance[1, 1]) / m)


def _slope(simulation: Simulation, n: int, pose: Float, step: Float) -> Float:
    """(H W 3,): how the pixels change by one of the pose's three numbers."""
    ahead, behind = (simulation.noiseless(n, p).astype(np.float64).ravel() for p in (pose + step, pose - step))
    return np.asarray((ahead - behind) / (2 * step.sum()))
