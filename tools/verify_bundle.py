"""Checks an evidence bundle by docs/evidence.md alone: python verify_bundle.py BUNDLE [PUBLIC_KEY_HEX]

It shares no line with Pondwatch. Needs the standard library and `cryptography`.
"""

import hashlib
import json
import sys
import zipfile
from pathlib import Path
from typing import Any

from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey

Json = dict[str, Any]


class Wrong(Exception):
    """What is wrong with the bundle."""


def need(holds: bool, what: str) -> None:
    """Raises Wrong unless it holds."""
    if not holds:
        raise Wrong(what)


def check_signature(public: str, signature: bytes, message: bytes, what: str) -> None:
    """Raises Wrong: the signature is not that of the message."""
    try:
        Ed25519PublicKey.from_public_bytes(bytes.fromhex(public)).verify(signature, message)
    except InvalidSignature:
        raise Wrong(f"the signature of {what} does not hold") from None


def read_records(lines: list[bytes], count: int, head: str) -> list[Json]:
    """The records' bodies, after the chain was followed to its end."""
    need(lines[-1] == b"", "records.jsonl does not end with a newline")
    previous, bodies = "0" * 64, list[Json]()
    for number, line in enumerate(lines[:-1], 1):
        record = json.loads(line)
        need(record["number"] == number and record["previous"] == previous, f"the chain breaks at record {number}")
        previous = hashlib.sha256(line).hexdigest()
        bodies.append(record["body"])
    need(len(bodies) == count, f"there are {len(bodies)} records of {count}")
    need(previous == head, f"record {count}, the last, was changed")
    return bodies


def check_files(archive: zipfile.ZipFile, bodies: list[Json]) -> None:
    """Every file is on record, every record's file is there, and none was changed."""
    names = archive.namelist()
    files = {body["file"]["path"]: body["file"]["sha256"] for body in bodies if "file" in body}
    own = {"manifest.json", "manifest.sig", "records.jsonl"}
    need(len(names) == len(set(names)), "two files have one name")
    need(set(names) == own | set(files), f"files and records differ: {sorted(set(names) ^ (own | set(files)))[:1]}")
    for name, digest in files.items():
        need(hashlib.sha256(archive.read(name)).hexdigest() == digest, f"{name} was changed")


def check_file_itself(path: str, public: str) -> None:
    """The last 128 bytes are the signature of all before them."""
    digest, tail = hashlib.sha256(), b""
    with Path(path).open("rb") as file:
        while part := file.read(1 << 20):
            tail += part
            digest.update(tail[:-128])
            tail = tail[-128:]
    need(tail == tail.lower(), "the .zip's last bytes were changed")
    message = b"pondwatch-evidence/1 archive\n" + digest.digest()
    check_signature(public, bytes.fromhex(tail.decode()), message, "the .zip as a whole")


def verify(path: str, trusted: str | None = None) -> Json:
    """The manifest of an intact bundle. Raises Wrong."""
    try:
        with zipfile.ZipFile(path) as archive:
            content = archive.read("manifest.json")
            manifest = json.loads(content)
            need(manifest["format"] == "pondwatch-evidence/1", "it is of another format")
            public = manifest["key"]["public"]
            need(trusted in (None, public), f"it is signed with another key, {public}")
            check_signature(public, archive.read("manifest.sig"), content, "manifest.json")
            lines = archive.read("records.jsonl").split(b"\n")
            check_files(archive, read_records(lines, manifest["records"]["count"], manifest["records"]["head"]))
        check_file_itself(path, public)
    except (OSError, zipfile.BadZipFile, RuntimeError, ValueError, KeyError, TypeError) as error:
        raise Wrong(f"it cannot be read: {error}") from None
    return dict(manifest)


if __name__ == "__main__":
    try:
        found = verify(*sys.argv[1:3])
    except Wrong as error:
        sys.exit(f"NOT INTACT: {error}")
    print(f"INTACT: session {found['session']['id']}, signed with {found['key']['public']}")
