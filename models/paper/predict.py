"""What trained networks say of a data set. Needs torch."""

from __future__ import annotations

import time
from pathlib import Path

import torch

from pondwatch.core.values import Float
from pondwatch.simulator.sfp10_files import load_spec

from . import data, train
from .network import PaperNetwork
from .recipes import Recipe, told
from .tally import Row, Tally, ponds_of, raster_mask


def network_row(folder: Path, run: Path, instances: int, iou_every: int) -> Row:
    """One trained network."""
    network, made = train.load(run)
    tally = Tally(iou_every)
    for _, sets in ponds_of(folder):
        tensors = data.as_tensors(sets, network.shape, instances, made["poses"])
        started = time.process_time()
        estimates, truth = predict(network, tensors)
        tally.seconds += time.process_time() - started
        mask = raster_mask(truth)
        for estimate in estimates:
            tally.add(estimate, truth, mask)
    recipe = Recipe(**made["recipe"])
    return tally.row(load_spec(folder), run.name, f"{told(recipe)}, seed {made['seed']}, {made['epochs']} epochs done")


def predict(network: PaperNetwork, one: data.PaperSets) -> tuple[Float, Float]:
    """Of one pond: (K, 221, 3) estimates and (221, 3) truth, normalised."""
    every = torch.arange(one.coordinates.shape[1])[None]
    inputs, _ = one.batch(torch.zeros(1, dtype=torch.long), every)
    with torch.no_grad():
        out = network(**dict(zip(network.shape.inputs, inputs, strict=True)))
    return out.double().numpy(), one.truth[0].double().numpy()
