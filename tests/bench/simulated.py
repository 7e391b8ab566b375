"""Sessions made up for the bench, with their truth, in the bundle format."""

from __future__ import annotations

from pathlib import Path


def simulated_bundles(folder: Path) -> list[Path]:
    """Some ponds of the simulator."""
    return []
