"""Alarms as JSON values: the one place for the API and the live feed."""

from __future__ import annotations

import math
from typing import Any

from sqlalchemy import RowMapping

from pondwatch.core.alarmacts import possible
from pondwatch.core.alarms import POLICIES, Alarm, Comment, Kind, grouped
from pondwatch.store.clock import rfc3339

Json = dict[str, Any]


def alarm(number: int, alarm: Alarm) -> Json:
    """An alarm. shelved_until: a time, `until-clear` where it ends with the alarm, None where it is not shelved.
    acts: what may be done to it now. comment: what was last done by a person."""
    flags = ("active", "acknowledged", "latched", "suppressed", "out_of_service", "retained", "quiet", "rings")
    policy, said = alarm.policy, alarm.comments[-1:]
    return {
        "id": number,
        "kind": alarm.key.kind.value,
        "subject": alarm.key.subject,
        "title": policy.title,
        "severity": policy.severity,
        "message": alarm.detail,
        "advice": policy.advice,
        **{name: getattr(alarm, name) for name in flags},
        "shelved_until": _until(alarm.shelved_until_s),
        "since": _time(alarm.since_s),
        "occurrences": alarm.occurrences,
        "acts": [act.value for act in possible(alarm)],
        "comment": _comment(said[0]) if said else None,
    }


def groups(alarms: dict[int, Alarm]) -> list[Json]:
    """What is retained and not quiet, by kind, the worst first."""
    numbers = {alarm.key: number for number, alarm in alarms.items()}
    return [
        {
            "kind": group.kind.value,
            "title": POLICIES[group.kind].title,
            "count": len(group.alarms),
            "ringing": sum(a.rings for a in group.alarms),
            "flood": group.is_flood,
            "alarms": [numbers[a.key] for a in group.alarms],
        }
        for group in grouped(alarms.values())
    ]


def event(row: RowMapping) -> Json:
    """A transition. by: None for the program itself."""
    names = ("id", "kind", "subject", "act", "text")
    told = {name: row[name] for name in names}
    return told | {
        "alarm": row["alarm_id"],
        "title": POLICIES[Kind(row["kind"])].title,
        "by": row["who"],
        "at": rfc3339(row["at_ms"]),
    }


def _comment(said: Comment) -> Json:
    return {"at": _time(said.at_s), "by": said.by, "act": said.act, "text": said.text}


def _until(until_s: float | None) -> str | None:
    if until_s is None or math.isfinite(until_s):
        return None if until_s is None else _time(until_s)
    return "until-clear"


def _time(at_s: float) -> str | None:
    return rfc3339(round(at_s * 1000))
