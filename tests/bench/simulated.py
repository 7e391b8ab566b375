"""Sessions made up for the bench, with their truth, in the bundle format: by seed, so the same every time."""

from __future__ import annotations

from pathlib import Path

from pondwatch.simulator.bundle import write_bundle
from pondwatch.simulator.simulation import Simulation
from pondwatch.simulator.spec import SimulationSpec

SPECS = {
    "simulated": SimulationSpec(),
    "simulated-square": SimulationSpec(lattice="square", path="smooth", noise_pitch=0.4),
    "simulated-turned": SimulationSpec(lattice_angle_rad=0.3, fills="wedges", missing=0.1),
    "simulated-murky": SimulationSpec(water="murky", path="sweep"),
    "simulated-unclaimed": SimulationSpec(claim=0.0, noise_pitch=0.5),
    "simulated-outliers": SimulationSpec(outliers=0.05),
    "simulated-striped": SimulationSpec(fills="striped"),
    "simulated-large": SimulationSpec(snapshots=1000, coverage=5.0),
    "simulated-unmapped": SimulationSpec(mapped=False),
}


def simulated_bundles(folder: Path, names: tuple[str, ...] = tuple(SPECS)) -> list[Path]:
    """Write those named; their folders, in that order."""
    written = []
    for name in names:
        seed = 1000 + list(SPECS).index(name)
        write_bundle(Simulation(SPECS[name], seed), folder / name)
        written.append(folder / name)
    return written
