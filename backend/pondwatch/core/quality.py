"""How well a session stands, in figures and in one sentence for an operator."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Collection

import numpy as np

from .codes import Palette
from .fill import ENOUGH_TAUGHT
from .noise import UNKNOWN_HEADING, NoiseModel
from .ranks import median
from .values import Camera, CorrectedPose, Quality, Status

LATEST = 500  # snapshots that medians are of


class Tally:
    """Counts of snapshots by status, and what is typical of the latest of them."""

    def __init__(self) -> None:
        self._count = Counter[Status]()
        self._sigmas_m: deque[float] = deque(maxlen=LATEST)
        self._residuals: deque[float] = deque(maxlen=LATEST)

    def count(self, before: CorrectedPose | None, after: CorrectedPose, residual: float) -> None:
        """A snapshot is new, or lies otherwise than before."""
        if before is not None:
            self._count[before.status] -= 1
        self._count[after.status] += 1
        if after.status is Status.PLACED and after.sigma_xy_m is not None:
            self._sigmas_m.append(after.sigma_xy_m)
        if np.isfinite(residual):
            self._residuals.append(residual)

    def quality(self, noise: NoiseModel, camera: Camera, pitch_m: float, palette: Palette | None = None) -> Quality:
        """Counts, estimated noise of the poses that came in, residual in grey levels, and what it means.

        palette: what rods are read by, where any were read.
        """
        total = sum(self._count.values())
        facts = {
            "gross_share": round(noise.gross, 4),
            "error_correlation": round(noise.correlation, 3),
            "sigma_in_pitches": round(noise.sigma_xy_m / pitch_m, 3),
            "residual_grey": round(_middle(self._residuals), 3) if self._residuals else None,
        }
        sigma_px = _middle(self._sigmas_m) / camera.metres_per_pixel if self._sigmas_m else None
        uncertain = self._count[Status.UNCERTAIN]
        sentence = _sentence(total, uncertain, noise.sigma_xy_m / camera.metres_per_pixel, noise) + _alike(palette)
        return Quality(
            total, self._count[Status.PLACED], uncertain, self._count[Status.REJECTED],
            noise.sigma_xy_m, noise.sigma_theta_rad, sigma_px, sentence, facts,
        )  # fmt: skip


def _middle(values: Collection[float]) -> float:
    return float(median(np.fromiter(values, float, len(values))))


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


def _alike(palette: Palette | None) -> str:
    """What to know of a pond with one kind of rod; nothing of others."""
    if palette is None or palette.only is None or palette.taught < ENOUGH_TAUGHT:
        return ""
    kind = "empty" if palette.only == palette.hollow else "full"
    return f" All rods look alike and are read as {kind} (certain to {100 * palette.certainty:.0f} %)."
