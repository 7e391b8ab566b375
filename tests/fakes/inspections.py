"""Finished inspections put into a store as they stand after their last correction: no pictures are corrected."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from pondwatch.core.inspection import parse_inspection
from pondwatch.core.layouts import document_of
from pondwatch.core.values import Image, Inspection, Pond, RodReading, RodState
from pondwatch.jobs.quickpng import png
from pondwatch.jobs.raster import TILE_PX
from pondwatch.store import revisions, sessions
from pondwatch.store.revisions import NewRevision, TileRow
from pondwatch.store.sessions import State
from pondwatch.store.store import Store

SCALE_M = 0.001
FILLS = {"E": 0.0, "P": 0.5, "F": 1.0, "?": None}
STATES = {"E": RodState.EMPTY, "P": RodState.PARTIAL, "F": RodState.FULL, "?": RodState.UNSEEN}


def readings(pond: Pond, letters: str, confidence: float = 0.999) -> list[RodReading]:
    """A letter a rod: E, P, F or ? for not observed."""
    return [
        RodReading(rod.id, STATES[x], FILLS[x], 0.0 if x == "?" else confidence, 0 if x == "?" else 3)
        for rod, x in zip(pond.rods, letters, strict=True)
    ]


def finished(
    store: Store, pond: Pond, letters: str, now_ms: int, *, name: str = "Survey", image: Image | None = None,
    confidence: float = 0.999, scale_m: float = SCALE_M,
) -> str:  # fmt: skip
    """A finished session of a pond that was read as `letters`, with its mosaic; its id."""
    document = {
        "format": "pond-session/1",
        "name": name,
        "camera": {"width_px": 48, "height_px": 32, "metres_per_pixel": scale_m},
        "pond": document_of(pond),
    }
    picture = floor(pond, letters, scale_m) if image is None else image
    return stored(store, parse_inspection(document), readings(pond, letters, confidence), picture, now_ms)


def stored(store: Store, inspection: Inspection, rods: Sequence[RodReading], mosaic: Image, now_ms: int) -> str:
    """A finished session with these readings and this mosaic, (h, w, 4) BGRA; its id."""
    session = store.write(lambda c: sessions.create(c, inspection, "lattice", now_ms))
    revision = NewRevision(
        session,
        0,
        0,
        at_ms=now_ms + 60_000,
        rods=rods,
        tiles=tiles_of(mosaic),
        seen_share=1.0,
        quality="Every snapshot was placed.",
        state=State.FINISHED,
        finished_ms=now_ms + 60_000,
    )
    store.write(lambda c: revisions.write(c, revision))
    return session


def floor(pond: Pond, letters: str, scale_m: float = SCALE_M, shift_px: tuple[float, float] = (0.0, 0.0)) -> Image:
    """(h, w, 4): rings on grey, filled as `letters` say; where `?`, nothing was seen. Shifted right and down."""
    width, height = round(pond.width_m / scale_m), round(pond.height_m / scale_m)
    out = np.full((height, width, 4), (150, 150, 150, 255), np.uint8)
    for rod, letter in zip(pond.rods, letters, strict=True):
        u = rod.x_m / scale_m - 0.5 + shift_px[0]
        v = (pond.height_m - rod.y_m) / scale_m - 0.5 + shift_px[1]
        at, outer, inner = (round(u * 16), round(v * 16)), rod.outer_radius_m, rod.inner_radius_m
        fill = FILLS[letter]
        dark, light = (40, 40, 40, 255), (240, 240, 240, 255)
        if fill is None:
            cv2.circle(out, at, round(outer / scale_m * 20), (0, 0, 0, 0), -1, cv2.LINE_8, 4)
            continue
        for radius, colour in ((outer, dark), (outer * 0.85, light), (inner, dark), (inner * 0.8, light)):
            cv2.circle(out, at, round(radius / scale_m * 16), colour, -1, cv2.LINE_AA, 4)
        reach = round(inner * 0.8 / scale_m)
        cv2.ellipse(out, (round(u), round(v)), (reach, reach), 0, 0, 360 * fill, (60, 50, 40, 255), -1 if fill else 1)
    return out


def tiles_of(image: Image) -> list[TileRow]:
    """The finest tiles of the mosaic's layers."""
    out = []
    for top in range(0, image.shape[0], TILE_PX):
        for left in range(0, image.shape[1], TILE_PX):
            part = np.ascontiguousarray(image[top : top + TILE_PX, left : left + TILE_PX])
            out.append(TileRow("mosaic", left // TILE_PX, top // TILE_PX, png(part)))
            out.append(TileRow("coverage", left // TILE_PX, top // TILE_PX, png((part[..., 3] > 0).astype(np.uint8))))
    return out
