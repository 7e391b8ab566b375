"""How well two pictures of one floor agree, and how well pictures of other places do: learned from the session itself.

Pure. Agreement is z = atanh(rho) of a refined fit at full scale. Where two snapshots truly share floor, z is the same
throughout a session to a few tenths (it is the noise and the water that set it); where they do not, z is lower, but on
a floor that repeats it may come near. How near is learned from pairs that cannot fit: a snapshot turned by half a turn
against its neighbour keeps the rows, the lattice and the spectrum, and nothing else. (ASHLAR takes its threshold from
tiles known not to overlap, doi 10.1093/bioinformatics/btac544.)
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .values import Float

LEAST_WRONG = 8  # fits that cannot be right, before any place is believed
LEAST_BEST = 6
KNOWN_FITS = 12
SCATTER = 0.12  # of z among true fits, at the least
WIDE_SHARED = 0.15  # of a snapshot's area: fits that share about as much are compared
CLIP_NATS = 12.0
STRAY = 0.05  # of true fits lie far below the others: particles, glare
NULL_NATS = 12.0  # what the best of some 100,000 places scores on noise alone


def agreement(rho: float) -> float:
    """z of a correlation."""
    return float(np.arctanh(min(max(rho, -0.9999), 0.9999)))


class Agreement:
    """What is known of a session's fits; grows as it is told."""

    def __init__(self) -> None:
        self._wrong: list[tuple[float, float]] = []
        self._wrong_nats: list[float] = []
        self._best: list[float] = []
        self._right: list[float] = []

    def tell_wrong(self, nats: float, fits: Sequence[tuple[float, float]]) -> None:
        """A search that cannot be right: its best score, and (z, shared) of the fits at its places."""
        self._wrong_nats.append(nats)
        self._wrong.extend(fits)

    def tell_best(self, z: float) -> None:
        """The best z among the places of a pair that probably shares floor."""
        self._best.append(z)

    def tell_right(self, z: float) -> None:
        """The z of a fit that was accepted."""
        self._right.append(z)

    @property
    def searches(self) -> int:
        """How many searches that cannot be right were told."""
        return len(self._wrong_nats)

    @property
    def repeats(self) -> float:
        """How many times better wrong places score than on a floor that does not repeat, 1 or more."""
        if not self._wrong_nats:
            return 1.0
        high = float(np.quantile(self._wrong_nats, 0.9)) * (1 + 2 / len(self._wrong_nats))
        return max(1.0, high / NULL_NATS)

    def true_fits(self) -> tuple[float, float] | None:
        """Middle and scatter of z where two snapshots share floor; None while too little is known."""
        if len(self._right) >= KNOWN_FITS:
            known = np.array(self._right[-300:])
        elif len(self._best) >= LEAST_BEST and len(self._wrong) >= LEAST_WRONG:
            known = self._upper()
        else:
            return None
        middle = float(np.median(known))
        return middle, max(float(np.median(np.abs(known - middle))) / 0.6745, SCATTER)

    def _upper(self) -> Float:
        """The best fits that stand above what wrong ones reach, or the upper half where they do not stand out."""
        best, wrong = np.array(self._best), np.array([z for z, _ in self._wrong])
        above = best[best > np.quantile(wrong, 0.95)]
        return np.asarray(above if len(above) >= max(3, len(best) // 4) else best[best >= np.median(best)])

    def log_ratio(self, z: float, shared: float) -> float:
        """Nats for a fit with agreement z over the share `shared` of a snapshot: right against wrong."""
        true = self.true_fits()
        if true is None:
            return 0.0
        middle, scatter = true
        off = (min(z, middle) - middle) / scatter  # a better fit than most speaks for none but the right place
        right = (1 - STRAY) * np.exp(-0.5 * off**2) / scatter + STRAY * np.exp(-0.5 * (off / 6) ** 2) / (6 * scatter)
        wrong = np.array(self._wrong)
        alike = np.exp(-0.5 * np.square((wrong[:, 1] - shared) / WIDE_SHARED))
        near = np.exp(-0.5 * np.square((wrong[:, 0] - min(z, middle)) / scatter)) / scatter
        spread = 3 * max(float(wrong[:, 0].std()), scatter)
        stray = np.exp(-0.5 * ((z - wrong[:, 0].mean()) / spread) ** 2) / spread
        density = ((alike * near).sum() + stray) / (alike.sum() + 1)
        return float(np.clip(np.log(right + 1e-9) - np.log(density + 1e-9), -CLIP_NATS, CLIP_NATS))
