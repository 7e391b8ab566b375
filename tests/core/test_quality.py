"""How well a session stands: counts that follow each change, and a sentence that an operator can act on."""

from __future__ import annotations

import numpy as np
import pytest

from pondwatch.core.noise import NoiseModel
from pondwatch.core.quality import Tally
from pondwatch.core.values import Camera, CorrectedPose, SnapshotKey, Status

CAMERA = Camera(160, 110, 0.001)
NOISE = NoiseModel(0.02, np.radians(6), gross=0.05, correlation=0.9)


def _pose(number, status, sigma_m=1e-5):
    return CorrectedPose(SnapshotKey("bubble-1", 0, number), np.zeros(3), np.diag([sigma_m**2] * 3), status)


def _told(*statuses):
    tally = Tally()
    for n, status in enumerate(statuses):
        tally.count(None, _pose(n, status), 3.0)
    return tally


def test_snapshots_are_counted_by_their_status():
    quality = _told(Status.PLACED, Status.PLACED, Status.UNCERTAIN, Status.REJECTED).quality(NOISE, CAMERA, 0.05)

    assert (quality.snapshots, quality.placed, quality.uncertain, quality.rejected) == (4, 2, 1, 1)


def test_a_snapshot_that_changes_its_status_is_counted_once():
    tally = _told(Status.UNCERTAIN, Status.PLACED)

    tally.count(_pose(0, Status.UNCERTAIN), _pose(0, Status.PLACED), 3.0)

    quality = tally.quality(NOISE, CAMERA, 0.05)
    assert (quality.snapshots, quality.placed, quality.uncertain) == (2, 2, 0)


def test_the_noise_is_told_in_metres_in_pitches_and_in_words():
    quality = _told(Status.PLACED).quality(NOISE, CAMERA, pitch_m=0.05)

    assert quality.sigma_xy_m == 0.02
    assert quality.facts["sigma_in_pitches"] == pytest.approx(0.4)
    assert quality.facts["gross_share"] == pytest.approx(0.05)
    assert "20 px" in quality.sentence
    assert "6 degrees" in quality.sentence


def test_the_typical_sigma_of_placed_snapshots_is_told_in_pixels():
    tally = Tally()
    for n, sigma in enumerate([1e-5, 2e-5, 3e-5]):
        tally.count(None, _pose(n, Status.PLACED, sigma), float("nan"))
    tally.count(None, _pose(9, Status.UNCERTAIN, 1.0), float("nan"))

    assert tally.quality(NOISE, CAMERA, 0.05).residual_px == pytest.approx(0.02)


def test_where_all_is_sure_the_sentence_says_so_and_where_not_how_many_are_not():
    sure = _told(Status.PLACED).quality(NOISE, CAMERA, 0.05).sentence
    unsure = _told(Status.PLACED, Status.UNCERTAIN, Status.UNCERTAIN).quality(NOISE, CAMERA, 0.05).sentence

    assert "sure" in sure
    assert "2 of 3" in unsure


def test_headings_that_say_nothing_are_not_given_in_degrees():
    sentence = _told(Status.PLACED).quality(NoiseModel(0.02, 1.8), CAMERA, 0.05).sentence

    assert "degrees" not in sentence


def test_a_session_without_snapshots_has_a_sentence_too():
    quality = Tally().quality(NOISE, CAMERA, 0.05)

    assert quality.snapshots == 0
    assert quality.sentence
    assert quality.residual_px is None
