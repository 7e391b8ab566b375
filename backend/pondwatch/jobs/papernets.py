"""The networks of arXiv 2503.02752 as correction methods, run by onnxruntime; and every method by its name.

The networks predict the poses of exactly 221 snapshots at once and read no rods. Until the last correction of a session
its poses stand as they came, as `uncertain`; so they do after it, since a network says nothing of its own error. Each
ONNX file carries its contract as JSON in its metadata: `canvas` ("mask", "stitched" or null), `canvas_px`,
`snapshot_px`, and `rmse`, its error on ponds that it was not trained on, x by width, y by height, theta rad.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from pondwatch.core import corrector as core
from pondwatch.core.errors import Invalid, Unavailable
from pondwatch.core.frames import wrap_angle
from pondwatch.core.paperinputs import (
    CANVAS_PX,
    COUNT,
    binarised,
    covered,
    denormalised,
    grey_stack,
    normalised,
    smaller,
    stitched,
    tile_size,
)
from pondwatch.core.ports import Spread, one_by_one
from pondwatch.core.values import (
    CorrectedPose,
    Correction,
    Float,
    Float32,
    Inspection,
    Quality,
    RodReading,
    RodState,
    Snapshot,
    SnapshotKey,
    Status,
)
from pondwatch.resources import models_dir

from .methods import LEARNED_METHOD, PAPER_METHODS
from .rodfinder import OnnxRodFinder

METHODS = (*core.METHODS, LEARNED_METHOD, *PAPER_METHODS)
CAMERA_PX = (160, 110)


class Network(Protocol):
    """A network as it is run."""

    @property
    def contract(self) -> Mapping[str, Any]:
        """What its file says of it."""

    def __call__(self, inputs: Mapping[str, Float32]) -> Float32:
        """`coordinates` (1, 221, 3), `snapshots` (1, 221, h, w) and `canvas` (1, 1, s, s), of which it takes what it
        needs, to (1, 221, 3)."""


NetworkFactory = Callable[[str], Network]


@dataclass(frozen=True, slots=True, eq=False)
class OnnxNetwork:
    """A network in onnxruntime, on one thread."""

    session: Any
    contract: Mapping[str, Any]

    @classmethod
    def of(cls, method: str, folder: Path | None = None) -> OnnxNetwork:
        """The network of a method.

        Raises:
            Unavailable: its file is not there or cannot be read.
        """
        import onnxruntime as ort

        path = (folder or models_dir() / "paper") / f"{method}.onnx"
        options = ort.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        try:
            session = ort.InferenceSession(path.read_bytes(), options, providers=["CPUExecutionProvider"])
            contract = json.loads(session.get_modelmeta().custom_metadata_map["contract"])
        except Exception as error:  # a border: onnxruntime names its errors by no one class
            raise Unavailable(f"The network of {method} cannot be used: {path.name}: {error}") from error
        return cls(session, contract)

    def __call__(self, inputs: Mapping[str, Float32]) -> Float32:
        """See `Network`."""
        wanted = {i.name: inputs[i.name] for i in self.session.get_inputs()}
        return np.asarray(self.session.run(None, wanted)[0], np.float32)


class PaperCorrector:
    """Corrects a session of exactly 221 snapshots by one of the paper's networks.

    Raises:
        Invalid: there is no such network, or the camera is not the one that they are built for.
    """

    def __init__(self, inspection: Inspection, method: str, network: NetworkFactory | None = None) -> None:
        if method not in PAPER_METHODS:
            raise Invalid(f"There is no network {method!r}; there are {', '.join(PAPER_METHODS)}.", method=method)
        camera = inspection.camera
        if (camera.width_px, camera.height_px) != CAMERA_PX:
            raise Invalid(
                f"{method} is built for snapshots of {CAMERA_PX[0]} x {CAMERA_PX[1]} pixels; this camera takes "
                f"{camera.width_px} x {camera.height_px}.",
                method=method,
            )
        self.method = method
        self._inspection, self._factory = inspection, network or OnnxNetwork.of
        self._snapshots: dict[SnapshotKey, Snapshot] = {}
        self._poses: dict[SnapshotKey, CorrectedPose] = {}
        self._settled = False

    def add(self, snapshots: Sequence[Snapshot]) -> Correction:
        """Every new snapshot where its pose says, as `uncertain`."""
        noise = self._inspection.pose_noise
        sigma = (noise.sigma_xy_m, noise.sigma_xy_m, noise.sigma_theta_rad) if noise else (0.0, 0.0, 0.0)
        covariance = np.diag(np.square(sigma))
        new = tuple(CorrectedPose(s.key, s.pose_pond, covariance, Status.UNCERTAIN) for s in snapshots)
        self._snapshots.update({s.key: s for s in snapshots})
        self._poses.update({p.key: p for p in new})
        self._settled = False
        return Correction(new, (), self.quality())

    def settle(self) -> Correction:
        """Ask the network.

        Raises:
            Invalid: there are not exactly 221 snapshots. Unavailable: the network's file cannot be used.
        """
        if len(self._snapshots) != COUNT:
            raise Invalid(
                f"{self.method} is built for exactly {COUNT} snapshots; this session has {len(self._snapshots)} that "
                "can be used. Choose another method, as `auto`.",
                method=self.method,
                snapshots=len(self._snapshots),
            )
        taken = sorted(self._snapshots.values(), key=lambda s: (s.key.sequence, s.key))
        network = self._factory(self.method)
        predicted = self._predicted(taken, network)
        covariance = np.diag(np.square(denormalised(np.array(network.contract["rmse"]), self._inspection.pond)))
        new = tuple(
            CorrectedPose(s.key, pose, covariance, Status.UNCERTAIN) for s, pose in zip(taken, predicted, strict=True)
        )
        self._poses = {p.key: p for p in new}
        self._settled = True
        return Correction(new, (), self.quality())

    def poses(self) -> Mapping[SnapshotKey, CorrectedPose]:
        """Every pose as it stands."""
        return self._poses

    def rods(self) -> tuple[RodReading, ...]:
        """All unseen: the networks read none."""
        return tuple(RodReading(r.id, RodState.UNSEEN, None, 0.0, 0) for r in self._inspection.pond.rods)

    def quality(self) -> Quality:
        """Counts, and whose word it is."""
        n = len(self._poses)
        if self._settled:
            sentence = f"{n} snapshots lie where the network {self.method} puts them; it says nothing of its error."
        else:
            sentence = f"{n} of {COUNT} snapshots lie where their robots said; {self.method} corrects all at the end."
        return Quality(n, 0, n, 0, sentence=sentence)

    def _predicted(self, taken: Sequence[Snapshot], network: Network) -> Float:
        inspection = self._inspection
        noisy = np.stack([s.pose_pond for s in taken])
        inputs = network_inputs([s.image for s in taken], noisy, inspection, network.contract)
        poses = denormalised(network(inputs)[0].astype(np.float64), inspection.pond)
        poses[:, 2] = wrap_angle(poses[:, 2])
        return poses


def network_inputs(
    images: Sequence[np.ndarray], noisy_pond: Float, inspection: Inspection, contract: Mapping[str, Any]
) -> dict[str, Float32]:
    """What a network looks at.

    Args:
        images: 221 of (110, 160, 3), BGR. noisy_pond: (221, 3), m, m, rad.
    """
    camera, pond = inspection.camera, inspection.pond
    inputs = {"coordinates": normalised(noisy_pond, pond).astype(np.float32)[None]}
    if contract["snapshot_px"] is None:
        return inputs
    grey = grey_stack(images)
    inputs["snapshots"] = binarised(grey, tuple(contract["snapshot_px"]))[None]
    if contract["canvas"] == "mask":
        inputs["canvas"] = smaller(covered(noisy_pond, camera, pond), contract["canvas_px"])[None, None]
    elif contract["canvas"] == "stitched":
        tiles = binarised(grey, tile_size(camera, pond, CANVAS_PX))
        inputs["canvas"] = smaller(stitched(tiles, noisy_pond, camera, pond), contract["canvas_px"])[None, None]
    return inputs


def make_corrector(inspection: Inspection, method: str = "auto", spread: Spread = one_by_one) -> core.Corrector:
    """A corrector by name, the networks among them.

    Raises:
        Invalid: there is no such method, or the session does not have what it needs. Unavailable: a network's file
            cannot be used.
    """
    if method in PAPER_METHODS:
        return PaperCorrector(inspection, method)
    if method == LEARNED_METHOD:
        corrector = core.make_corrector(inspection, "lattice", OnnxRodFinder.of())
        corrector.method = method
        return corrector
    if method not in METHODS:
        raise Invalid(f"There is no correction method {method!r}; there are {', '.join(METHODS)}.", method=method)
    return core.make_corrector(inspection, method, spread=spread)
