"""What a report tells beside the session: discrepancies with the declared inventory, changes since the baseline."""

from __future__ import annotations

from sqlalchemy import Connection

from pondwatch.core.errors import Missing
from pondwatch.core.inventory import Outcome, Reconciled
from pondwatch.core.values import RodReading, RodState
from pondwatch.store import alarms, conditions, ponds, sessions
from pondwatch.store.sessions import State
from pondwatch.store.store import Store

from . import comparing, pondviews, tiles
from .dossier import Table
from .findingviews import findings_table
from .views import Json, metres_per_pixel

CHANGED, DISCREPANT = "C", "D"
_WORDS = {"empty": "empty", "partial": "partly filled", "full": "full", "unseen": "not observed"}
_REASONS = {
    "elsewhere": "the layouts put it elsewhere",
    "residual": "the mosaics do not coincide here",
    "unsure": "a reading is not sure",
    "withheld": "the comparison is refused",
}


def tables_of(store: Store, session_id: str) -> tuple[Table, ...]:
    """The tables that the store has of a session, in the order of a report.

    Raises:
        Missing: there is no such session.
    """
    return discrepancies(store, session_id), changes(store, session_id), findings(store, session_id)


def findings(store: Store, session_id: str) -> Table:
    """What is otherwise than the layout says, of condition and position.

    Raises:
        Missing: there is no such session.
    """
    session = store.read(lambda c: sessions.get(c, session_id, with_rods=True))
    found = store.read(lambda c: conditions.read(c, session_id))
    pond, scale = session.inspection.pond, metres_per_pixel(session)
    return findings_table(found, pond, scale, lambda: tiles.whole(store, session_id)[1])


def discrepancies(store: Store, session_id: str) -> Table:
    """Lines of the newest inventory that the observation contradicts, or that it leaves open."""
    columns = ("line", "item", "position", "declared", "observed", "fill", "confidence", "outcome")
    try:
        head, found = pondviews.reconciliation(store, session_id, pondviews.LATEST)
    except Missing as error:
        if error.facts.get("kind") != "inventory":
            raise
        return Table("Discrepancies", "No inventory was declared for this pond.", columns, (), "no inventory")
    counts, stored = found.counts(), head["inventory"]
    told = [line for line in found.lines if line.outcome in (Outcome.DISAGREE, Outcome.AMBIGUOUS)]
    note = (
        f"Declared inventory {stored['name']}, imported {stored['created_at']}, {stored['digest']}: of "
        f"{len(found.lines)} lines {counts['agree']} agree, {counts['disagree']} disagree, {counts['not_observed']} "
        f"were not observed, {counts['ambiguous']} are ambiguous. {len(found.undeclared)} positions are not declared."
    )
    marks = {line.declared.position: DISCREPANT for line in told if line.outcome is Outcome.DISAGREE}
    headline = f"{counts['disagree']} of {len(found.lines)} lines"
    return Table(
        "Discrepancies", note, columns, [_line(line) for line in told], headline, marks, "D otherwise than declared."
    )


def _line(line: Reconciled) -> tuple[str, ...]:
    d, r = line.declared, line.reading or RodReading(line.declared.position, RodState.UNSEEN, None, 0.0, 0)
    fill = "" if r.fill is None else f"{100 * r.fill:.0f} %"
    observed = _WORDS[r.state.value] + (", conflicting" if r.conflicting else "")
    return (
        str(d.line), d.item, d.position, _WORDS[d.state.value], observed, fill, f"{r.confidence:.4f}",
        line.outcome.value,
    )  # fmt: skip


def changes(store: Store, session_id: str) -> Table:
    """Rods that differ from the session's baseline; where none was chosen, from the finished inspection before it."""
    columns = ("rod", "change", "what", "before", "now", "confidence", "residual, mm")

    def base_of(connection: Connection) -> str | None:
        if sessions.get(connection, session_id).state is not State.FINISHED:
            return None
        try:
            return alarms.baseline(connection, session_id) or ponds.before(connection, session_id)
        except Missing:
            return None

    base = store.read(base_of)
    if base is None:
        note = "There is no finished inspection of this pond before it, or it is not finished itself."
        return Table("Changes", note, columns, (), "no baseline")
    told = comparing.json_of(comparing.find(store, base, session_id))
    unsure = [r for r in told["not_comparable"] if not str(r["reason"]).startswith("not_observed")]
    rows = [_change(rod) for rod in told["rods"]] + [_open(rod) for rod in unsure]
    changed = f"{len(told['rods'])} of {told['compared']} rods" if told["comparable"] else "not comparable"
    marks = {rod["rod_id"]: CHANGED for rod in told["rods"]}
    return Table("Changes", _note(told, len(unsure)), columns, rows, changed, marks, "C changed since the baseline.")


def _note(told: Json, unsure: int) -> str:
    base, residual, counts = told["base"], told["residual"], told["counts"]
    lies = (
        "The residual between the mosaics was not measured."
        if residual["median_mm"] is None
        else f"The mosaics lie {residual['median_mm']:.3f} mm ({residual['median_px']:.2f} px) apart in the median of "
        f"{residual['rods']} rods; over {residual['limit_mm']:.3f} mm no difference is claimed."
    )
    return (
        f"Held against {base['name']} ({base['session']}), finished {base['finished_at']}. {told['sentence']} {lies} "
        f"Of {told['compared']} rods seen in both {counts['filled']} were filled, {counts['emptied']} emptied, "
        f"{counts['partly']} filled or emptied in part; of {unsure} nothing is claimed. "
        f"{told['not_observed']} were not seen in both."
    )


def _change(rod: Json) -> tuple[str, ...]:
    return _told(rod, str(rod["change"]), str(rod["word"] or ""))


def _open(rod: Json) -> tuple[str, ...]:
    return _told(rod, "no claim", _REASONS.get(str(rod["reason"]), str(rod["reason"])))


def _told(rod: Json, change: str, word: str) -> tuple[str, ...]:
    before, now = (_side(rod[side]) for side in ("base", "with"))
    apart = "" if rod["residual_mm"] is None else f"{rod['residual_mm']:.3f}"
    return rod["rod_id"], change, word, before, now, f"{rod['confidence']:.4f}", apart


def _side(reading: Json) -> str:
    fill = "" if reading["fill"] is None else f", {100 * reading['fill']:.0f} %"
    return _WORDS[reading["state"]] + fill
