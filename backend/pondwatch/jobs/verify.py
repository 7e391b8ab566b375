"""Whether an evidence bundle is what was signed. Needs the file and, to know by whom, the public key; no server."""

from __future__ import annotations

import hashlib
import json
import re
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

from cryptography.exceptions import InvalidSignature, UnsupportedAlgorithm
from cryptography.hazmat.primitives import serialization
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey

from pondwatch.core.auditchain import BrokenChain, Head, read
from pondwatch.core.errors import Invalid

from .evidencemarks import ARCHIVE, FORMAT, SIGNATURE_CHARS, digest_of_first

_OWN = ("manifest.json", "manifest.sig", "records.jsonl")
_UNREADABLE = (OSError, zipfile.BadZipFile, zlib.error, EOFError, RuntimeError, NotImplementedError, ValueError)


class Tampered(Invalid):
    """The bundle is not what was signed; the message says what is wrong with it."""


@dataclass(frozen=True, slots=True)
class Verified:
    """An intact bundle. key: the public key that it is signed with, hexadecimal."""

    session: str
    name: str
    finished_at: str
    sealed_at: str
    records: int
    images: int
    key: str


def public_key_of(path: Path) -> str:
    """The public key in a PEM file, hexadecimal.

    Raises:
        Invalid: there is no such file, or it holds no Ed25519 public key.
    """
    try:
        key = serialization.load_pem_public_key(path.read_bytes())
    except (OSError, ValueError, UnsupportedAlgorithm) as error:
        raise Invalid(f"{path}: is not a public key ({type(error).__name__}).") from error
    if not isinstance(key, Ed25519PublicKey):
        raise Invalid(f"{path}: is not an Ed25519 public key.")
    return key.public_bytes_raw().hex()


def verify(path: Path, trusted: str | None = None) -> Verified:
    """Check a bundle, from the signature of its manifest to its last byte.

    Args:
        trusted: the public key that it must be signed with, hexadecimal; the bundle's own word where absent.

    Raises:
        Invalid: there is no such file. Tampered: it is not what was signed.
    """
    try:
        file = path.open("rb")
    except OSError as error:
        raise Invalid(f"{path}: cannot be read ({error.strerror}).") from error
    with file:
        try:
            archive = zipfile.ZipFile(file)
        except _UNREADABLE as error:
            raise Tampered(f"{path.name}: is not a whole .zip: it was cut, or is something else.") from error
        with archive:
            manifest = _manifest(archive, trusted)
            images = _check_records(archive, manifest)
            _check_archive(file, archive.comment, manifest["key"]["public"])
    about, sealed = manifest["session"], manifest["sealed_at"]
    return Verified(
        about["id"], about["name"], about["finished_at"], sealed, manifest["records"]["count"], images,
        manifest["key"]["public"],
    )  # fmt: skip


def _manifest(archive: zipfile.ZipFile, trusted: str | None) -> dict[str, Any]:
    content, signature = _member(archive, "manifest.json"), _member(archive, "manifest.sig")
    try:
        manifest = json.loads(content)
        form, public = manifest["format"], manifest["key"]["public"]
        Head(int(manifest["records"]["count"]), str(manifest["records"]["head"]))
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise Tampered("manifest.json: is not a manifest.") from error
    if form != FORMAT:
        raise Tampered(f"manifest.json: is of the format {str(form)[:40]!r}, not {FORMAT!r}.")
    if trusted is not None and public != trusted:
        raise Tampered(f"manifest.json: is signed with the key {str(public)[:64]}, not with {trusted}.")
    if not _signed(public, signature, content):
        raise Tampered("manifest.json: was changed, or its signature was: the one does not bear out the other.")
    found: dict[str, Any] = manifest
    return found


def _check_records(archive: zipfile.ZipFile, manifest: dict[str, Any]) -> int:
    """Every record, and every file that one names; how many images there are."""
    head = Head(manifest["records"]["count"], manifest["records"]["head"])
    named = set(_OWN)
    lines = _member(archive, "records.jsonl").split(b"\n")
    try:
        if lines.pop() != b"":
            raise Tampered("records.jsonl: does not end with a newline.")
        for body in read(lines, head):
            named |= {_check_file(archive, body["file"])} if isinstance(body, dict) and "file" in body else set()
    except BrokenChain as error:
        raise Tampered(error.message, **error.facts) from error
    names = archive.namelist()
    if len(set(names)) != len(names):
        raise Tampered("The bundle holds two files of one name.")
    if strange := sorted(set(names) - named):
        raise Tampered(f"{strange[0]}: is in the bundle, and no record names it.")
    return sum(name.startswith("images/") for name in names)


def _check_file(archive: zipfile.ZipFile, told: Any) -> str:
    try:
        name, digest = str(told["path"]), told["sha256"]
    except (TypeError, KeyError) as error:
        raise Tampered("records.jsonl: a record names a file without its path or digest.") from error
    if hashlib.sha256(_member(archive, name)).hexdigest() != digest:
        raise Tampered(f"{name}: was changed: its SHA-256 is not the one on record.")
    return name


def _check_archive(file: IO[bytes], comment: bytes, public: str) -> None:
    """The whole file, against the signature in its last bytes."""
    file.seek(0, 2)
    digest = digest_of_first(file, file.tell() - SIGNATURE_CHARS)
    is_hex = re.fullmatch(rb"[0-9a-f]{128}", comment)
    if not is_hex or not _signed(public, bytes.fromhex(comment.decode()), ARCHIVE + digest):
        raise Tampered("The .zip itself was changed, though nothing in it was: it is not the file that was written.")


def _member(archive: zipfile.ZipFile, name: str) -> bytes:
    try:
        return archive.read(name)
    except KeyError:
        raise Tampered(f"{name}: is missing.") from None
    except _UNREADABLE as error:
        raise Tampered(f"{name}: was changed: its bytes are damaged.") from error


def _signed(public: str, signature: bytes, message: bytes) -> bool:
    try:
        Ed25519PublicKey.from_public_bytes(bytes.fromhex(public)).verify(signature, message)
    except (InvalidSignature, ValueError, TypeError):
        return False
    return True
