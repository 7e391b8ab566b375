"""What an SFP10 data set says of itself, and pictures of it."""

from __future__ import annotations

from collections.abc import Mapping

import cv2
import numpy as np

from pondwatch.core.paperinputs import COUNT, Grey, binarised, stitched, tile_size

from . import sfp10

_SIDE_PX = 512
_GAP_PX = 8

CARD = """\
# SFP10, made anew

{train} training sets and {test} test sets for correcting the poses of snapshots of a spent-fuel pond's floor, after the
description in Chen et al., *Deep Learning-Enhanced Visual Monitoring in Hazardous Underwater Environments with a Swarm
of Micro-Robots* (arXiv 2503.02752). No data of theirs is in it. Made by

    pondwatch dataset sfp10 --train {train} --test {test} --seed {seed} --split {split} --noise {noise} \\
        --instances {instances}

and the same command makes the same arrays.

## A set
A pond's image ({width} x {height} px), its {count} snapshots of {cw} x {ch} px, their noisy poses, and the mask of
what the noisy poses cover. A pond gives {instances} sets, which differ in the noise alone: `pond-NNNN.npz` holds

| array | shape | what |
| --- | --- | --- |
| `snapshots` | ({count}, {ch}, {cw}), 8 bits | grey; lines and fills are darker than 128 |
| `truth` | ({count}, 3) | x m, y m, theta rad: where each snapshot's centre lies, pond frame (x right, y up) |
| `noisy` | (sets, {count}, 3) | the same with noise |
| `masks` | (sets, 8192), packed bits | 256 x 256, right and down from the pond's upper left corner |
| `fills` | (rods,) | what each inner circle holds, 0 to 1 |

and `pond-NNNN.png` the pond's image, {mpp:.10f} m a pixel.

## How it is made
Rods stand in a hexagonal pattern, pitch {pitch:g} px, inner radius {inner:g} px, the same in every pond; each inner
circle is filled with probability 0.5, half of these wholly, the others by 1/4, 1/2 or 3/4. Poses are uniform over
the pond but for a margin of {margin:g} px, turned by 0 to {turn:g} rad. Noise `{noise}`: {told}.
Split `{split}`: {split_told}. What the rods hold is never shared.

## Do not use it
to say how well a method does on real ponds: no water, no lens, no lighting, no drift along a path. With the split
`shared` a method that recognises the pond by its poses knows the answer.
"""
_SPLITS = {
    "shared": "test pond k has the very poses of training pond k, as in the released scripts",
    "disjoint": "no pose of a test pond is one of a training pond",
}


def card(spec: sfp10.Sfp10Spec) -> str:
    """README.md of a data set."""
    return CARD.format(
        **{name: getattr(spec, name) for name in ("train", "test", "seed", "split", "noise", "instances")},
        width=sfp10.WIDTH_PX,
        height=sfp10.HEIGHT_PX,
        count=COUNT,
        cw=sfp10.CAMERA.width_px,
        ch=sfp10.CAMERA.height_px,
        mpp=sfp10.METRES_PER_PIXEL,
        pitch=sfp10.PITCH_PX,
        inner=sfp10.INNER_PX,
        margin=sfp10.MARGIN_PX,
        turn=sfp10.THETA_MOST_RAD,
        told=noise_told(spec.noise),
        split_told=_SPLITS[spec.split],
    )


def noise_told(noise: sfp10.Noise) -> str:
    """One noise in words."""
    kind = sfp10.NOISES[noise]
    if kind.cumulative:
        return (
            f"a pond's k-th set carries the sum of k draws, N(0, {kind.sigma_xy_px:g} px) cut to whole pixels on x and "
            f"y, N(0, {kind.sigma_theta_rad:g} rad) on theta, as in the released scripts"
        )
    return f"independent, N(0, {kind.sigma_xy_px:.3g} px) on x and y, N(0, {kind.sigma_theta_rad:g} rad) on theta"


def previews(ponds: Mapping[str, sfp10.PondSets]) -> dict[str, bytes]:
    """PNG pictures of ponds, by the names that these are given under. A row each for the first and the last set: the
    pond's image, the snapshots stitched by noisy and by true poses, the mask."""
    out = {}
    for name, sets in ponds.items():
        rows = [_row(sets, instance) for instance in sorted({0, len(sets.noisy) - 1})]
        out[f"{name}.png"] = cv2.imencode(".png", np.vstack(rows))[1].tobytes()
    return out


def _row(sets: sfp10.PondSets, instance: int) -> Grey:
    pond = sfp10.layout()
    tiles = binarised(sets.snapshots, tile_size(sfp10.CAMERA, pond, _SIDE_PX))
    poses = (sets.noisy[instance].astype(np.float64), sets.truth)
    laid = [stitched(tiles, p, sfp10.CAMERA, pond, _SIDE_PX) * 255 for p in poses]
    whole = cv2.resize(sets.raster, (_SIDE_PX, _SIDE_PX), interpolation=cv2.INTER_AREA)
    mask = cv2.resize(sets.masks[instance].astype(np.uint8) * 255, (_SIDE_PX, _SIDE_PX))
    height = round(_SIDE_PX * sfp10.HEIGHT_PX / sfp10.WIDTH_PX)
    panels = [cv2.resize(np.asarray(p, np.uint8), (_SIDE_PX, height)) for p in (whole, *laid, mask)]
    edge = ((0, _GAP_PX), (0, _GAP_PX))
    return np.hstack([np.pad(p, edge, constant_values=128) for p in panels])
