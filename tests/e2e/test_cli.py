"""The command line as a person meets it: a process, its files, its exit status and its one line of complaint."""

from __future__ import annotations

import csv
import json
import subprocess
import sys

import cv2
import numpy as np
import pytest
import rasterio


def pondwatch(*arguments):
    command = [sys.executable, "-c", "from pondwatch.cli import main; main()", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)


@pytest.fixture
def bundle(tmp_path):
    root = tmp_path / "bundle"
    (root / "snapshots").mkdir(parents=True)
    rods = [{"id": "R0", "x_m": 0.05, "y_m": 0.04, "outer_radius_m": 0.01, "inner_radius_m": 0.006}]
    session = {
        "format": "pond-session/1",
        "name": "small",
        "camera": {"width_px": 40, "height_px": 30, "metres_per_pixel": 0.001},
        "pond": {"width_m": 0.1, "height_m": 0.08, "rods": rods},
    }
    (root / "session.json").write_text(json.dumps(session))
    rows = ["sequence,robot,captured_at,image,x_m,y_m,theta_rad"]
    for n in (2, 0, 1):
        image = np.full((30, 40, 3), 40 + 60 * n, np.uint8)
        cv2.imwrite(str(root / f"snapshots/{n}.png"), image)
        rows.append(f"{n},bubble-1,2026-01-01T08:00:00.000Z,snapshots/{n}.png,{0.03 + n / 50},0.04,0.0")
    (root / "poses.csv").write_text("\n".join(rows) + "\n")
    return root


def test_correct_writes_every_file_of_a_result(bundle, tmp_path):
    done = pondwatch("correct", bundle, "--out", tmp_path / "result", "--method", "identity")

    assert (done.returncode, done.stderr) == (0, "")
    names = sorted(path.name for path in (tmp_path / "result").iterdir())
    assert names == ["findings.csv", "findings.json", "mosaic.pgw", "mosaic.png", "mosaic.tif", "poses.csv", "rods.csv"]
    poses = list(csv.DictReader((tmp_path / "result/poses.csv").read_text().splitlines()))
    assert [row["sequence"] for row in poses] == ["2", "0", "1"]
    png = cv2.imread(str(tmp_path / "result/mosaic.png"), cv2.IMREAD_UNCHANGED)
    with rasterio.open(tmp_path / "result/mosaic.tif") as tif:
        np.testing.assert_array_equal(np.moveaxis(tif.read(), 0, -1), png[..., [2, 1, 0, 3]])
    assert png.shape == (80, 100, 4)
    assert png[40, 15].tolist() == [40, 40, 40, 255]
    assert png[0, 0].tolist() == [0, 0, 0, 0]


def test_correct_rejects_a_bad_picture_alone_and_says_so(bundle, tmp_path):
    (bundle / "snapshots/1.png").write_bytes(b"not a picture")

    done = pondwatch("correct", bundle, "--out", tmp_path / "result", "--method", "identity")

    assert done.returncode == 0
    assert done.stderr == "rejected: snapshots/1.png: Not a PNG, JPEG or WebP picture.\n"
    poses = {row["sequence"]: row for row in csv.DictReader((tmp_path / "result/poses.csv").read_text().splitlines())}
    assert (poses["1"]["status"], poses["1"]["x_m"]) == ("rejected", "")
    assert poses["0"]["status"] == "placed"


@pytest.mark.parametrize(
    ("file", "content", "line"),
    [
        ("session.json", "{", "pondwatch: session.json, row 1: is not JSON"),
        ("session.json", "{}", "pondwatch: session.json: format must be 'pond-session/1'"),
        ("poses.csv", "sequence,robot\n", "pondwatch: poses.csv, row 1: the header lacks captured_at"),
    ],
)
def test_an_unusable_bundle_ends_with_status_two_and_one_line(bundle, tmp_path, file, content, line):
    (bundle / file).write_text(content)

    done = pondwatch("correct", bundle, "--out", tmp_path / "result")

    assert done.returncode == 2
    assert done.stderr.startswith(line)
    assert done.stderr.count("\n") == 1
    assert not (tmp_path / "result").exists()


def test_an_unknown_method_ends_with_status_two_and_one_line(bundle, tmp_path):
    done = pondwatch("correct", bundle, "--out", tmp_path / "result", "--method", "guess")

    assert done.returncode == 2
    assert done.stderr.startswith("pondwatch: There is no correction method 'guess'")
    assert done.stderr.count("\n") == 1


def test_importing_the_command_line_loads_no_library_of_the_sciences():
    code = "import sys, pondwatch.cli; print([m for m in ('numpy', 'cv2', 'scipy', 'rasterio') if m in sys.modules])"

    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)

    assert done.stdout == "[]\n"
