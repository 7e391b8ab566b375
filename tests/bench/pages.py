"""Writes figures down: tables in Markdown, the machine beside them."""

from __future__ import annotations

import os
import platform
import re
import statistics
from collections.abc import Callable, Iterable, Sequence
from importlib.metadata import version
from pathlib import Path

ROOT = Path(__file__).parents[2]


def machine() -> str:
    """One sentence: what the figures were made on."""
    cpu = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.exists():
        names = re.findall(r"^model name\s*: (.+)$", info.read_text(), re.MULTILINE)
        cpu = " ".join(names[0].split()) if names else cpu
    system = f"{platform.system()}, Python {platform.python_version()}"
    return f"Made on {cpu}, {os.cpu_count()} cores, {system}; Pondwatch {version('pondwatch')}."


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table; the first column to the left, the others to the right."""
    lines = [head, ["---", *["---:"] * (len(head) - 1)], *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def write_page(name: str, title: str, parts: Iterable[str]) -> Path:
    """docs/`name`, whole."""
    path = ROOT / "docs" / name
    body = "\n\n".join(part.strip() for part in (f"# {title}", *parts, machine()))
    path.write_text(body + "\n", encoding="utf-8")
    return path


def replace_block(path: Path, name: str, text: str) -> None:
    """What stands between `<!-- name:begin -->` and `<!-- name:end -->`.

    Raises:
        ValueError: the file has no such markers.
    """
    before = path.read_text(encoding="utf-8")
    pattern = re.compile(rf"(<!-- {name}:begin -->\n).*?(<!-- {name}:end -->)", re.DOTALL)
    after, found = pattern.subn(lambda m: f"{m[1]}{text.strip()}\n{m[2]}", before)
    if not found:
        raise ValueError(f"{path} has no markers for {name}")
    path.write_text(after, encoding="utf-8")


def number(value: float | None, digits: int = 3) -> str:
    """Three significant digits, no exponent; a dash where there is none."""
    if value is None or value != value:
        return "-"
    return f"{value:.{digits}g}" if abs(value) < 100 else f"{value:.0f}"


def percent(value: float | None) -> str:
    """A share as percent with one decimal; a dash where there is none."""
    return "-" if value is None else f"{100 * value:.1f} %"


def spread(
    values: Sequence[float],
    worst: Callable[[Sequence[float]], float],
    show: Callable[[float], str],
    goal: float | None = None,
) -> str:
    """The median, the worst of several in brackets, and after a slash what is asked; a dash where there is none."""
    if not values:
        return "-"
    others = f" ({show(worst(values))})" if len(values) > 1 else ""
    asked = "" if goal is None else f" / {show(goal)}"
    return f"{show(statistics.median(values))}{others}{asked}"
