"""A decided place to a refined pose with its covariance, and to looks at rods."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from . import states
from .appearance import FILLED, HOLLOW, OTHER, Profile
from .codes import SECTORS, read_codes
from .decision import Vocabulary
from .evidence import Evidence, Setting
from .fill import wholly_in_view
from .frames import centre_px, image_to_pond, pond_to_image, wrap_angle
from .hypotheses import describe, explained, one_rod, precision
from .noise import UNKNOWN_HEADING, NoiseModel
from .observe import RodsFound, find_rods
from .refine import FLOOR_PX, Fit, fit
from .rodbook import Entry
from .teaching import Teaching
from .values import Camera, CorrectedPose, Float, Int, Status

FOCUS_PX = 2.0  # blur of a first fit from afar
STRAY_PX = 2.5  # a refinement that moves further than this is not believed
STRAY_PX_TURNED = 5.0  # the same of one from a heading that is one of several, up to half their distance off
LEAST_BELIEF = 0.05  # of a place, from which its looks count
ROUGH_PX = 2.0  # one sigma of a pose that the pixels did not bear out
UNFITTED_TRUST = 0.9  # of its place, at most
ROUGH_RAD = 0.01
LOOSE_PX = 0.5  # one sigma of a fit, above which its pixels do not fix a pose
TURN_RAD = 0.05  # between the headings that a fit is started from where one rod alone is seen well
INDEPENDENT_PIXELS = 60  # of a rod: its residuals go together
UNEXPLAINED = 3.0  # times the least variance: what pixels would cost a fit that leaves their rods out
ABSENT = 6.0  # log of the same, for a rod that is not there
RIVAL_NATS, RIVAL_PX = 4.0, 2.0  # another fit this likely, this far away, leaves a place in doubt
MODEL_INFLATION = 3.0  # of the covariance: what is common to all rods of a snapshot does not show in their spread


@dataclass(frozen=True, slots=True, eq=False)
class Placed:
    """A snapshot at its place. pose: (3,) or None. covariance: (3, 3), m and rad. trust: probability of the place.
    rods: (K,), wholly in view. ratio: (K, SECTORS, 3), their sectors, image orientation. residual: rms, grey
    levels, or NaN. start: the pose refined from. fitted: whether the pixels bore it out. hasty: by one start alone.
    others: its looks from the other places where it may lie."""

    evidence: Evidence
    pose: Float | None
    covariance: Float | None
    trust: float
    rods: Int
    ratio: Float
    residual: float
    start: Float | None = None
    fitted: bool = False
    hasty: bool = False
    others: tuple[Entry, ...] = ()


class Placing:
    """Refinement in one setting. teaching: what its rods look like."""

    def __init__(self, setting: Setting) -> None:
        self._setting, self.teaching = setting, Teaching(setting)

    def kinds(self, vocabulary: Vocabulary, state: Float) -> Int:
        """(R,): which profile each rod follows."""
        kind = np.full(len(state), OTHER, dtype=np.int64)
        kind[state[:, list(vocabulary.states).index(states.EMPTY)] > 0.9] = HOLLOW
        kind[state[:, list(vocabulary.states).index(states.FULL)] > 0.9] = FILLED
        return kind

    def place(
        self,
        e: Evidence,
        pose: Float | None,
        trust: float,
        kinds: Int,
        profile: Profile | None,
        noise: NoiseModel,
        hasty: bool = False,
    ) -> Placed:
        """Refine a pose; where the pixels do not bear it, keep that of the rod centres and say so.

        Args:
            hasty: from this pose alone, also where other headings are possible: for one that is in doubt anyway.
        """
        if pose is None:
            return Placed(e, None, None, trust, np.zeros(0, np.int64), np.zeros((0, SECTORS, 3)), float("nan"))
        m = self._setting.camera.metres_per_pixel
        rough = np.diag([(ROUGH_PX * m) ** 2, (ROUGH_PX * m) ** 2, ROUGH_RAD**2])
        refined, covariance, residual, fitted = pose, rough, float("nan"), False
        best = self._best_fit(e, pose, kinds, profile, noise, hasty) if profile is not None else None
        if best is not None:
            refined, result, alone = best
            inflation = MODEL_INFLATION * max(1.0, result.disagreement) * (1 + 2 / result.whole)
            variance = inflation * result.variance
            normal = result.normal + np.diag([0, 0, variance / noise.sigma_theta_rad**2])
            covariance = self._covariance(normal, variance, refined[2])
            residual, fitted = float(np.sqrt(result.variance)), alone and result.absent < 0.6
        trust = trust if fitted else min(trust, UNFITTED_TRUST)
        rods, ratio = self._looks(e, refined)
        return Placed(e, refined, covariance, trust, rods, ratio, residual, pose, fitted, hasty)

    def _best_fit(
        self, e: Evidence, pose: Float, kinds: Int, profile: Profile, noise: NoiseModel, hasty: bool
    ) -> tuple[Float, Fit, bool] | None:
        """The likeliest fit, of one start where the rods found fix the heading, of several where not; and whether its
        pixels fix its pose, and no other that lies elsewhere is nearly as likely."""
        about, m = centre_px(self._setting.camera), self._setting.camera.metres_per_pixel
        prior, found = e.snapshot.pose_pond, list[tuple[Float, Fit]]()
        rods = explained(e.found, pose, self._setting.layout, self._setting.camera)  # the others fix no heading
        several = starts(pose, prior, rods, self._setting.camera, noise)
        for start in several[-1:] if hasty else several:
            if len(several) > 1:
                start = self._focused(e, start, kinds, profile)
            patches, centres = self.teaching.cut(e, start, kinds, profile.axis)
            if not len(centres):
                continue
            result = fit(patches, centres, about, profile, 4)
            if np.hypot(*result.shift[:2]) < (STRAY_PX if len(several) == 1 else STRAY_PX_TURNED):
                found.append((self.teaching.moved(start, result.shift), result))
        if not found:
            return None
        least = min(r.variance for _, r in found)
        geometry = self._geometry(e, [at for at, _ in found])
        cost = [
            0.5 * INDEPENDENT_PIXELS * (r.whole * np.log(r.variance / least / UNEXPLAINED) + r.absent * ABSENT)
            - noise.log_density(at, prior)
            - g
            for (at, r), g in zip(found, geometry, strict=True)
        ]
        best = int(np.argmin(cost))
        at, result = found[best]
        away = [np.hypot(*(other - at)[:2]) > RIVAL_PX * m for other, _ in found]
        alone = not any(c < cost[best] + RIVAL_NATS for c, far in zip(cost, away, strict=True) if far)
        return at, result, alone and _sigma_px(result) < LOOSE_PX and (not hasty or len(several) == 1)

    def _geometry(self, e: Evidence, poses: list[Float]) -> Float:
        """Nats against each of several poses, for rods missing or unexplained; nothing where there is one only."""
        if len(poses) == 1:
            return np.zeros(1)
        found = find_rods(e.snapshot.image, self._setting.band, self._setting.finder)
        return describe(np.array(poses), found, self._setting.layout, self._setting.camera).geometry

    def _focused(self, e: Evidence, pose: Float, kinds: Int, profile: Profile) -> Float:
        """A first fit, out of focus, which reaches further; the pose as it was where it strays."""
        patches, centres = self.teaching.cut(e, pose, kinds, profile.axis, FOCUS_PX)
        if not len(centres):
            return pose
        shift = fit(patches, centres, centre_px(self._setting.camera), profile.blurred(FOCUS_PX), 4).shift
        return self.teaching.moved(pose, shift) if np.hypot(*shift[:2]) < 3 * STRAY_PX else pose

    def corrected(self, p: Placed, threshold: float, noise: NoiseModel) -> CorrectedPose:
        """With its status. A snapshot that shows no rod keeps its noisy pose, as uncertain as that is."""
        key = p.evidence.snapshot.key
        odds = float(np.log(max(p.trust, 1e-12)) - np.log(max(1 - p.trust, 1e-12)))
        wide = np.diag([noise.sigma_xy_m**2, noise.sigma_xy_m**2, noise.sigma_theta_rad**2])
        if p.pose is None or p.covariance is None:
            return CorrectedPose(key, p.evidence.snapshot.pose_pond, wide, Status.UNCERTAIN, min(odds, 0.0))
        if p.trust > threshold:
            return CorrectedPose(key, p.pose, p.covariance, Status.PLACED, odds)
        return CorrectedPose(key, p.pose, p.covariance + (1 - p.trust) * wide, Status.UNCERTAIN, odds)

    def _looks(self, e: Evidence, pose: Float) -> tuple[Int, Float]:
        camera, band = self._setting.camera, self._setting.band
        reach_m = np.hypot(camera.width_px, camera.height_px) / 2 * camera.metres_per_pixel
        near = np.array(sorted(self._setting.layout.tree.query_ball_point(pose[:2], reach_m)), dtype=np.int64)
        centres = pond_to_image(self._setting.layout.centres[near], pose, camera)
        whole = wholly_in_view(centres, band.outer_px, camera.width_px, camera.height_px)
        codes = read_codes(e.snapshot.image, centres[whole], band.inner_px, band.outer_px, camera)
        return near[whole], codes.ratio

    def _covariance(self, normal: Float, variance: float, theta: float) -> Float:
        m = self._setting.camera.metres_per_pixel
        c, s = np.cos(theta), np.sin(theta)
        to_pond = np.array([[-c * m, -s * m, 0], [-s * m, c * m, 0], [0, 0, 1]])
        arm = 0.5 * np.hypot(self._setting.camera.width_px, self._setting.camera.height_px)
        floor = np.diag([(FLOOR_PX * m) ** 2, (FLOOR_PX * m) ** 2, (FLOOR_PX / arm) ** 2])
        return np.asarray(to_pond @ (variance * np.linalg.inv(normal)) @ to_pond.T + floor)


def doubted(p: Placed, residual_limit: float) -> Placed:
    """The same; where its pixels misfit by more than the limit, with less trust in its place."""
    return replace(p, trust=min(p.trust, UNFITTED_TRUST)) if p.residual > residual_limit else p


def elsewhere(e: Evidence, belief: Float, chosen: int, setting: Setting) -> tuple[Entry, ...]:
    """The looks of a doubtful snapshot from its other places (belief: (H,)), those too unlikely left out."""
    entries = []
    for h in np.flatnonzero(belief[: len(e.places)] >= LEAST_BELIEF):
        if h != chosen:
            whole = wholly_in_view(
                e.places.centres_px[h], setting.band.outer_px, setting.camera.width_px, setting.camera.height_px
            )
            whole = whole & e.places.real[h] & (e.site[h] >= 0)
            ratio = e.codes.ratio[e.site[h][whole]]
            entries.append(Entry(e.places.rods[h][whole], ratio, float(e.places.poses[h, 2]), float(belief[h])))
    return tuple(entries)


def starts(pose: Float, prior: Float, found: RodsFound, camera: Camera, noise: NoiseModel) -> list[Float]:
    """Poses to refine from. One, where two rods or more were found precisely; where one, turned about it as far as the
    noisy heading may be off, the pose itself last."""
    weight = precision(found)
    if not len(weight) or not one_rod(found):
        return [pose]
    pivot = image_to_pond(found.centres_px[int(np.argmax(weight))], pose, camera)
    reach = min(3 * noise.sigma_theta_rad, np.pi / 6)
    middle = pose[2] if noise.sigma_theta_rad > UNKNOWN_HEADING else prior[2]
    headings = middle + np.linspace(-reach, reach, 2 * int(np.ceil(reach / TURN_RAD)) + 1)
    turn = np.append(wrap_angle(headings - pose[2]), 0.0)
    c, s, d = np.cos(turn), np.sin(turn), pose[:2] - pivot
    x, y = pivot[0] + c * d[0] - s * d[1], pivot[1] + s * d[0] + c * d[1]
    return list(np.stack([x, y, pose[2] + turn], axis=1))


def _sigma_px(fitted: Fit) -> float:
    """Of the image's centre, by the pixels alone: great where one round rod is all they show, and any turn fits."""
    return float(np.sqrt(np.trace(fitted.variance * np.linalg.inv(fitted.normal)[:2, :2])))
