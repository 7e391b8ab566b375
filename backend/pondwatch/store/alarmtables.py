"""The tables of alarms. An alarm is a row for as long as its session is kept; every transition of it is a row too."""

from __future__ import annotations

from sqlalchemy import Boolean, Column, ForeignKey, Index, Integer, String, Table, UniqueConstraint

from .tables import BigInteger, metadata


def _flag(name: str) -> Column[bool]:
    return Column(name, Boolean(create_constraint=False), nullable=False)


alarms = Table(
    "alarms",
    metadata,
    Column("id", BigInteger, primary_key=True),
    Column("session_id", ForeignKey("sessions.id", ondelete="CASCADE"), nullable=False),
    Column("kind", String(40), nullable=False),
    Column("subject", String, nullable=False),  # a rod, a robot; empty for the whole inspection
    Column("detail", String, nullable=False),
    _flag("active"),
    _flag("acknowledged"),
    _flag("latched"),
    _flag("suppressed"),
    _flag("out_of_service"),
    _flag("shelved"),
    Column("shelved_until_ms", BigInteger),  # where shelved: none for until it is next inactive
    Column("since_ms", BigInteger, nullable=False),  # it is active, or inactive
    Column("occurrences", Integer, nullable=False),
    UniqueConstraint("session_id", "kind", "subject"),
    sqlite_autoincrement=True,
)

alarm_events = Table(
    "alarm_events",
    metadata,
    Column("id", BigInteger, primary_key=True),
    Column("session_id", ForeignKey("sessions.id", ondelete="CASCADE"), nullable=False),
    Column("alarm_id", ForeignKey("alarms.id", ondelete="CASCADE"), nullable=False),
    Column("at_ms", BigInteger, nullable=False),
    Column("act", String(30), nullable=False),  # raise, clear, unshelve, or what a person did
    Column("who", String),  # none: the program itself
    Column("text", String, nullable=False),  # what was wrong, or a person's comment
    Index(None, "session_id", "id"),
    Index(None, "alarm_id", "id"),
    sqlite_autoincrement=True,
)

baselines = Table(
    "baselines",
    metadata,
    Column("session_id", ForeignKey("sessions.id", ondelete="CASCADE"), primary_key=True),
    Column("baseline_id", ForeignKey("sessions.id", ondelete="CASCADE"), nullable=False),
    Column("set_ms", BigInteger, nullable=False),
)
