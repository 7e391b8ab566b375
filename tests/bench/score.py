"""Scores a correction against the truth of its bundle. Only this and tests may read a truth.

Figures: the paper's (mean squared and absolute error and R² of x / width, y / height and theta in radians; IoU of the
union of footprints), and what an operator cares for: the error in snapshot pixels, the share of gross errors, each
footprint's IoU, how honest the reported uncertainties are, and the rods. A snapshot without a pose counts with its
noisy one.
"""

from __future__ import annotations

import csv
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from pondwatch.core.frames import footprint_pond, wrap_angle
from pondwatch.core.inspection import parse_inspection
from pondwatch.core.values import Bool, Float, Inspection

GROSS_PX = 5.0
EMPTY_BELOW, FULL_ABOVE = 0.05, 0.95
Figures = dict[str, Any]


@dataclass(frozen=True, slots=True, eq=False)
class Truth:
    """A bundle with its truth, sorted by sequence. poses, noisy: (N, 3), pond frame. fills: rod to 0..1."""

    inspection: Inspection
    sequences: tuple[int, ...]
    poses: Float
    noisy: Float
    fills: dict[str, float]


@dataclass(frozen=True, slots=True, eq=False)
class Result:
    """What a correction wrote, in the order of a truth's sequences. poses: (N, 3), NaN where there is none."""

    poses: Float
    sigma_xy_m: Float
    statuses: tuple[str, ...]
    rods: dict[str, dict[str, str]]


def read_truth(bundle: Path) -> Truth:
    """A bundle folder that has a truth."""
    inspection = parse_inspection(json.loads((bundle / "session.json").read_text(encoding="utf-8")))
    true, noisy = (_by_sequence(bundle / name) for name in ("truth_poses.csv", "poses.csv"))
    order = tuple(sorted(true))
    rods = bundle / "truth_rods.csv"
    fills = {row["rod_id"]: float(row["fill"]) for row in _rows(rods)} if rods.exists() else {}
    return Truth(inspection, order, _poses(true, order), _poses(noisy, order), fills)


def read_result(result: Path, truth: Truth) -> Result:
    """The folder that `pondwatch correct` wrote."""
    found = _by_sequence(result / "poses.csv")
    sigma = np.array([float(found.get(s, {}).get("sigma_xy_m") or "nan") for s in truth.sequences])
    statuses = tuple(found.get(s, {}).get("status", "rejected") for s in truth.sequences)
    rods = result / "rods.csv"
    read = {row["rod_id"]: row for row in _rows(rods)} if rods.exists() else {}
    return Result(_poses(found, truth.sequences), sigma, statuses, read)


def identity(truth: Truth) -> Result:
    """The poses as they came, for the row that every other is shown beside."""
    n = len(truth.sequences)
    return Result(truth.noisy, np.full(n, np.nan), ("placed",) * n, {})


def score(truth: Truth, result: Result) -> Figures:
    """Every figure; None where there is nothing to tell."""
    placed: Bool = np.isfinite(result.poses[:, 0])
    poses = np.where(placed[:, None], result.poses, truth.noisy)
    return {
        "snapshots": len(truth.sequences),
        "placed": float(placed.mean()),
        **_paper(truth, poses),
        **_pixels(truth, poses),
        **_footprints(truth, poses),
        **_honesty(truth, poses, result, placed),
        **_aligned(truth, poses[placed], placed),
        **(_rods(truth, result.rods) if truth.fills and result.rods else {}),
    }


def error_px(truth: Truth, poses: Float) -> Float:
    """(N,), px of a snapshot: how far each centre is from the truth."""
    offset: Float = np.linalg.norm(poses[:, :2] - truth.poses[:, :2], axis=1)
    return offset / truth.inspection.camera.metres_per_pixel


def _paper(truth: Truth, poses: Float) -> Figures:
    error = poses - truth.poses
    error[:, 2] = wrap_angle(error[:, 2])
    pond = truth.inspection.pond
    unit = np.array([pond.width_m, pond.height_m, 1.0])
    error, true = error / unit, truth.poses / unit
    spread = np.square(true - true.mean(axis=0)).sum(axis=0)
    return {
        "mse": np.square(error).mean(axis=0).tolist(),
        "mae": np.abs(error).mean(axis=0).tolist(),
        "r2": (1 - np.square(error).sum(axis=0) / spread).tolist(),
    }


def _pixels(truth: Truth, poses: Float) -> Figures:
    px = error_px(truth, poses)
    turn = np.abs(wrap_angle(poses[:, 2] - truth.poses[:, 2]))
    return {
        "median_px": float(np.median(px)),
        "p95_px": float(np.percentile(px, 95)),
        "gross": float((px > GROSS_PX).mean()),
        "theta_median_rad": float(np.median(turn)),
    }


def _footprints(truth: Truth, poses: Float) -> Figures:
    pairs = [_pair_iou(truth.inspection, a, b) for a, b in zip(poses, truth.poses, strict=True)]
    a, b = (_union(truth.inspection, p) for p in (poses, truth.poses))
    return {"iou_union": float((a & b).sum() / max(1, (a | b).sum())), "iou_footprint": float(np.mean(pairs))}


def _pair_iou(inspection: Inspection, a: Float, b: Float) -> float:
    scale = inspection.camera.metres_per_pixel
    first, second = ((footprint_pond(p, inspection.camera) / scale).astype(np.float32) for p in (a, b))
    shared, _ = cv2.intersectConvexConvex(first, second)
    return float(shared / (2 * cv2.contourArea(first) - shared))


def _union(inspection: Inspection, poses: Float) -> Bool:
    """Which pixels of the pond some footprint covers."""
    scale, pond = inspection.camera.metres_per_pixel, inspection.pond
    mask = np.zeros((round(pond.height_m / scale), round(pond.width_m / scale)), np.uint8)
    for pose in poses:
        corners = footprint_pond(pose, inspection.camera)
        corners[:, 1] = pond.height_m - corners[:, 1]
        cv2.fillConvexPoly(mask, np.round(corners / scale * 16).astype(np.int32), 1, cv2.LINE_8, 4)
    return mask.astype(bool)


def _honesty(truth: Truth, poses: Float, result: Result, placed: Bool) -> Figures:
    px = error_px(truth, poses)
    sure = placed & (np.array(result.statuses) == "placed")
    sigma_px = result.sigma_xy_m / truth.inspection.camera.metres_per_pixel
    told = sure & np.isfinite(sigma_px) & (sigma_px > 0)
    within = px[told] <= 3 * np.sqrt(2) * sigma_px[told]
    return {
        "sure": float(sure.mean()),
        "gross_among_sure": float((px[sure] > GROSS_PX).mean()) if sure.any() else None,
        "within_3_sigma": float(within.mean()) if told.any() else None,
    }


def _aligned(truth: Truth, poses: Float, placed: Bool) -> Figures:
    """After one best rigid motion of all, fitted again on what the last fit leaves close: for ponds without a layout,
    whose frame only the noisy poses know."""
    if not placed.any():
        return {"median_px_aligned": None, "gross_aligned": None}
    a, b = poses[:, :2], truth.poses[placed, :2]
    keep = np.ones(len(a), bool)
    left_px = np.full(len(a), np.nan)
    for _ in range(10 if len(a) > 1 else 0):
        centre_a, centre_b = a[keep].mean(axis=0), b[keep].mean(axis=0)
        u, _, vt = np.linalg.svd((a[keep] - centre_a).T @ (b[keep] - centre_b))
        turn = vt.T @ np.diag([1.0, np.sign(np.linalg.det(vt.T @ u.T))]) @ u.T
        moved = (a - centre_a) @ turn.T + centre_b
        left_px = np.linalg.norm(moved - b, axis=1) / truth.inspection.camera.metres_per_pixel
        keep = left_px <= max(GROSS_PX, 3 * float(np.median(left_px)))
    return {"median_px_aligned": float(np.median(left_px)), "gross_aligned": float((left_px > GROSS_PX).mean())}


def _rods(truth: Truth, read: dict[str, dict[str, str]]) -> Figures:
    views = _views(truth)
    seen = [rod for rod in truth.fills if views[rod] > 0]
    right = [read.get(rod, {}).get("state") == state_of(truth.fills[rod]) for rod in seen]
    told = [rod for rod in seen if read.get(rod, {}).get("fill")]
    off = [abs(float(read[rod]["fill"]) - truth.fills[rod]) for rod in told]
    made_up = [rod for rod in truth.fills if not views[rod] and read.get(rod, {}).get("state", "unseen") != "unseen"]
    return {
        "rods_visible": len(seen),
        "rod_state_accuracy": float(np.mean(right)) if right else None,
        "rod_fill_mae": float(np.mean(off)) if off else None,
        "rods_read_though_never_visible": len(made_up),
    }


def state_of(fill: float) -> str:
    """The state that a fill from 0 to 1 is called by."""
    return "empty" if fill < EMPTY_BELOW else "full" if fill > FULL_ABOVE else "partial"


def _views(truth: Truth) -> dict[str, int]:
    """Rod to the number of true footprints that its outer circle lies inside."""
    camera = truth.inspection.camera
    half = np.array([camera.width_px, camera.height_px]) * camera.metres_per_pixel / 2
    c, s = np.cos(truth.poses[:, 2]), np.sin(truth.poses[:, 2])
    views = {}
    for rod in truth.inspection.pond.rods:
        dx, dy = rod.x_m - truth.poses[:, 0], rod.y_m - truth.poses[:, 1]
        inside = np.abs(np.stack([c * dx + s * dy, c * dy - s * dx], axis=1)) < half - rod.outer_radius_m
        views[rod.id] = int(inside.all(axis=1).sum())
    return views


def _rows(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def _by_sequence(path: Path) -> dict[int, dict[str, str]]:
    return {int(row["sequence"]): row for row in _rows(path)}


def _poses(rows: dict[int, dict[str, str]], order: tuple[int, ...]) -> Float:
    names = ("x_m", "y_m", "theta_rad")
    return np.array([[float(rows.get(s, {}).get(name) or "nan") for name in names] for s in order])
