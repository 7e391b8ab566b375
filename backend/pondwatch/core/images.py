"""Pictures as bytes: what they claim to be, read from their header alone, and their pixels.

Pure: bytes in, arrays out. No decoder runs before the header's size was compared with the camera's, so a bomb (a
small file that decodes to gigabytes) costs nothing. Formats: PNG (ISO/IEC 15948), JPEG (ITU-T T.81), WebP (RFC 9649).
"""

from __future__ import annotations

import hashlib
import zlib
from typing import NamedTuple

import cv2
import numpy as np

from .errors import InvalidImage
from .values import Camera, Image

MEDIA_TYPES = {"png": "image/png", "jpeg": "image/jpeg", "webp": "image/webp"}
_PNG_CHANNELS = {0: 1, 2: 3, 3: 3, 4: 2, 6: 4}
_JPEG_FRAMES = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}


class Header(NamedTuple):
    """What a picture says of itself: kind `png`, `jpeg` or `webp`; bits a channel; channels with alpha."""

    kind: str
    width: int
    height: int
    bits: int
    channels: int


def read_header(content: bytes) -> Header:
    """What a picture says of itself, without decoding it.

    Raises:
        InvalidImage: it is none of PNG, JPEG and WebP, it is animated, or its header is damaged.
    """
    if content.startswith(b"\x89PNG\r\n\x1a\n"):
        return _png(content)
    if content.startswith(b"\xff\xd8\xff"):
        return _jpeg(content)
    if content[:4] == b"RIFF" and content[8:12] == b"WEBP":
        return _webp(content)
    raise InvalidImage("Not a PNG, JPEG or WebP picture." if content else "The picture is empty: 0 bytes.")


def check_header(content: bytes, camera: Camera) -> Header:
    """The header of a picture that this camera could have taken: its size, 8 bits, grey or colour.

    Raises:
        InvalidImage: it could not.
    """
    header = read_header(content)
    if (header.width, header.height) != (camera.width_px, camera.height_px):
        raise InvalidImage(
            f"The picture has {header.width} x {header.height} pixels, the camera {camera.width_px} x "
            f"{camera.height_px}.",
            width_px=header.width,
            height_px=header.height,
        )
    if header.bits != 8:
        raise InvalidImage(f"The picture has {header.bits} bits a channel; 8 are taken.", bits=header.bits)
    return header


def decode(content: bytes, camera: Camera) -> Image:
    """The pixels of a snapshot: (H, W, 3), BGR. Alpha is dropped and an orientation tag is not followed, since the
    pose is that of the sensor.

    Raises:
        InvalidImage: not a picture of this camera, cut short or damaged.
    """
    header = check_header(content, camera)
    _check_whole(content, header.kind)
    flags = cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION
    try:
        image = cv2.imdecode(np.frombuffer(content, np.uint8), flags)
    except cv2.error:
        image = None
    if image is None or image.shape != (camera.height_px, camera.width_px, 3) or image.dtype != np.uint8:
        raise InvalidImage(f"The {header.kind.upper()} picture is damaged: it does not decode.")
    return np.asarray(image, np.uint8)


def digest_of(content: bytes) -> str:
    """`sha256:<hex>` of the bytes, as the upload contract spells it."""
    return "sha256:" + hashlib.sha256(content).hexdigest()


def _png(content: bytes) -> Header:
    if len(content) < 33 or content[12:16] != b"IHDR":
        raise InvalidImage("The PNG picture has no header.")
    width, height = int.from_bytes(content[16:20], "big"), int.from_bytes(content[20:24], "big")
    channels = _PNG_CHANNELS.get(content[25])
    if not channels:
        raise InvalidImage(f"The PNG picture has a colour type that does not exist, {content[25]}.")
    return Header("png", width, height, content[24], channels)


def _jpeg(content: bytes) -> Header:
    at = 2
    while at + 9 < len(content) and content[at] == 0xFF:
        marker, length = content[at + 1], int.from_bytes(content[at + 2 : at + 4], "big")
        if marker == 0xFF:  # a fill byte
            at += 1
        elif marker in _JPEG_FRAMES:
            height, width = (int.from_bytes(content[at + k : at + k + 2], "big") for k in (5, 7))
            return Header("jpeg", width, height, content[at + 4], content[at + 9])
        elif marker == 0xDA or length < 2:
            break
        else:
            at += 2 + length
    raise InvalidImage("The JPEG picture has no frame header.")


def _webp(content: bytes) -> Header:
    kind, body = content[12:16], content[20:30]
    if kind == b"VP8 " and len(body) == 10 and body[3:6] == b"\x9d\x01\x2a":
        width, height = (int.from_bytes(body[k : k + 2], "little") & 0x3FFF for k in (6, 8))
        return Header("webp", width, height, 8, 3)
    if kind == b"VP8L" and len(body) >= 5 and body[0] == 0x2F:
        packed = int.from_bytes(body[1:5], "little")
        return Header("webp", (packed & 0x3FFF) + 1, (packed >> 14 & 0x3FFF) + 1, 8, 3 + (packed >> 28 & 1))
    if kind == b"VP8X" and len(body) == 10:
        if body[0] & 0x02:
            raise InvalidImage("The WebP picture is an animation.")
        width, height = (int.from_bytes(body[k : k + 3], "little") + 1 for k in (4, 7))
        return Header("webp", width, height, 8, 3 + (body[0] >> 4 & 1))
    raise InvalidImage("The WebP picture has no header.")


def _check_whole(content: bytes, kind: str) -> None:
    """Decoders fill what is missing with grey, or with the last picture: find a cut before they run."""
    if kind == "png":
        _check_png_chunks(content)
    elif kind == "jpeg":
        if content.find(b"\xff\xd9", content.find(b"\xff\xda")) < 0:
            raise InvalidImage("The JPEG picture is cut short: it has no end mark.")
    elif int.from_bytes(content[4:8], "little") + 8 > len(content):
        raise InvalidImage(f"The WebP picture is cut short: {len(content)} bytes are there.")


def _check_png_chunks(content: bytes) -> None:
    at = 8
    while at + 12 <= len(content):
        end = at + 12 + int.from_bytes(content[at : at + 4], "big")
        name, stored = content[at + 4 : at + 8], content[end - 4 : end]
        if end > len(content):
            break
        if zlib.crc32(content[at + 4 : end - 4]) != int.from_bytes(stored, "big"):
            raise InvalidImage("The PNG picture is damaged: a checksum does not match.")
        if name == b"acTL":
            raise InvalidImage("The PNG picture is an animation.")
        if name == b"IEND":
            return
        at = end
    raise InvalidImage("The PNG picture is cut short: it has no end chunk.")
