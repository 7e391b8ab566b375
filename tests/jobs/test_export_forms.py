"""A simulated inspection as files: each read back by a program that is not ours, and held against what is stored."""

from __future__ import annotations

import base64
import csv
import hashlib
import io
import json
import re
import uuid
import zipfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import rasterio
from mcap.reader import make_reader

from pondwatch.core.errors import Invalid
from pondwatch.core.values import SnapshotKey
from pondwatch.jobs import report
from pondwatch.jobs.dossier import Dossier, Table, dossier
from pondwatch.jobs.forms import FORMS, view_from, write_dossier, write_form
from pondwatch.jobs.ingest import Upload
from pondwatch.simulator.simulation import Simulation
from pondwatch.simulator.spec import SimulationSpec
from pondwatch.store import conditions, sessions
from tests.fakes.house import House

COUNT = 40
PNG = cv2.imencode(".png", np.zeros((20, 20, 3), np.uint8))[1].tobytes()


@pytest.fixture(scope="module")
def house(tmp_path_factory: pytest.TempPathFactory) -> Iterator[House]:
    """A finished inspection of a small pond, its poses corrected and every rod read."""
    built = House(tmp_path_factory.mktemp("house"))
    simulation = Simulation(SimulationSpec(snapshots=COUNT, noise_pitch=0.1, name="Becken <7>"), 5)
    built.session = built.store.write(lambda c: sessions.create(c, simulation.inspection, "lattice", 1_000))
    session = built.ingest.session(built.session)
    for i in range(COUNT):
        shot = simulation.snapshot(i)
        pose = [float(v) for v in shot.pose_pond]
        key = SnapshotKey(shot.key.robot, shot.key.boot, shot.key.sequence)
        built.ingest.accept(session, Upload(key, 1_767_254_400_000 + 140 * i, *pose, shot.content))
    built.finish()
    yield built
    built.store.close()


@pytest.fixture(scope="module")
def found(house: House) -> Dossier:
    return dossier(house.store, house.session)


def written(house: House, form: str, **sides: float) -> bytes:
    out = io.BytesIO()
    write_form(house.store, house.session, form, out, 9_000, view_from(sides))
    return out.getvalue()


def of(found: Dossier, form: str) -> bytes:
    out = io.BytesIO()
    write_dossier(found, form, out)
    return out.getvalue()


@pytest.mark.parametrize("form", [*FORMS])
def test_every_form_is_the_same_bytes_again(house: House, form: str) -> None:
    assert written(house, form) == written(house, form)


def test_rod_centres_of_the_mosaic_cog_lie_within_half_a_pixel_of_the_layout(house: House, found: Dossier) -> None:
    with rasterio.MemoryFile(written(house, "mosaic")) as memory, memory.open() as tif:
        assert tif.tags(ns="IMAGE_STRUCTURE")["LAYOUT"] == "COG"
        assert [c.name for c in tif.colorinterp] == ["red", "green", "blue", "alpha"]
        image, alpha = np.moveaxis(tif.read((3, 2, 1)), 0, -1), tif.read(4)
        rods = found.inspection.pond.rods
        off = [_offset_px(tif, image, r) for r in rods if _is_whole(tif, alpha, r)]

    assert len(off) > 0.6 * len(rods)
    assert max(off) < 0.5


def _is_whole(tif: Any, alpha: np.ndarray, rod: Any) -> bool:
    """Whether a square around the rod lies in the mosaic and was seen."""
    row, column = tif.index(rod.x_m, rod.y_m)
    reach = int(1.4 * rod.outer_radius_m / tif.res[0])
    part = alpha[row - reach : row + reach + 1, column - reach : column + reach + 1]
    return bool(part.size == (2 * reach + 1) ** 2 and part.all())


def _offset_px(tif: Any, image: np.ndarray, rod: Any) -> float:
    """How far the outer circle's centre lies from the layout's, by the symmetry of its edges: the shift that the ring
    agrees best with itself turned by 180 degrees, halved. It knows nothing of how the mosaic was made."""
    column, row = ~tif.transform @ (rod.x_m, rod.y_m)
    radius = rod.outer_radius_m / tif.res[0]
    reach = 1.3 * radius
    left, top = (max(0, int(at - reach) - 3) for at in (column, row))
    part = image[top : int(row + reach) + 4, left : int(column + reach) + 4].astype(np.float32)
    grid = np.arange(-reach, reach + 0.01, 0.5, dtype=np.float32)
    u, v = np.meshgrid(grid, grid)
    wanted = abs(np.hypot(u, v) - radius) < 0.25 * radius
    best: tuple[float, float] = (np.inf, np.inf)
    for du in np.arange(-1, 1.01, 0.1):
        for dv in np.arange(-1, 1.01, 0.1):
            at = (u + np.float32(column - 0.5 - left + du), v + np.float32(row - 0.5 - top + dv))
            sampled = cv2.remap(part, *at, cv2.INTER_LINEAR)
            apart = (sampled - sampled[::-1, ::-1])[wanted]
            best = min(best, (float(np.vdot(apart, apart)), float(np.hypot(du, dv))))
    return best[1]


def test_the_layers_lie_over_the_mosaic_and_count_what_was_seen(house: House, found: Dossier) -> None:
    with rasterio.MemoryFile(written(house, "layers")) as memory, memory.open() as tif:
        assert tif.descriptions == ("looks", "age_s", "sigma_m")
        looks, age, sigma = tif.read()
        with rasterio.MemoryFile(written(house, "mosaic")) as other, other.open() as mosaic:
            assert (tif.transform, tif.crs, tif.shape) == (mosaic.transform, mosaic.crs, mosaic.shape)
            alpha = mosaic.read(4)

    seen = alpha > 0
    assert np.mean((looks > 0) == seen) > 0.9999  # a centre on a footprint's very edge may go either way
    assert np.isnan(age[~(looks > 0)]).all()
    newest = max(p["captured_ms"] for p in found.poses if p["corrected"])
    pose = next(p for p in found.poses if p["captured_ms"] == newest)
    row, column = tif_index(found, pose["corrected"])
    assert age[row, column] == 0
    assert sigma[row, column] <= pose["sigma_xy_m"] * 1.001
    assert np.nanmax(age) <= 0.14 * COUNT


def tif_index(found: Dossier, at: dict[str, float]) -> tuple[int, int]:
    scale, pond = found.metres_per_pixel, found.inspection.pond
    return int((pond.height_m - at["y_m"]) / scale), int(at["x_m"] / scale)


def test_the_recording_is_read_back_with_its_schemas_on_one_clock(house: House, found: Dossier) -> None:
    reader = make_reader(io.BytesIO(written(house, "mcap")))

    by_topic: dict[str, list[Any]] = {}
    names = {}
    for schema, channel, message in reader.iter_messages():
        assert schema is not None
        assert (channel.message_encoding, schema.encoding) == ("json", "jsonschema")
        assert json.loads(schema.data)["title"] == schema.name
        names[channel.topic.rsplit("/", 1)[1]] = schema.name
        by_topic.setdefault(channel.topic, []).append((message.log_time, json.loads(message.data)))
    assert names == {
        "raw": "foxglove.PoseInFrame",
        "corrected": "foxglove.PoseInFrame",
        "image": "foxglove.CompressedImage",
        "rods": "foxglove.SceneUpdate",
    }
    shot = found.poses[0]
    time_ns, image = by_topic[f"/{shot['robot']}/image"][0]
    assert time_ns == shot["captured_ms"] * 1_000_000
    assert hashlib.sha256(base64.b64decode(image["data"])).hexdigest() == shot["digest"]
    assert image["format"] == "jpeg"
    _, pose = by_topic[f"/{shot['robot']}/corrected"][0]
    turn = pose["pose"]["orientation"]
    assert pose["pose"]["position"]["x"] == shot["corrected"]["x_m"]
    assert 2 * np.arctan2(turn["z"], turn["w"]) == pytest.approx(shot["corrected"]["theta_rad"])
    assert sum(len(m) for topic, m in by_topic.items() if topic.endswith("/raw")) == COUNT
    (_, rods), *others = by_topic["/rods"]
    assert ([e["id"] for e in rods["entities"]], others) == ([r["rod_id"] for r in found.rods], [])
    assert [m.name for m in reader.iter_metadata()] == ["session"]


def test_the_floor_of_a_finished_inspection_was_looked_over_and_nothing_made_up(house: House) -> None:
    condition = house.store.read(lambda c: conditions.read(c, house.session))

    assert condition is not None
    assert condition["findings"] == []
    assert condition["examined"] > 0.3
    assert len(condition["positions"]) > 10


def test_the_tables_tell_every_snapshot_and_every_rod(house: House, found: Dossier) -> None:
    with zipfile.ZipFile(io.BytesIO(written(house, "csv"))) as archive:
        tables = {n: list(csv.DictReader(archive.read(n).decode().splitlines())) for n in archive.namelist()}

    assert [row["rod_id"] for row in tables["rods.csv"]] == [rod.id for rod in found.inspection.pond.rods]
    assert [float(row["x_m"]) for row in tables["rods.csv"]] == [rod.x_m for rod in found.inspection.pond.rods]
    first = tables["snapshots.csv"][0]
    assert float(first["raw_x_m"]) == found.poses[0]["raw"]["x_m"]
    assert first["image_sha256"] == found.poses[0]["digest"]
    assert len(tables["snapshots.csv"]) == COUNT
    document = json.loads(written(house, "json"))
    assert [r["state"] for r in document["rods"]] == [row["state"] for row in tables["rods.csv"]]
    assert document["seal"]["session"]["id"] == house.session


def test_the_ifdo_names_every_picture_by_its_digest(house: House, found: Dossier) -> None:
    document = json.loads(written(house, "ifdo"))

    assert document["image-set-header"]["image-set-ifdo-version"] == "v2.1.0"
    uuid.UUID(document["image-set-header"]["image-set-uuid"])
    items = document["image-set-items"]
    assert {name.split(".")[0] for name in items} == {p["digest"] for p in found.poses}
    assert items[f"{found.poses[0]['digest']}.jpg"]["image-datetime"] == "2026-01-01 08:00:00.000"


def test_a_stamped_view_shows_that_part_of_the_pond_and_a_bar_of_the_right_length(house: House, found: Dossier) -> None:
    rod = next(r for r, reading in zip(found.inspection.pond.rods, found.rods, strict=True) if reading["views"] > 2)
    reach = 2 * rod.outer_radius_m
    sides = {"west": rod.x_m - reach, "east": rod.x_m + reach, "south": rod.y_m - reach, "north": rod.y_m + reach}

    sheet = cv2.imdecode(np.frombuffer(written(house, "png", width=640, **sides), np.uint8), cv2.IMREAD_COLOR)

    assert sheet.shape == (640 + 64, 640, 3)
    row, column = tif_index(found, {"x_m": rod.x_m, "y_m": rod.y_m})
    assert np.abs(sheet[320, 320].astype(int) - found.mosaic()[row, column, :3]).max() < 12
    dark = 545 + np.flatnonzero((sheet[640 + 45, 545:] < 60).all(axis=1))  # a line of the bar, right of the text
    assert dark.max() - dark.min() == pytest.approx(0.005 / (2 * reach) * 640, abs=2)  # 5 mm, of a view of 48 mm


@pytest.mark.parametrize(
    ("sides", "said"),
    [
        ({"west": 0.1, "east": 0.05, "south": 0.0, "north": 0.1}, "less than"),
        ({"west": 5.0, "east": 6.0, "south": 0.0, "north": 0.1}, "outside the pond"),
        ({"west": 0.0, "east": 0.1}, "go together"),
        ({"west": 0.0, "east": 0.1, "south": 0.0, "north": 0.1, "width": 9}, "width"),
        ({"west": float("nan"), "east": 0.1, "south": 0.0, "north": 0.1}, "less than"),
        ({"west": 0.0, "east": 1e-9, "south": 0.0, "north": 0.1}, "tall"),
    ],
)
def test_a_view_that_makes_no_sense_is_refused(house: House, sides: dict[str, float], said: str) -> None:
    with pytest.raises(Invalid, match=said):
        written(house, "png", **sides)


def test_the_report_tells_what_there_is_and_is_the_same_bytes_again(found: Dossier) -> None:
    table = Table(
        "Discrepancies", "One rod is otherwise than declared.", ("rod", "declared"), (("R0001", "full"),),
        "1 of 9 lines", {"R0001": "D"}, "D otherwise than declared.", [(0.02, 0.03, "1")], [(PNG, "R0001")],
    )  # fmt: skip
    named = replace(found, tables=(table,))

    content = of(named, "pdf")

    assert content.startswith(b"%PDF-")
    assert content == of(named, "pdf")
    text = "\n".join(_texts(report.story(named)))
    assert found.seal is not None
    titles = ("Becken <7>", "Mosaic", "Coverage", "Rods by state", "Every rod", "Discrepancies", "Quality", "Digests")
    for said in (
        *titles, "1 of 9 lines", "D otherwise than declared.", found.seal["records"]["head"], "Signed",
        *(rod.id for rod in found.inspection.pond.rods),
    ):  # fmt: skip
        assert said in text, said
    in_order = [text.index(name) for name in ("Mosaic", "Rods by state", "Coverage", "One rod is", "Quality", "Signed")]
    assert in_order == sorted(in_order)


def test_every_page_of_a_report_says_how_many_there_are(found: Dossier, monkeypatch: pytest.MonkeyPatch) -> None:
    said = list[str]()
    draw = report.Canvas.drawRightString

    def hear(self: Any, x: float, y: float, text: str, *rest: Any, **options: Any) -> None:
        said.extend([text] if text.startswith("page ") else [])
        draw(self, x, y, text, *rest, **options)

    monkeypatch.setattr(report.Canvas, "drawRightString", hear)

    content = of(found, "pdf")

    pages = len(re.findall(rb"/Type /Page\b", content))
    assert said == [f"page {n} of {pages}" for n in range(1, pages + 1)]
    assert pages >= 4


def _texts(parts: Any) -> Iterator[str]:
    """The words of a report's parts, in their order, as a reader would find them on the pages."""
    for part in parts if isinstance(parts, list | tuple) else [parts]:
        if hasattr(part, "getPlainText"):
            yield part.getPlainText(identify=True)
        elif hasattr(part, "_cellvalues"):
            yield from _texts([cell for row in part._cellvalues for cell in row])
        elif hasattr(part, "_content") and isinstance(part._content, list):
            yield from _texts(part._content)
        elif isinstance(part, list | tuple):
            yield from _texts(part)


def test_an_inspection_without_snapshots_or_rods_has_a_report_too(tmp_path: Path) -> None:
    house = House(tmp_path)
    simulation = Simulation(SimulationSpec(snapshots=4, mapped=False), 1)
    house.session = house.store.write(lambda c: sessions.create(c, simulation.inspection, "graph", 1_000))

    made = {form: written(house, form) for form in FORMS if form != "bundle"}

    assert all(made.values())
    house.store.close()
