"""The docs tell all: every setting, command, endpoint and metric, and no link leads nowhere."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import pytest

from tools import reference

ROOT = Path(__file__).parent.parent
PAGES = [ROOT / "README.md", ROOT / "SECURITY.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").rglob("*.md"))]


@cache
def told() -> str:
    """What docs/reference.md says now."""
    return reference.PAGE.read_text()


@cache
def true() -> str:
    """What it would say if it were written anew."""
    return reference.render()


def section(text: str, title: str) -> dict[str, str]:
    """First column to the whole row, of the table under a heading."""
    body = text.split(f"\n## {title}\n")[1].split("\n## ")[0]
    rows = [line for line in body.splitlines() if line.startswith("| `")]
    return {line.split(" | ")[0].removeprefix("| "): line for line in rows}


@pytest.mark.parametrize("title", ["Settings", "Commands", "Endpoints", "Metrics"])
def test_the_reference_tells_what_there_is_and_no_more(title: str) -> None:
    there_is = section(true(), title)

    assert there_is
    assert set(section(told(), title)) == set(there_is), "run `make reference`"
    assert [name for name, row in there_is.items() if "|  |" in row] == [], "they say nothing of themselves"


def test_every_option_of_a_command_is_told() -> None:
    assert section(told(), "Commands") == section(true(), "Commands")


@pytest.mark.parametrize("page", PAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_every_link_inside_the_docs_leads_somewhere(page: Path) -> None:
    links = re.findall(r"\]\(([^)\s]+)\)", page.read_text())

    inside = [link for link in links if not link.startswith(("http:", "https:", "mailto:"))]
    assert [link for link in inside if not _leads(page, link)] == []


def _leads(page: Path, link: str) -> bool:
    name, _, anchor = link.partition("#")
    target = page.parent / name if name else page
    if not target.exists():
        return False
    headings = re.findall(r"^#+ (.+)$", target.read_text(), re.MULTILINE) if anchor else []
    return not anchor or anchor in [re.sub(r"[^\w -]", "", h.lower()).replace(" ", "-") for h in headings]


@pytest.mark.parametrize("page", PAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_every_make_target_that_is_named_exists(page: Path) -> None:
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))

    named = re.findall(r"`make ([a-z-]+)|^make ([a-z-]+)", page.read_text(), re.MULTILINE)
    assert {a or b for a, b in named} <= targets


@pytest.mark.parametrize("page", PAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_every_command_that_is_named_exists(page: Path) -> None:
    commands = {name.split()[1].rstrip("`") for name in section(true(), "Commands")}

    code = re.findall(r"`[^`]+`|^\S*/pondwatch .+$", page.read_text(), re.MULTILINE)
    assert set(re.findall(r"pondwatch ([a-z]+)", "\n".join(code))) <= commands
