"""How long modules and functions are, against the budget of docs/developers.md.

Prints what is over the budget, fails on what is over a hard limit. A function's length is from its `def` to its last
line, its docstring not counted.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

MODULE_LINES, MODULE_LIMIT = 300, 500
FUNCTION_LINES, FUNCTION_LIMIT = 50, 60
P90_LIMIT, SHARE_OVER_LIMIT = 30, 0.04
CODE = ("backend/pondwatch", "tools", "migrations", "models", "hatch_build.py")
SCRIPTS = ("frontend",)
TESTS = ("tests",)
SKIPPED = {"node_modules", "vendor", "__pycache__", "versions"}  # migrations are lists, and never edited


@dataclass(frozen=True, slots=True)
class Function:
    """One function and its length in lines."""

    place: str
    lines: int


def files(root: Path, names: tuple[str, ...], suffix: str) -> Iterator[Path]:
    """The files under `names` that end in `suffix`, sorted."""
    for name in names:
        start = root / name
        found = [start] if start.is_file() else sorted(start.rglob(f"*{suffix}"))
        yield from (p for p in found if p.suffix == suffix and not SKIPPED & set(p.parts))


def functions(path: Path, name: str) -> list[Function]:
    """Every function of a Python file; `name` is what the file is called in what is printed."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    found = [n for n in ast.walk(tree) if isinstance(n, ast.FunctionDef | ast.AsyncFunctionDef)]
    return [Function(f"{name}:{n.lineno} {n.name}", _length(n)) for n in found]


def _length(node: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    first = node.body[0]
    documented = isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant)
    docstring = (first.end_lineno or 0) - first.lineno + 1 if documented else 0
    return (node.end_lineno or node.lineno) - node.lineno + 1 - docstring


def long_modules(root: Path) -> list[tuple[str, int]]:
    """Modules over the budget, longest first."""
    every = [*files(root, CODE + TESTS, ".py"), *files(root, SCRIPTS, ".js")]
    sizes = [(str(p.relative_to(root)), p.read_text(encoding="utf-8").count("\n")) for p in every]
    return sorted((s for s in sizes if s[1] > MODULE_LINES), key=lambda s: -s[1])


def report(root: Path) -> tuple[list[str], list[str]]:
    """What is over the budget, and of that what is over a hard limit: sentences, both."""
    over: list[str] = []
    broken: list[str] = []
    for name, lines in long_modules(root):
        (broken if lines > MODULE_LIMIT else over).append(f"{name}: {lines} lines")
    found = [f for p in files(root, CODE, ".py") for f in functions(p, str(p.relative_to(root)))]
    for f in sorted(found, key=lambda f: -f.lines):
        if f.lines > FUNCTION_LINES:
            (broken if f.lines > FUNCTION_LIMIT else over).append(f"{f.place}: {f.lines} lines")
    return over, broken + _as_a_whole(sorted(f.lines for f in found))


def _as_a_whole(lengths: list[int]) -> list[str]:
    if not lengths:
        return []
    p90 = lengths[int(0.9 * (len(lengths) - 1))]
    share = sum(n > FUNCTION_LINES for n in lengths) / len(lengths)
    broken = []
    if p90 > P90_LIMIT:
        broken.append(f"one function in ten is over {p90} lines; the limit is {P90_LIMIT}")
    if share > SHARE_OVER_LIMIT:
        broken.append(f"{share:.1%} of functions are over {FUNCTION_LINES} lines; the limit is {SHARE_OVER_LIMIT:.0%}")
    return broken


def main() -> int:
    """Print what is over; 1 where a hard limit is broken."""
    over, broken = report(Path(__file__).parent.parent)
    for line in over:
        print(f"over the budget: {line}")
    for line in broken:
        print(f"over the limit: {line}", file=sys.stderr)
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
