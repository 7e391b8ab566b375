"""What a report is put together of: headings, texts, tables, and the places to sign."""

from __future__ import annotations

import io
from collections.abc import Sequence
from xml.sax.saxutils import escape

from reportlab.lib import colors
from reportlab.lib.pagesizes import A4
from reportlab.lib.styles import ParagraphStyle
from reportlab.lib.units import mm
from reportlab.pdfbase import pdfmetrics
from reportlab.pdfbase.ttfonts import TTFont
from reportlab.platypus import Flowable, Image, KeepTogether, LongTable, Paragraph, Spacer, TableStyle
from reportlab.platypus import Table as Cells

from .reportpictures import BOLD, GREY, PLAIN

MARGIN = 18 * mm
WIDE = A4[0] - 2 * MARGIN
_LINE = colors.Color(0.75, 0.75, 0.75)
_GROUND = colors.Color(0.94, 0.94, 0.94)
_FONTS = {PLAIN: "Vera.ttf", BOLD: "VeraBd.ttf"}  # they come with reportlab
_BODY = ParagraphStyle("body", fontName=PLAIN, fontSize=8.5, leading=12)
_SMALL = ParagraphStyle("small", parent=_BODY, fontSize=7, leading=9)
_CELL = ParagraphStyle("cell", parent=_SMALL, splitLongWords=1, wordWrap="CJK")
_NAMED = ParagraphStyle("named", parent=_SMALL, textColor=GREY)
_HEAD = ParagraphStyle("head", parent=_BODY, fontName=BOLD, fontSize=11, leading=15, spaceBefore=8, spaceAfter=3)
_TITLE = ParagraphStyle("title", parent=_HEAD, fontSize=17, leading=21, spaceBefore=0)
_FIGURE = ParagraphStyle("figure", parent=_HEAD, fontSize=10, leading=13, spaceBefore=0, spaceAfter=0)
_NAME_WIDE = 30 * mm
_SHORT, _LONG = 6, 32  # letters: what a column of a table is at least and at most wide enough for


def register_fonts() -> None:
    """Make the fonts known to reportlab; again is as good as once."""
    for name, file in _FONTS.items():
        if name not in pdfmetrics.getRegisteredFontNames():
            pdfmetrics.registerFont(TTFont(name, file))


def title(name: str, standing: str) -> list[Flowable]:
    """The head of the first page."""
    return [Paragraph("INSPECTION REPORT", _NAMED), Paragraph(escape(name), _TITLE), paragraph(standing), Spacer(1, 6)]


def head(text: str) -> Flowable:
    """A heading; it stays with what follows."""
    found = Paragraph(escape(text), _HEAD)
    found.keepWithNext = True
    return found


def paragraph(text: str) -> Flowable:
    """A text."""
    return Paragraph(escape(text), _BODY)


def small(text: str) -> Flowable:
    """A text below a picture or a table."""
    return Paragraph(escape(text), _SMALL)


def tiles(headlines: Sequence[tuple[str, str]]) -> Flowable:
    """What it comes to, side by side: a name and a figure each."""
    cells = [[[Paragraph(escape(name), _NAMED), Paragraph(escape(said), _FIGURE)] for name, said in headlines]]
    style = [
        ("BACKGROUND", (0, 0), (-1, -1), _GROUND),
        ("INNERGRID", (0, 0), (-1, -1), 3, colors.white),
        ("VALIGN", (0, 0), (-1, -1), "TOP"),
        ("BOTTOMPADDING", (0, 0), (-1, -1), 5),
    ]
    return Cells(cells, colWidths=[WIDE / len(headlines)] * len(headlines), style=TableStyle(style), hAlign="LEFT")


def facts(rows: Sequence[tuple[str, str]], across: int = 2) -> Flowable:
    """Names with values, so many pairs side by side."""
    texts = [[Paragraph(escape(name), _NAMED), Paragraph(escape(value), _CELL)] for name, value in rows]
    texts += [["", ""]] * (-len(texts) % across)
    cells = [[cell for pair in texts[i : i + across] for cell in pair] for i in range(0, len(texts), across)]
    widths = [_NAME_WIDE, WIDE / across - _NAME_WIDE] * across
    return Cells(cells, colWidths=widths, style=_ruled(), hAlign="LEFT")


def shares_of(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> list[float]:
    """Of the width, a column each: by its longest text, within reason."""
    longest = [max(len(str(text)) for text in texts) for texts in zip(columns, *rows, strict=True)]
    wanted = [min(max(length, _SHORT), _LONG) + 1.5 for length in longest]
    return [share / sum(wanted) for share in wanted]


def grid(columns: Sequence[str], rows: Sequence[Sequence[str]], shares: Sequence[float]) -> Flowable:
    """A table over as many pages as it takes, its head on each. shares: of the width, a column each."""
    cells = [[Paragraph(escape(str(cell)), _CELL) for cell in row] for row in rows]
    first = [[Paragraph(f'<font name="{BOLD}">{escape(name)}</font>', _SMALL) for name in columns]]
    style = _ruled([("LINEBELOW", (0, 0), (-1, 0), 0.8, colors.black)])
    widths = [share * WIDE for share in shares]
    return LongTable([*first, *cells], colWidths=widths, repeatRows=1, style=style, hAlign="LEFT")


def _ruled(more: Sequence[tuple[object, ...]] = ()) -> TableStyle:
    lines = [
        ("LINEBELOW", (0, 0), (-1, -1), 0.25, _LINE),
        ("VALIGN", (0, 0), (-1, -1), "TOP"),
        ("TOPPADDING", (0, 0), (-1, -1), 1.5),
        ("BOTTOMPADDING", (0, 0), (-1, -1), 1.5),
        ("LEFTPADDING", (0, 0), (-1, -1), 0),
        *more,
    ]
    return TableStyle(lines)


def strip(pictures: Sequence[tuple[bytes, str]], across: int = 6) -> Flowable:
    """Square pictures with a line below each, so many side by side."""
    side = WIDE / across - 6
    cells = [[Image(io.BytesIO(content), side, side), small(said)] for content, said in pictures]
    padded = [*cells, *([[]] * (-len(cells) % across))]
    rows = [padded[i : i + across] for i in range(0, len(padded), across)]
    style = TableStyle([("LEFTPADDING", (0, 0), (-1, -1), 0), ("VALIGN", (0, 0), (-1, -1), "TOP")])
    return Cells(rows, colWidths=[WIDE / across] * across, style=style, hAlign="LEFT")


def signatures() -> Flowable:
    """Where those who answer for the report sign it."""
    names = ("Inspected by", "Name", "Date", "Signature"), ("Reviewed by", "Name", "Date", "Signature")
    cells = [[Paragraph(escape(name), _NAMED) for name in row] for row in names]
    style = TableStyle(
        [
            ("LINEBELOW", (1, 0), (-1, -1), 0.5, colors.black),
            ("VALIGN", (0, 0), (-1, -1), "BOTTOM"),
            ("LEFTPADDING", (0, 0), (-1, -1), 0),
        ]
    )
    widths = [share * WIDE for share in (0.18, 0.32, 0.18, 0.32)]
    return KeepTogether(
        [head("Signed"), Cells(cells, colWidths=widths, rowHeights=[11 * mm] * 2, style=style, hAlign="LEFT")]
    )
