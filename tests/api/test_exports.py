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


@pytest.mark.parametrize(
    ("form", "kind", "start"),
    [
        ("pdf", "application/pdf", b"%PDF-"),
        ("csv", "application/zip", b"PK"),
        ("mosaic", "image/tiff", b"II*"),
        ("layers", "image/tiff", b"II*"),
        ("png", "image/png", b"\x89PNG"),
        ("mcap", "application/octet-stream", b"\x89MCAP"),
        ("ifdo", "application/json", b"{"),
        ("json", "application/json", b"{"),
    ],
)
def test_a_session_is_handed_out_in_every_form(api: Api, session: str, form: str, kind: str, start: bytes) -> None:
    answer = api.get(session, f"/export/{form}")

    assert (answer.status_code, answer.headers["content-type"]) == (200, kind)
    assert answer.content.startswith(start)
    assert session in answer.headers["content-disposition"]
    assert int(answer.headers["content-length"]) == len(answer.content)


def test_a_view_that_makes_no_sense_is_a_problem(api: Api, session: str) -> None:
    answer = api.get(session, "/export/png", west=1, east=0, south=0, north=1)

    assert (answer.status_code, answer.json()["field"]) == (422, "view")


def test_files_in_the_making_leave_nothing_behind(api: Api, session: str) -> None:
    before = sorted(path.name for path in api.data.iterdir())
    api.get(session, "/export/pdf")
    api.get("nothing", "/export/pdf")

    assert sorted(path.name for path in api.data.iterdir()) == before


def test_a_result_without_a_server_has_the_same_forms(tmp_path: Path) -> None:
    bundle, result = tmp_path / "pond", tmp_path / "result"
    assert pondwatch("simulate", "--out", bundle, "--snapshots", 9).returncode == 0
    assert pondwatch("correct", bundle, "--out", result, "--method", "identity").returncode == 0

    made = pondwatch("export", result, "--of", bundle, "--format", "mcap", "--out", tmp_path / "pond.mcap")
    refused = pondwatch("export", result, "--of", bundle, "--format", "bundle", "--out", tmp_path / "no.zip")

    assert (made.returncode, made.stderr) == (0, "")
    assert (tmp_path / "pond.mcap").read_bytes().startswith(b"\x89MCAP")
    assert (refused.returncode, refused.stderr.count("\n")) == (2, 1)
    assert not (tmp_path / "no.zip").exists()
