"""Exports a trained network: `python -m models.rods.export --run RUN` writes rods.onnx and rods.json beside this file.

`rods.json` says what the network takes and gives, what it was made by, and the SHA-256 of rods.onnx.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import torch

from pondwatch.core.rodsight import STRIDE
from pondwatch.jobs.rodfinder import CONTRACT, OnnxRodFinder

from .network import RodNetwork
from .train import load

HERE = Path(__file__).parent
PARITY = 1e-3
INPUT = "planes (1, 4, h, w), float32, h and w multiples of 4: B, G, R less their means over the picture, over the \
standard deviation of all plus 2 grey levels; the share of each pixel in the picture. See pondwatch.core.rodsight."


def export(network: RodNetwork, recipe: dict[str, Any], folder: Path) -> None:
    """Write a network for pictures of any size.

    Raises:
        RuntimeError: onnxruntime answers otherwise than torch.
    """
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "rods.onnx"
    network = network.eval()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the exporter that needs no further package is an old one
        torch.onnx.export(
            network, (torch.zeros(1, 4, 96, 124),), path, input_names=["planes"], output_names=["answer"],
            dynamic_axes={"planes": {2: "h", 3: "w"}, "answer": {2: "h4", 3: "w4"}}, opset_version=17, dynamo=False,
        )  # fmt: skip
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    told = {"sha256": digest, **CONTRACT, "input": INPUT, "recipe": recipe}
    (folder / "rods.json").write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")
    if (off := apart(network, folder)) > PARITY:
        raise RuntimeError(f"onnxruntime and torch are {off:.2g} apart; {PARITY:g} is allowed.")


def apart(network: RodNetwork, folder: Path) -> float:
    """The largest difference between what torch and onnxruntime answer, over pictures of three sizes."""
    session = OnnxRodFinder.of(folder).session
    worst = 0.0
    for seed, height in enumerate((64, 96, 120)):
        planes = np.random.default_rng(seed).standard_normal((1, 4, height, height + STRIDE), np.float32)
        with torch.no_grad():
            ours = network(torch.from_numpy(planes)).numpy()
        worst = max(worst, float(np.abs(session.run(None, {"planes": planes})[0] - ours).max()))
    return worst


def main() -> None:
    """Export a run."""
    parser = argparse.ArgumentParser(prog="python -m models.rods.export", description=__doc__)
    parser.add_argument("--run", type=Path, required=True)
    parser.add_argument("--out", type=Path, default=HERE)
    asked = parser.parse_args()
    network, recipe = load(asked.run)
    export(network, recipe, asked.out)
    print(f"{asked.out / 'rods.onnx'}: {(asked.out / 'rods.onnx').stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
