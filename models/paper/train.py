"""Trains the networks: `python -m models.paper.train DATASET --out RUNS`. Cut off, it goes on at the last epoch.

A run is a folder RUNS/NAME with `checkpoint.pt` (weights, optimiser, epoch, generator; written after each epoch) and
`log.jsonl`, a line an epoch.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import torch

from . import data
from .network import VARIANTS, PaperNetwork, Shape, loss
from .recipes import RECIPES, Recipe


def train(
    dataset: Path, run: Path, variant: str, recipe: Recipe, poses: data.Poses = "noisy", seed: int = 0,
    device: str = "cpu", ponds: int = 0,
) -> list[float]:  # fmt: skip
    """Train one network, or go on with it.

    Args:
        run: its folder. poses: which poses draw the mask; `true` is an oracle. ponds: how many to train on, 0 is all.

    Returns:
        The mean loss of every epoch from the first.
    """
    shape = Shape(variant, recipe.width, recipe.snapshot_px, recipe.canvas_px)  # type: ignore[arg-type]
    told = {"shape": shape.facts(), "recipe": asdict(recipe), "poses": poses, "seed": seed}
    torch.manual_seed(seed)
    network = PaperNetwork(shape).to(device)
    optimiser = torch.optim.Adam(network.parameters(), lr=recipe.learning_rate, betas=(0.9, 0.999))
    losses, generator = _resume(run, told, network, optimiser, torch.Generator().manual_seed(seed))
    if len(losses) == recipe.epochs:
        return losses
    sets = data.read(dataset, "train", shape, ponds, recipe.instances, poses).to(device)
    for epoch in range(len(losses), recipe.epochs):
        started = time.monotonic()
        rate = _rate(recipe, epoch)
        for group in optimiser.param_groups:
            group["lr"] = rate
        losses.append(_epoch(network, optimiser, sets, recipe, generator))
        _save(run, told, network, optimiser, losses, generator)
        _log(run, {"epoch": epoch + 1, "loss": losses[-1], "lr": rate, "seconds": time.monotonic() - started})
    return losses


def load(run: Path, device: str = "cpu") -> tuple[PaperNetwork, dict[str, Any]]:
    """A trained network, and what its checkpoint says of it."""
    held = torch.load(run / "checkpoint.pt", map_location=device, weights_only=True)
    shape = held["told"]["shape"]
    network = PaperNetwork(Shape(**{**shape, "snapshot_px": tuple(shape["snapshot_px"])})).to(device)
    network.load_state_dict(held["network"])
    return network.eval(), held["told"] | {"epochs": len(held["losses"]), "loss": held["losses"][-1]}


def _rate(recipe: Recipe, epoch: int) -> float:
    if not recipe.decay:
        return recipe.learning_rate
    return recipe.learning_rate * (1 + math.cos(math.pi * epoch / recipe.epochs)) / 2


def _epoch(
    network: PaperNetwork, optimiser: torch.optim.Optimizer, sets: data.PaperSets, recipe: Recipe,
    generator: torch.Generator,
) -> float:  # fmt: skip
    network.train()
    total, batches = torch.zeros((), device=sets.truth.device), 0
    for inputs, truth in sets.batches(recipe.batch, recipe.ponds_a_batch, generator):
        named = dict(zip(network.shape.inputs, inputs, strict=True))
        off = loss(network(**named), truth)
        optimiser.zero_grad()
        torch.autograd.backward(off)
        optimiser.step()
        total += off.detach()
        batches += 1
    return float(total) / batches


def _resume(
    run: Path, told: dict[str, Any], network: PaperNetwork, optimiser: torch.optim.Optimizer, generator: torch.Generator
) -> tuple[list[float], torch.Generator]:
    path = run / "checkpoint.pt"
    if not path.is_file():
        return [], generator
    held = torch.load(path, weights_only=True)
    if json.dumps(held["told"]) != json.dumps(told):
        raise SystemExit(f"{path}: was trained otherwise ({held['told']}); give another folder.")
    network.load_state_dict(held["network"])
    optimiser.load_state_dict(held["optimiser"])
    generator.set_state(held["generator"])
    return list(held["losses"]), generator


def _save(
    run: Path, told: dict[str, Any], network: PaperNetwork, optimiser: torch.optim.Optimizer, losses: list[float],
    generator: torch.Generator,
) -> None:  # fmt: skip
    run.mkdir(parents=True, exist_ok=True)
    held = {
        "told": told,
        "network": network.state_dict(),
        "optimiser": optimiser.state_dict(),
        "losses": losses,
        "generator": generator.get_state(),
    }
    beside = run / ".checkpoint.pt"
    torch.save(held, beside)
    beside.replace(run / "checkpoint.pt")


def _log(run: Path, line: dict[str, float]) -> None:
    with (run / "log.jsonl").open("a", encoding="utf-8") as log:
        log.write(json.dumps(line) + "\n")


def main() -> None:
    """Train some or all of the networks, one after another."""
    parser = argparse.ArgumentParser(prog="python -m models.paper.train", description=__doc__)
    parser.add_argument("dataset", type=Path, help="an SFP10 folder with training sets")
    parser.add_argument("--out", type=Path, required=True, metavar="RUNS")
    parser.add_argument("--recipe", choices=RECIPES, default="full")
    parser.add_argument("--nets", nargs="+", default=[*VARIANTS, "ours-oracle"], metavar="NET",
                        help="a, b, c, ours, corrections; NET-oracle draws its mask from the true poses, any other "
                             "NET-WORD is NET under a name of its own")  # fmt: skip
    parser.add_argument("--epochs", type=int, help="instead of the recipe's")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--device", default="cuda" if torch.cuda.is_available() else "cpu")
    parser.add_argument("--threads", type=int, default=0, help="CPU threads; 0 leaves it to torch")
    asked = parser.parse_args()
    if asked.threads:
        torch.set_num_threads(asked.threads)
    recipe = RECIPES[asked.recipe]
    recipe = replace(recipe, epochs=asked.epochs or recipe.epochs)
    for net in asked.nets:
        variant, _, kind = net.partition("-")
        poses: data.Poses = "true" if kind == "oracle" else "noisy"
        started, spent = time.monotonic(), time.process_time()
        losses = train(asked.dataset, asked.out / net, variant, recipe, poses, asked.seed, asked.device)
        took, cpu = time.monotonic() - started, time.process_time() - spent
        print(f"{net}: loss {losses[0]:.5f} to {losses[-1]:.5f}, {took:.0f} s, {cpu:.0f} CPU s", flush=True)


if __name__ == "__main__":
    main()
