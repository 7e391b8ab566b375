"""Training the paper's networks on a tiny set. Needs torch: `make test-paper` installs it.

torch is imported where it is used, so that the other tests run without it.
"""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from pondwatch.simulator.sfp10 import Sfp10Spec
from pondwatch.simulator.sfp10_files import write_dataset

pytestmark = pytest.mark.long
VARIANTS = ("a", "b", "c", "ours", "corrections")


@pytest.fixture(scope="module")
def tiny(tmp_path_factory):
    folder = tmp_path_factory.mktemp("paper") / "tiny"
    write_dataset(Sfp10Spec(train=12, test=4, instances=4, split="disjoint"), folder, workers=1)
    return folder


def recipe(epochs=6):
    from models.paper.recipes import REDUCED

    return replace(REDUCED, name="tiny", epochs=epochs, instances=4, batch=6, ponds_a_batch=3, canvas_px=32)


@pytest.mark.parametrize("variant", VARIANTS)
def test_training_lowers_the_loss_and_torch_and_onnxruntime_agree(variant, tiny, tmp_path):
    from models.paper import export, train

    losses = train.train(tiny, tmp_path / variant, variant, recipe(25))
    network, made = train.load(tmp_path / variant)
    path = tmp_path / f"paper-{variant}.onnx"
    export.export(network, export.contract_of(network, made, [0.1, 0.1, 0.1]), path)

    assert losses[-1] < 0.9 * losses[0]
    assert export.apart(network, path) < 1e-4


def test_the_full_recipe_trains_on_a_small_set(tiny, tmp_path):
    from models.paper import train
    from models.paper.recipes import FULL

    losses = train.train(tiny, tmp_path / "ours", "ours", replace(FULL, epochs=1, batch=6), poses="true")

    assert 0 < losses[0] < 5


def test_training_cut_off_goes_on_as_if_it_had_not_been(tiny, tmp_path, monkeypatch):
    from models.paper import train

    whole = train.train(tiny, tmp_path / "whole", "ours", recipe(4))
    save, saved = train._save, []

    def stop_after_two(*args):
        save(*args)
        saved.append(args)
        if len(saved) == 2:
            raise KeyboardInterrupt

    monkeypatch.setattr(train, "_save", stop_after_two)
    with pytest.raises(KeyboardInterrupt):
        train.train(tiny, tmp_path / "cut", "ours", recipe(4))
    monkeypatch.setattr(train, "_save", save)

    np.testing.assert_allclose(train.train(tiny, tmp_path / "cut", "ours", recipe(4)), whole, rtol=1e-6)


def test_a_run_trained_otherwise_is_refused(tiny, tmp_path):
    from models.paper import train

    train.train(tiny, tmp_path, "a", recipe(1))
    with pytest.raises(SystemExit, match="trained otherwise"):
        train.train(tiny, tmp_path, "a", recipe(2))


def test_a_network_that_predicts_corrections_begins_as_the_identity():
    import torch

    from models.paper.network import PaperNetwork, Shape

    network = PaperNetwork(Shape("corrections", 1, (20, 14), 32))
    coordinates = torch.rand(4, 221, 3)

    out = network(coordinates, torch.rand(2, 221, 14, 20), torch.rand(4, 1, 32, 32))

    assert torch.equal(out, coordinates)


def test_the_snapshots_of_a_pond_are_encoded_once_and_shared_by_its_sets():
    import torch

    from models.paper.network import PaperNetwork, Shape

    network = PaperNetwork(Shape("b", 1, (20, 14), 32))
    coordinates, snapshots = torch.rand(6, 221, 3), torch.rand(2, 221, 14, 20)

    once = network(coordinates, snapshots)

    each = network(coordinates, snapshots[[0, 0, 0, 1, 1, 1]])
    torch.testing.assert_close(once, each)


def test_the_loss_is_xy_and_a_twentieth_of_theta():
    import torch

    from models.paper.network import loss

    truth, predicted = torch.zeros(2, 221, 3), torch.zeros(2, 221, 3)
    predicted[..., 0], predicted[..., 2] = 2.0, 10.0

    assert float(loss(predicted, truth)) == pytest.approx((4 + 0) / 2 + 0.05 * 100)


def test_every_set_is_seen_once_an_epoch(tiny):
    import torch

    from models.paper import data
    from models.paper.network import Shape

    sets = data.read(tiny, "train", Shape("a"))

    seen = [inputs[0] for inputs, _ in sets.batches(6, 3, torch.Generator().manual_seed(1))]

    assert sets.count == 12
    assert len(torch.unique(torch.cat(seen).flatten(1), dim=0)) == 12


def test_the_table_is_measured_and_kept_with_identity_beside(tiny, tmp_path, monkeypatch):
    from models.paper import evaluate, page, train

    monkeypatch.setattr(evaluate, "RESULTS", tmp_path / "results.json")
    train.train(tiny, tmp_path / "runs/paper/ours", "ours", recipe(1))

    rows = list(evaluate.measure(tiny, tmp_path / "runs", ["a", "ours"], 2, 1, 0))
    found = evaluate.keep(rows)

    assert [r.method for r in rows] == ["identity", "middle", "ours"]
    identity, middle, _ = rows
    assert identity.mse[0] == pytest.approx((0.32 * 74 / 2245) ** 2, rel=0.2)  # the noise's variance
    assert identity.mse[2] == pytest.approx(0.01, rel=0.2)
    assert middle.mse[:2] == pytest.approx([1 / 12, 1 / 12], rel=0.1)  # a uniform's variance
    assert middle.r2 == pytest.approx([0, 0, 0], abs=0.02)
    assert identity.iou > 0.7 > 0.2 > middle.iou
    assert json.loads((tmp_path / "results.json").read_text()) == found
    [table] = page.tables(found)
    assert "identity: the input handed back" in table
    assert "0.0019 | 0.0022 | 0.0091" in table  # the published row
