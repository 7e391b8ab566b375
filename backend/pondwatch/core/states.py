"""The states a rod may be in, as codes of sectors, and how likely each is given what was seen.

Hollow, filled, or a wedge (a pie sector) of one of seven sizes at one of 24 angles in the pond frame: enough to tell
places apart. Which of these a pond uses is learned from its looks (`prior_from`), and only those are kept. The fill
itself is read later, from all looks together (`fill.py`).
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from .codes import SECTORS
from .values import Bool, Float, Int

EMPTY, FULL = 0, 1
ANGLES = 24
LEVELS = (0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875)
COUNT = 2 + ANGLES * len(LEVELS)
CODE_SIGMA = 0.22  # of one sector: blur, wedge angles between ours, water
INDEPENDENT = 0.5  # of the sectors' errors: neighbours err together
SLIP_NATS = 11.0  # a look that contradicts a state costs at most this: things drift through the view


def fills() -> Float:
    """(COUNT,): the share filled of each state."""
    return np.concatenate([[0.0, 1.0], np.repeat(LEVELS, ANGLES)])


def templates(angles_rad: Float) -> Float:
    """(COUNT, len(angles)): what each state shows at pond angles, 0 hollow to 1 filled; edges soft by a sector."""
    start = 2 * np.pi * np.arange(ANGLES) / ANGLES
    soft = 2 * np.pi / SECTORS
    rows = [np.zeros_like(angles_rad), np.ones_like(angles_rad)]
    for level in LEVELS:
        half = np.pi * level
        for s in start:
            off = np.abs((angles_rad - s + np.pi) % (2 * np.pi) - np.pi)
            rows.append(np.clip((half - off) / soft + 0.5, 0, 1))
    return np.array(rows)


@lru_cache(maxsize=1)
def _fine_templates() -> Float:
    """(COUNT, 4 SECTORS): the templates at quarter-sector steps; the same always."""
    return templates(2 * np.pi * np.arange(4 * SECTORS) / (4 * SECTORS))


@lru_cache(maxsize=1)
def sector_templates() -> Float:
    """(COUNT, SECTORS): the templates at the sectors themselves; the same always."""
    return templates(2 * np.pi * np.arange(SECTORS) / SECTORS)


def log_likelihood(
    share: Float, valid: Bool, theta_rad: Float, sigma: float = CODE_SIGMA, kept: Int | None = None
) -> Float:
    """How well each state explains what was seen.

    Args:
        share: (S, SECTORS), 0 hollow to 1 filled, sectors in the image's orientation.
        valid: (S, SECTORS), which sectors are in view.
        theta_rad: (S,), the heading under which they are taken.
        kept: (K,), the states asked for; all where None.

    Returns:
        (S, COUNT) or (S, K), nats, up to a term that all states share; at least -SLIP_NATS below a perfect match.
    """
    steps, columns = heading_steps(theta_rad), slice(None) if kept is None else kept
    out = np.empty((len(share), COUNT if kept is None else len(kept)))
    seen = np.where(valid, np.clip(share, -0.5, 1.5), 0)
    for step in sorted(set(steps.tolist())):
        rows = steps == step
        w, w2 = _turned(step)
        v = valid[rows].astype(float)
        square = (seen[rows] ** 2).sum(axis=1, keepdims=True) - (2 * seen[rows] @ w.T)[:, columns]
        out[rows] = -INDEPENDENT * (square + (v @ w2.T)[:, columns]) / (2 * sigma**2)
    weight = valid.mean(axis=1, keepdims=True)
    return np.asarray(np.logaddexp(out, -SLIP_NATS * np.sqrt(weight)))


def heading_steps(theta_rad: Float) -> Int:
    """The quarter-sector step of each heading; under one step all look alike."""
    return np.asarray(np.round(theta_rad / (2 * np.pi / (4 * SECTORS))).astype(int) % (4 * SECTORS))


@lru_cache(maxsize=4 * SECTORS)
def _turned(step: int) -> tuple[Float, Float]:
    """(COUNT, SECTORS): what each state shows in an image of that heading; and its square."""
    w = _fine_templates()[:, (4 * np.arange(SECTORS) + step) % (4 * SECTORS)]
    return w, w**2


def prior_from(log_like: Float, valid: Bool, most: int = 48, rounds: int = 12) -> tuple[Int, Float]:
    """Which states the looks use, and how often, by expectation-maximisation over looks wholly in view.

    Args:
        log_like: (L, COUNT), from `log_likelihood`. valid: (L, SECTORS).

    Returns:
        The states kept, empty and full always among them, (K,) with K at most `most`; and their frequencies (K,).
    """
    like = np.exp(log_like[valid.mean(axis=1) > 0.9])
    prior = np.concatenate([[0.4, 0.4], np.full(COUNT - 2, 0.2 / (COUNT - 2))])
    for _ in range(rounds if len(like) else 0):
        r = like * prior
        mean = (r / r.sum(axis=1, keepdims=True)).sum(axis=0) + np.concatenate([[1.0, 1.0], np.full(COUNT - 2, 0.01)])
        prior = mean / mean.sum()
    rank = np.argsort(-prior[2:], kind="stable")[: most - 2] + 2
    used = rank[prior[rank] * max(len(like), 1) > 0.4]
    kept = np.concatenate([[EMPTY, FULL], np.sort(used)]).astype(np.int64)
    share = np.maximum(prior[kept], 0.01)
    return kept, share / share.sum()
