"""The one interface of every correction method: add snapshots, hear which poses moved.

A corrector is a value machine: it holds what it was told and nothing else, so the same snapshots always give the
same result. `add` is quick and decides a new snapshot against what is known; `settle` decides everything at once,
and its result does not depend on the order in which the snapshots came.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol, runtime_checkable

from .errors import Invalid
from .graph import GraphCorrector
from .identity import IdentityCorrector
from .lattice import LatticeCorrector
from .ports import RodFinder, Spread, one_by_one
from .values import CorrectedPose, Correction, Inspection, Quality, RodReading, Snapshot, SnapshotKey

METHODS = ("auto", "identity", "lattice", "graph")


class Corrector(Protocol):
    """Corrects the poses of one session."""

    method: str

    def add(self, snapshots: Sequence[Snapshot]) -> Correction:
        """Take snapshots; returns every new pose, every earlier one that moved, and every rod read otherwise."""

    def settle(self) -> Correction:
        """Decide all at once. The state after it is a function of the set of snapshots, not of their order."""

    def poses(self) -> Mapping[SnapshotKey, CorrectedPose]:
        """Every pose as it stands."""

    def rods(self) -> tuple[RodReading, ...]:
        """Every rod of the layout as it stands, in the layout's order; rods never seen are `unseen`."""

    def quality(self) -> Quality:
        """How well it stands."""


@runtime_checkable
class Deliberates(Protocol):
    """A corrector whose joint decisions may be made beside it: `deliberate` in another thread, then `adopt`."""

    def beside(self) -> None:
        """From now on somebody asks for joint decisions when they are due, so that `add` need not make them."""

    def due(self) -> bool:
        """Whether all should be decided together again."""

    def deliberate(self) -> Any:
        """Decide all together that are held now; changes nothing."""

    def held(self) -> Sequence[object]:
        """Values that a deliberation made now may refer to, none of which ever changes."""

    def adopt(self, deliberation: Any, /) -> Correction:
        """Take the result over. What came since, and what rods read as, follow by `catch_up`."""

    @property
    def behind(self) -> bool:
        """Whether something still stands as it did before the last deliberation was taken over."""

    def catch_up(self, most: int) -> Correction:
        """Decide up to so many such snapshots again, and read some rods again."""


def hold(corrector: Corrector, snapshots: Sequence[Snapshot]) -> None:
    """Give a corrector snapshots that it need not decide before it is settled."""
    getattr(corrector, "hold", corrector.add)(snapshots)


def make_corrector(
    inspection: Inspection, method: str = "auto", finder: RodFinder | None = None, spread: Spread = one_by_one
) -> Corrector:
    """A corrector by name. `auto`: `lattice` with a layout, `graph` without one. `finder` and `spread`: for `lattice`.

    Raises:
        Invalid: there is no such method, or the session does not have what it needs.
    """
    if method == "auto":
        method = "lattice" if inspection.pond.rods else "graph"
    if method == "identity":
        return IdentityCorrector(inspection)
    if method == "graph":
        return GraphCorrector(inspection)
    if method == "lattice":
        return LatticeCorrector(inspection, finder=finder, spread=spread)
    raise Invalid(f"There is no correction method {method!r}; there are {', '.join(METHODS)}.", method=method)
