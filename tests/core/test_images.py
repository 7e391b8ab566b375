"""Pictures: headers read without a decoder, and damage refused rather than filled in."""

from __future__ import annotations

import struct
import zlib

import cv2
import numpy as np
import pytest

from pondwatch.core import images
from pondwatch.core.errors import InvalidImage
from pondwatch.core.images import Header, decode, digest_of, read_header
from pondwatch.core.values import Camera

CAMERA = Camera(64, 48, 0.001)
NOISE = np.random.default_rng(0).integers(0, 256, (48, 64, 4), dtype=np.uint8)
LOSSLESS = [cv2.IMWRITE_WEBP_QUALITY, 101]


def encoded(extension, image=NOISE[..., :3], parameters=()):
    return cv2.imencode(extension, image, list(parameters))[1].tobytes()


def png_bomb(width, height):
    """A valid header of a vast picture and nothing behind it."""
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    chunk = b"IHDR" + header
    return b"\x89PNG\r\n\x1a\n" + struct.pack(">I", 13) + chunk + struct.pack(">I", zlib.crc32(chunk))


@pytest.mark.parametrize(
    ("content", "header"),
    [
        (encoded(".png"), Header("png", 64, 48, 8, 3)),
        (encoded(".png", NOISE[..., 0]), Header("png", 64, 48, 8, 1)),
        (encoded(".png", NOISE), Header("png", 64, 48, 8, 4)),
        (encoded(".png", NOISE.astype(np.uint16)[..., :3] * 257), Header("png", 64, 48, 16, 3)),
        (encoded(".jpg"), Header("jpeg", 64, 48, 8, 3)),
        (encoded(".jpg", NOISE[..., 0]), Header("jpeg", 64, 48, 8, 1)),
        (encoded(".jpg", parameters=[cv2.IMWRITE_JPEG_PROGRESSIVE, 1]), Header("jpeg", 64, 48, 8, 3)),
        (encoded(".webp", parameters=[cv2.IMWRITE_WEBP_QUALITY, 80]), Header("webp", 64, 48, 8, 3)),
        (encoded(".webp", parameters=LOSSLESS), Header("webp", 64, 48, 8, 3)),
        (encoded(".webp", NOISE, LOSSLESS), Header("webp", 64, 48, 8, 4)),
    ],
)
def test_a_header_says_kind_size_bits_and_channels(content, header):
    assert read_header(content) == header


@pytest.mark.parametrize("extension", [".png", ".webp"])
def test_a_lossless_picture_decodes_to_its_pixels(extension):
    content = encoded(extension, parameters=LOSSLESS if extension == ".webp" else ())

    np.testing.assert_array_equal(decode(content, CAMERA), NOISE[..., :3])


def test_a_grey_picture_decodes_to_three_equal_channels():
    image = decode(encoded(".png", NOISE[..., 0]), CAMERA)

    np.testing.assert_array_equal(image, np.repeat(NOISE[..., :1], 3, axis=-1))


def test_a_bomb_is_refused_before_any_decoder_runs(monkeypatch):
    monkeypatch.setattr(images.cv2, "imdecode", lambda *_: pytest.fail("a decoder ran"))

    with pytest.raises(InvalidImage, match="60000 x 60000 pixels, the camera 64 x 48"):
        decode(png_bomb(60_000, 60_000), CAMERA)


def test_sixteen_bits_are_refused():
    with pytest.raises(InvalidImage, match="16 bits a channel"):
        decode(encoded(".png", NOISE.astype(np.uint16)[..., :3] * 257), CAMERA)


@pytest.mark.parametrize("content", [b"", b"GIF89a", b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff\xe0", b"RIFF0000WEBPVP8 "])
def test_what_is_no_picture_is_refused(content):
    with pytest.raises(InvalidImage):
        read_header(content)


@pytest.mark.parametrize("extension", [".png", ".jpg", ".webp"])
@pytest.mark.parametrize("share", [0.3, 0.6, 0.9, 0.995])
def test_a_picture_cut_short_is_refused(extension, share):
    content = encoded(extension)

    with pytest.raises(InvalidImage):
        decode(content[: int(len(content) * share)], CAMERA)


def test_one_wrong_byte_in_a_png_is_refused():
    content = bytearray(encoded(".png"))
    content[len(content) // 2] ^= 0x10

    with pytest.raises(InvalidImage, match="checksum"):
        decode(bytes(content), CAMERA)


def test_an_orientation_tag_does_not_turn_the_picture():
    exif = b"Exif\0\0II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0\x06\0\0\0\0\0\0\0"
    content = encoded(".jpg")
    turned = content[:2] + b"\xff\xe1" + struct.pack(">H", len(exif) + 2) + exif + content[2:]

    np.testing.assert_array_equal(decode(turned, CAMERA), decode(content, CAMERA))


def test_a_digest_is_spelled_as_the_contract_has_it():
    empty = "sha256:e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"

    assert digest_of(b"") == empty
