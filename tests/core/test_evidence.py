"""What one snapshot says: its places share the sites where they see rods, and may be widened by others."""

from __future__ import annotations

import numpy as np
import pytest

from pondwatch.core.evidence import gather, lean, widen
from pondwatch.core.hypotheses import Reach
from pondwatch.core.values import Snapshot, SnapshotKey
from tests.core.ponds import CAMERA, METRES, PITCH_PX, draw_rods, hexagonal, in_image, setting_of

PITCH = PITCH_PX * METRES
POINTS = hexagonal(15, 15, PITCH)
POSE = np.array([0.17, 0.14, 0.2])
SETTING = setting_of(POINTS)


@pytest.fixture(scope="module")
def evidence():
    centres = in_image(POINTS, POSE)
    near = centres[((centres > -25) & (centres < [185, 135])).all(axis=1)]
    image = draw_rods(near, np.arange(len(near)) % 2 * 1.0)
    return gather(Snapshot(SnapshotKey("bubble-1", 0, 0), 0.0, POSE, image), Reach(1.6 * PITCH, 0.4), SETTING)


def test_the_radii_of_the_layout_are_those_of_the_picture():
    assert SETTING.band.outer_px * METRES == pytest.approx(SETTING.layout.outer_radius)
    assert SETTING.band.inner_px * METRES == pytest.approx(SETTING.layout.inner_radius)


def test_places_that_put_a_rod_at_the_same_point_share_a_site(evidence):
    at_site = evidence.site >= 0

    apart = np.hypot(*(evidence.places.centres_px - evidence.sites_px[evidence.site]).transpose(2, 0, 1))

    assert apart[at_site].max() < 5
    assert len(evidence.sites_px) < 0.2 * at_site.sum()  # far fewer than rods of places
    assert len(evidence.codes.ratio) == len(evidence.sites_px)


def test_every_rod_that_a_place_shows_in_the_picture_has_a_site(evidence):
    u, v = evidence.places.centres_px[..., 0], evidence.places.centres_px[..., 1]
    in_view = evidence.places.real & (u > 0) & (v > 0) & (u < CAMERA.width_px - 1) & (v < CAMERA.height_px - 1)
    far_out = (u < -12) | (v < -12) | (u > CAMERA.width_px + 11) | (v > CAMERA.height_px + 11)

    assert (evidence.site[in_view] >= 0).all()
    assert (evidence.site[far_out | ~evidence.places.real] == -1).all()


def test_what_a_site_shows_is_what_was_drawn_there(evidence):
    true = int(np.argmin(np.hypot(*(evidence.places.poses[:, :2] - POSE[:2]).T)))
    centres = in_image(POINTS, POSE)
    order = np.flatnonzero(((centres > -25) & (centres < [185, 135])).all(axis=1))

    for rod, site in zip(evidence.places.rods[true], evidence.site[true], strict=True):
        if site >= 0 and evidence.codes.valid[site].all():
            filled = np.flatnonzero(order == rod)[0] % 2
            assert (evidence.codes.ratio[site].mean() < -0.5) == bool(filled)


def test_further_places_come_after_the_old_ones_and_are_marked_as_far(evidence):
    far = POSE + [[3 * PITCH, 0, 0], [0, 3 * PITCH * np.sqrt(3) / 2, 0]]

    wider = widen(evidence, far, SETTING)

    count = len(evidence.places)
    np.testing.assert_array_equal(wider.places.poses[:count], evidence.places.poses)
    np.testing.assert_array_equal(wider.places.poses[count:], far)
    assert wider.far.tolist() == [0] * count + [1, 1]
    assert wider.site.shape == wider.places.real.shape
    assert evidence.far.tolist() == [0] * count


def test_without_its_response_the_evidence_is_small_and_otherwise_the_same(evidence):
    light = lean(evidence)

    assert light.found.field.nbytes < 100 < evidence.found.field.nbytes
    np.testing.assert_array_equal(light.found.centres_px, evidence.found.centres_px)
    assert light.places is evidence.places


def test_a_picture_of_nothing_is_evidence_without_places():
    blank = Snapshot(SnapshotKey("bubble-1", 0, 1), 0.0, POSE, np.full((110, 160, 3), 90, np.uint8))

    evidence = gather(blank, Reach(PITCH, 0.4), SETTING)

    assert len(evidence.places) == len(evidence.sites_px) == len(evidence.codes.ratio) == 0
