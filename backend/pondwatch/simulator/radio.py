"""The radio between robots and base station: late, out of order, twice, and now and then broken."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pondwatch.core.values import Float

from .faults import FAULTS, Fault

_RESEND_S = 1.5  # after which a lost picture is sent again


@dataclass(frozen=True, slots=True, kw_only=True)
class RadioSpec:
    """loss: share of pictures that must be sent again; delay_s: mean of the random delay of each; twice: share that
    arrives twice; broken: share that arrives damaged first, and whole later."""

    loss: float = 0.0
    delay_s: float = 0.0
    twice: float = 0.0
    broken: float = 0.0


@dataclass(frozen=True, slots=True, order=True)
class Delivery:
    """When a snapshot arrives, seconds; which one; and what is wrong with its bytes."""

    at_s: float
    index: int
    fault: Fault | None = None


def deliveries(captured_s: Float, radio: RadioSpec, rng: np.random.Generator) -> list[Delivery]:
    """Every arrival in order of time. Each snapshot arrives whole at least once."""
    out = []
    for index, start in enumerate(captured_s):
        at = float(start)
        while rng.random() < min(radio.loss, 0.9):
            at += _RESEND_S
        at += float(rng.exponential(radio.delay_s)) if radio.delay_s else 0.0
        out.append(Delivery(at, index))
        if rng.random() < radio.twice:
            out.append(Delivery(at + float(rng.exponential(_RESEND_S)), index))
        if rng.random() < radio.broken:
            out.append(Delivery(at - 0.001, index, FAULTS[int(rng.integers(len(FAULTS)))]))
    return sorted(out, key=lambda delivery: (delivery.at_s, delivery.index))
