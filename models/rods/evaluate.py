"""Measures the network beside the classical detector on the same pictures, and writes CARD.md:
`python -m models.rods.evaluate`. The ponds are apart from those trained on, by seed.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pondwatch.core.lattice import LatticeCorrector
from pondwatch.core.observe import RingBand, find_rods
from pondwatch.core.ports import RodFinder
from pondwatch.core.rodsight import RodsSeen
from pondwatch.core.values import Float, Snapshot, SnapshotKey, Status
from pondwatch.jobs.rodfinder import OnnxRodFinder
from pondwatch.resources import models_dir
from pondwatch.simulator.camera import photograph
from pondwatch.simulator.simulation import Simulation
from pondwatch.simulator.spec import SimulationSpec
from pondwatch.simulator.water import through_water

from . import card, data

HERE = Path(__file__).parent
HELD_OUT = 90_000  # seeds from here on are not trained on
MATCH = 0.3  # outer radii
COUNTED = 0.35  # of a rod in view, from which missing it counts
GROSS_PX = 5.0
SETS = {"clear": ("clear", False), "murky": ("murky", False), "harder": ("harder", False), "any pond": ("any", True)}


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """What one detector made of one picture. hit: (K,), of the rods that count. off_px: of those hit. false: centres
    where there is no rod."""

    hit: Float
    off_px: Float
    calls: int
    false: int


def compare(scene: data.Scene, centres_px: Float) -> Found:
    """Centres found with the rods that are there."""
    reach = MATCH * scene.outer_px
    apart = np.hypot(*np.moveaxis(scene.centres_px[:, None] - centres_px[None], -1, 0))
    counts = scene.share >= COUNTED
    nearest = apart.min(axis=1, initial=np.inf)[counts]
    false = int((apart.min(axis=0, initial=np.inf) > reach).sum())
    return Found((nearest < reach).astype(float), nearest[nearest < reach], len(centres_px), false)


def row(found: Sequence[Found]) -> dict[str, float]:
    """Recall, precision, and the centre error of rods found, px: median and 90th percentile."""
    off = np.concatenate([f.off_px for f in found])
    calls = sum(f.calls for f in found)
    return {
        "rods": int(sum(len(f.hit) for f in found)),
        "recall": round(float(np.concatenate([f.hit for f in found]).mean()), 4),
        "precision": round(1 - sum(f.false for f in found) / max(calls, 1), 4),
        "median_px": round(float(np.median(off)), 3),
        "p90_px": round(float(np.percentile(off, 90)), 3),
    }


def detect(finder: RodFinder, kind: str, wide: bool, ponds: int, each: int, seed: int) -> dict[str, Any]:
    """Both detectors on the same pictures, and what else the network says of the rods it finds."""
    network, classical, aside = [], [], []
    for n, scene in enumerate(data.scenes(HELD_OUT + seed, ponds, each, kind, wide)):
        seen = finder(scene.image, scene.outer_px)
        height, width = scene.image.shape[:2]
        if n % each == 0:  # a pond's rods are of one size; the ordinary ones' inner radius is known
            band = RingBand.of(scene.inner_px, scene.outer_px, width, height)
        network.append(compare(scene, seen.centres_px))
        classical.append(compare(scene, find_rods(scene.image, band).centres_px))
        aside.append(_read_aside(scene, seen))
    size, within = (np.concatenate(part) for part in zip(*aside, strict=True))
    beside = {
        "radius": round(float(np.median(np.abs(size))), 4),
        "within_3_sigma": round(float(np.mean(within < 3)), 4),
    }
    return {"network": row(network), "classical": row(classical), "aside": beside}


def _read_aside(scene: data.Scene, seen: RodsSeen) -> tuple[Float, Float]:
    """Errors of rods found and wholly in view: of the radius, as a share; of the centre, in sigmas."""
    apart = np.hypot(*np.moveaxis(scene.centres_px[:, None] - seen.centres_px[None], -1, 0))
    k, j = np.nonzero((apart < MATCH * scene.outer_px) & (scene.share > 0.99)[:, None])
    off = (scene.centres_px[k] - seen.centres_px[j]) / seen.sigma_px[j, None]
    return seen.outer_px[j] / scene.outer_px - 1, np.abs(off).reshape(-1)


def place(finder: RodFinder | None, kind: str, seed: int, snapshots: int = 120) -> dict[str, float]:
    """A whole inspection corrected by the method `lattice`, with the finder or without."""
    simulation = Simulation(SimulationSpec(snapshots=snapshots, noise_pitch=0.32), HELD_OUT + seed)
    corrector = LatticeCorrector(simulation.inspection, finder=finder)
    corrector.hold(list(pictures(simulation, kind, seed)))
    corrector.settle()
    poses = sorted(corrector.poses().values(), key=lambda p: p.key.sequence)
    camera = simulation.spec.camera
    off = np.array([
        np.inf if p.pose_pond is None else np.hypot(*(p.pose_pond[:2] - t[:2])) / camera.metres_per_pixel
        for p, t in zip(poses, simulation.truth_poses, strict=True)
    ])  # fmt: skip
    placed = np.array([p.status is Status.PLACED for p in poses])
    return {
        "gross": round(float((off > GROSS_PX).mean()), 4), "placed": round(float(placed.mean()), 4),
        "gross_placed": round(float((off[placed] > GROSS_PX).mean()) if placed.any() else 0.0, 4),
        "median_px": round(float(np.median(off)), 3),
    }  # fmt: skip


def pictures(simulation: Simulation, kind: str, seed: int) -> Iterator[Snapshot]:
    """The inspection's snapshots through another water."""
    camera = simulation.spec.camera
    water = data.waters(kind, 1.0, np.random.default_rng([HELD_OUT, seed]))
    for n, pose in enumerate(simulation.truth_poses):
        rng = np.random.default_rng([HELD_OUT, seed, n])
        image = through_water(photograph(simulation.floor, pose, camera), water, pose, float(n), camera, rng)
        yield Snapshot(SnapshotKey("bubble-1", 0, n), float(n), simulation.poses[n], image)


def main() -> None:
    """Measure and write the card."""
    parser = argparse.ArgumentParser(prog="python -m models.rods.evaluate", description=__doc__)
    parser.add_argument("--ponds", type=int, default=10, help="of each water, for finding")
    parser.add_argument("--each", type=int, default=8, help="pictures of a pond")
    parser.add_argument("--inspections", type=int, default=3, help="of each water, corrected with and without")
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    finder = OnnxRodFinder.of()
    told = json.loads((models_dir() / "rods/rods.json").read_text(encoding="utf-8"))
    detected = {}
    for name, (kind, wide) in SETS.items():
        detected[name] = detect(finder, kind, wide, asked.ponds, asked.each, asked.seed)
        print(name, detected[name], flush=True)
    corrected = []
    for kind in ("clear", "murky", "harder"):
        for n in range(asked.seed, asked.seed + asked.inspections):
            corrected.append((kind, n, place(None, kind, n), place(finder, kind, n)))
            print(*corrected[-1], flush=True)
    command = f"--ponds {asked.ponds} --each {asked.each} --inspections {asked.inspections} --seed {asked.seed}"
    (HERE / "CARD.md").write_text(card.text(told, detected, corrected, command), encoding="utf-8")


if __name__ == "__main__":
    main()
