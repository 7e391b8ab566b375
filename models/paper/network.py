"""The four networks of Chen et al. (arXiv 2503.02752), as the paper's text has them, and one that predicts corrections.

Inputs of a batch of B sets from P ponds, B a multiple of P, sets of one pond side by side:
    coordinates  (B, 221, 3)        noisy x by width, y by height, theta rad
    snapshots    (P, 221, h, w)     binarised grey, once a pond: its sets share them
    canvas       (B, 1, s, s)       the mask of what the noisy poses cover; for net (c) the noisy stitched image
Output: (B, 221, 3), x, y and theta of all snapshots.

The paper gives no widths. `width` 1 keeps an exported network under 2 MB; the full recipe takes 4.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from itertools import pairwise
from typing import Literal

import torch
from torch import Tensor, nn

from pondwatch.core.paperinputs import COUNT

Variant = Literal["a", "b", "c", "ours", "corrections"]
VARIANTS: tuple[Variant, ...] = ("a", "b", "c", "ours", "corrections")
THETA_WEIGHT = 0.05
_COORDINATES = (256, 192, 128, 128)  # four fully connected layers
_FUSION = (192, 160)  # and the third gives the output
_CANVAS = (8, 16, 32)  # channels of the three blocks


@dataclass(frozen=True, slots=True)
class Shape:
    """What a network is made of: enough to make it again from a checkpoint."""

    variant: Variant
    width: int = 1
    snapshot_px: tuple[int, int] = (160, 110)  # width, height
    canvas_px: int = 256

    @property
    def sees_snapshots(self) -> bool:
        """Whether the snapshot encoder is there."""
        return self.variant != "a"

    @property
    def canvas(self) -> Literal["mask", "stitched"] | None:
        """What the second encoder looks at."""
        if self.variant in ("a", "b"):
            return None
        return "stitched" if self.variant == "c" else "mask"

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the inputs, in order."""
        return ("coordinates", *(["snapshots"] if self.sees_snapshots else []), *(["canvas"] if self.canvas else []))

    def facts(self) -> dict[str, object]:
        """As JSON values."""
        return asdict(self)


def connected(*sizes: int) -> nn.Sequential:
    """Fully connected layers, a ReLU after each."""
    layers: list[nn.Module] = []
    for before, after in pairwise(sizes):
        layers += [nn.Linear(before, after), nn.ReLU()]
    return nn.Sequential(*layers)


class SnapshotEncoder(nn.Module):
    """Depth-wise convolution over the 221 snapshots and ReLU, downsampling, global average pooling: a number each."""

    def __init__(self) -> None:
        super().__init__()
        self.convolution = nn.Conv2d(COUNT, COUNT, 3, padding=1, groups=COUNT)
        self.downsample = nn.MaxPool2d(2)

    def forward(self, snapshots: Tensor) -> Tensor:
        """(P, 221, h, w) to (P, 221)."""
        out: Tensor = self.downsample(torch.relu(self.convolution(snapshots)))
        return out.mean(dim=(2, 3))


class CanvasEncoder(nn.Module):
    """Three blocks of convolution and ReLU, the second and third downsampling; global average pooling."""

    def __init__(self, width: int) -> None:
        super().__init__()
        first, second, third = (width * n for n in _CANVAS)
        self.blocks = nn.Sequential(
            nn.Conv2d(1, first, 3, padding=1),
            nn.ReLU(),
            nn.Conv2d(first, second, 3, padding=1, stride=2),
            nn.ReLU(),
            nn.Conv2d(second, third, 3, padding=1, stride=2),
            nn.ReLU(),
        )

    def forward(self, canvas: Tensor) -> Tensor:
        """(B, 1, s, s) to (B, channels)."""
        out: Tensor = self.blocks(canvas)
        return out.mean(dim=(2, 3))


class PaperNetwork(nn.Module):
    """Nets (a), (b), (c), the paper's own, and `corrections`: the paper's own with its output added to its input.

    `corrections` trusts its input by a learned factor for each of x, y and theta, 1 at first: where the noise of an
    input is larger than what there is to know, as theta's in the released scripts, it can learn to pass it over.
    """

    def __init__(self, shape: Shape) -> None:
        super().__init__()
        self.shape = shape
        widths = [shape.width * n for n in _COORDINATES]
        self.coordinates = connected(3 * COUNT, *widths)
        self.snapshots = SnapshotEncoder() if shape.sees_snapshots else None
        self.canvas = CanvasEncoder(shape.width) if shape.canvas else None
        fused = widths[-1] + COUNT * shape.sees_snapshots + shape.width * _CANVAS[-1] * bool(shape.canvas)
        fusion = [shape.width * n for n in _FUSION]
        self.fusion = nn.Sequential(connected(fused, *fusion), nn.Linear(fusion[-1], 3 * COUNT))
        self.apply(_he)
        self.gain = nn.Parameter(torch.ones(3)) if shape.variant == "corrections" else None
        if self.gain is not None:  # begins as the identity
            for parameter in self.fusion[-1].parameters():
                nn.init.zeros_(parameter)

    def forward(self, coordinates: Tensor, snapshots: Tensor | None = None, canvas: Tensor | None = None) -> Tensor:
        """(B, 221, 3), as the module says; the inputs that `shape.inputs` does not name are not looked at."""
        sets = coordinates.shape[0]
        features = [self.coordinates(coordinates.flatten(1))]
        if self.snapshots is not None and snapshots is not None:
            seen = self.snapshots(snapshots)
            features.append(seen if torch.onnx.is_in_onnx_export() else _shared(seen, sets))
        if self.canvas is not None and canvas is not None:
            features.append(self.canvas(canvas))
        out: Tensor = self.fusion(torch.cat(features, dim=1)).view(-1, COUNT, 3)
        return out if self.gain is None else self.gain * coordinates + out


def _he(module: nn.Module) -> None:
    """He's initial weights for fully connected layers: the paper names none, and these start some 500 steps ahead."""
    if isinstance(module, nn.Linear):
        nn.init.kaiming_normal_(module.weight, nonlinearity="relu")
        nn.init.zeros_(module.bias)


def _shared(features: Tensor, sets: int) -> Tensor:
    """A pond's features for each of its sets, side by side."""
    return features.repeat_interleave(sets // features.shape[0], dim=0)


def loss(predicted: Tensor, truth: Tensor) -> Tensor:
    """L_xy + 0.05 L_theta, each a mean squared error. Theta's error is not wrapped, as in the paper: the truth lies in
    0 to 2 rad."""
    error = (predicted - truth) ** 2
    return error[..., :2].mean() + THETA_WEIGHT * error[..., 2].mean()
