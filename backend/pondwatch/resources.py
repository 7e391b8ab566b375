"""Where the files that are not Python lie: the front end, the migrations and the models.

A wheel carries them inside the package (`_frontend`, `_migrations`, `_models`); a checkout has them beside
`backend/`. Callers ask here and need not know which.
"""

from __future__ import annotations

from pathlib import Path

_PACKAGE = Path(__file__).parent
_CHECKOUT = _PACKAGE.parent.parent


def frontend_dir() -> Path:
    """The folder that holds `index.html` and `vendor/`, to be served as it is."""
    return _folder("frontend")


def migrations_dir() -> Path:
    """Alembic's script folder, the one that holds `env.py`."""
    return _folder("migrations")


def models_dir() -> Path:
    """The folder with one folder a model, each with its ONNX file."""
    return _folder("models")


def _folder(name: str) -> Path:
    carried = _PACKAGE / f"_{name}"
    return carried if carried.is_dir() else _CHECKOUT / name
