"""Sessions as files, over REST and by the commands that check them."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.api.conftest import Api
from tests.fakes.robot import Shot


def pondwatch(*arguments: Any) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", "from pondwatch.cli import main; main()", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)


@pytest.fixture(scope="module")
def session(api: Api) -> str:
    found = api.open()
    for i in range(3):
        api.send(found, Shot(i))
    api.finish(found)
    return found


def test_a_bundle_made_by_the_server_is_verified_by_the_command(api: Api, session: str, tmp_path: Path) -> None:
    bundle, key = tmp_path / "bundle.zip", tmp_path / "plant.pem"

    made = pondwatch("export", session, "--format", "bundle", "--out", bundle, "--url", api.http.base_url)
    shown = pondwatch("key", "--data", api.data, "--out", key)

    told = api.http.get("/api/key").json()
    assert (made.returncode, made.stderr) == (0, "")
    assert bundle.read_bytes() == api.get(session, "/export/bundle").content
    assert (shown.stdout.strip(), key.read_text()) == (told["public"], told["pem"])
    intact = pondwatch("verify", bundle, "--key", key)
    assert (intact.returncode, intact.stderr) == (0, "")
    assert intact.stdout.startswith(f"INTACT: session {session}")
    assert "3 images" in intact.stdout


def test_a_tampered_bundle_ends_with_1_and_a_line_that_says_what_is_wrong(
    api: Api, session: str, tmp_path: Path
) -> None:
    content = bytearray(api.get(session, "/export/bundle").content)
    content[content.index(b"poses.csv") + 100] ^= 1
    (tmp_path / "bundle.zip").write_bytes(content)

    done = pondwatch("verify", tmp_path / "bundle.zip")

    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr == "NOT INTACT: poses.csv: was changed: its bytes are damaged.\n"


def test_what_cannot_be_checked_ends_with_2(tmp_path: Path) -> None:
    done = pondwatch("verify", tmp_path / "nothing.zip")

    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert "nothing.zip: cannot be read" in done.stderr


def test_an_open_session_a_missing_one_and_an_unknown_format_are_problems(api: Api, session: str) -> None:
    answers = [
        api.get(api.open(), "/export/bundle"),
        api.get("nothing", "/export/bundle"),
        api.get(session, "/export/papyrus"),
    ]

    assert [a.status_code for a in answers] == [409, 404, 422]
    assert {a.headers["content-type"] for a in answers} == {"application/problem+json"}
    assert "papyrus" in answers[2].json()["detail"]
