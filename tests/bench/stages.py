"""What the server says of its own stages, from `/metrics`."""

from __future__ import annotations

import re

import httpx

Stages = dict[str, float]
_LINE = re.compile(r'^pondwatch_stage_seconds_(sum|count)\{stage="(\w+)"\} (\S+)$', re.MULTILINE)


async def stages(url: str) -> Stages:
    """The mean of each stage, seconds; NaN of one that never was."""
    async with httpx.AsyncClient(base_url=url, timeout=60) as client:
        return means((await client.get("/metrics")).text)


def means(text: str) -> Stages:
    """The same, of metrics as Prometheus reads them."""
    found: dict[str, dict[str, float]] = {}
    for kind, stage, value in _LINE.findall(text):
        found.setdefault(stage, {})[kind] = float(value)
    return {stage: f["sum"] / f["count"] if f["count"] else float("nan") for stage, f in found.items()}
