"""What one snapshot says before any other is heard: its places, and what its rods show.

Computed once a snapshot; the joint decision works on these alone. All places of a snapshot that put a rod at the
same point of the image share one site there, so what a site shows is sampled once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from .codes import Codes, read_codes
from .hypotheses import Places, Reach, describe, propose
from .observe import RingBand, RodsFound, find_rods
from .pond import Layout
from .ports import RodFinder
from .values import Camera, Float, Int, Snapshot

SITE_REACH_PX = 4.0


@dataclass(frozen=True, slots=True, eq=False)
class Setting:
    """What stays the same through a session. finder: a learned finder of rods, where one is used."""

    layout: Layout
    camera: Camera
    band: RingBand
    finder: RodFinder | None = None

    @classmethod
    def of(cls, layout: Layout, camera: Camera, finder: RodFinder | None = None) -> Setting:
        """Radii of the layout to pixels of the camera."""
        m = camera.metres_per_pixel
        band = RingBand.of(layout.inner_radius / m, layout.outer_radius / m, camera.width_px, camera.height_px)
        return cls(layout, camera, band, finder)


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """One snapshot's evidence.

    places: its hypotheses. far: (H,), which of them lie beyond the prior's reach. sites_px: (S, 2). site: (H, K),
    the site of each rod of each place, -1 where it is not in view. codes: what the sites show.
    reach: what the places were looked for within; None once others were added.
    """

    snapshot: Snapshot
    found: RodsFound
    places: Places
    far: Int
    sites_px: Float
    site: Int
    codes: Codes
    reach: Reach | None = None


def gather(snapshot: Snapshot, reach: Reach, setting: Setting, found: RodsFound | None = None) -> Evidence:
    """Look at a snapshot. `found`: where its rods were found already."""
    found = found or find_rods(snapshot.image, setting.band, setting.finder)
    places = propose(found, snapshot.pose_pond, reach, setting.layout, setting.camera)
    return replace(_with_places(snapshot, found, places, np.zeros(len(places), dtype=np.int64), setting), reach=reach)


def widen(evidence: Evidence, extra: Float, setting: Setting) -> Evidence:
    """The same evidence with further places (H', 3), marked as far."""
    own = evidence.places
    poses = np.concatenate([own.poses, extra])
    far = np.concatenate([evidence.far, np.ones(len(extra), dtype=np.int64)])
    return _with_places(
        evidence.snapshot, evidence.found, describe(poses, evidence.found, setting.layout, setting.camera), far, setting
    )


def _with_places(snapshot: Snapshot, found: RodsFound, places: Places, far: Int, setting: Setting) -> Evidence:
    sites, site = _sites(places, setting)
    b = setting.band
    codes = read_codes(snapshot.image, sites, b.inner_px, b.outer_px, setting.camera)
    return Evidence(snapshot, found, places, far, sites, site, codes)


def _sites(places: Places, setting: Setting) -> tuple[Float, Int]:
    """Group the image points of all places: (S, 2) means, and (H, K) the group of each, -1 out of view."""
    reach = 0.8 * setting.band.inner_px
    size = np.array([setting.camera.width_px, setting.camera.height_px])
    visible = places.real & ((places.centres_px > -reach) & (places.centres_px < size - 1 + reach)).all(axis=-1)
    points = places.centres_px[visible]
    group = np.full(len(points), -1, dtype=np.int64)
    means: list[Float] = []
    left = np.arange(len(points))
    while len(left):
        close = np.hypot(*(points[left] - points[left[0]]).T) < SITE_REACH_PX
        group[left[close]] = len(means)
        means.append(points[left[close]].mean(axis=0))
        left = left[~close]
    site = np.full(places.real.shape, -1, dtype=np.int64)
    site[visible] = group
    return np.array(means).reshape(-1, 2), site


def all_of(evidence: Sequence[Evidence]) -> list[object]:
    """What work on evidence may return as it is: the evidence, its snapshots, their pictures."""
    return [*evidence, *(e.snapshot for e in evidence), *(e.snapshot.image for e in evidence)]


def lean(evidence: Evidence) -> Evidence:
    """Without the response field, which is large and can be made again."""
    return replace(evidence, found=replace(evidence.found, field=np.zeros((1, 1), np.float32)))
