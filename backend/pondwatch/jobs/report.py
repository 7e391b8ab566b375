"""The report of an inspection as PDF. The same dossier gives the same bytes: no clock, no random names."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import IO, Any

from reportlab.lib.pagesizes import A4
from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import CondPageBreak, Flowable, KeepTogether, PageBreak, SimpleDocTemplate, Spacer

from pondwatch import __version__

from .dossier import Dossier, Table, seen_rods
from .reportparts import (
    MARGIN,
    WIDE,
    facts,
    grid,
    head,
    paragraph,
    register_fonts,
    shares_of,
    signatures,
    small,
    strip,
    tiles,
    title,
)
from .reportpictures import GREY, PLAIN, Mark, PictureSheet, RodMap, coverage_picture, legend, mosaic_picture
from .views import Json

_TALL = 0.335 * A4[1]  # so that two plans share a page
_WORDS = {"empty": "empty", "partial": "partly filled", "full": "full", "unseen": "not observed"}


def write_report(found: Dossier, out: IO[bytes]) -> None:
    """Write the report: what was seen, what is otherwise than it should be, every rod, how it was done, how well, and
    the digests that hold it together."""
    register_fonts()
    named = f"{found.facts['name']} ({found.facts['id']})"
    document = SimpleDocTemplate(
        out,
        pagesize=A4,
        invariant=1,
        title=f"Inspection {named}",
        author=f"Pondwatch {__version__}",
        leftMargin=MARGIN,
        rightMargin=MARGIN,
        topMargin=MARGIN,
        bottomMargin=MARGIN,
    )
    foot = f"{named}, revision {found.facts['revision']}"
    document.build(story(found), canvasmaker=lambda *args, **options: _Numbered(foot, *args, **options))


class _Numbered(Canvas):  # type: ignore[misc]
    """A canvas whose pages say how many there are: each is held back until the last is known."""

    def __init__(self, foot: str, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self._foot, self._held = foot, list[dict[str, Any]]()

    def showPage(self) -> None:  # noqa: N802 - reportlab's name
        """Hold the page back."""
        self._held.append(dict(self.__dict__))
        self._startPage()

    def save(self) -> None:
        """Write every page with its foot."""
        held = self._held
        for number, page in enumerate(held, 1):
            self.__dict__.update(page)
            self.setFont(PLAIN, 7)
            self.setFillColor(GREY)
            self.drawString(MARGIN, 10 * mm, self._foot)
            self.drawRightString(A4[0] - MARGIN, 10 * mm, f"page {number} of {len(held)}")
            super().showPage()
        super().save()


def story(found: Dossier) -> list[Flowable]:
    """What the report shows, in its order."""
    parts = [*title(f"{found.facts['name']}", _standing(found)), tiles(_headlines(found)), Spacer(1, 6), _facts(found)]
    parts += [*_mosaic(found), PageBreak(), *_rods(found), *_coverage(found)]
    if found.tables:
        parts.append(PageBreak())
    for table in found.tables:
        parts += _table_section(table)
    parts += [*_method(found), *_quality(found), *_digests(found), signatures()]
    if found.rods:
        parts += [PageBreak(), *_rod_table(found)]
    return parts


def _standing(found: Dossier) -> str:
    sealed = "sealed" if found.seal is not None else "not sealed: what it says may still change"
    return f"{found.facts['state']}, revision {found.facts['revision']}, {sealed}"


def _headlines(found: Dossier) -> list[tuple[str, str]]:
    counts = seen_rods(found.rods)
    seen = sum(counts.values()) - counts["unseen"]
    first = [("Floor observed", _percent(found.facts["coverage"])), ("Rods observed", f"{seen} of {len(found.rods)}")]
    return first + [(table.title, table.headline or str(len(table.rows))) for table in found.tables]


def _facts(found: Dossier) -> Flowable:
    told, pond = found.facts, found.inspection.pond
    counts = {status: sum(p["status"] == status for p in found.poses) for status in ("placed", "uncertain", "rejected")}
    first, last = _span(found.poses)
    return facts(
        [
            ("Session", str(told["id"])),
            ("Pond", f"{pond.width_m:.4g} m x {pond.height_m:.4g} m, {len(pond.rods)} rods by its layout"),
            ("Opened", str(told["created_at"])),
            ("Finished", str(told["finished_at"] or "not finished")),
            ("First snapshot", first),
            ("Last snapshot", last),
            ("Snapshots", f"{len(found.poses)}: " + ", ".join(f"{n} {status}" for status, n in counts.items())),
            ("Method", str(told["method"])),
        ]
    )


def _span(poses: Sequence[Json]) -> tuple[str, str]:
    times = sorted(pose["captured_at"] for pose in poses)
    return (times[0], times[-1]) if times else ("none", "none")


def _mosaic(found: Dossier) -> list[Flowable]:
    marks = [Mark(x, y, text) for table in found.tables for x, y, text in table.places]
    sheet = PictureSheet(mosaic_picture(found), found.inspection.pond, WIDE, 0.52 * A4[1], marks)
    key = "Pond frame: x to the right, y up, from the lower left corner."
    if marks:
        key += " Numbered rings are the findings of the table below."
    return [head("Mosaic"), sheet, legend([(0.84, "never seen")]), small(key)]


def _coverage(found: Dossier) -> list[Flowable]:
    looks = found.layers().looks
    once, twice = (float((looks >= n).mean()) for n in (1, 2))
    said = f"Seen at least once: {_percent(once)}, twice: {_percent(twice)}. Most looks at a place: {looks.max()}."
    shades = [(1.0, "never"), (0.78, "once"), (0.59, "twice"), (0.41, "3"), (0.25, "4"), (0.12, "5 times and more")]
    sheet = PictureSheet(coverage_picture(looks), found.inspection.pond, WIDE, _TALL)
    return [KeepTogether([head("Coverage"), paragraph(said), Spacer(1, 4), sheet, legend(shades)])]


def _rods(found: Dossier) -> list[Flowable]:
    if not found.rods:
        said = "The pond is unmapped: there is no layout, so no rod was read."
        return [head("Rods by state"), paragraph(said)]
    counts = seen_rods(found.rods)
    conflicting = sum(bool(rod["conflicting"]) for rod in found.rods)
    said = ", ".join(f"{n} {_WORDS[state]}" for state, n in counts.items()) + f"; {conflicting} with conflicting looks."
    letters = _letters(found.tables)
    drawn = RodMap(found.inspection.pond, found.rods, WIDE, _TALL, letters)
    key = legend([(1.0, "E empty"), (0.8, "P partly filled"), (0.55, "F full"), (None, "- not observed")])
    more = "! looks that conflict." + "".join(f" {t.marked}" for t in found.tables if t.marks)
    return [head("Rods by state"), paragraph(said), Spacer(1, 4), drawn, key, small(more)]


def _letters(tables: Iterable[Table]) -> dict[str, str]:
    out: dict[str, str] = {}
    for table in tables:
        for rod_id, letter in table.marks.items():
            out[rod_id] = out.get(rod_id, "") + letter
    return out


def _rod_table(found: Dossier) -> list[Flowable]:
    columns = ("rod", "x, m", "y, m", "state", "fill", "confidence", "views", "")
    rows = [
        (
            rod.id,
            f"{rod.x_m:.4f}",
            f"{rod.y_m:.4f}",
            _WORDS[reading["state"]],
            "" if reading["fill"] is None else _percent(reading["fill"]),
            "" if reading["fill"] is None else f"{reading['confidence']:.4f}",
            str(reading["views"]),
            "conflicting" if reading["conflicting"] else "",
        )
        for rod, reading in zip(found.inspection.pond.rods, found.rods, strict=True)
    ]
    widths = (0.2, 0.11, 0.11, 0.16, 0.1, 0.12, 0.08, 0.12)
    return [head("Every rod"), grid(columns, rows, widths)]


def _table_section(table: Table) -> list[Flowable]:
    told = [CondPageBreak(40 * mm), head(table.title), paragraph(table.note), Spacer(1, 4)]
    if table.pictures:
        told += [strip(table.pictures), Spacer(1, 4)]
    if table.rows:
        told.append(grid(table.columns, table.rows, shares_of(table.columns, table.rows)))
    return told


def _method(found: Dossier) -> list[Flowable]:
    noise, camera = found.inspection.pose_noise, found.inspection.camera
    claimed = "nothing" if noise is None else f"{1000 * noise.sigma_xy_m:.3g} mm, {noise.sigma_theta_rad:.3g} rad"
    made = (found.seal or {}).get("sealed_by", {})
    rows = [
        ("Method", str(found.facts["method"])),
        ("Software", str(made.get("software", "not on record"))),
        ("Libraries", ", ".join(f"{k} {v}" for k, v in made.get("libraries", {}).items()) or "not on record"),
        ("Camera", f"{camera.width_px} x {camera.height_px} px, {1000 * camera.metres_per_pixel:.4g} mm a pixel"),
        ("Localisation claims", claimed),
    ]
    return [KeepTogether([head("Method"), facts(rows, across=1)])]


def _quality(found: Dossier) -> list[Flowable]:
    sigmas = sorted(p["sigma_xy_m"] for p in found.poses if p["sigma_xy_m"] is not None)
    spread = [sigmas[int(share * (len(sigmas) - 1))] for share in (0.5, 0.95)] if sigmas else []
    told = " and ".join(f"{1000 * s:.3g} mm ({w})" for s, w in zip(spread, ("median", "95 %"), strict=False)) or "-"
    rows = [("Correction", str(found.facts["quality"] or "-")), ("Corrected poses", f"one sigma of x and of y: {told}")]
    return [KeepTogether([head("Quality"), facts(rows, across=1)])]


def _digests(found: Dossier) -> list[Flowable]:
    if found.seal is None:
        said = "The session is not sealed: it is not finished, and what it says may still change."
        return [head("Digests"), paragraph(said)]
    made, records = found.seal["sealed_by"], found.seal["records"]
    rows = [
        ("Sealed", str(found.seal["sealed_at"])),
        ("Records, head", f"{records['count']}, {records['head']}"),
        ("Public key", str(found.seal["key"]["public"])),
        ("Method", str(made["method_sha256"])),
        *((f"Model {name}", str(digest)) for name, digest in made["models"].items()),
    ]
    note = "The evidence bundle of this session carries every picture by its SHA-256; the head stands for all records."
    return [KeepTogether([head("Digests"), facts(rows, across=1), small(note)])]


def _percent(share: Any) -> str:
    return f"{100 * share:.1f} %"
