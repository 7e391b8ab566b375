"""The card's text: figures put into CARD.template."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

Corrected = tuple[str, int, Mapping[str, float], Mapping[str, float]]

CARD = Path(__file__).with_name("CARD.template")


def text(told: Mapping[str, Any], detected: Mapping[str, Any], corrected: Sequence[Corrected], command: str) -> str:
    """The whole card. told: what rods.json says. detected: by set. corrected: water, seed, without, with."""
    recipe = told["recipe"]
    return CARD.read_text(encoding="utf-8").format(
        **{k: v for k, v in recipe.items() if k != "loss"}, sha256=told["sha256"], command=command,
        record="0007-a-network-finds-rods-on-request.md", first=recipe["loss"][0], last=recipe["loss"][-1],
        found="\n".join(_found(name, w, d[w]) for name, d in detected.items() for w in ("classical", "network")),
        aside="\n".join(_row(name, *d["aside"].values()) for name, d in detected.items()),
        corrected="\n".join(_corrected(*c) for c in corrected),
    )  # fmt: skip


def _found(name: str, which: str, r: Mapping[str, float]) -> str:
    return _row(name, which, r["rods"], r["recall"], r["precision"], r["median_px"], r["p90_px"])


def _corrected(kind: str, seed: int, without: Mapping[str, float], joined: Mapping[str, float]) -> str:
    pairs = (v for k in ("gross", "gross_placed", "placed", "median_px") for v in (without[k], joined[k]))
    return _row(kind, seed, *pairs)


def _row(*cells: object) -> str:
    return f"| {' | '.join(str(c) for c in cells)} |"
