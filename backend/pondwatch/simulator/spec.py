"""What to simulate. Every value is a plain number or word, so that a spec can be written down beside its results."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal, get_args

from pondwatch.core.errors import Invalid
from pondwatch.core.values import Camera

Lattice = Literal["hexagonal", "square"]
Fills = Literal["quarters", "wedges", "empty", "full", "striped"]
Path = Literal["uniform", "smooth", "sweep"]
Noise = Literal["independent", "drift"]
WaterKind = Literal["clear", "murky"]
ImageKind = Literal["png", "jpeg", "webp"]

WORDS = {
    "lattice": get_args(Lattice),
    "fills": get_args(Fills),
    "path": get_args(Path),
    "noise": get_args(Noise),
    "water": get_args(WaterKind),
    "image_kind": get_args(ImageKind),
}
SMALL_CAMERA = Camera(160, 110, 0.0005625)


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulationSpec:
    """One inspection. Lengths in image pixels unless named otherwise.

    The pond's size follows from `snapshots` and `coverage` (the mean number of looks at a point of the floor).
    `noise_pitch` is one standard deviation of x and of y, in lattice pitches. `claim` scales what the localisation
    says of its noise: 1 is honest, 0 says nothing. `mapped=False`: a textured floor without rods or layout.
    """

    name: str = "Simulated pond"
    snapshots: int = 221
    robots: int = 7
    coverage: float = 6.14
    camera: Camera = SMALL_CAMERA
    capture_interval_s: float = 0.14
    start_s: float = 1767254400.0  # 2026-01-01T08:00:00Z

    mapped: bool = True
    lattice: Lattice = "hexagonal"
    pitch_px: float = 60.0
    lattice_angle_rad: float = 0.0
    missing: float = 0.03  # share of lattice sites without a rod, known to the layout
    outer_radius_pitch: float = 0.36  # of a rod
    inner_radius_pitch: float = 0.23
    layout_radius: float = 1.0  # what the layout says of a rod's radii, in what they are
    stated_scale: float = 1.0  # what is said of the metres in a pixel, in what they are
    edge_cells: bool = True  # whether sites without a rod still have their cell's walls
    fills: Fills = "quarters"
    pond_seed: int = -1  # of the pond and its fills; -1: the simulation's own, as of all else
    changed: int = 0  # rods whose fill is other than the seed gives: a later inspection of the same pond
    objects: int = 0  # things that lie on the floor and that no layout knows
    object_px: float = 6.0  # their diameter
    stains: int = 0
    stain_px: float = 40.0
    displaced: int = 0  # rods that stand off their place in the layout
    displaced_px: float = 2.0

    path: Path = "uniform"
    theta_range_rad: float = 1.0
    margin_px: float = 0.0  # between the pond's wall and the centres of snapshots

    noise: Noise = "independent"
    noise_pitch: float = 0.32
    noise_theta_rad: float = 0.1
    outliers: float = 0.0  # share of poses that are anywhere in the pond
    heading_known: bool = True
    claim: float = 1.0

    water: WaterKind = "clear"
    print_colours: bool = False  # the colours of a printed mock-up instead of random ones
    grey: bool = False  # whether the camera sees no colours
    image_kind: ImageKind = "jpeg"
    quality: int = 92

    @property
    def pond_size_m(self) -> tuple[float, float]:
        """(width, height), m, sixteen to eleven."""
        camera = self.camera
        area_px = self.snapshots * camera.width_px * camera.height_px / self.coverage
        width_px = math.sqrt(area_px * 16 / 11)
        return width_px * camera.metres_per_pixel, width_px * 11 / 16 * camera.metres_per_pixel

    @property
    def stated_camera(self) -> Camera:
        """The camera as the base station describes it."""
        return replace(self.camera, metres_per_pixel=self.camera.metres_per_pixel * self.stated_scale)

    @property
    def margin_m(self) -> float:
        """Between the wall and the centres of snapshots, m."""
        return self.margin_px * self.camera.metres_per_pixel

    @property
    def pitch_m(self) -> float:
        """The lattice's pitch, m."""
        return self.pitch_px * self.camera.metres_per_pixel

    def check(self) -> None:
        """Raises Invalid: a value out of its range, by name."""
        for name, words in WORDS.items():
            if getattr(self, name) not in words:
                raise Invalid(f"{name} must be one of {', '.join(words)}, and is {getattr(self, name)!r}.", field=name)
        ranges = {
            "snapshots": (1, 100_000), "robots": (1, 1000), "coverage": (0.01, 1000), "pitch_px": (12, 2000),
            "outer_radius_pitch": (0.05, 0.5),
            "inner_radius_pitch": (0.01, 0.99 * self.outer_radius_pitch), "layout_radius": (0.5, 2),
            "stated_scale": (0.5, 2), "missing": (0, 1), "outliers": (0, 1),
            "noise_pitch": (0, 100), "noise_theta_rad": (0, math.pi), "claim": (0, 100),
            "quality": (1, 100), "capture_interval_s": (0, 3600), "theta_range_rad": (0, math.pi),
            "margin_px": (0, 0.45 * min(self.pond_size_m) / self.camera.metres_per_pixel),
            "pond_seed": (-1, 2**63 - 1), "changed": (0, 100_000),
            "objects": (0, 10_000), "object_px": (0.5, 500), "stains": (0, 10_000), "stain_px": (0.5, 2000),
            "displaced": (0, 100_000), "displaced_px": (0, 500),
        }  # fmt: skip
        for name, (low, high) in ranges.items():
            value = getattr(self, name)
            if not low <= value <= high:
                raise Invalid(f"{name} must be from {low} to {high:g}, and is {value}.", field=name)
