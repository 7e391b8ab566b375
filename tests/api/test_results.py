"""What a session says while it runs and once it is finished."""

from __future__ import annotations

import csv
import io
from typing import Any

import cv2
import numpy as np
import pytest
from rasterio.io import MemoryFile

from pondwatch.core.images import decode
from pondwatch.core.inspection import parse_inspection
from pondwatch.core.mosaic import Mosaic
from pondwatch.core.values import Image, SnapshotKey
from pondwatch.jobs.provenance import method_digest
from tests.fakes.robot import Shot, document

from .conftest import Api
from .test_upload import problem

SHOTS = [Shot(i, f"bubble-{i % 3}") for i in range(12)]


@pytest.fixture(scope="module")
def finished(api: Api) -> str:
    """A finished session of twelve snapshots that were corrected by no method."""
    session = api.open()
    for shot in SHOTS:
        assert api.send(session, shot).status_code == 201
    api.finish(session)
    return session


def expected_mosaic() -> Image:
    inspection = parse_inspection(document())
    mosaic = Mosaic(inspection.camera, inspection.pond)
    for shot in SHOTS:
        pose = shot.pose()
        at = np.array([pose["x_m"], pose["y_m"], pose["theta_rad"]])
        mosaic.put(SnapshotKey(shot.robot, 0, shot.sequence), decode(shot.content, inspection.camera), at)
    return mosaic.bgra()


def picture_of(content: bytes) -> Image:
    image = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED)
    assert image is not None
    return np.asarray(image, np.uint8)


def test_a_session_tells_its_state_counts_coverage_and_layout(api: Api, finished: str) -> None:
    view = api.get(finished).json()

    assert (view["state"], view["method"]) == ("finished", "identity")
    assert view["counts"] == {"snapshots": 12, "placed": 12, "uncertain": 0, "rejected": 0, "pending": 0}
    assert view["coverage"] == np.count_nonzero(expected_mosaic()[..., 3]) / (200 * 120)
    assert view["raster"] == {"metres_per_pixel": 0.001, "width_px": 200, "height_px": 120}
    assert [rod["id"] for rod in view["pond"]["rods"]] == [f"R{i}" for i in range(6)]
    assert view["last_captured_at"] == "2026-01-01T08:00:11.250Z"
    assert view["finished_at"] >= view["created_at"]


def test_poses_come_with_what_was_sent_in_order_of_their_key(api: Api, finished: str) -> None:
    poses = api.get(finished, "/poses").json()["poses"]

    sent = sorted(SHOTS, key=lambda s: (s.robot, s.sequence))
    assert [(p["robot"], p["sequence"]) for p in poses] == [(s.robot, s.sequence) for s in sent]
    assert [p["x_m"] for p in poses] == [s.pose()["x_m"] for s in sent]
    assert [p["captured_at"] for p in poses] == [s.pose()["captured_at"] for s in sent]
    assert {(p["sigma_xy_m"], p["sigma_theta_rad"]) for p in poses} == {(0.004, 0.05)}


def test_tables_come_as_csv_too(api: Api, finished: str) -> None:
    poses = list(csv.DictReader(io.StringIO(api.get(finished, "/poses", format="csv").text)))
    rods = list(csv.DictReader(io.StringIO(api.get(finished, "/rods", format="csv").text)))

    assert len(poses) == 12
    columns = "sequence,robot,boot,x_m,y_m,theta_rad,sigma_xy_m,sigma_theta_rad,status"
    assert list(poses[0]) == columns.split(",")
    assert [(r["rod_id"], r["state"], r["fill"]) for r in rods] == [(f"R{i}", "unseen", "") for i in range(6)]
    problem(api.get(finished, "/poses", format="xml"), 422, "invalid-request")


def test_the_mosaic_is_that_of_the_core(api: Api, finished: str) -> None:
    answer = api.get(finished, "/mosaic.png")

    np.testing.assert_array_equal(picture_of(answer.content), expected_mosaic())
    world = [float(line) for line in api.get(finished, "/mosaic.pgw").text.split()]
    assert world == pytest.approx([0.001, 0, 0, -0.001, 0.0005, 0.1195])


def test_the_geotiff_lies_in_the_pond(api: Api, finished: str) -> None:
    with MemoryFile(api.get(finished, "/mosaic.tif").content) as memory, memory.open() as tif:
        assert (tif.width, tif.height) == (200, 120)
        assert tuple(tif.bounds) == pytest.approx((0, 0, 0.2, 0.12))
        np.testing.assert_array_equal(tif.read(4), expected_mosaic()[..., 3])


def test_a_tile_of_the_finest_level_is_the_raster_and_transparent_beyond_it(api: Api, finished: str) -> None:
    revision = api.get(finished).json()["revision"]

    answer = api.get(finished, "/tiles/mosaic/0/0/0", revision=revision)

    tile = picture_of(answer.content)
    np.testing.assert_array_equal(tile[:120, :200], expected_mosaic())
    assert tile.shape == (256, 256, 4)
    assert not tile[120:].any()
    assert not tile[:, 200:].any()
    assert "immutable" in answer.headers["cache-control"]
    assert "immutable" not in api.get(finished, "/tiles/mosaic/0/0/0").headers["cache-control"]


def test_the_coverage_layer_counts_looks_and_is_0_where_nothing_was_seen(api: Api, finished: str) -> None:
    looks = picture_of(api.get(finished, "/tiles/coverage/0/0/0").content)[:120, :200]

    seen = expected_mosaic()[..., 3] > 0
    np.testing.assert_array_equal(looks > 0, seen)
    assert looks.max() > 1


def test_the_age_layer_tells_how_long_before_the_newest_snapshot_a_place_was_seen(api: Api) -> None:
    session = api.open()
    flat = {"y_m": 0.06, "theta_rad": 0.0}  # 48 x 32 pixels around the 60th row: rows 44 to 75
    api.send(session, Shot(0).but(x_m=0.05, captured_at="2026-01-01T08:00:00.250Z", **flat))  # columns 26 to 73
    api.send(session, Shot(1).but(x_m=0.08, captured_at="2026-01-01T08:20:00.250Z", **flat))  # columns 56 to 103
    api.until(session, lambda view: view["counts"]["pending"] == 0)

    tile = picture_of(api.get(session, "/tiles/age/0/0/0").content).astype(int)

    seen = tile[..., 3] == 255
    age_s = tile[..., 2] * 65536 + tile[..., 1] * 256 + tile[..., 0]
    assert (seen[60, :120].nonzero()[0] == np.arange(26, 104)).all()
    assert seen[:, 60].nonzero()[0].tolist() == list(range(44, 76))
    assert (age_s[60, 26:56] == 1200).all()
    assert (age_s[60, 56:104] == 0).all()  # the later look counts
    looks = picture_of(api.get(session, "/tiles/coverage/0/0/0").content)
    np.testing.assert_array_equal(seen, looks > 0)


@pytest.mark.parametrize(
    "place", ["age/1/0/0", "mosaic/1/0/0", "mosaic/0/1/0", "mosaic/0/-1/0", "mosaic/99/0/0", "magic/0/0/0"]
)
def test_a_tile_that_is_not_there_is_not_found(api: Api, finished: str, place: str) -> None:
    problem(api.get(finished, f"/tiles/{place}"), 404, "missing")


def test_a_large_pond_has_coarser_levels(api: Api) -> None:
    pond = {"width_m": 0.6, "height_m": 0.3, "rods": []}
    session = api.open(pond=pond)
    api.send(session, Shot(1).but(x_m=0.3, y_m=0.15))
    api.until(session, lambda view: view["counts"]["pending"] == 0)

    coarse = picture_of(api.get(session, "/tiles/mosaic/0/0/0").content)
    fine = picture_of(api.get(session, "/tiles/mosaic/2/1/0").content)

    # 600 x 300 px: level 2 has 3 x 2 tiles, level 0 one, four raster pixels to one of the screen's
    problem(api.get(session, "/tiles/mosaic/3/0/0"), 404, "missing")
    assert coarse[37, 75, 3] == 255
    assert not coarse[76:].any()
    np.testing.assert_allclose(coarse[37, 75, :3], fine[148:152, 300 - 256 : 304 - 256, :3].mean(axis=(0, 1)), atol=1)


def test_a_rod_names_the_snapshots_that_show_it_whole(api: Api) -> None:
    session = api.open()
    near = {"x_m": 0.09, "y_m": 0.06, "theta_rad": 0.0}  # on rod R2, whose radius is 10 of the 16 pixels to the border
    api.send(session, Shot(1).but(**near))
    api.send(session, Shot(2).but(**{**near, "y_m": 0.068}))  # cut by the border
    api.until(session, lambda view: view["counts"]["pending"] == 0)

    rod = api.get(session, "/rods/R2").json()

    assert [s["sequence"] for s in rod["snapshots"]] == [1]
    assert rod["snapshots"][0]["raw"] == rod["snapshots"][0]["corrected"] == near
    assert "fill" not in rod["snapshots"][0]  # a rod is read from all its snapshots together
    assert rod["method_digest"] == f"sha256:{method_digest()}"
    assert rod["model_digest"] is None, "no network reads it"
    assert rod["place"].keys() == {"x_m", "y_m", "outer_radius_m"}
    assert rod["camera"] == api.get(session).json()["camera"]
    assert api.get(session, "/rods/R0").json()["snapshots"] == []
    problem(api.get(session, "/rods/R9"), 404, "missing")


def test_finishing_again_changes_nothing(api: Api, finished: str) -> None:
    before = api.get(finished).json()

    again = api.http.post(f"/api/sessions/{finished}/finish")

    assert again.status_code == 200
    assert again.json() == before


def test_a_session_without_snapshots_can_be_finished(api: Api) -> None:
    session = api.open()

    view = api.finish(session)

    assert (view["state"], view["coverage"]) == ("finished", 0.0)
    assert not picture_of(api.get(session, "/mosaic.png").content).any()


def test_jobs_tell_what_was_done(api: Api, finished: str) -> None:
    jobs = api.http.get("/api/jobs", params={"session": finished}).json()["jobs"]

    assert {(j["kind"], j["state"], j["progress"], j["error"]) for j in jobs} == {
        ("advance", "done", 1.0, None),
        ("finish", "done", 1.0, None),
    }
    assert api.http.get(f"/api/jobs/{jobs[0]['id']}").json() == jobs[0]
    problem(api.http.get("/api/jobs/999999"), 404, "missing")


def test_comparing_a_session_with_itself_finds_nothing(api: Api, finished: str) -> None:
    answer: dict[str, Any] = api.http.get("/api/compare", params={"base": finished, "with": finished}).json()

    assert (answer["rods"], answer["not_observed"], answer["compared"]) == ([], 6, 0)
    assert answer["base"] == answer["with"]
    problem(api.http.get("/api/compare", params={"base": finished, "with": "x"}), 404, "missing")


@pytest.mark.parametrize(
    "path", ["", "/poses", "/rods", "/mosaic.png", "/mosaic.tif", "/tiles/mosaic/0/0/0", "/rods/R0"]
)
def test_nothing_is_known_of_a_session_that_is_not_there(api: Api, path: str) -> None:
    assert problem(api.get("nosuch", path), 404, "missing")["kind"] == "session"
