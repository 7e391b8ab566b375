"""Where a bundle's files come from: a folder, or the same folder as a .zip. Bounded reads, nothing is unpacked.

Every fault is an `InvalidBundle` that names the file.
"""

from __future__ import annotations

import zipfile
import zlib
from pathlib import Path, PurePosixPath
from typing import Protocol, Self

from pondwatch.core.errors import InvalidBundle

_UNREADABLE = (OSError, zipfile.BadZipFile, zlib.error, EOFError, RuntimeError, NotImplementedError, ValueError)


class Source(Protocol):
    """Files by their path inside the bundle."""

    def read(self, name: str, limit: int) -> bytes:
        """A file's bytes. Raises InvalidBundle: missing, unreadable, over `limit` bytes, or not inside the bundle."""

    def has(self, name: str) -> bool:
        """Whether there is such a file."""

    def close(self) -> None:
        """Lets go of it."""


class FolderSource:
    """A bundle that is a folder. Links that lead out of it are not followed."""

    def __init__(self, root: Path) -> None:
        self._root = root.resolve()

    def has(self, name: str) -> bool:
        """Whether there is such a file."""
        return self._path(name).is_file()

    def read(self, name: str, limit: int) -> bytes:
        """A file's bytes."""
        path = self._path(name)
        if not path.is_file():
            raise missing(name)
        try:
            with path.open("rb") as file:
                return within(file.read(limit + 1), name, limit)
        except OSError as error:
            raise InvalidBundle(f"{name}: cannot be read ({error.strerror}).", file=name) from error

    def close(self) -> None:
        """Nothing is held."""

    def _path(self, name: str) -> Path:
        path = (self._root / inside(name)).resolve()
        if not path.is_relative_to(self._root):
            raise outside(name)
        return path


class ZipSource:
    """A bundle that is a .zip, its files at the top or in one folder. A member is read up to its limit only, whatever
    its header says of its size."""

    def __init__(self, path: Path) -> None:
        try:
            self._zip = zipfile.ZipFile(path)
            names = self._zip.namelist()
        except _UNREADABLE as error:
            raise InvalidBundle(f"{path.name}: is not a readable .zip ({error}).", file=path.name) from error
        for name in names:
            inside(name)
        tops = {name.partition("/")[0] for name in names}
        alone = len(tops) == 1 and f"{min(tops)}/session.json" in names
        self._prefix = f"{min(tops)}/" if alone else ""
        self._names = frozenset(names)

    def has(self, name: str) -> bool:
        """Whether there is such a file."""
        return self._prefix + inside(name) in self._names

    def read(self, name: str, limit: int) -> bytes:
        """A file's bytes."""
        if not self.has(name):
            raise missing(name)
        try:
            with self._zip.open(self._prefix + inside(name)) as member:
                return within(member.read(limit + 1), name, limit)
        except _UNREADABLE as error:
            raise InvalidBundle(f"{name}: cannot be read from the .zip ({error}).", file=name) from error

    def close(self) -> None:
        """Closes the file."""
        self._zip.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def open_source(path: Path) -> Source:
    """The source at a path. Raises InvalidBundle: there is nothing, or it is neither a folder nor a .zip."""
    if path.is_dir():
        return FolderSource(path)
    if not path.exists():
        raise InvalidBundle(f"{path.name}: there is no such bundle.", file=path.name)
    return ZipSource(path)


def inside(name: str) -> str:
    """A path inside the bundle, in one spelling. Raises InvalidBundle: it leads out of it."""
    path = PurePosixPath(name.replace("\\", "/"))
    if not name or "\0" in name or path.is_absolute() or ".." in path.parts or ":" in (path.parts or ("",))[0]:
        raise outside(name)
    return str(path)


def missing(name: str) -> InvalidBundle:
    """The error for a file that is not there."""
    return InvalidBundle(f"{name}: is missing.", file=name)


def outside(name: str) -> InvalidBundle:
    """The error for a path that leads out of the bundle."""
    return InvalidBundle(f"{name!r}: is not a path inside the bundle.", file=name)


def within(content: bytes, name: str, limit: int) -> bytes:
    """The content, or InvalidBundle where it is over the limit."""
    if len(content) > limit:
        raise InvalidBundle(f"{name}: is over {limit} bytes.", file=name, limit_bytes=limit)
    return content
