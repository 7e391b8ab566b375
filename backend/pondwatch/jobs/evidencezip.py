"""The evidence bundle of a finished session, as a file: a .zip whose every byte is signed for."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator
from typing import IO

from sqlalchemy import Connection

from pondwatch.core.auditchain import linked
from pondwatch.core.errors import Missing, Unavailable
from pondwatch.store.store import Store

from .evidencemarks import ARCHIVE, SIGNATURE_CHARS, digest_of_first
from .sealing import File, checked, records
from .views import Json

_MOMENT = (1980, 1, 1, 0, 0, 0)


def write_evidence(store: Store, session_id: str, out: IO[bytes], now_ms: int) -> None:
    """Write the bundle to an empty file that can be read too. The same session gives the same bytes.

    Raises:
        Missing, NotClosed: nothing to write. SealBroken: what is stored contradicts the seal. Unavailable: a
            picture is damaged or gone; the message names it.
    """
    seal = checked(store, session_id, now_ms)
    with zipfile.ZipFile(out, "w") as archive:
        _put(archive, "manifest.json", seal.manifest)
        _put(archive, "manifest.sig", seal.signature)
        store.read(lambda c: _put_records(archive, store, c, session_id))
        archive.comment = b"0" * SIGNATURE_CHARS
    out.seek(0, 2)
    size = out.tell() - SIGNATURE_CHARS
    signature = store.signer.sign(ARCHIVE + digest_of_first(out, size))
    out.seek(size)
    out.write(signature.hex().encode())
    out.flush()


def _put_records(archive: zipfile.ZipFile, store: Store, connection: Connection, session_id: str) -> None:
    written: set[str] = set()

    def bodies() -> Iterator[Json]:
        for body, file in records(connection, session_id):
            if file is not None and file.path not in written:
                written.add(file.path)  # two snapshots may be of the same bytes
                _put(archive, file.path, _content(store, file))
            yield body

    _put(archive, "records.jsonl", b"".join(line + b"\n" for line, _ in linked(bodies())))


def _content(store: Store, file: File) -> bytes:
    if file.content is not None:
        return file.content
    try:
        return store.blobs.get(file.sha256)
    except (Missing, Unavailable) as error:
        said = f"{file.path} is damaged or gone in the store: there is no bundle without it."
        raise Unavailable(said, file=file.path) from error


def _put(archive: zipfile.ZipFile, name: str, content: bytes) -> None:
    entry = zipfile.ZipInfo(name, _MOMENT)
    entry.external_attr = 0o644 << 16
    archive.writestr(entry, content, zipfile.ZIP_STORED)
