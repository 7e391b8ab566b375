"""Trains the network that finds rods: `python -m models.rods.train --out RUN` (RUN/rods.pt), one thread unless told.

The learning rate falls along a cosine over the epochs, or over the minutes of processor time where those end first.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from . import data
from .network import RodNetwork, loss

BATCH = 16
RATE = 4e-3
SCENES_A_POND = 14


def train(
    crops: data.Crops, epochs: int, minutes: float = math.inf, seed: int = 0, told: Callable[[str], None] = print
) -> tuple[RodNetwork, list[float]]:
    """A network trained on crops, and its mean loss of every epoch begun."""
    torch.manual_seed(seed)
    network = RodNetwork()
    optimiser = torch.optim.AdamW(network.parameters(), lr=RATE, weight_decay=1e-3)
    started = time.process_time()
    losses: list[float] = []
    steps = len(crops.planes) // BATCH
    for epoch in range(epochs):
        order, mean = torch.randperm(len(crops.planes)), 0.0
        for step in range(steps):
            done = max((epoch + step / steps) / epochs, (time.process_time() - started) / 60 / minutes)
            if done >= 1:
                return network.eval(), losses
            _set_rate(optimiser, done)
            mean += _step(network, optimiser, crops, order[step * BATCH : (step + 1) * BATCH])
        losses.append(mean / steps)
        told(f"epoch {epoch + 1}: loss {losses[-1]:.4f}, {time.process_time() - started:.0f} s of processor time")
    return network.eval(), losses


def _set_rate(optimiser: torch.optim.Optimizer, done: float) -> None:
    for group in optimiser.param_groups:
        group["lr"] = RATE * min(1, 0.1 + 20 * done) * (1 + math.cos(math.pi * done)) / 2


def _step(network: RodNetwork, optimiser: torch.optim.Optimizer, crops: data.Crops, index: Tensor) -> float:
    network.train()
    taken = index.numpy()
    every = (crops.planes, crops.target, crops.known, crops.rod)
    planes, *wanted = mirrored(*(torch.from_numpy(a[taken]) for a in every))
    value = loss(network(recoloured(planes)), *wanted)
    optimiser.zero_grad()
    torch.autograd.backward(value)
    torch.nn.utils.clip_grad_norm_(network.parameters(), 5.0)
    optimiser.step()
    return float(value.detach())


def mirrored(planes: Tensor, target: Tensor, known: Tensor, rod: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """A batch, left for right, upside down, both or neither; offsets and wedges turn with it."""
    for axis, channels in ((-1, [1, 6]), (-2, [2, 7])):
        if torch.rand(()) < 0.5:
            planes, target, known, rod = (t.flip(axis) for t in (planes, target, known, rod))
            target = target.clone()
            target[:, channels] *= -1
    return planes, target, known, rod


def recoloured(planes: Tensor) -> Tensor:
    """Other colours for each picture: channels in another order, some mixed, some made negative, a little noise."""
    n, inside = len(planes), planes[:, 3:]
    mix = torch.eye(3)[torch.stack([torch.randperm(3) for _ in range(n)])]
    mix = (mix + 0.15 * torch.randn(n, 3, 3)) * torch.where(torch.rand(n, 1, 1) < 0.5, -1.0, 1.0)
    light = torch.einsum("nij,njhw->nihw", mix * torch.empty(n, 1, 1).uniform_(0.8, 1.25), planes[:, :3])
    light = (light + 0.08 * torch.rand(n, 1, 1, 1) * torch.randn_like(light)) * inside
    return torch.cat([light, inside], dim=1)


def save(run: Path, network: RodNetwork, recipe: dict[str, Any]) -> None:
    """Weights and what they were made by: RUN/rods.pt."""
    run.mkdir(parents=True, exist_ok=True)
    torch.save({"network": network.state_dict(), "recipe": json.dumps(recipe)}, run / "rods.pt")


def load(run: Path) -> tuple[RodNetwork, dict[str, Any]]:
    """A trained network, and its recipe."""
    held = torch.load(run / "rods.pt", weights_only=True)
    network = RodNetwork()
    network.load_state_dict(held["network"])
    return network.eval(), json.loads(held["recipe"])


def main() -> None:
    """Make the pictures, train, save."""
    parser = argparse.ArgumentParser(prog="python -m models.rods.train", description=__doc__)
    parser.add_argument("--out", type=Path, required=True, metavar="RUN")
    parser.add_argument("--epochs", type=int, default=40)
    parser.add_argument("--minutes", type=float, default=math.inf, help="of processor time, at most")
    parser.add_argument("--ponds", type=int, default=180, help=f"{SCENES_A_POND} pictures of each")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--threads", type=int, default=1)
    asked = parser.parse_args()
    torch.set_num_threads(asked.threads)
    crops = data.crops(asked.seed, asked.ponds, SCENES_A_POND)
    print(f"{len(crops.planes)} pictures made", flush=True)
    started = time.process_time()
    network, losses = train(crops, asked.epochs, asked.minutes, asked.seed, lambda line: print(line, flush=True))
    spent = (time.process_time() - started) / 60
    recipe = {
        "seed": asked.seed, "ponds": asked.ponds, "pictures": len(crops.planes), "epochs": round(len(losses), 2),
        "batch": BATCH, "rate": RATE, "minutes": round(spent, 1), "threads": asked.threads,
        "parameters": sum(p.numel() for p in network.parameters()), "loss": [round(v, 4) for v in losses],
    }  # fmt: skip
    save(asked.out, network, recipe)


if __name__ == "__main__":
    main()
