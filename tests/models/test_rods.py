"""The network that finds rods: its file, and what it finds on ponds that it was not trained on.

Where rods are is known from the simulator's true poses; the discs by a formula share no code with it.
"""

from __future__ import annotations

import hashlib
import json
import shutil

import numpy as np
import pytest

from hatch_build import carried
from pondwatch.core.errors import Unavailable
from pondwatch.core.frames import pond_to_image
from pondwatch.core.observe import WEAK, RingBand, find_rods, response_field
from pondwatch.core.rodsight import CANONICAL_PX, CHANNELS, MARGIN_PX, RodsSeen, joined, look, read
from pondwatch.jobs.papernets import make_corrector
from pondwatch.jobs.rodfinder import OnnxRodFinder
from pondwatch.resources import models_dir
from pondwatch.simulator.spec import SimulationSpec
from tests.core.ponds import CAMERA, INNER_PX, OUTER_PX, draw_rods, inspected

FOLDER = models_dir() / "rods"
CENTRES = np.array([[40.3, 30.8], [92.0, 27.5], [65.6, 74.2], [118.4, 71.1]])
BAND = RingBand.of(INNER_PX, OUTER_PX, CAMERA.width_px, CAMERA.height_px)
UNSEEN = 731_000  # a seed that no training came near


@pytest.fixture(scope="module")
def finder() -> OnnxRodFinder:
    return OnnxRodFinder.of()


def nearest(seen, wanted):
    """(K,), px: how far the nearest rod seen is from each one wanted; and (K,) which."""
    apart = np.hypot(*np.moveaxis(wanted[:, None] - seen[None], -1, 0))
    return apart.min(axis=1, initial=np.inf), apart.argmin(axis=1)


def seen_at(*centres, probability=1.0):
    n = len(centres)
    return RodsSeen(np.array(centres, float).reshape(n, 2), np.full(n, probability), np.ones(n), np.ones(n))


def test_the_file_is_the_one_that_its_contract_describes(finder):
    told = json.loads((FOLDER / "rods.json").read_text())

    assert told["sha256"] == finder.digest == hashlib.sha256((FOLDER / "rods.onnx").read_bytes()).hexdigest()
    assert told["recipe"]["parameters"] < 150_000
    assert told["sha256"] in (FOLDER / "CARD.md").read_text()


def test_another_file_than_the_one_described_is_refused(tmp_path):
    for name in ("rods.onnx", "rods.json"):
        shutil.copy(FOLDER / name, tmp_path)
    content = bytearray((tmp_path / "rods.onnx").read_bytes())
    content[len(content) // 2] ^= 1
    (tmp_path / "rods.onnx").write_bytes(content)

    with pytest.raises(Unavailable, match="not the file"):
        OnnxRodFinder.of(tmp_path)


def test_a_network_for_another_input_is_refused(tmp_path):
    shutil.copy(FOLDER / "rods.onnx", tmp_path)
    told = json.loads((FOLDER / "rods.json").read_text()) | {"canonical_px": 9.0}
    (tmp_path / "rods.json").write_text(json.dumps(told))

    with pytest.raises(Unavailable, match="canonical_px"):
        OnnxRodFinder.of(tmp_path)


def test_a_network_that_is_not_there_is_named(tmp_path):
    with pytest.raises(Unavailable, match=r"rods\.onnx"):
        OnnxRodFinder.of(tmp_path)


@pytest.mark.parametrize("water", ["clear", "murky"])
def test_rods_of_ponds_never_trained_on_are_found_where_they_are(finder, water):
    found, off, sigmas = 0, [], []
    wanted_in_all = 0
    for seed in (UNSEEN, UNSEEN + 1):
        pond = inspected(SimulationSpec(snapshots=30, water=water), seed)
        setting = pond.setting
        for snapshot, pose, whole in zip(pond.snapshots, pond.truth, pond.views(), strict=True):
            wanted = pond_to_image(setting.layout.centres[whole], pose, setting.camera)
            rods = finder(snapshot.image, setting.band.outer_px)
            if len(wanted) and len(rods.centres_px):
                apart, which = nearest(rods.centres_px, wanted)
                hit = apart < 4
                found, off = found + int(hit.sum()), [*off, *apart[hit]]
                sigmas += list(rods.sigma_px[which[hit]])
            wanted_in_all += len(wanted)

    assert wanted_in_all > 30
    assert found / wanted_in_all > 0.9
    assert np.percentile(off, 90) < 1.5
    assert 0.05 < np.median(sigmas) < 1.5


def test_rods_drawn_by_a_formula_are_found_though_the_radius_is_stated_wrong(finder):
    image = draw_rods(CENTRES, np.array([0.0, 1.0, 0.0, 1.0]))

    for error in (0.85, 1.0, 1.15):
        seen = finder(image, OUTER_PX * error)
        apart, which = nearest(seen.centres_px, CENTRES)
        assert apart.max() < 1.5
        np.testing.assert_allclose(seen.outer_px[which], OUTER_PX, rtol=0.16)


def test_few_rods_are_seen_where_there_are_none(finder):
    pond = inspected(SimulationSpec(snapshots=30, water="murky"), UNSEEN)
    setting = pond.setting
    off = []
    for snapshot, pose in zip(pond.snapshots, pond.truth, strict=True):
        rods = pond_to_image(setting.layout.centres, pose, setting.camera)
        off.extend(nearest(rods, finder(snapshot.image, setting.band.outer_px).centres_px)[0])

    assert (np.array(off) > 8).mean() < 0.12


def test_the_input_has_the_rods_at_their_canonical_size_and_a_margin_around():
    sight = look(np.full((110, 160, 3), 90, np.uint8), 24.0)  # half as large there

    inside = sight.planes[3]
    assert CANONICAL_PX / 24 == 0.5
    assert inside.sum() == 55 * 80
    assert inside[MARGIN_PX, MARGIN_PX] == 1
    assert inside[MARGIN_PX - 1].sum() == inside[:, MARGIN_PX - 1].sum() == 0
    assert (sight.planes[:3] == 0).all()  # nothing differs from the mean
    corner = np.array([[-0.5, -0.5], [159.5, 109.5]])  # of the image
    np.testing.assert_allclose(sight.to_canonical(corner), [[15.5, 15.5], [95.5, 70.5]])
    np.testing.assert_allclose(sight.to_image(sight.to_canonical(corner)), corner)


def test_an_answer_is_read_as_its_channels_say():
    sight = look(np.full((110, 160, 3), 90, np.uint8), 24.0)
    answer = np.zeros((len(CHANNELS), 22, 28), np.float32)
    answer[0] = -20
    answer[0, 10, 12] = 3
    answer[1:, 10, 12] = [0.5, -1.5, 2 * np.log(0.4), np.log(1.1), 0.25, 0.0, 0.7]

    rods = read(answer, sight)

    # the cell's middle is 12 * 4 + 1.5, 10 * 4 + 1.5; less the margin of 16 and twice as large in the image
    np.testing.assert_allclose(rods.centres_px, [[(50 - 16 + 0.5) * 2 - 0.5, (40 - 16 + 0.5) * 2 - 0.5]], atol=1e-4)
    np.testing.assert_allclose(rods.probability, [1 / (1 + np.exp(-3))], rtol=1e-6)
    np.testing.assert_allclose(rods.sigma_px, [0.8], rtol=1e-4)
    np.testing.assert_allclose(rods.outer_px, [1.1 * 24], rtol=1e-4)


def test_the_response_is_joined_with_what_is_seen_on_its_own_level():
    field = response_field(draw_rods(CENTRES[:2]), BAND)
    at = np.round(CENTRES[:3] + BAND.pad).astype(int)
    level = np.median(field[at[:2, 1], at[:2, 0]])

    both = joined(field, BAND.pad, seen_at(*at[:2] - BAND.pad), OUTER_PX, word=0.5)
    third = joined(field, BAND.pad, seen_at(*at - BAND.pad), OUTER_PX, word=0.5)

    np.testing.assert_allclose(both[at[:2, 1], at[:2, 0]], 0.5 * (field[at[:2, 1], at[:2, 0]] + level), rtol=1e-5)
    assert third[at[2, 1], at[2, 0]] > both[at[2, 1], at[2, 0]] + 0.08  # seen, though the response knows nothing of it
    np.testing.assert_array_equal(joined(field, BAND.pad, seen_at(), OUTER_PX, word=0.0), field)


def test_a_finder_is_asked_where_the_response_is_weak_and_for_the_layouts_radius():
    asked = []

    def finder(image, outer_px):
        asked.append((image.shape, outer_px))
        return seen_at(*CENTRES)

    strong, faint = draw_rods(CENTRES), draw_rods(CENTRES, levels=(100, 92, 108, 100), noise=8.0)
    clear, weak = find_rods(strong, BAND, finder), find_rods(faint, BAND, finder)

    assert asked == [((110, 160, 3), OUTER_PX)]  # for the second alone
    np.testing.assert_array_equal(clear.field, find_rods(strong, BAND).field)
    assert find_rods(faint, BAND).typical < WEAK
    assert nearest(weak.centres_px, CENTRES)[0].max() < 1.5


def test_the_method_with_the_network_places_snapshots_where_they_belong():
    pond = inspected(SimulationSpec(snapshots=30, water="murky"), UNSEEN)
    corrector = make_corrector(pond.inspection, "lattice-network")

    corrector.add(pond.snapshots)

    apart = [
        np.hypot(*(corrector.poses()[s.key].pose_pond[:2] - t[:2])) / pond.inspection.camera.metres_per_pixel
        for s, t in zip(pond.snapshots, pond.truth, strict=True)
        if corrector.poses()[s.key].status == "placed"
    ]
    assert corrector.method == "lattice-network"
    assert len(apart) > 10
    assert max(apart) < 5


def test_a_wheel_carries_the_contract_beside_the_network():
    targets = {target for _, target in carried(FOLDER.parent.parent)}

    assert {"pondwatch/_models/rods/rods.onnx", "pondwatch/_models/rods/rods.json"} <= targets
