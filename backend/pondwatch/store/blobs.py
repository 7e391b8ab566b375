"""Immutable bytes by their SHA-256, in a local folder: `ab/cdef…`, written so that no power cut takes them back."""

from __future__ import annotations

import errno
import hashlib
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

from pondwatch.core.errors import Missing, StorageFull, Unavailable

_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


def storage_error(error: OSError) -> StorageFull | Unavailable:
    """What a failed file operation means to the caller."""
    if error.errno in _FULL:
        return StorageFull("There is no room left on the disk; nothing was stored.")
    return Unavailable("The storage failed; nothing was stored.")


def sync_folder(path: Path) -> None:
    """Returns once the folder's entries would survive a power cut."""
    handle = os.open(path, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def digest_of(content: bytes) -> str:
    """SHA-256, hexadecimal."""
    return hashlib.sha256(content).hexdigest()


class FolderBlobs:
    """`Blobs` in a folder. Written to a temporary file, synced, renamed, the folder synced: in that order."""

    def __init__(self, root: Path) -> None:
        self._root = root
        self._tmp = root / "tmp"
        self._prepare()

    def _prepare(self) -> None:
        self._tmp.mkdir(parents=True, exist_ok=True)
        for left_over in self._tmp.iterdir():
            left_over.unlink(missing_ok=True)
        for i in range(256):
            (self._root / f"{i:02x}").mkdir(exist_ok=True)
        sync_folder(self._root)
        sync_folder(self._root.parent)

    def path(self, digest: str) -> Path:
        """Where the bytes lie."""
        return self._root / digest[:2] / digest[2:]

    def put(self, content: bytes) -> str:
        """Keep bytes; their digest. Bytes that are there already are checked, and mended where damaged.

        Raises:
            StorageFull, Unavailable: nothing was stored.
        """
        digest = digest_of(content)
        path = self.path(digest)
        try:
            if not self._intact(path, digest):
                self._write(path, content)
            sync_folder(path.parent)
        except OSError as error:
            raise storage_error(error) from error
        return digest

    @staticmethod
    def _intact(path: Path, digest: str) -> bool:
        try:
            return digest_of(path.read_bytes()) == digest
        except FileNotFoundError:
            return False

    def _write(self, path: Path, content: bytes) -> None:
        handle, name = tempfile.mkstemp(dir=self._tmp)
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            os.rename(name, path)  # noqa: PTH104 - atomic, and the name is a string already
        except BaseException:
            Path(name).unlink(missing_ok=True)
            raise

    def get(self, digest: str) -> bytes:
        """The bytes, as they were put.

        Raises:
            Missing: there are none by this digest.
            Unavailable: they are damaged.
        """
        try:
            content = self.path(digest).read_bytes()
        except FileNotFoundError:
            raise Missing("These bytes are not in the store.", kind="blob", id=digest) from None
        if digest_of(content) != digest:
            raise Unavailable("These bytes are damaged in the store.", kind="blob", id=digest)
        return content

    def has(self, digest: str) -> bool:
        """Whether there are bytes by this digest."""
        return self.path(digest).is_file()

    def __iter__(self) -> Iterator[str]:
        for folder in sorted(self._root.glob("[0-9a-f][0-9a-f]")):
            yield from (folder.name + path.name for path in sorted(folder.iterdir()))
