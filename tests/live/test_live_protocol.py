"""The frames of the live feed."""

import json
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pondwatch.core.errors import Invalid
from pondwatch.live.protocol import delivery, hello, patch_frame, read_patch
from pondwatch.live.source import Changes, Patch, Raster

SIZES = st.integers(0, 20_000)
PATCHES = st.builds(
    Patch,
    layer=st.text(max_size=12),
    x=SIZES,
    y=SIZES,
    width=SIZES,
    height=SIZES,
    revision=st.integers(0, 2**53),
    mime=st.sampled_from(["image/jpeg", "image/png", "image/webp"]),
    content=st.binary(max_size=300),
)
PATCH = Patch("mosaic", 3, 4, 160, 110, 7, "image/jpeg", b"\xff\xd8\xff")


@given(PATCHES)
def test_reading_undoes_writing_a_patch(patch: Patch) -> None:
    assert read_patch(patch_frame(patch)) == patch


def test_a_patch_is_a_big_endian_length_a_json_header_and_the_image() -> None:
    frame = patch_frame(PATCH)

    (length,) = struct.unpack(">I", frame[:4])
    assert json.loads(frame[4 : 4 + length]) == {
        "type": "patch",
        "layer": "mosaic",
        "x": 3,
        "y": 4,
        "width": 160,
        "height": 110,
        "revision": 7,
        "mime": "image/jpeg",
    }
    assert frame[4 + length :] == b"\xff\xd8\xff"


@pytest.mark.parametrize(
    "frame", [b"", b"\0\0", b"\0\0\0\x09{}", b"\0\0\0\x02{}", b"\0\0\0\x02[]", b"\0\0\0\x03abc", b"\xff\xff\xff\xff{}"]
)
def test_a_damaged_patch_frame_is_refused(frame: bytes) -> None:
    with pytest.raises(Invalid):
        read_patch(frame)


def test_hello_says_the_raster_and_whether_all_follows() -> None:
    said = json.loads(hello("s1", 5, Raster(0.001, 64, 48), full=True))

    assert said == {
        "type": "hello",
        "session": "s1",
        "revision": 5,
        "full": True,
        "raster": {"metres_per_pixel": 0.001, "width_px": 64, "height_px": 48},
    }


def test_the_session_frame_comes_last_because_it_says_that_the_revision_is_complete() -> None:
    changes = Changes(
        session={"state": "running"},
        revision=9,
        full=False,
        poses=[{"robot": "a"}],
        rods=[{"rod_id": "R1"}],
        patches=[PATCH],
        jobs=[{"id": "j", "kind": "advance"}],
    )

    step = delivery(changes)

    kinds = ["patch" if isinstance(frame, bytes) else json.loads(frame)["type"] for frame in step.frames]
    assert kinds == ["patch", "rods", "poses", "job"]
    assert json.loads(step.status) == {"type": "session", "state": "running", "revision": 9}


def test_what_did_not_change_is_not_sent() -> None:
    assert delivery(Changes({}, 1, False, [], [], [], [])).frames == ()


def test_a_number_that_json_does_not_know_is_refused_rather_than_sent() -> None:
    with pytest.raises(ValueError, match="JSON"):
        delivery(Changes({}, 1, False, [{"x_m": float("nan")}], [], [], []))
