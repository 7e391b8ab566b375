"""Ponds that are simulated, corrected and scored in this process, and what was found kept in a file, line by line.

For benches of hundreds of ponds: no picture touches a disk and no mosaic is assembled. A bench that was cut off goes on
where it was, and one whose code (the simulator, and what the corrector is made of) changed begins anew.
"""

from __future__ import annotations

import ast
import hashlib
import json
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pondwatch.basestation.bundle import Bundle
from pondwatch.core.corrector import Corrector, hold, make_corrector
from pondwatch.core.images import decode
from pondwatch.core.values import Snapshot
from pondwatch.simulator.simulation import Simulation
from pondwatch.simulator.spec import SimulationSpec

from .bound import bound_px
from .pages import ROOT
from .score import GROSS_PX, Figures, Result, Truth, error_px, identity, read_truth, score

KEPT = ROOT / "build" / "bench"
CORE, SIMULATOR = (ROOT / "backend" / "pondwatch" / room for room in ("core", "simulator"))
CORRECTOR = CORE / "corrector.py"
BOUNDS = 16  # snapshots of a pond whose Cramér-Rao bound is worked out
Record = dict[str, Any]


@dataclass(frozen=True, slots=True, eq=False)
class Inspected:
    """An inspection's snapshots, decoded, and its truth, both sorted by sequence."""

    snapshots: tuple[Snapshot, ...]
    truth: Truth


def simulated(made: Simulation) -> Inspected:
    """All of a simulation, as a base station would send it."""
    spec = made.spec
    snapshots = tuple(Snapshot(s.key, s.captured_s, s.pose_pond, decode(s.content, spec.camera)) for s in made)
    fills = {rod.id: float(fill) for rod, fill in zip(made.inspection.pond.rods, made.truth_fills, strict=True)}
    truth = Truth(made.inspection, tuple(range(len(made))), made.truth_poses, made.poses, fills)
    return Inspected(snapshots, truth)


def opened(folder: Path) -> Inspected:
    """A bundle that has a truth."""
    with Bundle(folder) as bundle:
        rows = sorted(bundle.rows, key=lambda row: row.key.sequence)
        snapshots = tuple(s for _, s in bundle.snapshots(rows) if isinstance(s, Snapshot))
    return Inspected(snapshots, read_truth(folder))


def corrected(pond: Inspected, method: str) -> tuple[Result, float]:
    """By one of our methods, and the CPU seconds that it took."""
    corrector = make_corrector(pond.truth.inspection, method)
    started = time.process_time()
    hold(corrector, pond.snapshots)
    corrector.settle()
    return told_by(corrector, pond), time.process_time() - started


def told_by(corrector: Corrector, pond: Inspected) -> Result:
    """A corrector's poses and rods, in the truth's order."""
    found = [corrector.poses()[s.key] for s in pond.snapshots]
    poses = np.array([np.full(3, np.nan) if p.pose_pond is None else p.pose_pond for p in found])
    sigma = np.array([p.sigma_xy_m or np.nan for p in found])
    rods = {
        r.rod_id: {"state": r.state.value, "fill": "" if r.fill is None else f"{r.fill:.4f}"} for r in corrector.rods()
    }
    return Result(poses, sigma, tuple(p.status.value for p in found), rods)


def measured(spec: SimulationSpec, seed: int, method: str = "auto", bounds: int = BOUNDS) -> Record:
    """One pond by one method: figures as the scorer's, CPU seconds, errors in multiples of the bound."""
    simulation = Simulation(spec, seed)
    pond = simulated(simulation)
    result, seconds = corrected(pond, method)
    return {
        "seed": seed,
        "method": method,
        "seconds": seconds,
        "figures": score(pond.truth, result),
        "identity": score(pond.truth, identity(pond.truth)),
        "over_bound": over_bound(simulation, pond.truth, result, bounds),
        "jumps": jumps(pond.truth, result, spec.pitch_px),
    }


def over_bound(simulation: Simulation, truth: Truth, result: Result, most: int) -> list[float]:
    """Errors of up to `most` placed snapshots that are no jumps, each over the bound of its own pixels."""
    off = error_px(truth, result.poses)
    near = [n for n, s in enumerate(result.statuses) if s == "placed" and off[n] <= GROSS_PX]
    chosen = [near[i] for i in np.unique(np.linspace(0, len(near) - 1, min(most, len(near))).astype(int))]
    return [round(float(off[n] / bound_px(simulation, n)), 3) for n in chosen]


def jumps(truth: Truth, result: Result, pitch_px: float) -> Figures:
    """How many snapshots lie over half a pitch, and how many over 5 px, from the truth: of all, and of the placed."""
    poses = np.where(np.isfinite(result.poses[:, :1]), result.poses, truth.noisy)
    off, sure = error_px(truth, poses), np.array(result.statuses) == "placed"
    half = pitch_px / 2
    return {
        "snapshots": len(off),
        "placed": int(sure.sum()),
        "half_pitch": int((off > half).sum()),
        "half_pitch_placed": int((off > half)[sure].sum()),
        "gross": int((off > GROSS_PX).sum()),
        "gross_placed": int((off > GROSS_PX)[sure].sum()),
    }


class Kept:
    """Records of a bench, each appended as it is made; in a file named after the code that they depend on."""

    def __init__(self, bench: str, folder: Path = KEPT, code: Sequence[Path] = (CORRECTOR, SIMULATOR)) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.path = folder / f"{bench}-{code_digest(code)[:12]}.jsonl"

    def records(self) -> list[Record]:
        """All that are there; a last line that was cut off is not one."""
        lines = self.path.read_text(encoding="utf-8").splitlines(keepends=True) if self.path.exists() else []
        return [json.loads(line) for line in lines if line.endswith("\n")]

    def add(self, record: Record) -> None:
        """Write one down."""
        with self.path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(record) + "\n")


def code_digest(code: Sequence[Path]) -> str:
    """SHA-256 of the Python files in folders, and of modules with all that they need of their own folder."""
    digest = hashlib.sha256()
    for path in (path for part in code for path in (sorted(part.glob("*.py")) if part.is_dir() else needed(part))):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def needed(module: Path) -> list[Path]:
    """A module and all in its folder that it imports, directly or not."""
    found, waiting = set[Path](), [module]
    while waiting:
        path = waiting.pop()
        found.add(path)
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and node.level == 1:
                names = [node.module.split(".")[0]] if node.module else [alias.name for alias in node.names]
                paths = {path.parent / f"{name}.py" for name in names}
                waiting += [other for other in paths - found if other.exists()]
    return sorted(found)


def pooled(records: Sequence[Record], share: float) -> float | None:
    """A quantile of the errors over their bounds, of all records."""
    every = [v for r in records for v in r["over_bound"]]
    return float(np.quantile(every, share)) if every else None
