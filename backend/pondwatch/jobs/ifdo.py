"""A session's pictures as an iFDO (image FAIR Digital Object, marine-imaging.com/fair/ifdos), a JSON file beside them.

iFDO places images by longitude and latitude. A pond has none: places are metres in the pond frame, under names of our
own, and the reference system says so.
"""

from __future__ import annotations

import json
import uuid
from typing import IO

from pondwatch import __version__

from .dossier import Dossier
from .sealing import SUFFIXES
from .views import Json

VERSION = "v2.1.0"
_NAMESPACE = uuid.uuid5(uuid.NAMESPACE_URL, "https://pondwatch.invalid/ifdo")


def write_ifdo(found: Dossier, out: IO[bytes]) -> None:
    """Write it; the same session gives the same bytes. Names are those of the pictures in an evidence bundle."""
    items = {f"{shot['digest']}.{SUFFIXES[shot['media_type']]}": _item(found, shot) for shot in found.poses}
    document = {"image-set-header": _header(found), "image-set-items": items}
    out.write(json.dumps(document, indent=1, ensure_ascii=False).encode() + b"\n")


def _header(found: Dossier) -> Json:
    camera, facts = found.inspection.camera, found.facts
    identity = str(uuid.uuid5(_NAMESPACE, str(facts["id"])))
    abstract = f"Snapshots of a pond's floor, their poses corrected by {facts['method']}. {facts['quality']}"
    return {
        "image-set-name": facts["name"],
        "image-set-uuid": identity,
        "image-set-handle": f"urn:uuid:{identity}",
        "image-set-ifdo-version": VERSION,
        "image-set-local-path": "images",
        "image-abstract": abstract,
        "image-project": {"name": "Pondwatch"},
        "image-platform": {"name": "floating robots"},
        "image-sensor": {"name": "camera looking straight down"},
        "image-acquisition": "photo",
        "image-navigation": "reconstructed",
        "image-scale-reference": "calibrated camera",
        "image-area-square-meter": camera.width_px * camera.height_px * camera.metres_per_pixel**2,
        "image-coordinate-reference-system": "local: pond frame, metres, x right, y up, from the lower left",
        "image-set-provenance": {
            "provenance-agents": [{"name": "pondwatch", "type": "executable", "version": __version__}],
        },
    }


def _item(found: Dossier, shot: Json) -> Json:
    key = f"{found.facts['id']}/{shot['robot']}/{shot['boot']}/{shot['sequence']}"
    identity = str(uuid.uuid5(_NAMESPACE, key))
    corrected = shot["corrected"] or {}
    at = {f"pond-{axis.replace('_', '-')}": corrected.get(axis) for axis in ("x_m", "y_m", "theta_rad")}
    raw = {f"pond-raw-{axis.replace('_', '-')}": shot["raw"][axis] for axis in ("x_m", "y_m", "theta_rad")}
    return {
        "image-uuid": identity,
        "image-handle": f"urn:uuid:{identity}",
        "image-hash-sha256": shot["digest"],
        "image-datetime": str(shot["captured_at"]).replace("T", " ").removesuffix("Z"),
        "image-platform": {"name": shot["robot"]},
        "image-coordinate-uncertainty-meters": shot["sigma_xy_m"],
        "pond-status": shot["status"],
        **at,
        **raw,
    }
