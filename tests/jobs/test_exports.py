"""Exports as other programs read them: csv, world file arithmetic, and rasterio for the GeoTIFF."""

from __future__ import annotations

import csv
import io

import cv2
import numpy as np
import pytest
import rasterio
from rasterio.io import MemoryFile

from pondwatch.core.mosaic import Mosaic
from pondwatch.core.values import Camera, CorrectedPose, Pond, Rod, RodReading, RodState, SnapshotKey, Status
from pondwatch.jobs.exports import mosaic_png, mosaic_tif, poses_csv, rods_csv, world_file

CAMERA = Camera(120, 90, metres_per_pixel=0.001)
RODS = tuple(Rod(f"R{i}", 0.0603 + 0.0457 * i, 0.0511 + 0.0231 * i, 0.012, 0.008) for i in range(5))
POND = Pond(0.3, 0.2, RODS)


def table(content):
    return list(csv.DictReader(io.StringIO(content.decode())))


def floor_with_dots():
    """A mosaic of a dark floor on which each rod is a bright disc, drawn at 16 times the raster's resolution."""
    fine = np.zeros((200 * 16, 300 * 16), np.uint8)
    for rod in RODS:
        centre = (int(rod.x_m * 16000 - 0.5), int((0.2 - rod.y_m) * 16000 - 0.5))
        cv2.circle(fine, centre, 100, 255, -1)
    floor = cv2.cvtColor(cv2.resize(fine, (300, 200), interpolation=cv2.INTER_AREA), cv2.COLOR_GRAY2BGR)
    mosaic = Mosaic(CAMERA, POND)
    for n, (x, y) in enumerate((x, y) for x in (60, 180, 240) for y in (45, 100, 155)):
        image = np.ascontiguousarray(floor[y - 45 : y + 45, x - 60 : x + 60])
        mosaic.put(SnapshotKey("bubble-1", 0, n), image, np.array([x / 1000, (200 - y) / 1000, 0.0]))
    return mosaic


def centroid(grey, near_px):
    """Weighted centre of the blob around a point, px, by hand."""
    x0, y0 = (round(v) - 15 for v in near_px)
    part = grey[y0 : y0 + 31, x0 : x0 + 31].astype(float)
    v, u = np.mgrid[:31, :31]
    return x0 + (u * part).sum() / part.sum(), y0 + (v * part).sum() / part.sum()


def test_poses_are_written_in_the_order_given_and_a_rejected_one_has_no_pose():
    good = CorrectedPose(
        SnapshotKey("bubble-2", 1, 7),
        np.array([0.1, 0.25, -1.5]),
        np.diag([4e-8, 4e-8, 1e-6]),
        Status.PLACED,
    )
    bad = CorrectedPose(SnapshotKey("bubble, 1", 0, 3), None, None, Status.REJECTED)

    first, second = table(poses_csv([good, bad]))

    assert list(first) == [
        "sequence",
        "robot",
        "boot",
        "x_m",
        "y_m",
        "theta_rad",
        "sigma_xy_m",
        "sigma_theta_rad",
        "status",
    ]
    assert first["sequence"], first["boot"] == ("7", "1")
    assert [float(first[k]) for k in ("x_m", "y_m", "theta_rad")] == [0.1, 0.25, -1.5]
    assert [float(first[k]) for k in ("sigma_xy_m", "sigma_theta_rad")] == [0.0002, 0.001]
    assert second["robot"] == "bubble, 1"
    assert [second[k] for k in ("x_m", "y_m", "theta_rad", "sigma_xy_m", "status")] == ["", "", "", "", "rejected"]


def test_rods_are_written_in_the_order_given_and_an_unseen_one_has_no_fill():
    readings = [
        RodReading("R2", RodState.PARTIAL, 0.25, 0.99, 4),
        RodReading("R1", RodState.UNSEEN, None, 0.0, 0),
    ]

    assert rods_csv(readings).decode().splitlines() == [
        "rod_id,state,fill,confidence,views",
        "R2,partial,0.2500,0.9900,4",
        "R1,unseen,,0.0000,0",
    ]


def test_a_png_keeps_every_pixel_and_its_alpha():
    bgra = floor_with_dots().bgra()

    read = cv2.imdecode(np.frombuffer(mosaic_png(bgra), np.uint8), cv2.IMREAD_UNCHANGED)

    np.testing.assert_array_equal(read, bgra)


def test_the_world_file_places_the_first_pixels_centre_half_a_pixel_into_the_pond():
    lines = [float(line) for line in world_file(0.002, 0.37).decode().splitlines()]

    assert lines == pytest.approx([0.002, 0.0, 0.0, -0.002, 0.001, 0.369])


def test_rods_lie_in_the_geotiff_where_the_layout_says_within_a_fifth_of_a_pixel():
    with MemoryFile(mosaic_tif(floor_with_dots().bgra(), 0.001, 0.2)) as memory, memory.open() as tif:
        green = tif.read(2)
        for rod in RODS:
            row, column = tif.index(rod.x_m, rod.y_m)
            u, v = centroid(green, (column, row))
            x, y = tif.xy(v, u)  # of a pixel's centre

            assert np.hypot(x - rod.x_m, y - rod.y_m) < 0.2 * 0.001


def test_the_geotiff_is_in_metres_of_a_local_frame_with_alpha_tiled_and_deflated():
    bgra = floor_with_dots().bgra()
    bgra[:50, :, :] = 0

    with MemoryFile(mosaic_tif(bgra, 0.001, 0.2)) as memory, memory.open() as tif:
        assert tif.crs.to_wkt().startswith('LOCAL_CS["Pond frame')
        assert 'UNIT["metre",1,' in tif.crs.to_wkt()
        assert not tif.crs.is_geographic
        assert not tif.crs.is_projected
        assert tuple(tif.bounds) == pytest.approx((0.0, 0.0, 0.3, 0.2))
        assert [c.name for c in tif.colorinterp] == ["red", "green", "blue", "alpha"]
        assert tif.profile["tiled"]
        assert tif.compression == rasterio.enums.Compression.deflate
        np.testing.assert_array_equal(np.moveaxis(tif.read(), 0, -1), bgra[..., [2, 1, 0, 3]])
