"""Bundles: what is read, and every fault by its file and row. A bad snapshot is that snapshot's fault alone."""

from __future__ import annotations

import json
import zipfile

import cv2
import numpy as np
import pytest

from pondwatch.basestation.bundle import Bundle
from pondwatch.basestation.correcting import correct_bundle
from pondwatch.core.errors import Invalid, InvalidBundle, InvalidImage, InvalidPose
from pondwatch.core.values import Snapshot, SnapshotKey, Status

HEADER = "sequence,robot,captured_at,image,x_m,y_m,theta_rad"
SESSION = {
    "format": "pond-session/1",
    "name": "a pond",
    "camera": {"width_px": 40, "height_px": 30, "metres_per_pixel": 0.001},
    "pond": {
        "width_m": 0.2,
        "height_m": 0.1,
        "rods": [
            {"id": "R0", "x_m": 0.05, "y_m": 0.05, "outer_radius_m": 0.01, "inner_radius_m": 0.006},
            {"id": "R1", "x_m": 0.09, "y_m": 0.05, "outer_radius_m": 0.01, "inner_radius_m": 0.006},
        ],
    },
}


def row(n, **changes):
    fields = {
        "sequence": n,
        "robot": "bubble-1",
        "captured_at": "2026-01-01T08:00:00.250Z",
        "image": f"snapshots/{n}.png",
        "x_m": 0.05 + n / 100,
        "y_m": 0.05,
        "theta_rad": 0.1,
    }
    return ",".join(str(v) for v in (fields | changes).values())


def picture(width=40, height=30):
    image = np.random.default_rng(width).integers(0, 256, (height, width, 3), dtype=np.uint8)
    return cv2.imencode(".png", image)[1].tobytes()


@pytest.fixture
def folder(tmp_path):
    root = tmp_path / "bundle"
    (root / "snapshots").mkdir(parents=True)
    (root / "session.json").write_text(json.dumps(SESSION))
    write_rows(root, *(row(n) for n in range(3)))
    for n in range(3):
        (root / f"snapshots/{n}.png").write_bytes(picture())
    return root


def write_rows(root, *rows):
    (root / "poses.csv").write_text("\n".join([HEADER, *rows]) + "\n")


def change(root, path, value):
    session = json.loads((root / "session.json").read_text())
    holder = session
    for step in path[:-1]:
        holder = holder[step]
    holder[path[-1]] = value
    (root / "session.json").write_text(json.dumps(session))


def zipped(root, prefix=""):
    path = root.with_suffix(".zip")
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for file in sorted(root.rglob("*")):
            if file.is_file():
                archive.write(file, prefix + str(file.relative_to(root)))
    return path


def read_all(path):
    with Bundle(path) as bundle:
        return [bundle.snapshot(each) for each in bundle.rows]


def fault(path):
    with pytest.raises(InvalidBundle) as caught:
        read_all(path)
    assert "\n" not in caught.value.message
    return caught.value


@pytest.mark.parametrize("packed", ["folder", "zip", "zip in a folder"])
def test_a_bundle_reads_alike_as_a_folder_and_as_a_zip(folder, packed):
    path = {"folder": folder, "zip": zipped(folder), "zip in a folder": zipped(folder, "pond/")}[packed]

    snapshots = read_all(path)

    assert [s.key for s in snapshots if isinstance(s, Snapshot)] == [SnapshotKey("bubble-1", 0, n) for n in range(3)]
    assert snapshots[1].captured_s == 1767254400.25
    np.testing.assert_allclose(snapshots[1].pose_pond, [0.06, 0.05, 0.1])
    np.testing.assert_array_equal(snapshots[1].image, cv2.imdecode(np.frombuffer(picture(), np.uint8), 1))


def test_boot_is_part_of_the_key_and_zero_where_absent(folder):
    (folder / "poses.csv").write_text(f"{HEADER},boot\n{row(0)},\n{row(0)},2\n")

    with Bundle(folder) as bundle:
        assert [each.key.boot for each in bundle.rows] == [0, 2]


def test_rods_may_be_absent(folder):
    change(folder, ["pond"], {"width_m": 0.2, "height_m": 0.1})

    with Bundle(folder) as bundle:
        assert bundle.inspection.pond.rods == ()


@pytest.mark.parametrize(
    ("name", "change_row", "says"),
    [
        ("a sequence that is not whole", {"sequence": "1.5"}, "sequence must be a whole number, and is '1.5'"),
        ("a negative sequence", {"sequence": -1}, "sequence must be a whole number"),
        ("a pose that is not a number", {"x_m": "left"}, "x_m must be a number, and is 'left'"),
        ("no pose", {"theta_rad": ""}, "theta_rad is missing"),
        ("no robot", {"robot": ""}, "robot is missing"),
        ("a time without a zone", {"captured_at": "2026-01-01T08:00:00"}, "captured_at must be a time"),
        ("a picture that is missing", {"image": "snapshots/none.png"}, "'snapshots/none.png' is missing"),
        ("a picture outside", {"image": "../../secret.png"}, "must be a path inside the bundle"),
        ("a picture at an absolute path", {"image": "/etc/passwd"}, "must be a path inside the bundle"),
        ("a key given before", {"sequence": 0}, "snapshot 0 of bubble-1 was given before, in row 2"),
    ],
)
def test_a_bad_row_is_named(folder, name, change_row, says):
    write_rows(folder, row(0), row(2), row(1, **change_row))

    error = fault(folder)

    assert (error.facts["file"], error.facts["row"]) == ("poses.csv", 4)
    assert error.message.startswith("poses.csv, row 4: ")
    assert says in error.message


def test_a_row_cut_short_is_named(folder):
    write_rows(folder, row(0), "1,bubble-1,2026-01-01T08:00:00Z")

    assert fault(folder).message == "poses.csv, row 3: image is missing."


def test_a_header_without_a_column_is_row_one(folder):
    (folder / "poses.csv").write_text("sequence,robot,image,x_m,y_m\n")

    error = fault(folder)

    assert error.facts["row"] == 1
    assert error.message.endswith("the header lacks captured_at, theta_rad.")


@pytest.mark.parametrize("name", ["session.json", "poses.csv"])
def test_a_file_that_is_missing_is_named(folder, name):
    (folder / name).unlink()

    assert fault(folder).message == f"{name}: is missing."


@pytest.mark.parametrize("content", [b"\xff\xfe\x00", b"sequence,robot\0\n", b""])
def test_a_poses_file_that_is_no_table_is_named(folder, content):
    (folder / "poses.csv").write_bytes(content)

    assert fault(folder).facts["file"] == "poses.csv"


def test_a_session_that_is_not_json_names_its_row(folder):
    (folder / "session.json").write_text('{"format": "pond-session/1",\n "name": }')

    assert fault(folder).facts == {"file": "session.json", "row": 2}


@pytest.mark.parametrize(
    ("path", "value", "field"),
    [
        (["format"], "pond-session/9", "format"),
        (["camera"], None, "camera"),
        (["camera", "width_px"], 160.5, "camera.width_px"),
        (["camera", "metres_per_pixel"], 0, "camera.metres_per_pixel"),
        (["pond"], None, "pond"),
        (["pond", "width_m"], -1, "pond.width_m"),
        (["pond", "rods"], {}, "pond.rods"),
        (["pond", "rods", 1, "x_m"], float("nan"), "pond.rods[1].x_m"),
        (["pond", "rods", 1, "x_m"], "0.1", "pond.rods[1].x_m"),
        (["pond", "rods", 1, "x_m"], 9.0, "pond.rods[1]"),
        (["pond", "rods", 1, "x_m"], 0.051, "pond.rods[1]"),
        (["pond", "rods", 1, "id"], "R0", "pond.rods[1].id"),
        (["pond", "rods", 1, "inner_radius_m"], 0.02, "pond.rods[1].inner_radius_m"),
        (["pose_noise"], {"sigma_xy_m": -1, "sigma_theta_rad": 0}, "pose_noise.sigma_xy_m"),
        (["pose_noise"], {"sigma_xy_m": 1}, "pose_noise.sigma_theta_rad"),
    ],
)
def test_a_bad_session_names_the_field(folder, path, value, field):
    change(folder, path, value)

    error = fault(folder)

    assert error.message.startswith("session.json: ")
    assert (error.facts["file"], error.facts["field"]) == ("session.json", field)


def test_a_link_that_leads_out_of_the_bundle_is_not_followed(folder, tmp_path):
    (tmp_path / "secret.png").write_bytes(picture())
    (folder / "snapshots/1.png").unlink()
    (folder / "snapshots/1.png").symlink_to(tmp_path / "secret.png")

    assert "not a path inside the bundle" in fault(folder).message


def test_a_zip_with_a_member_that_leads_out_is_refused(folder):
    path = zipped(folder)
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr("../../outside.txt", "x")

    assert "../../outside.txt" in fault(path).message


@pytest.mark.parametrize("damage", ["not a zip", "cut short", "one byte"])
def test_a_zip_that_cannot_be_read_is_refused(folder, damage):
    path = zipped(folder)
    content = path.read_bytes()
    at = content.index(b"poses.csv") + 30
    changed = {
        "not a zip": b"hello",
        "cut short": content[: len(content) // 2],
        "one byte": content[:at] + bytes([content[at] ^ 0xFF]) + content[at + 1 :],
    }
    path.write_bytes(changed[damage])

    assert fault(path).facts["file"] in (path.name, "poses.csv")


def test_a_zip_bomb_is_read_up_to_its_limit_only(folder):
    path = zipped(folder)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("session.json", b" " * (80 << 20))

    assert "over 67108864 bytes" in fault(path).message


def test_no_bundle_at_all_is_named(tmp_path):
    assert fault(tmp_path / "nowhere").message == "nowhere: there is no such bundle."


@pytest.mark.parametrize(
    ("content", "kind"),
    [(picture()[:200], InvalidImage), (picture(41, 30), InvalidImage), (b"GIF89a", InvalidImage), (b"", InvalidImage)],
)
def test_a_bad_picture_rejects_its_snapshot_and_not_the_session(folder, content, kind):
    (folder / "snapshots/1.png").write_bytes(content)

    with Bundle(folder) as bundle:
        assert [type(bundle.snapshot(each)) for each in bundle.rows] == [Snapshot, kind, Snapshot]


@pytest.mark.parametrize("value", ["nan", "inf", "-Infinity", "1e999"])
def test_a_pose_that_is_not_finite_rejects_its_snapshot_and_not_the_session(folder, value):
    write_rows(folder, row(0), row(1, y_m=value), row(2))

    with Bundle(folder) as bundle:
        fault_found = bundle.snapshot(bundle.rows[1])
        result = correct_bundle(bundle, "identity")

    assert isinstance(fault_found, InvalidPose)
    assert [pose.status for pose in result.poses] == [Status.PLACED, Status.REJECTED, Status.PLACED]
    assert result.faults == ("poses.csv, row 3: the pose has a value that is not finite.",)


def test_poses_come_back_in_the_bundles_order(folder):
    write_rows(folder, row(2), row(0), row(1))

    with Bundle(folder) as bundle:
        result = correct_bundle(bundle, "identity")

    assert [pose.key.sequence for pose in result.poses] == [2, 0, 1]
    assert result.mosaic.shape == (100, 200, 4)


def test_an_unknown_method_is_refused(folder):
    with Bundle(folder) as bundle, pytest.raises(Invalid, match="no correction method"):
        correct_bundle(bundle, "guess")
