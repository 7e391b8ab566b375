"""The learned finder of rods, run by onnxruntime on one thread. See `core.rodsight` and `models/rods/CARD.md`."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pondwatch.core.errors import Unavailable
from pondwatch.core.rodsight import CANONICAL_PX, CHANNELS, STRIDE, RodsSeen, look, read
from pondwatch.core.values import Image
from pondwatch.resources import models_dir

CONTRACT = {"canonical_px": CANONICAL_PX, "stride": STRIDE, "channels": list(CHANNELS)}


@dataclass(frozen=True, slots=True, eq=False)
class OnnxRodFinder:
    """Implements `core.ports.RodFinder`. digest: SHA-256 of the network's file."""

    session: Any
    digest: str

    @classmethod
    def of(cls, folder: Path | None = None) -> OnnxRodFinder:
        """The network that comes with Pondwatch, or that of a folder with `rods.onnx` and `rods.json`.

        Raises:
            Unavailable: a file is missing or cannot be read, the network is not the one that `rods.json` describes,
                or it was made for another input.
        """
        import onnxruntime as ort

        folder = folder or models_dir() / "rods"
        try:
            content = (folder / "rods.onnx").read_bytes()
            told = json.loads((folder / "rods.json").read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise Unavailable(f"The network that finds rods cannot be read: {error}") from error
        digest = hashlib.sha256(content).hexdigest()
        if digest != told.get("sha256"):
            raise Unavailable(
                f"{folder / 'rods.onnx'} is not the file that rods.json describes: its SHA-256 is {digest}."
            )
        if differs := {k: told.get(k) for k, v in CONTRACT.items() if told.get(k) != v}:
            raise Unavailable(f"{folder / 'rods.onnx'} was made for another input: {differs}.")
        options = ort.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        return cls(ort.InferenceSession(content, options, providers=["CPUExecutionProvider"]), digest)

    def __call__(self, image: Image, outer_px: float) -> RodsSeen:
        """See `core.ports.RodFinder`."""
        sight = look(image, outer_px)
        answer = self.session.run(None, {"planes": sight.planes[None]})[0]
        return read(np.asarray(answer[0], np.float32), sight)
