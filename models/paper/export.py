"""Exports trained networks to ONNX for `pondwatch correct --method paper-...`:

`python -m models.paper.export --runs RUNS/NOISE` writes paper-NET.onnx beside this file with its contract inside,
compares torch and onnxruntime, and writes expected.json: what each file answers to inputs made by seed.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import torch

from pondwatch.core.paperinputs import COUNT
from pondwatch.core.values import Float32
from pondwatch.jobs.papernets import OnnxNetwork

from . import train
from .evaluate import RESULTS
from .network import VARIANTS, PaperNetwork

HERE = Path(__file__).parent
PARITY = 1e-4


def made_up(shape: Mapping[str, Any], seed: int = 0) -> dict[str, Float32]:
    """Inputs of the right shapes by seed: `snapshot_px`, `canvas` and `canvas_px` say which."""
    rng = np.random.default_rng(seed)
    inputs = {"coordinates": rng.uniform(0, 1, (1, COUNT, 3)).astype(np.float32)}
    if shape["snapshot_px"] is not None:
        width, height = shape["snapshot_px"]
        inputs["snapshots"] = rng.integers(0, 2, (1, COUNT, height, width)).astype(np.float32)
    if shape["canvas"]:
        inputs["canvas"] = rng.integers(0, 2, (1, 1, shape["canvas_px"], shape["canvas_px"])).astype(np.float32)
    return inputs


def contract_of(network: PaperNetwork, made: Mapping[str, Any], rmse: list[float]) -> dict[str, Any]:
    """What an ONNX file says of itself."""
    shape = network.shape
    return {
        "variant": shape.variant,
        "snapshots": COUNT,
        "snapshot_px": list(shape.snapshot_px) if shape.sees_snapshots else None,
        "canvas": shape.canvas,
        "canvas_px": shape.canvas_px,
        "rmse": rmse,
        "recipe": made["recipe"]["name"],
        "seed": made["seed"],
        "epochs": made["epochs"],
    }


def export(network: PaperNetwork, contract: Mapping[str, Any], path: Path) -> None:
    """Write a network for sets one by one.

    Raises:
        RuntimeError: onnxruntime answers otherwise than torch.
    """
    inputs = {name: torch.from_numpy(value) for name, value in made_up(contract).items()}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the exporter that needs no further package is an old one
        torch.onnx.export(
            network.eval(), tuple(inputs.values()), path, input_names=list(inputs), output_names=["poses"],
            opset_version=17, dynamo=False,
        )  # fmt: skip
    model = onnx.load(path)
    onnx.helper.set_model_props(model, {"contract": json.dumps(contract)})
    onnx.save(model, path)
    off = apart(network, path)
    if off > PARITY:
        raise RuntimeError(f"{path.name}: onnxruntime and torch are {off:.2g} apart; {PARITY:g} is allowed.")


def apart(network: PaperNetwork, path: Path, seeds: int = 4) -> float:
    """The largest difference between what torch and onnxruntime answer."""
    ours = OnnxNetwork.of(path.stem, path.parent)
    worst = 0.0
    for seed in range(seeds):
        inputs = made_up(ours.contract, seed)
        with torch.no_grad():
            theirs = network.eval()(**{name: torch.from_numpy(value) for name, value in inputs.items()}).numpy()
        worst = max(worst, float(np.abs(ours(inputs) - theirs).max()))
    return worst


def expected(path: Path) -> dict[str, Any]:
    """The file's digest, and its answer to the inputs of seed 0: every 37th value."""
    answer = OnnxNetwork.of(path.stem, path.parent)
    values = answer(made_up(answer.contract)).reshape(-1)[::37]
    return {"sha256": hashlib.sha256(path.read_bytes()).hexdigest(), "values": [round(float(v), 6) for v in values]}


def rmse_of(net: str, noise: str) -> list[float]:
    """Of x, y and theta on ponds and poses apart from those trained on, as it was measured."""
    found = json.loads(RESULTS.read_text(encoding="utf-8"))
    row = next(r for r in found if (r["noise"], r["split"], r["method"]) == (noise, "disjoint", net))
    return [round(float(np.sqrt(v)), 6) for v in row["mse"]]


def main() -> None:
    """Export every network that is there."""
    parser = argparse.ArgumentParser(prog="python -m models.paper.export", description=__doc__)
    parser.add_argument("--runs", type=Path, required=True, metavar="RUNS/NOISE", help="measured before by evaluate")
    asked = parser.parse_args()
    answers = {}
    for net in VARIANTS:
        network, made = train.load(asked.runs / net)
        path = HERE / f"paper-{net}.onnx"
        export(network, contract_of(network, made, rmse_of(net, asked.runs.name)), path)
        answers[path.stem] = expected(path)
        print(f"{path.name}: {path.stat().st_size / 1e6:.2f} MB, {apart(network, path):.1e} from torch")
    (HERE / "expected.json").write_text(json.dumps(answers, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
