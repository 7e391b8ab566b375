"""How well a session stands, in figures and in one sentence for an operator."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .noise import UNKNOWN_HEADING, NoiseModel
from .placement import Placed
from .values import Camera, CorrectedPose, Quality, Status


def judge(
    placed: Sequence[Placed], poses: Sequence[CorrectedPose], noise: NoiseModel, camera: Camera, pitch_m: float
) -> Quality:
    """Counts, estimated noise of the poses that came in, residual in grey levels, and what it means."""
    count = {s: sum(p.status == s for p in poses) for s in Status}
    residuals = [p.residual for p in placed if np.isfinite(p.residual)]
    sigma_px = noise.sigma_xy_m / camera.metres_per_pixel
    facts = {
        "gross_share": round(noise.gross, 4),
        "error_correlation": round(noise.correlation, 3),
        "sigma_in_pitches": round(noise.sigma_xy_m / pitch_m, 3),
        "residual_grey": round(float(np.median(residuals)), 3) if residuals else None,
    }
    sigmas = [p.sigma_xy_m for p in poses if p.status is Status.PLACED and p.sigma_xy_m is not None]
    residual_px = float(np.median(sigmas)) / camera.metres_per_pixel if sigmas else None
    sentence = _sentence(len(poses), count[Status.UNCERTAIN], sigma_px, noise)
    return Quality(
        len(poses), count[Status.PLACED], count[Status.UNCERTAIN], count[Status.REJECTED],
        noise.sigma_xy_m, noise.sigma_theta_rad, residual_px, sentence, facts,
    )  # fmt: skip


def _sentence(total: int, uncertain: int, sigma_px: float, noise: NoiseModel) -> str:
    if not total:
        return "No snapshot yet."
    heading = (
        "their headings say nothing"
        if noise.sigma_theta_rad > UNKNOWN_HEADING
        else f"their headings by {np.degrees(noise.sigma_theta_rad):.0f} degrees"
    )
    doubt = (
        "every place is sure"
        if not uncertain
        else f"{uncertain} of {total} snapshots could lie elsewhere as well: read rods seen by them alone with care"
    )
    return f"The robots' positions were off by {sigma_px:.0f} px and {heading}; {doubt}."
