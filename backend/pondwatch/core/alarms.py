"""Alarms as state machines, by the names of OPC UA Part 9 (Alarms and Conditions). Pure: time is an argument.

A condition is what is wrong now. An alarm is what people are told of it, and what they did about it: it becomes
active once its condition held for a while, and inactive once it was gone for a while, so that a value that flickers
about its limit rings once. What nobody acknowledged, or latched, is retained after its condition is gone.

    active ── acknowledged ── shelved (for a time, or until the next) ── latched ── suppressed ── out of service

Times are seconds since the epoch, UTC. What people do to alarms is in `alarmacts.py`.

Source: OPC 10000-9, UA Part 9, 5.8 (states), 5.8.17 (shelving); ISA-18.2 for the advice that each alarm carries.
"""

from __future__ import annotations

import enum
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

from .errors import Missing

FLOOD = 5  # alarms of a kind, from which they are told as one


class Kind(enum.StrEnum):
    """What an alarm is about."""

    ROD_CHANGED = "rod-changed"
    ROD_CONFLICTING = "rod-conflicting"
    ROBOT_SILENT = "robot-silent"
    COVERAGE_STALE = "coverage-stale"
    CORRECTION_POOR = "correction-poor"
    DISK_LOW = "disk-low"


@dataclass(frozen=True, slots=True)
class Policy:
    """How a kind behaves. severity: 1 to 1000. on_s, off_s: how long its condition must hold, or be gone, first.
    latches: it stays until it is reset, although its condition is gone. advice: what the operator should do."""

    title: str
    severity: int
    advice: str
    on_s: float = 0.0
    off_s: float = 0.0
    latches: bool = False


POLICIES: Mapping[Kind, Policy] = {
    Kind.ROD_CHANGED: Policy(
        "Rod changed",
        900,
        "Open the rod, compare its snapshots with the baseline's, and tell the shift supervisor.",
        on_s=2.0,
        latches=True,
    ),
    Kind.ROD_CONFLICTING: Policy(
        "Rod conflicting",
        600,
        "Open the rod and judge its snapshots; send a robot for another look.",
        on_s=5.0,
        off_s=5.0,
    ),
    Kind.ROBOT_SILENT: Policy(
        "Robot silent",
        500,
        "Look where it was last; check its radio link and battery, then the base station.",
        off_s=2.0,
    ),
    Kind.COVERAGE_STALE: Policy(
        "Coverage stale", 300, "Send a robot where the map says to look next.", on_s=30.0, off_s=30.0
    ),
    Kind.CORRECTION_POOR: Policy(
        "Correction poor",
        400,
        "Do not rely on uncertain places; check the robots' localisation and the water's clarity.",
        on_s=10.0,
        off_s=10.0,
    ),
    Kind.DISK_LOW: Policy(
        "Disk low",
        700,
        "Free room in the data folder, or move it: uploads will be refused when it is full.",
        off_s=60.0,
    ),
}


@dataclass(frozen=True, slots=True, order=True)
class AlarmKey:
    """One alarm: a kind, and what it is about (a rod, a robot; empty for the whole inspection)."""

    kind: Kind
    subject: str = ""


@dataclass(frozen=True, slots=True)
class Comment:
    """What somebody did, and why."""

    at_s: float
    by: str
    act: str
    text: str


@dataclass(frozen=True, slots=True)
class Alarm:
    """The state of one alarm.

    turning_s: since when the condition is otherwise than `active` says; None while they agree. shelved_until_s: end
    of a shelf; infinity for one that lasts until the alarm is next inactive; None where it is not shelved.
    """

    key: AlarmKey
    detail: str = ""
    active: bool = False
    acknowledged: bool = True
    latched: bool = False
    suppressed: bool = False
    out_of_service: bool = False
    shelved_until_s: float | None = None
    since_s: float = 0.0
    turning_s: float | None = None
    occurrences: int = 0
    comments: tuple[Comment, ...] = ()

    @property
    def policy(self) -> Policy:
        """How its kind behaves."""
        return POLICIES[self.key.kind]

    @property
    def retained(self) -> bool:
        """Whether it is still of interest: active, latched, or not acknowledged."""
        return self.active or self.latched or not self.acknowledged

    @property
    def quiet(self) -> bool:
        """Whether it rings nobody: shelved, suppressed or out of service."""
        return self.shelved_until_s is not None or self.suppressed or self.out_of_service

    @property
    def rings(self) -> bool:
        """Whether somebody should act now."""
        return self.retained and not self.quiet and not self.acknowledged


def observe(alarm: Alarm, holds: bool, at_s: float, detail: str = "") -> Alarm:
    """Take that the alarm's condition holds or does not, and that time has passed."""
    alarm = _unshelve_if_due(alarm, at_s)
    if holds and detail and detail != alarm.detail:
        alarm = replace(alarm, detail=detail)
    if holds == alarm.active:
        return alarm if alarm.turning_s is None else replace(alarm, turning_s=None)
    since = at_s if alarm.turning_s is None else alarm.turning_s
    wait = alarm.policy.on_s if holds else alarm.policy.off_s
    if at_s - since < wait:
        return replace(alarm, turning_s=since)
    return _raised(alarm, at_s) if holds else _cleared(alarm, at_s)


@dataclass(frozen=True, slots=True)
class Board:
    """All alarms of an inspection."""

    alarms: Mapping[AlarmKey, Alarm]

    def observe(self, conditions: Mapping[AlarmKey, str], at_s: float) -> Board:
        """Take all conditions that hold now, each with its detail; what is not among them does not hold. What rang
        once is kept, with its count; what never did is dropped when its condition is gone."""
        keys = sorted({*self.alarms, *conditions})
        stepped = [
            observe(self.alarms.get(key) or Alarm(key), key in conditions, at_s, conditions.get(key, ""))
            for key in keys
        ]
        return Board({alarm.key: alarm for alarm in stepped if _is_kept(alarm)})

    def put(self, alarm: Alarm) -> Board:
        """With one alarm replaced."""
        return Board({**self.alarms, alarm.key: alarm})

    def get(self, key: AlarmKey) -> Alarm:
        """Raises: Missing where there is no such alarm."""
        if key not in self.alarms:
            raise Missing("There is no such alarm.", kind="alarm", id=f"{key.kind}/{key.subject}")
        return self.alarms[key]


@dataclass(frozen=True, slots=True)
class Group:
    """Alarms told as one: the worst first. A flood has more than FLOOD of a kind."""

    kind: Kind
    alarms: tuple[Alarm, ...]

    @property
    def is_flood(self) -> bool:
        """Whether they are told as one line."""
        return len(self.alarms) > FLOOD


def grouped(alarms: Iterable[Alarm]) -> tuple[Group, ...]:
    """What is retained and not quiet, by kind: those that ring first, then by severity; in a group the newest first."""
    shown = sorted((a for a in alarms if a.retained and not a.quiet), key=lambda a: (-a.since_s, a.key))
    kinds = sorted(
        {alarm.key.kind for alarm in shown},
        key=lambda kind: (not any(a.rings for a in shown if a.key.kind is kind), -POLICIES[kind].severity),
    )
    return tuple(Group(kind, tuple(a for a in shown if a.key.kind is kind)) for kind in kinds)


def _raised(alarm: Alarm, at_s: float) -> Alarm:
    """A new occurrence asks for a new acknowledgement."""
    return replace(
        alarm,
        active=True,
        acknowledged=False,
        latched=alarm.latched or alarm.policy.latches,
        since_s=at_s,
        turning_s=None,
        occurrences=alarm.occurrences + 1,
    )


def _cleared(alarm: Alarm, at_s: float) -> Alarm:
    until = alarm.shelved_until_s
    return replace(
        alarm, active=False, since_s=at_s, turning_s=None, shelved_until_s=None if until == float("inf") else until
    )


def _unshelve_if_due(alarm: Alarm, at_s: float) -> Alarm:
    due = alarm.shelved_until_s is not None and at_s >= alarm.shelved_until_s
    return replace(alarm, shelved_until_s=None) if due else alarm


def _is_kept(alarm: Alarm) -> bool:
    return alarm.occurrences > 0 or alarm.turning_s is not None
