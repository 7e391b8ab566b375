"""What the rods of a session look like, learned from the snapshots that are surest."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

import cv2
import numpy as np

from .appearance import Patches, Profile, contrast_axis, cut, learn_profile
from .evidence import Evidence, Setting
from .frames import centre_px, pond_to_image
from .ports import Spread, one_by_one
from .refine import Fit, fit
from .values import Float, Int

T = TypeVar("T")

TEACHERS, JUDGES = 40, 16  # snapshots that the profile is learned from, and the channel weights
ROUNDS = 2  # of learning the profile and fitting the poses by it


class Teaching:
    """Snapshots with their poses, as pixels around rods, and the profile that they teach."""

    def __init__(self, setting: Setting) -> None:
        self._setting = setting
        self._reach_px = min(
            1.15 * setting.band.outer_px, 0.49 * setting.layout.pitch / setting.camera.metres_per_pixel
        )

    def learn(
        self,
        evidence: Sequence[Evidence],
        poses: Sequence[Float | None],
        trust: Float,
        kinds: Int,
        axis: Float | None,
        spread: Spread = one_by_one,
    ) -> Profile | None:
        """The radial profile, from the snapshots that are surest, spread evenly.

        Args:
            axis: the weights of the colour channels; where not given, brightness or what shows rods best against the
                light (`appearance.contrast_axis`), whichever leaves poses less uncertain.
        """
        sure = [i for i in range(len(poses)) if poses[i] is not None and trust[i] > 0.9]
        sure = sure or [i for i in range(len(poses)) if poses[i] is not None]
        if not sure:
            return None
        if axis is None:
            axis = self._best_axis(evidence, _spread_evenly(sure, poses, JUDGES), kinds, spread)
        profile, poses_by_it, _ = self._teach(evidence, _spread_evenly(sure, poses, TEACHERS), kinds, axis, spread)
        return self._learned(self._around(evidence, poses_by_it, kinds, axis), axis, profile)

    def _best_axis(self, evidence: Sequence[Evidence], few: dict[int, Float], kinds: Int, spread: Spread) -> Float:
        def judged(by_contrast: bool) -> tuple[float, Float]:
            axis = np.full(3, 1 / np.sqrt(3))
            if by_contrast:
                axis = contrast_axis([self._rings(evidence[i], few[i]) for i in few])
            return self._teach(evidence, few, kinds, axis, one_by_one)[2], axis

        contrast, brightness = spread(judged, (True, False), (), large=True)
        return min(brightness, contrast, key=lambda j: j[0])[1]

    def _teach(
        self, evidence: Sequence[Evidence], first: dict[int, Float], kinds: Int, axis: Float, spread: Spread
    ) -> tuple[Profile, dict[int, Float], float]:
        """The profile through some channel weights, the poses by it, and how uncertain they are (median variance,
        px²)."""
        taught, about = dict(first), centre_px(self._setting.camera)
        profile: Profile | None = None
        for _ in range(ROUNDS):
            around = self._around(evidence, taught, kinds, axis)
            profile = self._learned(around, axis, profile)
            uncertainty = []
            for i, result in zip(around, _fits(list(around.values()), about, profile, spread), strict=True):
                taught[i] = self.moved(taught[i], result.shift)
                covariance = result.variance * max(1.0, result.disagreement) * np.linalg.inv(result.normal)
                uncertainty.append(float(covariance[0, 0] + covariance[1, 1]))
        return _required(profile), taught, float(np.median(uncertainty))

    def _around(
        self, evidence: Sequence[Evidence], poses: dict[int, Float], kinds: Int, axis: Float
    ) -> dict[int, tuple[Patches, Float]]:
        return {i: self.cut(evidence[i], pose, kinds, axis) for i, pose in poses.items()}

    def _learned(self, around: dict[int, tuple[Patches, Float]], axis: Float, before: Profile | None) -> Profile:
        return learn_profile(list(around.values()), self._setting.band.inner_px, self._reach_px, axis, before)

    def cut(self, e: Evidence, pose: Float, kinds: Int, axis: Float, blur_px: float = 0.0) -> tuple[Patches, Float]:
        """The pixels around the rods in view, through the channel weights `axis`, and where the pose puts the rods."""
        camera, reach = self._setting.camera, self._reach_px
        near = self._setting.layout.tree.query_ball_point(
            pose[:2], (np.hypot(camera.width_px, camera.height_px) / 2 + reach) * camera.metres_per_pixel
        )
        rods = np.array(sorted(near), dtype=np.int64)
        centres = pond_to_image(self._setting.layout.centres[rods], pose, camera)
        size = np.array([camera.width_px, camera.height_px])
        seen = ((centres > -0.6 * reach) & (centres < size - 1 + 0.6 * reach)).all(axis=-1)
        grey = np.asarray(cv2.transform(e.snapshot.image.astype(np.float32), axis[None]), dtype=np.float32)
        grey = np.asarray(cv2.GaussianBlur(grey, (0, 0), blur_px), dtype=np.float32) if blur_px else grey
        return cut(grey, centres[seen], kinds[rods[seen]], reach), centres[seen]

    def _rings(self, e: Evidence, pose: Float) -> tuple[Float, Float]:
        """The pixels of all rods in view, each rod's mean taken out, and their radii, for `contrast_axis`."""
        p, centres = self.cut(e, pose, np.zeros(len(self._setting.layout.ids), np.int64), np.eye(3)[0])
        parts, counts = [], np.maximum(np.bincount(p.rod, minlength=len(p.kind)), 1)
        for channel in e.snapshot.image[p.v.astype(np.intp), p.u.astype(np.intp)].T.astype(np.float32, order="C"):
            value = channel - np.float32(channel.mean() if len(channel) else 0)
            parts.append(value - (p.of_rods(value) / counts)[p.rod])
        r = p.off(centres)[2]
        outer = r > 1.15 * self._setting.band.inner_px
        return np.stack(parts, axis=1)[outer], r[outer].astype(np.float64)

    def moved(self, pose: Float, shift: Float) -> Float:
        """The pose after its rods moved by (du, dv) and turned by shift[2], u towards v, in the image."""
        m = self._setting.camera.metres_per_pixel
        theta = pose[2] + shift[2]
        a, b = -shift[0] * m, shift[1] * m
        c, s = np.cos(theta), np.sin(theta)
        return np.array([pose[0] + c * a - s * b, pose[1] + s * a + c * b, theta])


def _fits(around: Sequence[tuple[Patches, Float]], about_px: Float, profile: Profile, spread: Spread) -> list[Fit]:
    return spread(lambda part: fit(*part, about_px, profile, 2), around, ())


def _spread_evenly(index: Sequence[int], poses: Sequence[Float | None], most: int) -> dict[int, Float]:
    chosen = [index[k] for k in np.unique(np.linspace(0, len(index) - 1, most).round().astype(int))]
    return {i: _required(poses[i]) for i in chosen}


def _required(value: T | None) -> T:
    if value is None:
        raise ValueError("a pose or a profile is needed here")
    return value
