"""Small plots as SVG, written by hand: panels side by side, points for single ponds, a line through their medians."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import escape

WIDTH, HEIGHT = 300, 190  # of a panel, px
LEFT, RIGHT, TOP, BOTTOM = 56, 10, 26, 34
COLOURS = ("#0b6e99", "#c2410c", "#6b7280", "#15803d")  # told apart in grey too
MARKS = ("none", "5 3", "2 2", "7 2 2 2")


@dataclass(frozen=True, slots=True)
class Axis:
    """The vertical axis: from `low` to `high`, lines at `ticks`, values told by `show`."""

    low: float
    high: float
    ticks: Sequence[float]
    show: Callable[[float], str]
    logarithmic: bool = False

    def share(self, value: float) -> float:
        """Where a value lies, 0 at the bottom to 1 at the top; beyond the ends at them."""
        value = min(max(value, self.low), self.high)
        if self.logarithmic:
            return math.log(value / self.low) / math.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)


@dataclass(frozen=True, slots=True)
class Panel:
    """One plot. lines: name to, for each of `levels`, the values of its ponds."""

    title: str
    levels: Sequence[str]
    lines: Mapping[str, Sequence[Sequence[float]]]


def write_plot(path: Path, panels: Sequence[Panel], axis: Axis, columns: int = 3) -> None:
    """All panels in rows, the names of the lines below."""
    rows = -(-len(panels) // columns)
    width, height = columns * WIDTH, rows * HEIGHT + 30
    body = [part for k, panel in enumerate(panels) for part in _panel(panel, axis, k % columns, k // columns)]
    body += _legend(list(panels[0].lines), rows * HEIGHT + 18)
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" '
        'font-family="sans-serif" font-size="11" fill="#111827">'
    )
    path.write_text("\n".join([head, f'<rect width="{width}" height="{height}" fill="#fff"/>', *body, "</svg>\n"]))


def _panel(panel: Panel, axis: Axis, column: int, row: int) -> Iterator[str]:
    yield f'<g transform="translate({column * WIDTH} {row * HEIGHT})">'
    yield _text(LEFT, 16, panel.title, weight="bold")
    for tick in axis.ticks:
        y = _y(axis, tick)
        yield f'<line x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{y}" y2="{y}" stroke="#e5e7eb"/>'
        yield _text(LEFT - 5, y + 4, axis.show(tick), "end")
    for k, level in enumerate(panel.levels):
        yield _text(_x(panel, k), HEIGHT - BOTTOM + 16, level, "middle")
    for k, values in enumerate(panel.lines.values()):
        yield from _line(panel, axis, values, k)
    yield "</g>"


def _line(panel: Panel, axis: Axis, values: Sequence[Sequence[float]], k: int) -> Iterator[str]:
    colour = COLOURS[k]
    middle = [(_x(panel, i), _y(axis, statistics.median(v))) for i, v in enumerate(values) if v]
    points = " ".join(f"{x},{y}" for x, y in middle)
    yield (
        f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="1.6" stroke-dasharray="{MARKS[k]}"/>'
    )
    for i, each in enumerate(values):
        for value in each:
            yield f'<circle cx="{_x(panel, i)}" cy="{_y(axis, value)}" r="2.4" fill="{colour}" fill-opacity="0.55"/>'


def _legend(names: Sequence[str], y: float) -> Iterator[str]:
    x = float(LEFT)
    for k, name in enumerate(names):
        yield (
            f'<line x1="{x}" x2="{x + 26}" y1="{y - 4}" y2="{y - 4}" stroke="{COLOURS[k]}" stroke-width="2" '
            f'stroke-dasharray="{MARKS[k]}"/>'
        )
        yield _text(x + 32, y, name)
        x += 32 + 6.2 * len(name) + 24


def _x(panel: Panel, k: int) -> float:
    room = WIDTH - LEFT - RIGHT - 24
    return round(LEFT + 12 + room * (k / max(1, len(panel.levels) - 1)), 1)


def _y(axis: Axis, value: float) -> float:
    return round(HEIGHT - BOTTOM - axis.share(value) * (HEIGHT - TOP - BOTTOM), 1)


def _text(x: float, y: float, text: str, anchor: str = "start", weight: str = "normal") -> str:
    return f'<text x="{x}" y="{y}" text-anchor="{anchor}" font-weight="{weight}">{escape(text)}</text>'
