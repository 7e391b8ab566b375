"""The report of an inspection as PDF. The same dossier gives the same bytes: no clock, no random names."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import IO, Any
from xml.sax.saxutils import escape

from reportlab.lib import colors
from reportlab.lib.pagesizes import A4
from reportlab.lib.styles import ParagraphStyle
from reportlab.lib.units import mm
from reportlab.pdfbase import pdfmetrics
from reportlab.pdfbase.ttfonts import TTFont
from reportlab.platypus import Flowable, Image, LongTable, PageBreak, Paragraph, SimpleDocTemplate, Spacer, TableStyle

from pondwatch import __version__

from .dossier import Dossier, Table, seen_rods
from .reportpictures import RodMap, coverage_picture, mosaic_picture, scale_bar
from .views import Json

_MARGIN = 18 * mm
_WIDE = A4[0] - 2 * _MARGIN
_TALL = 0.36 * A4[1]
_GRID = colors.Color(0.75, 0.75, 0.75)
_FONTS = {"Pond": "Vera.ttf", "Pond-Bold": "VeraBd.ttf"}  # they come with reportlab
_BODY = ParagraphStyle("body", fontName="Pond", fontSize=8.5, leading=12)
_SMALL = ParagraphStyle("small", parent=_BODY, fontSize=7, leading=9, wordWrap="CJK")
_HEAD = ParagraphStyle("head", parent=_BODY, fontName="Pond-Bold", fontSize=11, leading=15, spaceBefore=8, spaceAfter=3)
_TITLE = ParagraphStyle("title", parent=_HEAD, fontSize=16, leading=21, spaceBefore=0)
_WORDS = {"empty": "empty", "partial": "partly filled", "full": "full", "unseen": "not observed"}


def write_report(found: Dossier, out: IO[bytes]) -> None:
    """Write the report: what was seen, every rod, how it was done, how well, and the digests that hold it together."""
    for name, file in _FONTS.items():
        if name not in pdfmetrics.getRegisteredFontNames():
            pdfmetrics.registerFont(TTFont(name, file))
    named = f"{found.facts['name']} ({found.facts['id']})"
    document = SimpleDocTemplate(
        out,
        pagesize=A4,
        invariant=1,
        title=f"Inspection {named}",
        author=f"Pondwatch {__version__}",
        leftMargin=_MARGIN,
        rightMargin=_MARGIN,
        topMargin=_MARGIN,
        bottomMargin=_MARGIN,
    )

    def foot(canvas: Any, _document: Any) -> None:
        canvas.setFont("Pond", 7)
        canvas.drawString(_MARGIN, 10 * mm, f"{named}, revision {found.facts['revision']}")
        canvas.drawRightString(A4[0] - _MARGIN, 10 * mm, f"page {canvas.getPageNumber()}")

    document.build(_story(found), onFirstPage=foot, onLaterPages=foot)


def _story(found: Dossier) -> list[Flowable]:
    story = [Paragraph(_safe(f"Inspection report: {found.facts['name']}"), _TITLE), _facts(found)]
    story += _mosaic(found)
    story += [PageBreak(), *_rods(found), *_coverage(found)]
    for table in found.tables:
        story += _table_section(table)
    story += [PageBreak(), *_rod_table(found), *_method(found), *_digests(found)]
    return story


def _facts(found: Dossier) -> Flowable:
    facts, pond = found.facts, found.inspection.pond
    counts = {status: sum(p["status"] == status for p in found.poses) for status in ("placed", "uncertain", "rejected")}
    rods = seen_rods(found.rods)
    seen = sum(rods.values()) - rods["unseen"]
    rows = [
        ("Session", f"{facts['id']}, {facts['state']}, revision {facts['revision']}"),
        ("Opened, finished", f"{facts['created_at']}, {facts['finished_at'] or 'not finished'}"),
        ("First, last snapshot", _span(found.poses)),
        ("Pond", f"{pond.width_m:.4g} m x {pond.height_m:.4g} m, {len(pond.rods)} rods by its layout"),
        ("Snapshots", f"{len(found.poses)}: " + ", ".join(f"{n} {status}" for status, n in counts.items())),
        ("Rods observed", f"{seen} of {len(found.rods)}"),
        ("Floor observed", _percent(facts["coverage"])),
        ("Quality", str(facts["quality"] or "-")),
    ]
    return _grid([], rows, [38 * mm, _WIDE - 38 * mm])


def _span(poses: Sequence[Json]) -> str:
    times = sorted(pose["captured_at"] for pose in poses)
    return f"{times[0]}, {times[-1]}" if times else "none"


def _mosaic(found: Dossier) -> list[Flowable]:
    picture = mosaic_picture(found)
    return [
        Paragraph("Mosaic", _HEAD),
        _image(picture.content, picture.size_px),
        scale_bar(found.inspection.pond.width_m, _fit(picture.size_px)[0]),
        Paragraph("Grey was never seen. Pond frame: x to the right, y up, from the lower left corner.", _SMALL),
    ]


def _coverage(found: Dossier) -> list[Flowable]:
    looks = found.layers().looks
    picture = coverage_picture(looks)
    once, twice = (float((looks >= n).mean()) for n in (1, 2))
    said = f"Seen at least once: {_percent(once)}, twice: {_percent(twice)}. Most looks at a place: {looks.max()}."
    key = "White: never seen. Then darker with each look: 1, 2, 3, 4, 5 and more."
    return [Paragraph("Coverage", _HEAD), Paragraph(said, _BODY), _image(picture.content, picture.size_px),
            Paragraph(key, _SMALL)]  # fmt: skip


def _rods(found: Dossier) -> list[Flowable]:
    if not found.rods:
        return [
            Paragraph("Rods", _HEAD),
            Paragraph("The pond is unmapped: there is no layout, so no rod was read.", _BODY),
        ]
    counts = seen_rods(found.rods)
    conflicting = sum(bool(rod["conflicting"]) for rod in found.rods)
    said = ", ".join(f"{n} {_WORDS[state]}" for state, n in counts.items()) + f"; {conflicting} with conflicting looks."
    key = "E empty, P partly filled, F full, - not observed; ! looks that conflict."
    drawn = RodMap(found.inspection.pond, found.rods, _WIDE, _TALL)
    return [Paragraph("Rods", _HEAD), Paragraph(said, _BODY), Spacer(1, 4), drawn, Paragraph(key, _SMALL)]


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
    if not rows:
        return []
    widths = [w * _WIDE for w in (0.2, 0.11, 0.11, 0.16, 0.1, 0.12, 0.08, 0.12)]
    return [Paragraph("Every rod", _HEAD), _grid(columns, rows, widths)]


def _table_section(table: Table) -> list[Flowable]:
    told = [Paragraph(_safe(table.title), _HEAD), Paragraph(_safe(table.note), _BODY), Spacer(1, 4)]
    if table.rows:
        told.append(_grid(table.columns, table.rows, [_WIDE / len(table.columns)] * len(table.columns)))
    return told


def _method(found: Dossier) -> list[Flowable]:
    noise, camera = found.inspection.pose_noise, found.inspection.camera
    claimed = "nothing" if noise is None else f"{1000 * noise.sigma_xy_m:.3g} mm, {noise.sigma_theta_rad:.3g} rad"
    sigmas = sorted(p["sigma_xy_m"] for p in found.poses if p["sigma_xy_m"] is not None)
    median = f"{1000 * sigmas[len(sigmas) // 2]:.3g} mm" if sigmas else "-"
    made = (found.seal or {}).get("sealed_by", {})
    rows = [
        ("Method", str(found.facts["method"])),
        ("Software", str(made.get("software", "not on record"))),
        ("Libraries", ", ".join(f"{k} {v}" for k, v in made.get("libraries", {}).items()) or "not on record"),
        ("Camera", f"{camera.width_px} x {camera.height_px} px, {1000 * camera.metres_per_pixel:.4g} mm a pixel"),
        ("Localisation claims", claimed),
        ("Corrected poses", f"one sigma of x and y, median {median}"),
    ]
    return [Paragraph("Method and quality", _HEAD), _grid([], rows, [38 * mm, _WIDE - 38 * mm])]


def _digests(found: Dossier) -> list[Flowable]:
    if found.seal is None:
        said = "The session is not sealed: it is not finished, and what it says may still change."
        return [Paragraph("Digests", _HEAD), Paragraph(said, _BODY)]
    made, records = found.seal["sealed_by"], found.seal["records"]
    rows = [
        ("Sealed", str(found.seal["sealed_at"])),
        ("Records, head", f"{records['count']}, {records['head']}"),
        ("Public key", str(found.seal["key"]["public"])),
        ("Method", str(made["method_sha256"])),
        *((f"Model {name}", str(digest)) for name, digest in made["models"].items()),
    ]
    note = "The evidence bundle of this session carries every picture by its SHA-256; the head stands for all records."
    return [Paragraph("Digests", _HEAD), _grid([], rows, [38 * mm, _WIDE - 38 * mm]), Paragraph(note, _SMALL)]


def _grid(columns: Sequence[str], rows: Sequence[Sequence[str]], widths: Sequence[float]) -> Flowable:
    cells = [[Paragraph(_safe(str(cell)), _SMALL) for cell in row] for row in rows]
    head = [[Paragraph(f"<b>{_safe(name)}</b>", _SMALL) for name in columns]] if columns else []
    style = [
        ("LINEBELOW", (0, 0), (-1, -1), 0.25, _GRID),
        ("VALIGN", (0, 0), (-1, -1), "TOP"),
        ("TOPPADDING", (0, 0), (-1, -1), 1.5),
        ("BOTTOMPADDING", (0, 0), (-1, -1), 1.5),
    ]
    return LongTable(
        [*head, *cells], colWidths=list(widths), repeatRows=len(head), style=TableStyle(style), hAlign="LEFT"
    )


def _image(content: bytes, size_px: tuple[int, int]) -> Flowable:
    width, height = _fit(size_px)
    return Image(io.BytesIO(content), width, height, hAlign="LEFT")


def _fit(size_px: tuple[int, int]) -> tuple[float, float]:
    scale = min(_WIDE / size_px[0], _TALL / size_px[1])
    return size_px[0] * scale, size_px[1] * scale


def _safe(text: str) -> str:
    return escape(text)


def _percent(share: Any) -> str:
    return f"{100 * share:.1f} %"
