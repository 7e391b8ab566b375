"""Training the network that finds rods on a few pictures. Needs torch, which is imported where it is used."""

from __future__ import annotations

import numpy as np
import pytest

from pondwatch.core.observe import RingBand, find_rods

pytest.importorskip("torch")
pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def crops():
    from models.rods import data

    return data.crops(seed=1, ponds=4, each=12)


@pytest.fixture(scope="module")
def trained(crops):
    from models.rods import train

    return train.train(crops, epochs=5, told=lambda _: None)


def test_the_loss_falls(trained):
    losses = trained[1]

    assert losses[-1] < 0.7 * losses[0]


def test_training_again_by_the_same_seed_gives_the_same_losses(crops, trained):
    from models.rods import train

    again = train.train(crops, epochs=5, told=lambda _: None)[1]

    np.testing.assert_allclose(again[:2], trained[1][:2], rtol=1e-3)


def test_torch_and_onnxruntime_answer_alike(trained, tmp_path):
    from models.rods import export

    export.export(trained[0], {"seed": 0}, tmp_path)

    assert export.apart(trained[0], tmp_path) < export.PARITY


def test_mirroring_moves_offsets_and_wedges_with_the_rods(crops):
    import torch

    from models.rods import train

    batch = [torch.from_numpy(a[:4]) for a in (crops.planes, crops.target, crops.known, crops.rod)]
    torch.manual_seed(3)
    turned = [train.mirrored(*batch) for _ in range(12)]

    def centres(target, rod):  # (K, 2) of each rod's cell plus its offset
        n, v, u = np.nonzero(rod.numpy())
        return np.stack([u * 4 + 1.5 + target[n, 1, v, u].numpy(), v * 4 + 1.5 + target[n, 2, v, u].numpy()], axis=1)

    before = centres(batch[1], batch[3])
    height, width = batch[0].shape[2:]
    across, down = width - 1 - before[:, 0], height - 1 - before[:, 1]
    wanted = [np.stack([u, v], axis=1) for u in (before[:, 0], across) for v in (before[:, 1], down)]
    sums = {tuple(np.round(w.sum(axis=0), 1)) for w in wanted}
    got = {tuple(np.round(centres(t[1], t[3]).sum(axis=0), 1)) for t in turned}
    assert 1 < len(got) <= 4
    assert all(min(np.abs(np.subtract(g, s)).max() for s in sums) < 1 for g in got)


def test_rods_of_a_scene_lie_where_the_classical_detector_finds_them():
    from models.rods import data

    off = []
    for scene in data.scenes(seed=2, ponds=2, each=4, water="clear", wide=False):
        height, width = scene.image.shape[:2]
        found = find_rods(scene.image, RingBand.of(scene.inner_px, scene.outer_px, width, height)).centres_px
        for centre in scene.centres_px[scene.share > 0.99]:
            off.append(np.hypot(*(found - centre).T).min(initial=np.inf))

    assert len(off) > 8
    assert np.median(off) < 0.5
