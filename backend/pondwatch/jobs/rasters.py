"""The mosaic and what is known of its pixels as cloud-optimised GeoTIFFs, in the pond frame, one over the other."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from .dossier import Dossier
from .exports import POND_WKT

_BLOCK = 256
_CHUNK = 1 << 20
LAYER_BANDS = ("looks", "age_s", "sigma_m")


def write_mosaic_cog(found: Dossier, out: IO[bytes]) -> None:
    """Bands red, green, blue and alpha, 8 bits; alpha 0 where nothing was seen."""
    bgra = found.mosaic()
    bands = [bgra[..., k] for k in (2, 1, 0, 3)]
    _write(found, bands, out, dtype="uint8", photometric="RGB", alpha="yes", predictor=2)


def write_layers_cog(found: Dossier, out: IO[bytes]) -> None:
    """Bands `looks`, `age_s` and `sigma_m`, 32-bit floats: how many snapshots saw a pixel; how many seconds before
    the newest of all it was last seen; one standard deviation of its place, metres. NaN where it was never seen."""
    known = found.layers()
    looks = np.where(known.looks > 0, known.looks, np.nan).astype(np.float32)
    _write(found, [looks, known.age_s, known.sigma_m], out, LAYER_BANDS, dtype="float32", nodata=np.nan, predictor=3)


def _write(
    found: Dossier, bands: Sequence[NDArray[Any]], out: IO[bytes], names: Sequence[str] = (), **profile: Any
) -> None:
    import rasterio  # 0.2 s: only who asks for a TIFF pays it
    from rasterio.enums import ColorInterp, Resampling
    from rasterio.shutil import copy

    scale, pond = found.metres_per_pixel, found.inspection.pond
    height, width = bands[0].shape
    common = {"height": height, "width": width, "count": len(bands), "crs": rasterio.CRS.from_wkt(POND_WKT)}
    transform = rasterio.Affine(scale, 0.0, 0.0, 0.0, -scale, pond.height_m)  # the OUTER corner of the first pixel
    with tempfile.TemporaryDirectory() as folder:
        plain, cog = Path(folder) / "plain.tif", Path(folder) / "cog.tif"
        layout = {"tiled": True, "blockxsize": _BLOCK, "blockysize": _BLOCK, "compress": "deflate"}
        with rasterio.open(plain, "w", "GTiff", transform=transform, **common, **layout, **profile) as tif:
            for number, band in enumerate(bands, 1):
                tif.write(band, number)
                if names:
                    tif.set_band_description(number, names[number - 1])
            if not names:
                tif.colorinterp = (ColorInterp.red, ColorInterp.green, ColorInterp.blue, ColorInterp.alpha)
            tif.update_tags(session=str(found.facts["id"]), revision=str(found.facts["revision"]))
            levels = [2**k for k in range(1, 8) if max(height, width) / 2**k >= _BLOCK / 2]
            tif.build_overviews(levels, Resampling.average if profile["dtype"] == "uint8" else Resampling.nearest)
        copy(plain, cog, driver="COG", blocksize=_BLOCK, compress="deflate", overviews="force_use_existing")
        with cog.open("rb") as file:
            while part := file.read(_CHUNK):
                out.write(part)
