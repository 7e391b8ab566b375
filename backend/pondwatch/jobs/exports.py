"""What a session is handed out as: CSV tables, PNG with a world file, GeoTIFF. Values in, bytes out.

Columns, units and their order are those of the result of a correction; the mosaic's frame is the pond's, metres,
x right, y up, as a local engineering coordinate system.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence

import cv2
import numpy as np

from pondwatch.core.values import CorrectedPose, Image, RodReading

POSES_COLUMNS = ("sequence", "robot", "boot", "x_m", "y_m", "theta_rad", "sigma_xy_m", "sigma_theta_rad", "status")
RODS_COLUMNS = ("rod_id", "state", "fill", "confidence", "views")
POND_WKT = 'LOCAL_CS["Pond frame (x right, y up, origin at the lower left corner)",UNIT["metre",1]]'


def poses_csv(poses: Iterable[CorrectedPose]) -> bytes:
    """The table of poses, in the order given. Pose and sigma columns are empty where a snapshot is rejected."""
    return _csv(POSES_COLUMNS, map(_pose_row, poses))


def rods_csv(readings: Iterable[RodReading]) -> bytes:
    """The table of rods, in the order given. `fill` is empty where a rod is unseen."""
    return _csv(RODS_COLUMNS, map(_rod_row, readings))


def mosaic_png(bgra: Image) -> bytes:
    """A PNG of (h, w, 4) BGRA pixels."""
    ok, content = cv2.imencode(".png", bgra, [cv2.IMWRITE_PNG_COMPRESSION, 3])
    if not ok:
        raise ValueError(f"A picture of shape {bgra.shape} cannot be written as PNG.")
    return content.tobytes()


def world_file(metres_per_pixel: float, height_m: float) -> bytes:
    """The six lines beside a PNG: x scale, two rotations, y scale, and where the first pixel's CENTRE lies, pond frame.

    Args:
        height_m: the pond's; the raster's upper edge lies there.
    """
    half = metres_per_pixel / 2
    values = (metres_per_pixel, 0.0, 0.0, -metres_per_pixel, half, height_m - half)
    return "".join(f"{value:.12g}\n" for value in values).encode()


def mosaic_tif(bgra: Image, metres_per_pixel: float, height_m: float) -> bytes:
    """A tiled, deflated GeoTIFF of (h, w, 4) BGRA pixels: bands red, green, blue, alpha, in the pond frame.

    Its transform places the OUTER corner of the first pixel at the pond's upper left corner, as GeoTIFF's
    PixelIsArea has it.
    """
    import rasterio  # 0.2 s: only who asks for a TIFF pays it
    from rasterio.enums import ColorInterp
    from rasterio.io import MemoryFile

    with MemoryFile() as memory:
        with memory.open(
            driver="GTiff",
            height=bgra.shape[0],
            width=bgra.shape[1],
            count=4,
            dtype="uint8",
            crs=rasterio.CRS.from_wkt(POND_WKT),
            transform=rasterio.Affine(metres_per_pixel, 0.0, 0.0, 0.0, -metres_per_pixel, height_m),
            tiled=True,
            blockxsize=256,
            blockysize=256,
            compress="deflate",
            predictor=2,
            photometric="RGB",
            alpha="yes",
        ) as tif:
            tif.colorinterp = (ColorInterp.red, ColorInterp.green, ColorInterp.blue, ColorInterp.alpha)
            tif.write(np.moveaxis(bgra, -1, 0)[[2, 1, 0, 3]])
        return bytes(memory.read())


def _pose_row(pose: CorrectedPose) -> Sequence[object]:
    key = pose.key
    values = ("",) * 3 if pose.pose_pond is None else tuple(f"{v:.7f}" for v in pose.pose_pond)
    sigmas = ("" if s is None else f"{s:.4g}" for s in (pose.sigma_xy_m, pose.sigma_theta_rad))
    return key.sequence, key.robot, key.boot, *values, *sigmas, pose.status.value


def _rod_row(rod: RodReading) -> Sequence[object]:
    fill = "" if rod.fill is None else f"{rod.fill:.4f}"
    return rod.rod_id, rod.state.value, fill, f"{rod.confidence:.4f}", rod.views


def _csv(columns: Sequence[str], rows: Iterable[Sequence[object]]) -> bytes:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(rows)
    return text.getvalue().encode()
