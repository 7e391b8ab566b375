"""What the floor shows that the layout does not: drawn floors, seen by looks whose places are known."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import TypeVar

import cv2
import numpy as np
import pytest

from pondwatch.core.cells import cut, sites_of
from pondwatch.core.consensus import Look, _median, consensus
from pondwatch.core.findings import NOTHING, Condition, Kind, find
from pondwatch.core.frames import image_to_raster_affine, pond_to_image
from pondwatch.core.layouts import lattice
from pondwatch.core.values import Camera, Float, Image, Pond, RodReading, RodState

T = TypeVar("T")
R = TypeVar("R")

SCALE = 0.001
CAMERA, WIDE = Camera(120, 90, SCALE), Camera(200, 150, SCALE)
POND = lattice("square", 0.05, columns=8, rows=6, outer_m=0.018, inner_m=0.012)
READ = tuple(
    RodReading(rod.id, RodState.FULL if n % 2 else RodState.EMPTY, float(n % 2), 0.999, 5)
    for n, rod in enumerate(POND.rods)
)


def drawn(moved: dict[int, tuple[float, float]] | None = None) -> Image:
    """The floor at four times the raster: rings on a plain with walls between them. moved: rods, px right and down."""
    size = (round(POND.width_m / SCALE) * 4, round(POND.height_m / SCALE) * 4)
    out = np.full((size[1], size[0], 3), (120, 130, 100), np.uint8)
    for n, (rod, reading) in enumerate(zip(POND.rods, READ, strict=True)):
        u, v = np.array([rod.x_m, POND.height_m - rod.y_m]) / SCALE + (moved or {}).get(n, (0.0, 0.0))
        at = round(u * 4 * 16 - 8), round(v * 4 * 16 - 8)
        for radius, colour in ((18, (60, 60, 70)), (15, (170, 180, 190)), (12, (60, 60, 70))):
            cv2.circle(out, at, radius * 4 * 16, colour, -1, cv2.LINE_AA, 4)
        inside = (40, 30, 30) if reading.state is RodState.FULL else (200, 200, 190)
        cv2.circle(out, at, 10 * 4 * 16, inside, -1, cv2.LINE_AA, 4)
    return out


@lru_cache(maxsize=1)
def poses() -> tuple[tuple[float, float, float], ...]:
    """Looks on a grid that overlaps three times each way, each turned a little."""
    rng = np.random.default_rng(4)
    across = np.linspace(0.04, POND.width_m - 0.04, 11)
    up = np.linspace(0.03, POND.height_m - 0.03, 9)
    return tuple((float(x), float(y), float(rng.normal(0, 0.2))) for x in across for y in up)


def looks(floor: Image, camera: Camera = CAMERA) -> list[Look]:
    """The floor through a camera with some noise."""
    rng = np.random.default_rng(5)
    soft = cv2.GaussianBlur(floor, (0, 0), 2.0)
    out = []
    for pose in poses():
        to = image_to_raster_affine(np.array(pose), camera, POND, SCALE / 4)
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        image = cv2.warpAffine(
            soft, to, (camera.width_px, camera.height_px), flags=flags, borderMode=cv2.BORDER_REPLICATE
        )
        noisy = image + rng.normal(0, 2, image.shape)
        out.append(Look(np.clip(noisy, 0, 255).round().astype(np.uint8), np.array(pose)))
    return out


def seen(shots: list[Look], camera: Camera = CAMERA) -> Condition:
    return find(shots, camera, POND, READ)


def put(floor: Image, x_m: float, y_m: float, diameter_px: float, colour: tuple[int, int, int]) -> Image:
    """A disc on the floor."""
    at = round(x_m / SCALE * 4), round((POND.height_m - y_m) / SCALE * 4)
    return cv2.circle(floor.copy(), at, round(diameter_px * 2), colour, -1, cv2.LINE_AA)


def test_on_a_pond_as_it_should_be_nothing_is_found_and_every_rod_stands_at_its_place() -> None:
    condition = seen(looks(drawn()))

    assert condition.findings == ()
    assert condition.offsets is not None
    assert np.isfinite(condition.offsets.offset_m).all()
    assert np.abs(condition.offsets.offset_m).max() < 0.1 * SCALE
    assert condition.examined > 0.6


def test_an_object_is_found_at_its_place_with_its_size() -> None:
    condition = seen(looks(put(drawn(), 0.176, 0.124, 7, (30, 60, 220))))

    (found,) = condition.findings
    assert found.kind is Kind.FOREIGN_OBJECT
    assert (found.x_m, found.y_m) == pytest.approx((0.176, 0.124), abs=0.7 * SCALE)
    assert found.size_m == pytest.approx(0.007, rel=0.25)
    assert found.agreeing == found.looks >= 3
    assert found.confidence == pytest.approx((found.looks + 1) / (found.looks + 2))


def test_what_darkens_the_floor_and_lets_it_show_through_is_a_stain() -> None:
    floor = drawn()
    v, u = np.mgrid[: floor.shape[0], : floor.shape[1]] / 4.0
    off = np.hypot(u - 200, v - 150)
    dark = 1 - 0.5 * np.clip((26 - off) / 12, 0, 1)

    condition = seen(looks((floor * dark[..., None]).astype(np.uint8)))

    assert [f.kind for f in condition.findings] == [Kind.STAIN]
    assert (condition.findings[0].x_m, condition.findings[0].y_m) == pytest.approx((0.2, 0.2), abs=0.003)


def test_what_moves_with_a_snapshot_is_not_on_the_floor() -> None:
    """A fleck on the lens, at the same pixel of every look; and a particle in one of them."""
    flecked = looks(drawn())
    for look in flecked:
        look.image[40:46, 60:66] = 255
    flecked[40].image[20:30, 20:30] = 255

    assert seen(flecked).findings == ()


def test_a_rod_off_its_place_is_told_with_offset_and_sigma_and_its_neighbours_are_not() -> None:
    condition = seen(looks(drawn({20: (1.5, -0.8)})))

    (found,) = condition.findings
    assert (found.kind, found.rod_id) == (Kind.ROD_DISPLACED, POND.rods[20].id)
    assert found.offset_m == pytest.approx((0.0015, 0.0008), abs=0.0001)  # up is down in the picture
    assert found.sigma_m is not None
    assert np.hypot(*np.subtract(found.offset_m, (0.0015, 0.0008))) < 3 * found.sigma_m


def test_a_stain_that_darkens_one_side_of_a_ring_does_not_move_the_rod() -> None:
    floor = drawn()
    u = POND.rods[20].x_m / SCALE - 12
    v = (POND.height_m - POND.rods[20].y_m) / SCALE
    down, right = np.mgrid[: floor.shape[0], : floor.shape[1]] / 4.0
    dark = 1 - 0.45 * np.clip((22 - np.hypot(right - u, down - v)) / 14, 0, 1)

    condition = seen(looks((floor * dark[..., None]).astype(np.uint8)))

    assert [f for f in condition.findings if f.kind is Kind.ROD_DISPLACED] == []


def test_an_outermost_cell_ends_before_the_wall_that_it_shares_with_nobody() -> None:
    """The pitch is 50 px: towards a neighbour a cell has 25, and towards none 4 less."""
    sites = sites_of(POND, READ)
    corner = int(np.argmin(sites.place[:, 0] - sites.place[:, 1]))  # the upper left rod
    whole = consensus(looks(drawn()), CAMERA, POND, SCALE)

    cells = cut(whole, POND, sites, np.array([corner]))

    rows, columns = np.nonzero(cells.seen[0])
    down, right = rows - cells.reach, columns - cells.reach
    assert (right.min(), down.min()) == (-21, -21)
    assert min(right.max(), down.max()) >= 24


def test_where_no_ring_is_to_be_seen_no_offset_is_told() -> None:
    floor = drawn()
    at = round(POND.rods[20].x_m / SCALE * 4), round((POND.height_m - POND.rods[20].y_m) / SCALE * 4)
    cv2.rectangle(floor, (at[0] - 88, at[1] - 88), (at[0] + 88, at[1] + 88), (120, 130, 100), -1)
    floor[at[1] - 60 : at[1] + 60 : 16, at[0] - 60 : at[0] + 60] = (40, 160, 60)

    condition = seen(looks(floor))

    assert condition.offsets is not None
    assert np.isnan(condition.offsets.offset_m[20]).all()
    assert [f for f in condition.findings if f.rod_id == POND.rods[20].id and f.kind is Kind.ROD_DISPLACED] == []


def test_a_pond_that_is_off_as_a_whole_has_no_rod_that_is() -> None:
    condition = seen(looks(drawn(dict.fromkeys(range(len(POND.rods)), (1.0, 1.0)))))

    assert [f for f in condition.findings if f.kind is Kind.ROD_DISPLACED] == []


def test_offsets_that_poses_took_a_part_of_are_made_whole() -> None:
    """Each look is moved as the best motion of its ten rods moves, of which one stands off by 3 px."""
    off = np.zeros((len(POND.rods), 2))
    off[20] = (0.003, 0.0)
    taken = looks(drawn({20: (3.0, 0.0)}), WIDE)[::2]
    shots = [Look(look.image, drawn_along(look.pose_pond, off)) for look in taken]

    condition = seen(shots, WIDE)

    assert condition.offsets is not None
    told = condition.offsets.offset_m
    assert told[20] == pytest.approx((0.003, 0.0), abs=0.00015)
    assert np.abs(np.delete(told, 20, axis=0)).max() < 0.00015


def drawn_along(pose: Float, off: Float) -> Float:
    """The pose that fits rods that are off, by least squares, where the layout puts them elsewhere."""
    places = np.array([(r.x_m, r.y_m) for r in POND.rods])
    at = pond_to_image(places, pose, WIDE)
    mine = ((at > 0) & (at < (199, 149))).all(axis=1)
    if not mine.any():
        return pose
    centre = places[mine].mean(axis=0)
    arm = places[mine] - centre
    turn = float((arm[:, 0] * off[mine, 1] - arm[:, 1] * off[mine, 0]).sum() / max((arm**2).sum(), 1e-12))
    x, y = pose[:2] - centre
    moved = centre - off[mine].mean(axis=0) + (x + turn * y, y - turn * x)
    return np.append(moved, pose[2] - turn)


def test_work_that_is_done_in_parts_elsewhere_in_another_order_finds_the_same() -> None:
    done: list[int] = []

    def elsewhere(
        work: Callable[[T], R], things: Sequence[T], shared: Sequence[object], large: bool = False
    ) -> list[R]:
        done.append(len(things))
        return [pickle.loads(pickle.dumps(work(thing))) for thing in reversed(things)][::-1]

    shots = looks(put(drawn(), 0.176, 0.124, 7, (30, 60, 220)))
    here, there = seen(shots), find(shots, CAMERA, POND, READ, elsewhere)

    assert there.findings == here.findings != ()
    assert max(done) > 1


def test_the_order_of_looks_changes_nothing() -> None:
    """Where no more show a place than are held, which is every place here."""
    shots = looks(put(drawn(), 0.176, 0.124, 7, (30, 60, 220)))[::2]

    assert seen(shots).findings == seen(shots[::-1]).findings


@pytest.mark.parametrize(
    "pond", [Pond(0.2, 0.2), lattice("square", 0.05, columns=2, rows=1, outer_m=0.018, inner_m=0.012)]
)
def test_where_there_is_too_little_to_learn_from_nothing_is_claimed(pond: Pond) -> None:
    image = np.random.default_rng(1).integers(0, 255, (90, 120, 3)).astype(np.uint8)
    shots = [Look(image, np.array([0.05, 0.05, 0.0])) for _ in range(4)]

    condition = find(shots, CAMERA, pond, [RodReading(r.id, RodState.UNSEEN, None, 0.0, 0) for r in pond.rods])

    assert condition.findings == ()
    assert find([], CAMERA, POND, READ) is NOTHING


def test_the_consensus_is_the_median_of_the_looks() -> None:
    rng = np.random.default_rng(2)
    for count in (3, 5, 11):
        stack = rng.integers(0, 256, (count, 4, 7, 4)).astype(np.uint8)
        np.testing.assert_array_equal(_median(stack.copy()), np.median(stack, axis=0))


def test_a_pixel_that_few_looks_show_is_the_median_of_those() -> None:
    pond, camera = Pond(0.012, 0.009), Camera(12, 9, 0.001)
    grey = [np.full((9, 12, 3), v, np.uint8) for v in (100, 100, 104, 240, 100)]

    found = consensus([Look(g, np.array([0.006, 0.0045, 0.0])) for g in grey], camera, pond, 0.001)

    assert found.count[4, 6] == 5
    assert found.count[0, 0] == 0  # the rim of every snapshot is left out
    assert abs(int(found.image[4, 6, 0]) - 128) < 25  # brought to the light of their mean, 128.8


def test_floor_that_is_too_bright_for_the_camera_in_some_looks_is_not_a_finding() -> None:
    """Light grows from left to right, and every other look is a fifth brighter: on the right they are burnt."""
    floor = drawn()
    light = np.linspace(1.0, 1.75, floor.shape[1])[None, :, None]
    shots = looks(np.clip(floor * light, 0, 255).astype(np.uint8))
    burnt = [
        Look(np.clip(shot.image * (1.2 if n % 2 else 1.0), 0, 255).astype(np.uint8), shot.pose_pond)
        for n, shot in enumerate(shots)
    ]

    condition = seen(burnt)

    assert condition.findings == ()
    assert 0.1 < condition.examined < seen(looks(drawn())).examined
