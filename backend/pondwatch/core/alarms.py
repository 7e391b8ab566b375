"""Alarms as state machines, by the names of OPC UA Part 9 (Alarms and Conditions). Pure: time is an argument.

A condition is what is wrong now. An alarm is what people are told of it, and what they did about it: it becomes
active once its condition held for a while, and inactive once it was gone for a while, so that a value that flickers
about its limit rings once. What nobody acknowledged, or latched, is retained after its condition is gone.

    active ── acknowledged ── shelved (for a time, or until the next) ── latched ── suppressed ── out of service

Times are seconds since the epoch, UTC. Every act returns a new value; an act that makes no sense is a Conflict.

Source: OPC 10000-9, UA Part 9, 5.8 (states), 5.8.17 (shelving); ISA-18.2 for the advice that each alarm carries.
"""

from __future__ import annotations

import enum
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

from .errors import Conflict, Invalid, Missing

MOST_SHELVED_S = 8 * 3600.0
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
        "Rod changed against the baseline",
        900,
        "Open the rod, compare its snapshots with the baseline's, and tell the shift supervisor.",
        latches=True,
    ),
    Kind.ROD_CONFLICTING: Policy(
        "Looks at a rod disagree",
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
    if holds and detail:
        alarm = replace(alarm, detail=detail)
    if holds == alarm.active:
        return replace(alarm, turning_s=None)
    since = at_s if alarm.turning_s is None else alarm.turning_s
    wait = alarm.policy.on_s if holds else alarm.policy.off_s
    if at_s - since < wait:
        return replace(alarm, turning_s=since)
    return _raised(alarm, at_s) if holds else _cleared(alarm, at_s)


def acknowledge(alarm: Alarm, by: str, text: str, at_s: float) -> Alarm:
    """Somebody has seen it. Raises: Invalid without a comment, Conflict where there is nothing to acknowledge."""
    if alarm.acknowledged:
        raise Conflict("This alarm is acknowledged already.", kind=alarm.key.kind, subject=alarm.key.subject)
    return replace(_said(alarm, by, "acknowledge", text, at_s), acknowledged=True)


def shelve(alarm: Alarm, by: str, text: str, at_s: float, for_s: float | None) -> Alarm:
    """Out of the way for a time, or (None) until it is next inactive.

    Raises:
        Invalid: without a comment, or for longer than MOST_SHELVED_S. Conflict: it is shelved, or of no interest.
    """
    if for_s is not None and not 0 < for_s <= MOST_SHELVED_S:
        raise Invalid(f"An alarm is shelved for up to {MOST_SHELVED_S / 3600:.0f} hours.", for_s=for_s)
    if alarm.shelved_until_s is not None or not alarm.retained:
        raise Conflict("This alarm is shelved already, or there is nothing to shelve.", kind=alarm.key.kind)
    until = float("inf") if for_s is None else at_s + for_s
    return replace(_said(alarm, by, "shelve", text, at_s), shelved_until_s=until)


def unshelve(alarm: Alarm, by: str, text: str, at_s: float) -> Alarm:
    """Back in sight. Raises: Conflict where it is not shelved."""
    if alarm.shelved_until_s is None:
        raise Conflict("This alarm is not shelved.", kind=alarm.key.kind)
    return replace(_said(alarm, by, "unshelve", text, at_s), shelved_until_s=None)


def reset(alarm: Alarm, by: str, text: str, at_s: float) -> Alarm:
    """Let go of the latch. Raises: Conflict while it is active, not acknowledged, or not latched."""
    if not alarm.latched or alarm.active or not alarm.acknowledged:
        raise Conflict("Only a latched alarm that is inactive and acknowledged can be reset.", kind=alarm.key.kind)
    return replace(_said(alarm, by, "reset", text, at_s), latched=False)


def suppress(alarm: Alarm, is_suppressed: bool) -> Alarm:
    """By the program, where another fact explains it (a robot that is charging is silent)."""
    return replace(alarm, suppressed=is_suppressed)


def set_in_service(alarm: Alarm, is_in_service: bool, by: str, text: str, at_s: float) -> Alarm:
    """By a person, while what it watches is being mended. Raises: Conflict where it is so already."""
    if alarm.out_of_service is not is_in_service:
        raise Conflict("This alarm is in that state already.", kind=alarm.key.kind)
    act = "return to service" if is_in_service else "remove from service"
    return replace(_said(alarm, by, act, text, at_s), out_of_service=not is_in_service)


@dataclass(frozen=True, slots=True)
class Board:
    """All alarms of an inspection."""

    alarms: Mapping[AlarmKey, Alarm]

    def observe(self, conditions: Mapping[AlarmKey, str], at_s: float) -> Board:
        """Take all conditions that hold now, each with its detail; what is not among them does not hold. Alarms of
        no interest that nobody spoke of are dropped."""
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
    return alarm.retained or alarm.quiet or alarm.turning_s is not None


def _said(alarm: Alarm, by: str, act: str, text: str, at_s: float) -> Alarm:
    if not text.strip():
        raise Invalid(f"Say why: {act} needs a comment.", act=act)
    return replace(alarm, comments=(*alarm.comments, Comment(at_s, by, act, text.strip())))
