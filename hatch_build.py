"""Puts into the wheel what is not Python: the front end with its vendored files, the migrations and the models.

`pondwatch.resources` finds them again. An editable install needs none of it: it finds them in the checkout.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

LEFT_OUT = {"node_modules", "test", "tests", "__pycache__"}
FOR_DEVELOPERS = {"package.json", "package-lock.json", "jsconfig.json", ".npmrc"}


class CompleteWheel(BuildHookInterface[Any]):
    """Adds `_frontend`, `_migrations` and `_models` to the package."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Called by the build with "standard" or "editable"."""
        if version == "editable":
            return
        for source, target in carried(Path(self.root)):
            build_data["force_include"][str(source)] = target


def carried(root: Path) -> Iterator[tuple[Path, str]]:
    """Every file to carry, with its path in the wheel.

    Raises:
        FileNotFoundError: a vendored file is not there; `make setup` fetches it.
    """
    for source in _tree(root / "frontend"):
        yield source, f"pondwatch/_frontend/{source.relative_to(root / 'frontend')}"
    vendored = json.loads((root / "frontend/vendor.json").read_text(encoding="utf-8"))
    for address, name in vendored.items():
        source = root / "frontend" / name
        if not source.is_file():
            raise FileNotFoundError(f"{source} is not there; `make setup` fetches it")
        yield source, f"pondwatch/_frontend{address}"
    for source in _tree(root / "migrations"):
        yield source, f"pondwatch/_migrations/{source.relative_to(root / 'migrations')}"
    for network in sorted((root / "models").glob("*/*.onnx")):
        for source in (network, network.with_suffix(".json")):  # some have their contract beside them
            if source.is_file():
                yield source, f"pondwatch/_models/{source.relative_to(root / 'models')}"


def _tree(folder: Path) -> Iterator[Path]:
    for path in sorted(folder.rglob("*")):
        inside = path.relative_to(folder)
        wanted = not LEFT_OUT & set(inside.parts) and path.name not in FOR_DEVELOPERS
        if path.is_file() and wanted and not path.name.endswith((".test.js", ".pyc")):
            yield path
