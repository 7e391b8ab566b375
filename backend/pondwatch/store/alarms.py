"""Alarms of a session as they are kept, every transition of them, and the session that is the baseline."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Connection, Row, RowMapping, bindparam, delete, insert, select, update

from pondwatch.core.alarms import Alarm, AlarmKey, Comment, Kind

from .alarmtables import alarm_events, alarms, baselines
from .sessions import State
from .tables import sessions


@dataclass(frozen=True, slots=True)
class Event:
    """One transition. act: raise, clear, unshelve or what a person did. who: None for the program itself."""

    at_ms: int
    act: str
    text: str
    who: str | None = None


def load(connection: Connection, session_id: str) -> dict[int, Alarm]:
    """All alarms of a session by their number; their comments are what people did, in order."""
    said = select(alarm_events).where(alarm_events.c.session_id == session_id, alarm_events.c.who.is_not(None))
    comments: dict[int, list[Comment]] = {}
    for row in connection.execute(said.order_by(alarm_events.c.id)):
        comments.setdefault(row.alarm_id, []).append(Comment(row.at_ms / 1000, row.who, row.act, row.text))
    rows = connection.execute(select(alarms).where(alarms.c.session_id == session_id).order_by(alarms.c.id))
    return {row.id: _alarm(row, tuple(comments.get(row.id, ()))) for row in rows}


def save(
    connection: Connection, session_id: str, alarm_id: int | None, alarm: Alarm, events: Iterable[Event] = ()
) -> int:
    """Keep an alarm as it is now, and what became of it; its number. alarm_id: None where it is new."""
    values = _values(alarm)
    if alarm_id is None:
        made = connection.execute(insert(alarms), values | {"session_id": session_id}).inserted_primary_key
        assert made
        alarm_id = int(made[0])
    else:
        connection.execute(update(alarms).where(alarms.c.id == alarm_id).values(values))
    told = [
        {
            "session_id": session_id,
            "alarm_id": alarm_id,
            "at_ms": event.at_ms,
            "act": event.act,
            "who": event.who,
            "text": event.text,
        }
        for event in events
    ]
    if told:
        connection.execute(insert(alarm_events), told)
    return alarm_id


def events(
    connection: Connection, session_id: str, limit: int, before: int | None = None, alarm_id: int | None = None
) -> Sequence[RowMapping]:
    """Transitions with the alarm's `kind` and `subject`, the newest first, from the one after event `before`."""
    query = select(alarm_events, alarms.c.kind, alarms.c.subject).join(alarms, alarms.c.id == alarm_events.c.alarm_id)
    query = query.where(alarm_events.c.session_id == session_id)
    if before is not None:
        query = query.where(alarm_events.c.id < before)
    if alarm_id is not None:
        query = query.where(alarm_events.c.alarm_id == alarm_id)
    return connection.execute(query.order_by(alarm_events.c.id.desc()).limit(limit)).mappings().all()


def to_watch(connection: Connection) -> list[str]:
    """Sessions in which something may come to ring or to end: those not at their end, and those with alarms that are
    active or shelved."""
    going = sessions.c.state.in_((State.OPEN, State.FINISHING))
    ringing = select(alarms.c.session_id).where(alarms.c.active | alarms.c.shelved)
    query = select(sessions.c.id).where(going | sessions.c.id.in_(ringing)).order_by(sessions.c.id)
    return list(connection.execute(query).scalars())


def set_baseline(connection: Connection, session_id: str, baseline_id: str | None, now_ms: int) -> None:
    """Which session another is held against; None for none."""
    connection.execute(delete(baselines).where(baselines.c.session_id == session_id))
    if baseline_id is not None:
        row = {"session_id": session_id, "baseline_id": baseline_id, "set_ms": now_ms}
        connection.execute(insert(baselines), row)


_BASELINE = select(baselines.c.baseline_id).where(baselines.c.session_id == bindparam("session_id"))  # made once


def baseline(connection: Connection, session_id: str) -> str | None:
    """The session that another is held against."""
    return connection.execute(_BASELINE, {"session_id": session_id}).scalar_one_or_none()


def _values(alarm: Alarm) -> dict[str, Any]:
    until = alarm.shelved_until_s
    return {
        "kind": alarm.key.kind.value,
        "subject": alarm.key.subject,
        "detail": alarm.detail,
        "active": alarm.active,
        "acknowledged": alarm.acknowledged,
        "latched": alarm.latched,
        "suppressed": alarm.suppressed,
        "out_of_service": alarm.out_of_service,
        "shelved": until is not None,
        "shelved_until_ms": round(until * 1000) if until is not None and math.isfinite(until) else None,
        "since_ms": round(alarm.since_s * 1000),
        "occurrences": alarm.occurrences,
    }


def _alarm(row: Row[Any], comments: tuple[Comment, ...]) -> Alarm:
    until = row.shelved_until_ms
    return Alarm(
        AlarmKey(Kind(row.kind), row.subject),
        row.detail,
        row.active,
        row.acknowledged,
        row.latched,
        row.suppressed,
        row.out_of_service,
        (math.inf if until is None else until / 1000) if row.shelved else None,
        row.since_ms / 1000,
        None,
        row.occurrences,
        comments,
    )
