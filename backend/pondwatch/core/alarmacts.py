"""What people do to alarms. Every act returns a new value and says who did it and why. Pure: time is an argument.

Which act is possible when: `possible`. One that is not is a Conflict; none is without a comment.

Source: OPC 10000-9, UA Part 9, 5.7.3 (acknowledge), 5.8.17 (shelving), 5.8.2 (suppress, out of service, reset).
"""

from __future__ import annotations

import enum
from dataclasses import replace
from typing import Any

from .alarms import Alarm, Comment
from .errors import Conflict, Invalid

MOST_SHELVED_S = 8 * 3600.0


class Act(enum.StrEnum):
    """What may be done to an alarm."""

    ACKNOWLEDGE = "acknowledge"
    SHELVE = "shelve"
    UNSHELVE = "unshelve"
    SUPPRESS = "suppress"
    UNSUPPRESS = "unsuppress"
    REMOVE = "remove-from-service"
    RETURN = "return-to-service"
    RESET = "reset"


_REFUSALS = {
    Act.ACKNOWLEDGE: "This alarm is acknowledged already.",
    Act.SHELVE: "This alarm is shelved already, or there is nothing to shelve.",
    Act.UNSHELVE: "This alarm is not shelved.",
    Act.SUPPRESS: "This alarm is suppressed already.",
    Act.UNSUPPRESS: "This alarm is not suppressed.",
    Act.REMOVE: "This alarm is out of service already.",
    Act.RETURN: "This alarm is in service already.",
    Act.RESET: "Only a latched alarm that is inactive and acknowledged can be reset.",
}


def possible(alarm: Alarm) -> tuple[Act, ...]:
    """The acts that make sense now."""
    shelved = alarm.shelved_until_s is not None
    allowed = {
        Act.ACKNOWLEDGE: not alarm.acknowledged,
        Act.SHELVE: alarm.retained and not shelved,
        Act.UNSHELVE: shelved,
        Act.SUPPRESS: not alarm.suppressed,
        Act.UNSUPPRESS: alarm.suppressed,
        Act.REMOVE: not alarm.out_of_service,
        Act.RETURN: alarm.out_of_service,
        Act.RESET: alarm.latched and alarm.acknowledged and not alarm.active,
    }
    return tuple(act for act, is_allowed in allowed.items() if is_allowed)


def perform(alarm: Alarm, act: Act, by: str, text: str, at_s: float, for_s: float | None = None) -> Alarm:
    """The alarm after an act.

    Args:
        by: who; text: why. for_s: how long it is shelved, up to MOST_SHELVED_S; None: until it is next inactive.

    Raises:
        Invalid: without a comment, or shelved for too long or no time. Conflict: the act makes no sense now.
    """
    if not text.strip():
        raise Invalid(f"Say why: {act} needs a comment.", field="comment")
    if for_s is not None and not (act is Act.SHELVE and 0 < for_s <= MOST_SHELVED_S):
        raise Invalid(f"An alarm is shelved for up to {MOST_SHELVED_S / 3600:.0f} hours.", field="for_s")
    if act not in possible(alarm):
        raise Conflict(_REFUSALS[act], alarm=f"{alarm.key.kind}/{alarm.key.subject}", act=act.value)
    done = Comment(at_s, by, act.value, text.strip())
    return replace(alarm, **_change(act, at_s, for_s), comments=(*alarm.comments, done))


def _change(act: Act, at_s: float, for_s: float | None) -> dict[str, Any]:
    changes: dict[Act, dict[str, Any]] = {
        Act.ACKNOWLEDGE: {"acknowledged": True},
        Act.SHELVE: {"shelved_until_s": float("inf") if for_s is None else at_s + for_s},
        Act.UNSHELVE: {"shelved_until_s": None},
        Act.SUPPRESS: {"suppressed": True},
        Act.UNSUPPRESS: {"suppressed": False},
        Act.REMOVE: {"out_of_service": True},
        Act.RETURN: {"out_of_service": False},
        Act.RESET: {"latched": False},
    }
    return changes[act]
