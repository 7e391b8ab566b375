"""Plots put a value where its axis says."""

from __future__ import annotations

import re
from pathlib import Path
from xml.etree import ElementTree

import pytest

from tests.bench.plots import Axis, Panel, write_plot


def circles(path: Path) -> list[tuple[float, float]]:
    """(x, y), px, of every point, in the order drawn."""
    return [(float(x), float(y)) for x, y in re.findall(r'<circle cx="([\d.]+)" cy="([\d.]+)"', path.read_text())]


def test_points_lie_at_their_share_of_the_axis(tmp_path: Path) -> None:
    panel = Panel("a < b", ["low", "high"], {"one": [[0.0, 0.5], [1.0]], "two": [[], []]})

    write_plot(tmp_path / "p.svg", [panel], Axis(0, 1, (0, 1), str))

    # 130 px of height from 26 to 156; 210 px of width from 68
    assert circles(tmp_path / "p.svg") == [(68.0, 156.0), (68.0, 91.0), (278.0, 26.0)]
    assert ElementTree.parse(tmp_path / "p.svg").getroot().tag.endswith("svg")


def test_a_logarithmic_axis_gives_every_power_the_same_room() -> None:
    axis = Axis(0.01, 100, (0.01, 1, 100), str, logarithmic=True)

    assert [axis.share(v) for v in (0.001, 0.01, 1, 100)] == pytest.approx([0, 0, 0.5, 1])
