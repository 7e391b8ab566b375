"""The files that are not Python are found from a checkout and from a wheel."""

from pathlib import Path

import pytest

from pondwatch import resources

CHECKOUT = Path(__file__).parent.parent
FINDERS = {
    "frontend": resources.frontend_dir,
    "migrations": resources.migrations_dir,
    "models": resources.models_dir,
}


@pytest.mark.parametrize("name", FINDERS)
def test_a_checkout_has_them_beside_the_backend(name: str) -> None:
    assert FINDERS[name]() == CHECKOUT / name


@pytest.mark.parametrize("name", FINDERS)
def test_a_wheel_has_them_inside_the_package(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / f"_{name}").mkdir()
    monkeypatch.setattr(resources, "_PACKAGE", tmp_path)

    assert FINDERS[name]() == tmp_path / f"_{name}"
