"""The house in order: locks without places, dependencies pinned, budgets that bite, a wheel that is complete."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import sysconfig
import tomllib
import zipfile
from pathlib import Path

import httpx
import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tests.bench.stage import server
from tools import budgets

ROOT = Path(__file__).parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
LOCKS = (
    "requirements.lock",
    "requirements-test.lock",
    "requirements-postgres.lock",
    "requirements-train.lock",
    "frontend/package-lock.json",
)
NEEDS = {
    "requirements.lock": PROJECT["dependencies"],
    "requirements-test.lock": PROJECT["dependencies"] + PROJECT["optional-dependencies"]["test"],
    "requirements-postgres.lock": PROJECT["dependencies"] + PROJECT["optional-dependencies"]["postgres"],
    "requirements-train.lock": PROJECT["dependencies"] + PROJECT["optional-dependencies"]["train"],
}
SESSION = {
    "format": "pond-session/1",
    "name": "empty",
    "camera": {"width_px": 160, "height_px": 110, "metres_per_pixel": 0.0005625},
    "pond": {"width_m": 0.54, "height_m": 0.37125, "rods": []},
}


def pins(lock: str) -> dict[str, str]:
    """Package to version."""
    found = re.findall(r"^([\w.-]+)==([^ \\\n]+)", (ROOT / lock).read_text(), re.MULTILINE)
    return {canonicalize_name(name): version for name, version in found}


@pytest.mark.parametrize("lock", LOCKS)
def test_a_lock_names_no_place_to_get_a_package_from(lock: str) -> None:
    text = (ROOT / lock).read_text()

    if lock.endswith(".json"):  # what a package says of its authors' funding is no place to get it from
        text = json.dumps(
            [{k: v for k, v in p.items() if k != "funding"} for p in json.loads(text)["packages"].values()]
        )
    assert re.findall(r"\S*(?:https?:|://|file:|--index-url|--find-links)\S*", text) == []


@pytest.mark.parametrize("lock", NEEDS)
def test_a_lock_pins_what_the_project_asks_for(lock: str) -> None:
    pinned = pins(lock)

    needs = [Requirement(n) for n in NEEDS[lock]]
    assert [str(n) for n in needs if pinned.get(canonicalize_name(n.name), "none") not in n.specifier] == []


def test_running_and_testing_use_the_same_versions() -> None:
    tested = pins("requirements-test.lock")

    assert pins("requirements.lock").items() <= tested.items()


@pytest.mark.parametrize("lock", ["requirements.lock", "requirements-test.lock", "requirements-postgres.lock"])
def test_every_locked_package_has_a_digest(lock: str) -> None:
    entries = re.split(r"\n(?=\S)", (ROOT / lock).read_text().strip())

    assert [e.split()[0] for e in entries if "--hash=sha256:" not in e] == []


def test_nothing_that_runs_needs_torch() -> None:
    assert "torch" not in pins("requirements.lock")
    imports = re.compile(r"^\s*(import|from) torch\b", re.MULTILINE)
    assert [p for p in (ROOT / "backend").rglob("*.py") if imports.search(p.read_text())] == []


def test_the_budget_counts_a_function_without_its_docstring(tmp_path: Path) -> None:
    source = tmp_path / "module.py"
    source.write_text('def f():\n    """One.\n\n    Two.\n    """\n    x = 1\n    return x\n')

    assert [f.lines for f in budgets.functions(source, "module.py")] == [3]  # def, x, return


@pytest.mark.parametrize(("lines", "complaints"), [(300, ""), (301, "over"), (501, "broken")])
def test_the_budget_of_a_module_bites(tmp_path: Path, lines: int, complaints: str) -> None:
    package = tmp_path / "backend/pondwatch"
    package.mkdir(parents=True)
    (package / "long.py").write_text("x = 1\n" * lines)

    over, broken = budgets.report(tmp_path)

    sentence = [f"backend/pondwatch/long.py: {lines} lines"]
    assert (over, broken) == (sentence if complaints == "over" else [], sentence if complaints == "broken" else [])


@pytest.mark.parametrize(("lines", "found"), [(50, 0), (61, 3)])
def test_the_budget_of_functions_bites(tmp_path: Path, lines: int, found: int) -> None:
    package = tmp_path / "backend/pondwatch"
    package.mkdir(parents=True)
    (package / "m.py").write_text("def f():\n" + "    x = 1\n" * (lines - 1))

    over, broken = budgets.report(tmp_path)

    # too long by itself, as one in ten, and as the share over 50: one function is all of them
    assert len(broken) == (found or 1)
    assert over == []


@pytest.fixture(scope="session")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A wheel of the tree as it is."""
    folder = tmp_path_factory.mktemp("wheel")
    build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    subprocess.run(build, cwd=ROOT, check=True, capture_output=True)
    return next(folder.glob("*.whl"))


def test_the_wheel_is_complete(wheel: Path) -> None:
    carried = set(zipfile.ZipFile(wheel).namelist())

    vendored = json.loads((ROOT / "frontend/vendor.json").read_text())
    wanted = {f"pondwatch/_frontend{address}" for address in vendored}
    wanted |= {"pondwatch/_frontend/index.html", "pondwatch/_frontend/app.js", "pondwatch/_migrations/env.py"}
    wanted |= {f"pondwatch/_models/{p.relative_to(ROOT / 'models')}" for p in (ROOT / "models").glob("*/*.onnx")}
    wanted |= {f"pondwatch/{p.relative_to(ROOT / 'backend/pondwatch')}" for p in (ROOT / "backend").rglob("*.py")}
    assert wanted - carried == set()


def test_the_wheel_carries_nothing_of_the_workshop(wheel: Path) -> None:
    carried = zipfile.ZipFile(wheel).namelist()

    assert [n for n in carried if re.search(r"node_modules|\.test\.js|package(-lock)?\.json|/tests?/|\.pyc", n)] == []


def test_every_page_and_module_of_the_front_end_asks_only_this_server() -> None:
    sources = [p for p in (ROOT / "frontend").rglob("*") if p.suffix in {".js", ".html", ".css"}]
    own = [p for p in sources if "node_modules" not in p.parts and not p.name.endswith(".test.js")]
    outside = re.compile(r"""(?:src|href|from|import|url|fetch|WebSocket)\s*[=(]?\s*["'(](?:https?:|wss?:)?//""")

    assert own
    assert [str(p) for p in own if outside.search(p.read_text())] == []


def test_an_installed_wheel_serves_from_an_empty_folder(wheel: Path, tmp_path: Path) -> None:
    python = _environment(tmp_path)
    # what the wheel needs is taken from where this test runs; the wheel itself must come from its own environment
    libraries = next((tmp_path / "venv").rglob("site-packages"))
    (libraries / "libraries.pth").write_text(sysconfig.get_path("purelib") + "\n")
    _install(python, "-q", "--no-deps", "--no-index", wheel)

    _shows_a_page_and_opens_a_session(python, tmp_path)


@pytest.mark.long
def test_a_wheel_and_the_lock_are_enough_for_a_fresh_machine(wheel: Path, tmp_path: Path) -> None:
    python = _environment(tmp_path)
    _install(python, "-qq", "-r", ROOT / "requirements.lock")
    _install(python, "-qq", "--no-deps", "--no-index", wheel)

    _shows_a_page_and_opens_a_session(python, tmp_path)


def _environment(folder: Path) -> Path:
    """An empty one; pip is not in it, as unpacking it takes longer than all the rest."""
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", folder / "venv"], check=True)
    return folder / "venv/bin/python"


def _install(python: Path, *what: str | Path) -> None:
    """Into the environment of that interpreter, by the pip of this one."""
    subprocess.run([sys.executable, "-m", "pip", "--python", python, "install", *what], check=True)


def _shows_a_page_and_opens_a_session(python: Path, folder: Path) -> None:
    """Its front end, its vendored files and its migrations are the wheel's own: there is no checkout beside it."""
    (folder / "empty").mkdir()
    with server(folder / "data", python=python, cwd=folder / "empty") as url:
        pages = [httpx.get(f"{url}{address}").status_code for address in ("/", "/app.js", "/vendor/ol.js")]
        session = httpx.post(f"{url}/api/sessions", json=SESSION).status_code
    assert (pages, session) == ([200, 200, 200], 201)
    assert list((folder / "empty").iterdir()) == []


def test_a_server_that_starts_loads_nothing_that_it_may_never_need() -> None:
    """Reports, recordings, migrations and correction methods, which together take as long to load as all the rest."""
    late = [
        "reportlab",
        "mcap",
        "alembic",
        "sqlalchemy.dialects.postgresql",
        "rasterio",
        "onnxruntime",
        "typer",
        "scipy.spatial",
    ]
    late += ["pondwatch.core.corrector", "pondwatch.simulator", "pondwatch.jobs.worker"]
    script = f"import sys, pondwatch.app; print([name for name in {late} if name in sys.modules])"

    assert subprocess.check_output([sys.executable, "-c", script], text=True) == "[]\n"
