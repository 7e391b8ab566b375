"""A small convolutional network that finds rods, and its loss. Input and answer are those of `core.rodsight`."""

from __future__ import annotations

import math

import torch
from torch import Tensor, nn
from torch.nn import functional

from pondwatch.core.rodsight import CHANNELS

RARE = 0.02  # the share of cells with a rod's centre, roughly; where the heat starts


class Block(nn.Module):
    """Two convolutions beside a straight way."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.inner = nn.Sequential(
            nn.Conv2d(width, width, 3, padding=1, bias=False), nn.BatchNorm2d(width), nn.ReLU(),
            nn.Conv2d(width, width, 3, padding=1, bias=False), nn.BatchNorm2d(width),
        )  # fmt: skip

    def forward(self, x: Tensor) -> Tensor:
        """(N, width, h, w) to the same."""
        return functional.relu(x + self.inner(x))


class RodNetwork(nn.Module):
    """(N, 4, H, W), H and W multiples of 4, to (N, 8, H / 4, W / 4); a rod's surroundings lie in its field of view."""

    def __init__(self, width: int = 40, blocks: int = 4) -> None:
        super().__init__()
        stem = width // 2
        self.body = nn.Sequential(
            nn.Conv2d(4, stem, 5, stride=2, padding=2, bias=False), nn.BatchNorm2d(stem), nn.ReLU(),
            nn.Conv2d(stem, width, 3, stride=2, padding=1, bias=False), nn.BatchNorm2d(width), nn.ReLU(),
            *(Block(width) for _ in range(blocks)),
        )  # fmt: skip
        self.head = nn.Conv2d(width, len(CHANNELS), 1)
        at_first = torch.zeros(len(CHANNELS))
        at_first[0] = math.log(RARE / (1 - RARE))
        self.head.bias = nn.Parameter(at_first)

    def forward(self, planes: Tensor) -> Tensor:
        """See the class."""
        answer: Tensor = self.head(self.body(planes))
        return answer


def parts(answer: Tensor, target: Tensor, known: Tensor, rod: Tensor) -> dict[str, Tensor]:
    """The loss by its parts.

    Args:
        target: (N, 8, h, w): heat 0 to 1, offsets, nothing, then log_size, fill and wedge. known: (N, h, w), where
            the heat is to be learned. rod: (N, h, w), cells that the rest is learned from.
    """
    odds, near = answer[:, 0], target[:, 0]
    p = torch.sigmoid(odds)
    hit = near > 0.95
    focal = torch.where(
        hit, (1 - p) ** 2 * functional.softplus(-odds), (1 - near) ** 4 * p**2 * functional.softplus(odds)
    )
    count = rod.sum().clamp(min=1)
    heat = (focal * known).sum() / (hit & known).sum().clamp(min=1)
    spread = answer[:, 3].clamp(-6, 6)
    off = ((answer[:, 1:3] - target[:, 1:3]) ** 2).sum(dim=1)
    centre = ((off * torch.exp(-spread) / 2 + spread) * rod).sum() / count
    rest = (functional.smooth_l1_loss(answer[:, 4:], target[:, 4:], reduction="none", beta=0.1) * rod[:, None]).sum()
    return {"heat": heat, "centre": centre, "rest": rest / count}


def loss(answer: Tensor, target: Tensor, known: Tensor, rod: Tensor) -> Tensor:
    """What is made small."""
    p = parts(answer, target, known, rod)
    return p["heat"] + 0.25 * p["centre"] + 0.5 * p["rest"]
