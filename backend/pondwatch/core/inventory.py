"""A declared inventory against what was observed: agree, disagree, not observed, ambiguous.

Pure: bytes and values in, values out. A file is checked whole; one fault refuses all of it, and every fault is named by
its line. A declaration that an observation contradicts is a *discrepancy*, no more.
"""

from __future__ import annotations

import csv
import enum
import io
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from datetime import date

from .compare import SURE
from .errors import InvalidInventory
from .values import RodReading, RodState

COLUMNS = ("item", "position", "state", "date")
ALIASES = {"declared_state": "state"}
STATES = {state.value: state for state in (RodState.EMPTY, RodState.PARTIAL, RodState.FULL)}
MOST_LINES = 50_000
MOST_TEXT = 200
TOLD = 20  # faults that a refusal spells out


@dataclass(frozen=True, slots=True)
class Declared:
    """One line of an inventory. line: of the file, its header being 1. position: a rod's id. on: 2026-01-31."""

    line: int
    item: str
    position: str
    state: RodState
    on: str


class Outcome(enum.StrEnum):
    """What became of a line. Every line has exactly one."""

    AGREE = "agree"
    DISAGREE = "disagree"  # a discrepancy
    NOT_OBSERVED = "not_observed"
    AMBIGUOUS = "ambiguous"  # the looks contradict each other, or are not sure enough for either


@dataclass(frozen=True, slots=True)
class Reconciled:
    """A line, what was observed at its position, and the probability that the declared state is right (None where
    nothing was observed)."""

    declared: Declared
    reading: RodReading | None
    outcome: Outcome
    confidence: float | None


@dataclass(frozen=True, slots=True)
class Reconciliation:
    """lines: in the file's order. undeclared: readings at positions that no line names."""

    lines: tuple[Reconciled, ...]
    undeclared: tuple[RodReading, ...]

    def counts(self) -> dict[str, int]:
        """How many lines of each outcome; they add up to the list."""
        return {outcome.value: sum(line.outcome is outcome for line in self.lines) for outcome in Outcome}


def parse_inventory(content: bytes, positions: Collection[str]) -> tuple[Declared, ...]:
    """The lines of a CSV file with the header `item,position,state,date`.

    Args:
        positions: the ids of the pond's rods.

    Raises:
        InvalidInventory: names every line that is wrong. facts: line (the first), lines, faults (how many).
    """
    known = frozenset(positions)
    rows = _rows(content)
    faults: dict[int, str] = {}
    out: list[Declared] = []
    first: dict[tuple[str, str], int] = {}
    for line, row in rows:
        found = _declared(line, row, known)
        if isinstance(found, str):
            faults[line] = found
            continue
        for kind, name in (("item", found.item), ("position", found.position)):
            if (before := first.setdefault((kind, name), line)) != line:
                faults.setdefault(line, f"{kind} {name!r} was given before, in line {before}")
        out.append(found)
    if faults:
        raise _refused(faults)
    if not out:
        raise _refused({1: "there is no line under the header"})
    return tuple(out)


def reconcile(declared: Sequence[Declared], readings: Mapping[str, RodReading]) -> Reconciliation:
    """Every declared line against what was observed.

    Args:
        readings: by rod id; a position that has none was not observed.
    """
    named = {d.position for d in declared}
    undeclared = tuple(r for rod_id, r in readings.items() if rod_id not in named)
    return Reconciliation(tuple(_reconciled(d, readings.get(d.position)) for d in declared), undeclared)


def _reconciled(declared: Declared, reading: RodReading | None) -> Reconciled:
    if reading is None or reading.state is RodState.UNSEEN:
        return Reconciled(declared, reading, Outcome.NOT_OBSERVED, None)
    agrees = reading.state is declared.state
    confidence = reading.confidence if agrees else (1 - reading.confidence) / 2
    if reading.conflicting or reading.confidence < SURE:
        return Reconciled(declared, reading, Outcome.AMBIGUOUS, confidence)
    return Reconciled(declared, reading, Outcome.AGREE if agrees else Outcome.DISAGREE, confidence)


def _rows(content: bytes) -> list[tuple[int, dict[str | None, str | list[str] | None]]]:
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise _refused({content.count(b"\n", 0, error.start) + 1: "is not UTF-8"}) from error
    if "\0" in text:
        raise _refused({text.count("\n", 0, text.index("\0")) + 1: "holds a zero byte; this is no CSV file"})
    reader = csv.DictReader(io.StringIO(text, newline=""), strict=True)
    try:
        names = [ALIASES.get(name.strip().lower(), name.strip().lower()) for name in reader.fieldnames or ()]
        absent = [name for name in COLUMNS if name not in names]
        if absent:
            raise _refused({1: f"the header lacks {', '.join(absent)}"})
        if len(set(names)) < len(names):
            raise _refused({1: "the header names a column twice"})
        reader.fieldnames = names
        rows = []
        for row in reader:
            rows.append((reader.line_num, dict(row)))
            if len(rows) > MOST_LINES:
                raise _refused({reader.line_num: f"there are more than {MOST_LINES} lines"})
    except csv.Error as error:
        raise _refused({reader.reader.line_num: f"is not CSV: {error}"}) from error
    return rows


def _declared(line: int, row: Mapping[str | None, str | list[str] | None], known: frozenset[str]) -> Declared | str:
    """The line; or what is wrong with it."""
    if None in row:
        return "has more fields than the header"
    values = {name: str(row[name] or "").strip() for name in COLUMNS}
    for name, value in values.items():
        if not value:
            return f"{name} is missing"
        if len(value) > MOST_TEXT or not value.isprintable():
            return f"{name} must be 1 to {MOST_TEXT} printable characters"
    if values["position"] not in known:
        return f"there is no position {values['position']!r} in the layout"
    state = STATES.get(values["state"].lower())
    if state is None:
        return f"state must be one of {', '.join(STATES)}, and is {values['state'][:40]!r}"
    day = _day(values["date"])
    if day is None:
        return f"date must be a day as 2026-01-31, and is {values['date'][:40]!r}"
    return Declared(line, values["item"], values["position"], state, day)


def _day(text: str) -> str | None:
    try:
        return date.fromisoformat(text).isoformat() if len(text) == 10 else None
    except ValueError:
        return None


def _refused(faults: Mapping[int, str]) -> InvalidInventory:
    lines = sorted(faults)
    told = "; ".join(f"line {line}: {faults[line]}" for line in lines[:TOLD])
    more = f"; and {len(lines) - TOLD} more" if len(lines) > TOLD else ""
    numbers = ", ".join(str(line) for line in lines[:1000])
    return InvalidInventory(f"{told}{more}. Nothing was imported.", line=lines[0], lines=numbers, faults=len(lines))
