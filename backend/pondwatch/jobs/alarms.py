"""Watches over sessions: judges what is wrong after every revision and once a second, and keeps what became of it.

The boards are held in memory and written through: what a viewer is told is committed before. A condition that only
begins to hold is forgotten by a restart, and begins again; nothing that ever rang is.
"""

from __future__ import annotations

import itertools
import threading
import time
import uuid
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import structlog
from sqlalchemy import Connection

from pondwatch.core import conditions
from pondwatch.core.alarmacts import Act, perform
from pondwatch.core.alarms import Alarm, AlarmKey, Board, Kind
from pondwatch.core.conditions import Limits
from pondwatch.core.errors import Missing, PondwatchError
from pondwatch.core.ports import Clock
from pondwatch.store import alarms, sessions
from pondwatch.store.alarms import Event
from pondwatch.store.sessions import State
from pondwatch.store.store import Store

from . import alarmviews
from .alarmfacts import Facts

CLOCK_S = 1.0
_LEAST_S = 0.2  # between two rounds: many revisions are judged once

Json = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Told:
    """A session's alarms as viewers are told. version: grows with every change."""

    version: int
    rows: tuple[Json, ...]


@dataclass(frozen=True, slots=True)
class Deed:
    """What somebody does to alarms: by whom, why; for_s: how long they are shelved."""

    act: Act
    by: str
    comment: str
    for_s: float | None = None


@dataclass(slots=True)
class _Watched:
    """One session. numbers: of the alarms that are stored."""

    facts: Facts
    board: Board
    numbers: dict[AlarmKey, int] = field(default_factory=dict)
    told: Told = Told(0, ())

    @property
    def alarms(self) -> dict[int, Alarm]:
        return {number: self.board.alarms[key] for key, number in self.numbers.items()}

    @property
    def is_over(self) -> bool:
        """Whether nothing changes any more by itself."""
        ended = self.facts.session.state in (State.FINISHED, State.FAILED)
        return ended and not any(a.turning_s or a.shelved_until_s is not None for a in self.board.alarms.values())


class Watch:
    """All sessions' alarms. free_bytes: of the data folder. tell: hears of a session whose alarms are otherwise."""

    def __init__(
        self,
        store: Store,
        clock: Clock,
        limits: Limits,
        free_bytes: Callable[[], int],
        tell: Callable[[str, int], None],
    ) -> None:
        self.limits = limits
        self._store, self._clock, self._free, self._tell = store, clock, free_bytes, tell
        self._lock = threading.RLock()
        self._watched: dict[str, _Watched] = {}
        self._going: set[str] = set()
        self._versions = itertools.count(1)
        self._woken: set[str] = set()
        self._stir, self._closing = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._run, name="alarms", daemon=True)

    def start(self) -> None:
        """Begin, with every session in which something may come to ring."""
        self._woken |= set(self._store.read(alarms.to_watch))
        self._thread.start()

    def close(self) -> None:
        """Stop."""
        self._closing.set()
        self._stir.set()
        if self._thread.is_alive():
            self._thread.join()

    def wake(self, session_id: str) -> None:
        """Something is otherwise in this session. Any thread; returns at once."""
        self._woken.add(session_id)
        self._stir.set()

    def told(self, session_id: str) -> Told:
        """A session's alarms, all that ever rang. Raises: Missing where there is no such session."""
        known = self._watched.get(session_id)
        if known is None:
            with self._lock:
                known = self._take_up(session_id)
        return known.told

    def groups(self, session_id: str) -> list[Json]:
        """What is retained and not quiet, by kind. Raises: Missing."""
        with self._lock:
            return alarmviews.groups(self._take_up(session_id).alarms)

    def act(self, session_id: str, numbers: Sequence[int], deed: Deed) -> list[Json | PondwatchError]:
        """Do the same to some alarms of a session, each for itself: as it is then, or why not. Committed on return.

        Raises:
            Missing: there is no such session. Unavailable, StorageFull: nothing was done.
        """
        with self._lock:
            watched, now_s = self._take_up(session_id), self._clock.now_s()
            after, failed = self._done(watched, numbers, deed, now_s)
            self._keep(watched, after, now_s, deed)
            rows = {row["id"]: row for row in watched.told.rows}
            self._going.add(session_id)
            return [failed.get(number) or rows[number] for number in numbers]

    def judge(self, session_id: str) -> None:
        """Judge a session now, and keep and tell what changed.

        Raises:
            Missing: there is no such session. Unavailable, StorageFull: nothing changed.
        """
        with self._lock:
            watched, now_s = self._take_up(session_id), self._clock.now_s()
            self._store.read(lambda c: watched.facts.look(c, now_s, self.limits))
            found = self._conditions(watched, now_s)
            self._keep(watched, watched.board.observe(found, now_s).alarms, now_s)
            (self._going.discard if watched.is_over else self._going.add)(session_id)

    def _conditions(self, watched: _Watched, now_s: float) -> conditions.Conditions:
        facts, limits = watched.facts, self.limits
        rods = facts.rods.values()
        unjudged = [rod for rod in rods if rod.rod_id not in facts.judged]
        found = conditions.changed(rods, facts.baseline, limits) | conditions.conflicting(unjudged, limits)
        active = {key.kind for key, alarm in watched.board.alarms.items() if alarm.active}
        poor = Kind.CORRECTION_POOR in active
        found |= conditions.poor(facts.snapshots, facts.doubtful, limits, is_active=poor)
        if facts.session.state is State.OPEN:
            found |= conditions.silent(facts.heard_s, now_s, limits)
            found |= conditions.stale(facts.seen_twice, limits, is_active=Kind.COVERAGE_STALE in active)
        if facts.session.state in (State.OPEN, State.FINISHING):
            found |= conditions.low(self._free(), limits, is_active=Kind.DISK_LOW in active)
        return found

    def _take_up(self, session_id: str) -> _Watched:
        known = self._watched.get(session_id)
        if known is None:

            def look(connection: Connection) -> tuple[sessions.Session, dict[int, Alarm]]:
                return sessions.get(connection, session_id), alarms.load(connection, session_id)

            session, stored = self._store.read(look)
            known = _Watched(Facts(session, self._clock.now_s()), Board({a.key: a for a in stored.values()}))
            known.numbers = {alarm.key: number for number, alarm in stored.items()}
            self._retell(known)
            self._watched[session_id] = known
        return known

    def _done(
        self, watched: _Watched, numbers: Sequence[int], deed: Deed, now_s: float
    ) -> tuple[dict[AlarmKey, Alarm], dict[int, PondwatchError]]:
        after, failed = dict(watched.board.alarms), dict[int, PondwatchError]()
        stored = watched.alarms
        for number in dict.fromkeys(numbers):
            try:
                if number not in stored:
                    raise Missing("There is no such alarm.", kind="alarm", id=number)
                changed = perform(stored[number], deed.act, deed.by, deed.comment, now_s, deed.for_s)
                after[changed.key] = changed
            except PondwatchError as error:
                failed[number] = error
        return after, failed

    def _keep(self, watched: _Watched, after: Mapping[AlarmKey, Alarm], now_s: float, deed: Deed | None = None) -> None:
        """Commit what is otherwise, then hold and tell it."""
        before = watched.board.alarms
        changed = [a for key, a in after.items() if a.occurrences and _settled(a) != _settled(before.get(key))]
        session = watched.facts.session

        def unit(connection: Connection) -> dict[AlarmKey, int]:
            return {
                a.key: alarms.save(
                    connection, session.id, watched.numbers.get(a.key), a, _events(before.get(a.key), a, now_s, deed)
                )
                for a in changed
            }

        numbers = self._store.write(unit) if changed else {}
        watched.board = Board(after)
        watched.numbers |= numbers
        if changed:
            self._retell(watched)
            self._tell(session.id, session.revision)

    def _retell(self, watched: _Watched) -> None:
        rows = tuple(alarmviews.alarm(number, alarm) for number, alarm in watched.alarms.items())
        watched.told = Told(next(self._versions), rows)

    def _run(self) -> None:
        beat_s = 0.0
        while not self._closing.is_set():
            self._stir.clear()
            due, now_s = set(self._woken), time.monotonic()
            self._woken -= due
            if now_s >= beat_s:
                due, beat_s = due | self._going, now_s + CLOCK_S
            for session_id in sorted(due):
                self._judge_safely(session_id)
            self._closing.wait(_LEAST_S)
            self._stir.wait(max(0.0, beat_s - time.monotonic()))

    def _judge_safely(self, session_id: str) -> None:
        try:
            self.judge(session_id)
        except Missing:
            self._going.discard(session_id)
        except Exception as error:  # a border: no session's fault may silence the others' alarms
            known = isinstance(error, PondwatchError)
            fault = uuid.uuid4().hex
            self._going.add(session_id)  # it is tried again at the next beat
            structlog.get_logger().error(
                "alarms_failed", session=session_id, fault=fault, error=str(error), exc_info=not known
            )


def _settled(alarm: Alarm | None) -> Alarm | None:
    return alarm and replace(alarm, turning_s=None)


def _events(before: Alarm | None, after: Alarm, now_s: float, deed: Deed | None) -> list[Event]:
    at_ms = round(now_s * 1000)
    if deed is not None:
        return [Event(at_ms, deed.act.value, deed.comment.strip(), deed.by)]
    was_active, was_shelved = (before.active, before.shelved_until_s) if before else (False, None)
    told = []
    if was_shelved is not None and after.shelved_until_s is None:
        told.append(Event(at_ms, "unshelve", "Its time on the shelf is over."))
    if after.active != was_active:
        told.append(Event(at_ms, "raise" if after.active else "clear", after.detail))
    return told
