"""Which snapshots see which rods, and every rod's reading, kept up to date rod by rod."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .codes import Palette
from .fill import Looks, read_rods, to_pond
from .values import Float, Int, RodReading, RodState, SnapshotKey


@dataclass(frozen=True, slots=True, eq=False)
class Entry:
    """One snapshot's looks from one place. rods: (K,), wholly in view. ratio: (K, SECTORS, 3), image orientation.
    trust: probability that it lies there."""

    rods: Int
    ratio: Float
    theta_rad: float
    trust: float


class RodBook:
    """The looks of all snapshots, and what the rods are read as. The order of entries leaves no trace."""

    def __init__(self, ids: tuple[str, ...]) -> None:
        self._ids = ids
        self._entries: dict[SnapshotKey, tuple[Entry, ...]] = {}
        self._seen_by: dict[int, dict[tuple[SnapshotKey, int], int]] = {}
        self._readings = [RodReading(i, RodState.UNSEEN, None, 0.0, 0) for i in ids]
        self._touched: set[int] = set()
        self._put_off: dict[int, None] = {}  # the longest first
        self._palette: Palette | None = None
        self._prior: Float | None = None

    def read_by(self, palette: Palette, prior: Float) -> None:
        """Read by another palette from now on."""
        self._palette, self._prior = palette, prior
        self._touched.update(self._seen_by)

    def enter(self, key: SnapshotKey, entries: Sequence[Entry]) -> None:
        """Put a snapshot's looks, from each place where it may lie, in the place of those it had."""
        for n, before in enumerate(self._entries.get(key, ())):
            for rod in before.rods.tolist():
                del self._seen_by[rod][key, n]
                self._touched.add(rod)
        for n, entry in enumerate(entries):
            for row, rod in enumerate(entry.rods.tolist()):
                self._seen_by.setdefault(rod, {})[key, n] = row
                self._touched.add(rod)
        self._entries[key] = tuple(entries)

    def seen_by(self, rods: Sequence[int]) -> set[SnapshotKey]:
        """The snapshots that have any of some rods wholly in view, from any place where they may lie."""
        return {key for rod in rods for key, _ in self._seen_by.get(rod, {})}

    def readings(self) -> tuple[RodReading, ...]:
        """Of all rods, in the layout's order."""
        return tuple(self._readings)

    @property
    def behind(self) -> bool:
        """Whether rods are still read as before they were put off."""
        return bool(self._put_off)

    def put_off(self) -> None:
        """Leave what was touched so far to later calls of `changed`."""
        self._put_off |= dict.fromkeys(sorted(self._touched))
        self._touched.clear()

    def changed(self, most: int | None = None) -> tuple[RodReading, ...]:
        """Read again what was touched, and of what was put off `most` at most; the readings that are otherwise than
        before."""
        waiting = [rod for rod in self._put_off if rod not in self._touched]
        rods = sorted(self._touched.union(waiting[:most]))
        self._touched.clear()
        for rod in rods:
            self._put_off.pop(rod, None)
        if not rods or self._palette is None:
            return ()
        ids, by = tuple(self._ids[r] for r in rods), self._palette
        fresh = read_rods(ids, self._looks(rods), self._prior, by.certainty, by.taught)
        pairs = [(r, reading) for r, reading in zip(rods, fresh, strict=True) if reading != self._readings[r]]
        for rod, reading in pairs:
            self._readings[rod] = reading
        return tuple(reading for _, reading in pairs)

    def _looks(self, rods: list[int]) -> Looks:
        """All looks at some rods, numbered by their place in the list."""
        assert self._palette is not None
        rows = [
            (n, self._entries[key][place], i)
            for n, r in enumerate(rods)
            for (key, place), i in sorted(self._seen_by.get(r, {}).items())
        ]
        if not rows:
            return Looks(np.zeros(0, np.int64), np.zeros((0, 0)), np.zeros(0))
        ratio = np.array([e.ratio[i] for _, e, i in rows])
        theta = np.array([e.theta_rad for _, e, _ in rows])
        number = np.array([n for n, _, _ in rows], dtype=np.int64)
        trust = np.array([e.trust for _, e, _ in rows])
        return Looks(number, to_pond(self._palette.share(ratio), theta), trust, self._palette.strange(ratio))
