"""SFP10, the data set of Chen et al. (arXiv 2503.02752), made anew from its description: no public release exists.

A pond is a hexagonal pattern of rods, hollow and solid circles, the same in every pond but for what the inner circles
hold. 221 snapshots of 160 x 110 px are taken of it at random poses, and the poses are given wrong, `instances` times.
A *set* is a pond, its snapshots and one of those instances with the mask of what it covers.

Everything is a function of the spec: pond p of a part draws from generators seeded by (seed, purpose, part, p).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, get_args

import cv2
import numpy as np
from numpy.typing import NDArray

from pondwatch.core.errors import Invalid
from pondwatch.core.frames import image_to_raster_affine, pond_to_raster
from pondwatch.core.paperinputs import COUNT, Grey, covered
from pondwatch.core.values import Bool, Camera, Float, Inspection, Pond, PoseNoise, Rod

Split = Literal["shared", "disjoint"]
Part = Literal["train", "test"]
Noise = Literal["paper", "wide", "scripts"]

WIDTH_PX, HEIGHT_PX = 2245, 1587
METRES_PER_PIXEL = 0.54 / WIDTH_PX
PITCH_PX, OUTER_PX, INNER_PX = 74.0, 26.0, 17.0
LINE_PX, INNER_LINE_PX = 3.6, 2.6
MARGIN_PX = 10.0
THETA_MOST_RAD = 2.0
FILLED = 0.5  # probability; half of the filled are full
FLOOR, RING, DARK = 170, 250, 30  # grey levels
FINE = 2  # pixels of the drawing to a pixel of the pond's raster
CAMERA = Camera(160, 110, METRES_PER_PIXEL)
_PURPOSES = {"fills": 0, "poses": 1, "noise": 2}
_APART = 1_000_000  # numbers of ponds whose poses no training pond has


@dataclass(frozen=True, slots=True)
class NoiseKind:
    """Standard deviations of one draw; where cumulative, instance k is the sum of k + 1 draws, x and y in whole
    pixels towards 0."""

    sigma_xy_px: float
    sigma_theta_rad: float
    cumulative: bool = False


# The paper's text gives no size. `paper` takes that of an ordinary localisation, 0.32 of the rods' pitch; `wide`
# doubles it; `scripts` is what the released scripts draw.
NOISES: dict[str, NoiseKind] = {
    "paper": NoiseKind(0.32 * PITCH_PX, 0.10),
    "wide": NoiseKind(0.64 * PITCH_PX, 0.15),
    "scripts": NoiseKind(1.0, 0.5, cumulative=True),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Sfp10Spec:
    """What is to be made. `split`: `shared`, test pond k has the very poses of training pond k, as in the released
    scripts; `disjoint`, no pose is shared. What the rods hold is never shared."""

    train: int = 10_000
    test: int = 1_000
    seed: int = 0
    split: Split = "shared"
    noise: Noise = "paper"
    instances: int = 100  # noise instances a pond

    def check(self) -> None:
        """Raises Invalid: a value out of its range."""
        for name, words in (("split", get_args(Split)), ("noise", get_args(Noise))):
            if getattr(self, name) not in words:
                raise Invalid(f"{name} must be one of {', '.join(words)}, and is {getattr(self, name)!r}.")
        for name, least, most in (("train", 0, 10**6), ("test", 0, 10**6), ("seed", 0, 2**31), ("instances", 1, 10**4)):
            if not least <= getattr(self, name) <= most:
                raise Invalid(f"{name} must be from {least} to {most}, and is {getattr(self, name)}.")
        if not self.train + self.test:
            raise Invalid("train and test are both 0: there is nothing to make.")

    def ponds(self) -> list[tuple[Part, int]]:
        """Every pond to make: its part and its number there."""
        parts: tuple[tuple[Part, int], ...] = (("train", self.train), ("test", self.test))
        return [(part, p) for part, sets in parts for p in range(math.ceil(sets / self.instances))]

    def sets_of(self, part: Part, number: int) -> int:
        """How many sets a pond gives; the last may give fewer."""
        return min(self.instances, (self.train if part == "train" else self.test) - number * self.instances)


@dataclass(frozen=True, slots=True, eq=False)
class PondSets:
    """A pond and its sets.

    raster: (1587, 2245), grey, the pond's image. snapshots: (221, 110, 160), grey. truth: (221, 3), m, m, rad, pond
    frame. noisy: (K, 221, 3), the same. masks: (K, 256, 256), covered by the noisy poses. fills: (R,), 0 to 1.
    """

    raster: Grey
    snapshots: Grey
    truth: Float
    noisy: NDArray[np.float32]
    masks: Bool
    fills: Float


def layout() -> Pond:
    """The rods: the same in every pond, centred."""
    columns = int((WIDTH_PX - 2 * OUTER_PX) / PITCH_PX)
    rows = int((HEIGHT_PX - 2 * OUTER_PX) / (PITCH_PX * math.sqrt(3) / 2)) + 1
    left = (WIDTH_PX - (columns - 0.5) * PITCH_PX) / 2
    top = (HEIGHT_PX + (rows - 1) * PITCH_PX * math.sqrt(3) / 2) / 2
    m = METRES_PER_PIXEL
    places = (
        (left + (i + row % 2 / 2) * PITCH_PX, top - row * PITCH_PX * math.sqrt(3) / 2)
        for row in range(rows)
        for i in range(columns)
    )
    rods = (
        Rod(f"R{n:04d}", round(x * m, 7), round(y * m, 7), OUTER_PX * m, INNER_PX * m)
        for n, (x, y) in enumerate(places)
    )
    return Pond(WIDTH_PX * m, HEIGHT_PX * m, tuple(rods))


def inspection_of(noise: Noise, instance: int = 0) -> Inspection:
    """The session of one set, its claim of the noise honest."""
    kind = NOISES[noise]
    grown = math.sqrt(instance + 1) if kind.cumulative else 1.0
    claim = PoseNoise(kind.sigma_xy_px * grown * METRES_PER_PIXEL, kind.sigma_theta_rad * grown)
    return Inspection(f"SFP10, noise {noise}, instance {instance}", CAMERA, layout(), claim)


def make_pond(spec: Sfp10Spec, part: Part, number: int) -> PondSets:
    """One pond with all its sets."""
    pond = layout()
    fills, starts = _fills(_rng(spec, "fills", part, number), len(pond.rods))
    fine = draw(pond, fills, starts)
    poses_of: Part = "train" if spec.split == "shared" else part
    truth = _true_poses(_rng(spec, "poses", poses_of, number + (_APART if poses_of == "test" else 0)))
    noisy = (truth + _errors(spec, part, number)).astype(np.float32)
    raster = cv2.resize(fine, (WIDTH_PX, HEIGHT_PX), interpolation=cv2.INTER_AREA)
    snapshots = np.stack([photograph(fine, pose, pond) for pose in truth])
    masks = np.stack([covered(poses.astype(np.float64), CAMERA, pond) for poses in noisy])
    return PondSets(np.asarray(raster, np.uint8), snapshots, truth, noisy, masks, fills)


def draw(pond: Pond, fills: Float, starts_deg: Float) -> Grey:
    """(FINE x 1587, FINE x 2245): the pond drawn finely. A fill of 1 is a solid circle, anything between a wedge."""
    image = np.full((HEIGHT_PX * FINE, WIDTH_PX * FINE), FLOOR, np.uint8)
    centres = pond_to_raster(np.array([(r.x_m, r.y_m) for r in pond.rods]), pond, METRES_PER_PIXEL / FINE)
    discs = ((OUTER_PX, DARK), (OUTER_PX - LINE_PX, RING), (INNER_PX, DARK), (INNER_PX - INNER_LINE_PX, RING))
    for centre, fill, start in zip(centres, fills, starts_deg, strict=True):
        at = (round(centre[0] * 16), round(centre[1] * 16))
        for radius, grey in discs:
            cv2.circle(image, at, round(radius * FINE * 16), grey, -1, cv2.LINE_AA, 4)
        if fill > 0:
            axes = (round(INNER_PX * FINE * 16),) * 2
            cv2.ellipse(image, at, axes, 0.0, float(start), float(start + 360 * fill), DARK, -1, cv2.LINE_AA, 4)
    return image


def photograph(fine: Grey, pose_pond: Float, pond: Pond) -> Grey:
    """(110, 160): the drawing seen from a pose, each pixel the mean of FINE x FINE samples."""
    to_raster = image_to_raster_affine(pose_pond, CAMERA, pond, METRES_PER_PIXEL / FINE)
    offset = 0.5 / FINE - 0.5  # of the first fine sample, in image pixels
    fine_to_image = np.array([[1 / FINE, 0, offset], [0, 1 / FINE, offset], [0, 0, 1]])
    size = (CAMERA.width_px * FINE, CAMERA.height_px * FINE)
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    seen = cv2.warpAffine(fine, to_raster @ fine_to_image, size, flags=flags, borderValue=(FLOOR,))
    small = cv2.resize(seen, (CAMERA.width_px, CAMERA.height_px), interpolation=cv2.INTER_AREA)
    return np.asarray(small, np.uint8)


def _rng(spec: Sfp10Spec, purpose: str, part: Part, number: int) -> np.random.Generator:
    return np.random.default_rng([spec.seed, _PURPOSES[purpose], int(part == "test"), number])


def _fills(rng: np.random.Generator, rods: int) -> tuple[Float, Float]:
    """(R,) fills, and where wedges start, degrees clockwise in the raster."""
    partly = rng.choice([0.25, 0.5, 0.75], rods)
    filled = np.where(rng.random(rods) < 0.5, 1.0, partly)
    return np.where(rng.random(rods) < FILLED, filled, 0.0), np.round(rng.uniform(0, 360, rods))


def _true_poses(rng: np.random.Generator) -> Float:
    """(221, 3), m, m, rad: uniform over the pond but for a margin, turned by 0 to 2 rad."""
    least = np.array([MARGIN_PX, MARGIN_PX, 0.0])
    most = np.array([WIDTH_PX - MARGIN_PX, HEIGHT_PX - MARGIN_PX, THETA_MOST_RAD])
    return np.asarray(rng.uniform(least, most, (COUNT, 3)) * (METRES_PER_PIXEL, METRES_PER_PIXEL, 1.0))


def _errors(spec: Sfp10Spec, part: Part, number: int) -> Float:
    """(K, 221, 3), m, m, rad."""
    kind = NOISES[spec.noise]
    draws = _rng(spec, "noise", part, number).standard_normal((spec.sets_of(part, number), COUNT, 3))
    draws *= (kind.sigma_xy_px, kind.sigma_xy_px, kind.sigma_theta_rad)
    if kind.cumulative:
        draws[..., :2] = np.trunc(draws[..., :2])
        draws = np.cumsum(draws, axis=0)
    return np.asarray(draws * (METRES_PER_PIXEL, METRES_PER_PIXEL, 1.0))
