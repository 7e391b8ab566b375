"""The noise of the poses that came in: what is stated, what the data say, and how far to look."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .frames import wrap_angle
from .hypotheses import Reach
from .values import Float, Int, PoseNoise

UNKNOWN_HEADING = 1.2  # rad; a sigma above this says nothing of the heading
GROSS_SHARE = 0.02  # of poses that are wrong by any amount, before the data say otherwise


@dataclass(frozen=True, slots=True)
class NoiseModel:
    """Gaussian with a share of gross errors, which may lie anywhere.

    sigma_xy_m, sigma_theta_rad: one standard deviation. gross: share. correlation: of a robot's error with its
    error one snapshot before (0: independent)."""

    sigma_xy_m: float
    sigma_theta_rad: float
    gross: float = GROSS_SHARE
    correlation: float = 0.0

    @classmethod
    def stated(cls, noise: PoseNoise | None, pitch_m: float) -> NoiseModel:
        """As the localisation claims; half a pitch and 0.3 rad where it claims nothing."""
        if noise is None:
            return cls(0.5 * pitch_m, 0.3)
        return cls(max(noise.sigma_xy_m, 0.02 * pitch_m), max(noise.sigma_theta_rad, 0.01))

    def reach(self, pitch_m: float) -> Reach:
        """How far to look: four sigma, and at least what the nearest other places need to be heard."""
        theta = np.pi if self.sigma_theta_rad > UNKNOWN_HEADING else max(4.2 * self.sigma_theta_rad, 0.3)
        return Reach(max(4 * self.sigma_xy_m, 0.75 * pitch_m), float(min(theta, np.pi)))

    def log_prior(self, poses: Float, prior: Float, cell_m2: float, pond_m2: float, turns: int) -> Float:
        """(H,): log prior mass of each place's cell.

        Args:
            poses: (H, 3). prior: (3,), the noisy pose. cell_m2: area of a place's cell (one rod of the layout).
            turns: how many headings a place has.
        """
        d2 = ((poses[:, :2] - prior[:2]) ** 2).sum(axis=1) / self.sigma_xy_m**2
        near = -d2 / 2 + np.log(cell_m2 / (2 * np.pi * self.sigma_xy_m**2))
        near = near + self._log_heading(poses[:, 2] - prior[2], turns)
        anywhere = np.log(self.gross * cell_m2 / (pond_m2 * turns))
        return np.asarray(np.logaddexp(np.log1p(-self.gross) + near, anywhere))

    def log_density(self, pose: Float, prior: Float) -> float:
        """Log density of one pose (3,), up to a constant; gross errors bound it from below."""
        d2 = float(((pose[:2] - prior[:2]) ** 2).sum()) / self.sigma_xy_m**2
        if self.sigma_theta_rad <= UNKNOWN_HEADING:
            d2 += float(wrap_angle(pose[2] - prior[2])) ** 2 / self.sigma_theta_rad**2
        return float(np.logaddexp(-d2 / 2, np.log(self.gross) - 4))

    def _log_heading(self, delta: Float, turns: int) -> Float:
        """Mass of a heading among the lattice's `turns`: a Gaussian over its sector, or even."""
        if self.sigma_theta_rad > UNKNOWN_HEADING:
            return np.full(len(delta), -np.log(turns))
        sector = 2 * np.pi / turns
        density = -(wrap_angle(delta) ** 2) / (2 * self.sigma_theta_rad**2)
        return np.asarray(density + min(0.0, np.log(sector / (np.sqrt(2 * np.pi) * self.sigma_theta_rad))))

    def learned(
        self, errors: Float, trust: Float, first: Int, second: Int, spread: tuple[Float, Float, Float]
    ) -> NoiseModel:
        """The noise that decided snapshots show.

        Args:
            errors: (N, 3), noisy minus corrected. trust: (N,), probability that the correction is right.
            first, second: (T,), consecutive snapshots of one robot.
            spread: squared errors of all places (H,), m², (H,), rad², and their beliefs (H,). Doubtful snapshots count
                by all their places: the nearest place alone would make the noise too small.
        """
        sure = trust > 0.95
        if len(errors) < 12 or not len(spread[0]):
            return self
        e = np.column_stack([errors[:, :2], wrap_angle(errors[:, 2])])
        sigma, sigma_theta = _weighted_sigma(spread[0] / 2, spread[2]), _weighted_sigma(spread[1], spread[2])
        gross = np.hypot(e[:, 0], e[:, 1]) > 4.5 * sigma
        share = (float((gross & sure).sum()) + 0.5) / (float(sure.sum()) + 50)
        both = sure[first] & sure[second] & ~gross[first] & ~gross[second] if len(first) else np.zeros(0, bool)
        rho = _correlation(e[first[both], :2], e[second[both], :2]) if both.sum() >= 12 else self.correlation
        return NoiseModel(sigma, max(sigma_theta, 0.003), float(np.clip(share, 0.002, 0.3)), rho)


def _weighted_sigma(square: Float, weight: Float) -> float:
    """Root of a weighted mean of squares, of what lies within four of it, from the weighted median outwards."""
    order = np.argsort(square)
    mass = np.cumsum(weight[order])
    sigma2 = 2.2 * float(square[order][np.searchsorted(mass, 0.5 * mass[-1])]) + 1e-18
    for _ in range(3):
        inner = square < 16 * sigma2
        sigma2 = float((weight * square)[inner].sum() / max(weight[inner].sum(), 1e-12)) + 1e-18
    return float(np.sqrt(sigma2))


def _correlation(a: Float, b: Float) -> float:
    """Correlation about zero of consecutive errors; below 0.4 they count as independent."""
    rho = float((a * b).sum() / max(np.sqrt((a**2).sum() * (b**2).sum()), 1e-18))
    return float(np.clip(rho, 0, 0.995)) if rho > 0.4 else 0.0
