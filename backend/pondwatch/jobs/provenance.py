"""What a result was made by: the program's version, the method, and digests of what decides it."""

from __future__ import annotations

import hashlib
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path

from pondwatch import __version__, core
from pondwatch.resources import models_dir

from .methods import LEARNED_METHOD, PAPER_METHODS
from .views import Json

_LIBRARIES = ("numpy", "onnxruntime", "opencv-python-headless", "scipy")


@lru_cache(maxsize=16)
def made_by(method: str) -> Json:
    """`software`, `method`, `method_sha256`, `models` (path to SHA-256) and `libraries` (name to version)."""
    return {
        "software": f"pondwatch {__version__}",
        "method": method,
        "method_sha256": method_digest(),
        "models": {name: _digest(models_dir() / name) for name in _models_of(method)},
        "libraries": {name: version(name) for name in _LIBRARIES},
    }


@lru_cache(maxsize=1)
def method_digest() -> str:
    """SHA-256 of what `sha256sum *.py` prints, sorted by name, in the package's folder `core`."""
    sources = sorted(Path(core.__path__[0]).glob("*.py"), key=lambda path: path.name)
    listed = "".join(f"{_digest(path)}  {path.name}\n" for path in sources)
    return hashlib.sha256(listed.encode()).hexdigest()


def _models_of(method: str) -> tuple[str, ...]:
    if method == LEARNED_METHOD:
        return ("rods/rods.onnx",)
    return (f"paper/{method}.onnx",) if method in PAPER_METHODS else ()


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
