"""SFP10 as tensors: a pond's snapshots once, batches of ponds with some of their sets each."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from pondwatch.core.paperinputs import CANVAS_PX, binarised, covered, normalised, smaller, stitched, tile_size
from pondwatch.simulator.sfp10 import CAMERA, Part, PondSets, layout
from pondwatch.simulator.sfp10_files import load_pond, load_spec

from .network import Shape
from .tally import instances_of

Poses = Literal["noisy", "true"]


@dataclass(frozen=True, slots=True, eq=False)
class PaperSets:
    """P ponds with K sets each.

    coordinates: (P, K, 221, 3), normalised. truth: (P, 221, 3). snapshots: (P, 221, h, w), 8 bits, 255 is 1, or
    empty. canvas: (P, K, s, s), 8 bits, or empty.
    """

    coordinates: Tensor
    truth: Tensor
    snapshots: Tensor
    canvas: Tensor

    def to(self, device: str) -> PaperSets:
        """On another device."""
        return PaperSets(*(t.to(device) for t in (self.coordinates, self.truth, self.snapshots, self.canvas)))

    @property
    def count(self) -> int:
        """All sets."""
        return self.coordinates.shape[0] * self.coordinates.shape[1]

    def batch(self, ponds: Tensor, sets: Tensor) -> tuple[list[Tensor], Tensor]:
        """The inputs of a network, in its order, and the truth.

        Args:
            ponds: (P',). sets: (P', K'), for each of these ponds which of its sets.
        """
        coordinates = self.coordinates[ponds[:, None], sets].flatten(0, 1)
        inputs = [coordinates]
        if self.snapshots.numel():
            inputs.append(self.snapshots[ponds].float() / 255)
        if self.canvas.numel():
            inputs.append(self.canvas[ponds[:, None], sets].flatten(0, 1)[:, None].float() / 255)
        return inputs, self.truth[ponds].repeat_interleave(sets.shape[1], dim=0)

    def batches(self, size: int, ponds: int, generator: torch.Generator) -> Iterator[tuple[list[Tensor], Tensor]]:
        """Every set once, in an order drawn anew: batches of `size` sets from `ponds` ponds."""
        (all_ponds, all_sets), device = self.coordinates.shape[:2], self.coordinates.device
        ponds = min(ponds, all_ponds)
        each = min(max(1, size // ponds), all_sets)
        turns = torch.rand(all_ponds, all_sets, generator=generator).argsort(dim=1)
        for start in range(0, all_sets - each + 1, each):
            for chosen in torch.split(torch.randperm(all_ponds, generator=generator), ponds):
                yield self.batch(chosen.to(device), turns[chosen, start : start + each].to(device))


def read(
    folder: Path, part: Part, shape: Shape, ponds: int = 0, instances: int = 0, poses: Poses = "noisy"
) -> PaperSets:
    """A part of a data set as a network takes it.

    Args:
        ponds, instances: how many of them; 0 is all.
        poses: which poses draw the canvas; `true` is an oracle.
    """
    numbers = [number for found, number in load_spec(folder).ponds() if found == part]
    loaded = [as_tensors(load_pond(folder, part, n), shape, instances, poses) for n in numbers[: ponds or None]]
    each = min(one.coordinates.shape[1] for one in loaded)  # the last pond of a part may have fewer
    return PaperSets(
        torch.cat([one.coordinates[:, :each] for one in loaded]),
        torch.cat([one.truth for one in loaded]),
        torch.cat([one.snapshots for one in loaded]),
        torch.cat([one.canvas[:, :each] if one.canvas.numel() else one.canvas for one in loaded]),
    )


def as_tensors(sets: PondSets, shape: Shape, instances: int = 0, poses: Poses = "noisy") -> PaperSets:
    """One pond."""
    pond = layout()
    chosen = instances_of(len(sets.noisy), instances)
    snapshots = np.zeros((0,), np.uint8)
    if shape.sees_snapshots:
        snapshots = _bytes(binarised(sets.snapshots, shape.snapshot_px))[None]
    canvas = _canvases(sets, shape, chosen, poses)[None] if shape.canvas else np.zeros((0,), np.uint8)
    return PaperSets(
        torch.from_numpy(normalised(sets.noisy[chosen].astype(np.float64), pond).astype(np.float32))[None],
        torch.from_numpy(normalised(sets.truth, pond).astype(np.float32))[None],
        torch.from_numpy(snapshots),
        torch.from_numpy(canvas),
    )


def _canvases(sets: PondSets, shape: Shape, chosen: NDArray[np.int64], poses: Poses) -> NDArray[np.uint8]:
    pond = layout()
    if shape.canvas == "mask":
        drawn = (
            [sets.masks[k] for k in chosen] if poses == "noisy" else [covered(sets.truth, CAMERA, pond)] * len(chosen)
        )
        return np.stack([_bytes(smaller(mask, shape.canvas_px)) for mask in drawn])
    tiles = binarised(sets.snapshots, tile_size(CAMERA, pond, CANVAS_PX))
    laid = (stitched(tiles, sets.noisy[k].astype(np.float64) if poses == "noisy" else sets.truth, CAMERA, pond)
            for k in chosen)  # fmt: skip
    return np.stack([_bytes(smaller(canvas, shape.canvas_px)) for canvas in laid])


def _bytes(values: NDArray[np.float32]) -> NDArray[np.uint8]:
    return np.round(values * 255).astype(np.uint8)
