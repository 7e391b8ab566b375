"""A simulated inspection sent over HTTP, like any base station's."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from pondwatch.basestation.uploader import Item, Uploader, item_of
from pondwatch.core.inspection import inspection_document
from pondwatch.core.values import RobotReport

from .faults import damaged
from .radio import Delivery, RadioSpec, deliveries
from .simulation import Simulation
from .spec import SimulationSpec

DEMO = "Demo inspection"
_RUNNING = ("open", "finishing")


def open_session(simulation: Simulation, uploader: Uploader) -> str:
    """A new session of the simulated inspection; its id. Raises Refused, Unavailable."""
    return uploader.open_session(inspection_document(simulation.inspection))


def arrivals(simulation: Simulation, radio: RadioSpec) -> list[Delivery]:
    """What the radio hands to the base station, in order; by the simulation's seed."""
    spec = simulation.spec
    captured_s = np.arange(spec.snapshots, dtype=np.float64) * spec.capture_interval_s
    return deliveries(captured_s, radio, np.random.default_rng([simulation.seed, 101]))


def items(simulation: Simulation, arriving: list[Delivery]) -> Iterator[Item]:
    """Arrivals as items to send, each made when it is asked for. A damaged one carries the digest of the picture
    that the robot took."""
    rng = np.random.default_rng([simulation.seed, 102])
    for delivery in arriving:
        snapshot = simulation.snapshot(delivery.index)
        item = item_of(snapshot.key, snapshot.captured_at, snapshot.pose_pond, snapshot.content, snapshot.suffix)
        item = replace(item, report=_report(delivery.index / len(arriving), rng))
        yield item if delivery.fault is None else replace(item, content=damaged(item.content, delivery.fault, rng))


def _report(share: float, rng: np.random.Generator) -> RobotReport:
    """What a robot says of itself when `share` of the inspection is over."""
    battery = 0.95 - 0.4 * share - 0.02 * rng.random()
    return RobotReport(round(battery, 2), link_loss=rng.binomial(50, 0.03) / 50)


def demo_spec(number: int, snapshots: int) -> SimulationSpec:
    """The n-th demo: seven robots sweep a printed mock-up of a pond, each in its strip."""
    return SimulationSpec(
        name=f"{DEMO} {number}", snapshots=snapshots, path="sweep", print_colours=True, capture_interval_s=0.05
    )


def next_demo(uploader: Uploader) -> tuple[int, str | None]:
    """The number of the demo to run, and the id of its session where one was cut short: by its number a demo is the
    same again, so it goes on from where it was. Raises Refused, Unavailable."""
    numbers = {}
    for session in uploader.sessions():
        name, _, number = str(session["name"]).rpartition(" ")
        if name == DEMO and number.isdigit():
            numbers[int(number)] = session
    cut_short = [n for n, session in numbers.items() if session["state"] in _RUNNING]
    if cut_short:
        return max(cut_short), str(numbers[max(cut_short)]["id"])
    return max(numbers, default=0) + 1, None
