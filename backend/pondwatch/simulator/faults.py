"""Ways in which a picture's bytes arrive wrong."""

from __future__ import annotations

from typing import Literal

import numpy as np

Fault = Literal["flipped", "cut", "empty", "noise"]
FAULTS: tuple[Fault, ...] = ("flipped", "cut", "empty", "noise")


def damaged(content: bytes, fault: Fault, rng: np.random.Generator) -> bytes:
    """The bytes with one bit flipped, cut short, gone, or replaced by noise of their length."""
    if fault == "empty" or not content:
        return b""
    if fault == "cut":
        return content[: int(rng.integers(1, max(2, len(content))))]
    if fault == "noise":
        return rng.bytes(len(content))
    broken = bytearray(content)
    broken[int(rng.integers(len(broken)))] ^= 1 << int(rng.integers(8))
    return bytes(broken)
