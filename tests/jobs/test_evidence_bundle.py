"""A finished session as evidence: checked by Pondwatch, and by a program that knows docs/evidence.md alone."""

from __future__ import annotations

import ast
import csv
import hashlib
import json
import random
import stat
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from cryptography.hazmat.primitives import serialization
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
from sqlalchemy import text

from pondwatch.basestation.bundle import Bundle
from pondwatch.core.errors import Unavailable
from pondwatch.jobs.evidencezip import write_evidence
from pondwatch.jobs.sealing import NotClosed, SealBroken, seal
from pondwatch.jobs.verify import Tampered, public_key_of, verify
from pondwatch.store import seals, sessions
from pondwatch.store.signing import Signer
from tests.fakes.house import House
from tests.fakes.robot import Shot
from tools import verify_bundle

LATER_MS = 9_000


@pytest.fixture(scope="module")
def house(tmp_path_factory: pytest.TempPathFactory) -> Iterator[House]:
    built = House(tmp_path_factory.mktemp("house"))
    built.send(*(Shot(i) for i in range(5)), Shot(5).but(captured_at=...), Shot(6, image=Shot(0).content))
    built.finish()
    yield built
    built.store.close()


@pytest.fixture(scope="module")
def bundle(house: House) -> Path:
    return written(house, house.store.folder / "bundle.zip")


def written(house: House, path: Path) -> Path:
    with path.open("w+b") as file:
        write_evidence(house.store, house.session, file, LATER_MS)
    return path


def own_verdict(path: Path, key: str | None = None) -> str:
    try:
        verify(path, key)
    except Tampered as error:
        return error.message
    return "intact"


def other_verdict(path: Path, key: str | None = None) -> str:
    try:
        verify_bundle.verify(str(path), key)
    except verify_bundle.Wrong as error:
        return str(error)
    return "intact"


def remade(bundle: Path, path: Path, change: Callable[[dict[str, bytes]], None]) -> Path:
    """The bundle with other contents, as someone without the key could make it."""
    with zipfile.ZipFile(bundle) as old, zipfile.ZipFile(path, "w") as new:
        contents = {name: old.read(name) for name in old.namelist()}
        change(contents)
        for name, content in contents.items():
            new.writestr(name, content)
        new.comment = old.comment
    return path


def lines_of(contents: dict[str, bytes], change: Callable[[list[bytes]], Any]) -> None:
    lines = contents["records.jsonl"].splitlines(keepends=True)
    change(lines)
    contents["records.jsonl"] = b"".join(lines)


def flip(contents: dict[str, bytes], name: str) -> None:
    changed = bytearray(contents[name])
    changed[len(changed) // 2] ^= 4
    contents[name] = bytes(changed)


def image_of(contents: dict[str, bytes]) -> str:
    return next(name for name in contents if name.startswith("images/"))


def test_an_untouched_bundle_is_intact(house: House, bundle: Path) -> None:
    found = verify(bundle, house.store.signer.public)

    assert (found.session, found.images, found.key) == (house.session, 6, house.store.signer.public)
    assert found.records == 1 + 7 + 1 + 1  # session, snapshots, table, the one tile; no rod was read
    assert verify_bundle.verify(str(bundle), house.store.signer.public)["session"]["id"] == house.session


FORGERIES: dict[str, tuple[Callable[[dict[str, bytes]], Any], str]] = {
    "a flipped bit of an image": (lambda c: flip(c, image_of(c)), "was changed"),
    "a flipped bit of the mosaic": (lambda c: flip(c, "mosaic/0-0.png"), "mosaic/0-0.png"),
    "a flipped bit of the poses": (lambda c: flip(c, "poses.csv"), "poses.csv"),
    "a flipped bit of the manifest": (lambda c: flip(c, "manifest.json"), "manifest.json"),
    "a flipped bit of the signature": (lambda c: flip(c, "manifest.sig"), "manifest.json"),
    "a removed record": (lambda c: lines_of(c, lambda ls: ls.pop(3)), "record"),
    "two swapped records": (lambda c: lines_of(c, lambda ls: ls.insert(2, ls.pop(3))), "record"),
    "a cut tail": (lambda c: lines_of(c, lambda ls: ls.pop()), "9"),
    "a changed record": (lambda c: lines_of(c, lambda ls: ls.__setitem__(4, ls[4].replace(b"1", b"2"))), "record"),
    "a missing image": (lambda c: c.pop(image_of(c)), "images/"),
    "a file that was slipped in": (lambda c: c.update({"images/more.png": b"x"}), "images/more.png"),
}


@pytest.mark.parametrize("name", FORGERIES)
def test_a_forged_bundle_is_not_intact(bundle: Path, tmp_path: Path, name: str) -> None:
    change, said = FORGERIES[name]

    forged = remade(bundle, tmp_path / "forged.zip", lambda contents: change(contents) and None)

    assert said in own_verdict(forged)
    assert other_verdict(forged) != "intact"


def test_whoever_signs_again_needs_the_plants_key(house: House, bundle: Path, tmp_path: Path) -> None:
    forger = Ed25519PrivateKey.generate()

    def sign_again(contents: dict[str, bytes]) -> None:
        manifest = json.loads(contents["manifest.json"])
        manifest["key"]["public"] = forger.public_key().public_bytes_raw().hex()
        contents["manifest.json"] = json.dumps(manifest).encode()
        contents["manifest.sig"] = forger.sign(contents["manifest.json"])

    forged = remade(bundle, tmp_path / "forged.zip", sign_again)

    assert "not with" in own_verdict(forged, house.store.signer.public)
    assert "another key" in other_verdict(forged, house.store.signer.public)
    assert own_verdict(bundle, forger.public_key().public_bytes_raw().hex()) != "intact"


def test_no_bit_of_the_file_can_be_flipped_and_no_tail_cut(bundle: Path, tmp_path: Path) -> None:
    whole, rng, missed = bundle.read_bytes(), random.Random(1), []
    altered = tmp_path / "altered.zip"
    for place in [*rng.sample(range(len(whole)), 150), *range(len(whole) - 150, len(whole))]:
        changed = bytearray(whole)
        changed[place] ^= 1 << rng.randrange(8)
        altered.write_bytes(changed)
        missed += [place] if "intact" in (own_verdict(altered), other_verdict(altered)) else []
    for length in (0, 1, len(whole) // 2, len(whole) - 129, len(whole) - 1):
        altered.write_bytes(whole[:length])
        missed += [length] if "intact" in (own_verdict(altered), other_verdict(altered)) else []

    assert missed == []


def test_repacking_the_same_files_is_noticed_too(bundle: Path, tmp_path: Path) -> None:
    repacked = remade(bundle, tmp_path / "repacked.zip", lambda contents: None)

    assert own_verdict(repacked).startswith("The .zip itself was changed")
    assert other_verdict(repacked) != "intact"


def test_the_same_session_gives_the_same_bytes(house: House, bundle: Path, tmp_path: Path) -> None:
    assert written(house, tmp_path / "again.zip").read_bytes() == bundle.read_bytes()


def test_the_bundle_is_a_session_bundle_too(house: House, bundle: Path) -> None:
    with Bundle(bundle) as opened:
        assert (
            opened.inspection == house.store.read(lambda c: sessions.get(c, house.session, with_rods=True)).inspection
        )
        rows = {row.key.sequence: row for row in opened.rows}
        assert {n: opened.content(row) for n, row in rows.items()} == {
            **{n: Shot(n).content for n in range(6)},
            6: Shot(0).content,
        }
    assert rows[3].pose == tuple(Shot(3).pose()[axis] for axis in ("x_m", "y_m", "theta_rad"))


def test_the_records_tell_raw_and_corrected_poses_and_the_manifest_by_what(house: House, bundle: Path) -> None:
    with zipfile.ZipFile(bundle) as archive:
        bodies = [json.loads(line)["body"] for line in archive.read("records.jsonl").splitlines()]
        manifest = json.loads(archive.read("manifest.json"))
        table = list(csv.DictReader(archive.read("poses.csv").decode().splitlines()))

    snapshots = [body for body in bodies if body["kind"] == "snapshot"]
    assert [s["sequence"] for s in snapshots] == list(range(7)) == [int(row["sequence"]) for row in table]
    assert all(s["raw"] == s["corrected"] and s["status"] == "placed" for s in snapshots)  # by identity
    assert snapshots[2]["file"]["sha256"] == hashlib.sha256(Shot(2).content).hexdigest()
    assert manifest["sealed_by"]["method"] == "identity"
    assert manifest["sealed_by"]["software"].startswith("pondwatch ")
    assert len(manifest["sealed_by"]["method_sha256"]) == 64


def test_only_a_finished_session_is_evidence(tmp_path: Path) -> None:
    house = House(tmp_path)
    with pytest.raises(NotClosed, match="open"):
        seal(house.store, house.session, LATER_MS)
    house.store.close()


@pytest.mark.parametrize(
    "change",
    [
        "UPDATE snapshots SET x_m = x_m + 1e-9 WHERE sequence = 1",
        "UPDATE poses SET theta_rad = 0 WHERE snapshot_id = 2",
        "DELETE FROM snapshots WHERE sequence = 1",
        "UPDATE sessions SET quality = 'very good'",
    ],
)
def test_a_row_that_was_changed_after_the_end_contradicts_the_seal(tmp_path: Path, change: str) -> None:
    house = House(tmp_path)
    house.send(Shot(0), Shot(1))
    house.finish()
    house.store.write(lambda c: c.execute(text(change)))

    with pytest.raises(SealBroken, match="not what was sealed"):
        written(house, tmp_path / "bundle.zip")
    house.store.close()


def test_a_damaged_picture_is_named_and_no_bundle_made(tmp_path: Path) -> None:
    house = House(tmp_path)
    house.send(Shot(0))
    house.finish()
    house.store.blobs.path(Shot(0).digest).write_bytes(b"damaged")

    with pytest.raises(Unavailable, match=Shot(0).digest):
        written(house, tmp_path / "bundle.zip")
    house.store.close()


def test_a_session_that_could_not_be_sealed_at_its_end_is_sealed_later(tmp_path: Path) -> None:
    house = House(tmp_path)
    (tmp_path / "signing.key").write_bytes(b"no key")
    house.finish()
    assert house.store.read(lambda c: seals.find(c, house.session)) is None
    assert house.store.read(sessions.unfinished) == [house.session]

    (tmp_path / "signing.key").unlink()
    house.drain()

    assert house.store.read(sessions.unfinished) == []
    assert own_verdict(written(house, tmp_path / "bundle.zip"), house.store.signer.public) == "intact"
    house.store.close()


def test_the_key_is_made_once_and_only_its_owner_reads_it(tmp_path: Path) -> None:
    first, second = Signer(tmp_path / "data"), Signer(tmp_path / "data")

    assert first.public == second.public
    assert stat.S_IMODE((tmp_path / "data/signing.key").stat().st_mode) == 0o600
    (tmp_path / "public.pem").write_bytes(first.public_pem)
    assert public_key_of(tmp_path / "public.pem") == first.public
    loaded = serialization.load_pem_public_key(first.public_pem)
    loaded.verify(second.sign(b"x"), b"x")  # type: ignore[union-attr, call-arg]


def test_the_second_verifier_is_short_and_shares_nothing_with_pondwatch() -> None:
    source = Path(verify_bundle.__file__).read_text()

    imported = {
        (node.module if isinstance(node, ast.ImportFrom) else node.names[0].name).split(".")[0]
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.Import | ast.ImportFrom)
    }
    assert imported == {"hashlib", "json", "pathlib", "sys", "typing", "zipfile", "cryptography"}
    assert len(source.splitlines()) <= 100
