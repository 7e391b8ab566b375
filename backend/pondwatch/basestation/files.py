"""Files that are there whole or not at all."""

from __future__ import annotations

import errno
import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path

from pondwatch.core.errors import Invalid, StorageFull


def replace_files(folder: Path, contents: Mapping[str, bytes]) -> None:
    """Write files into a folder, made if need be: all are written beside it before the first takes its name.

    Raises:
        Invalid: the folder is a file or cannot be written. StorageFull: no room.
    """
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        staging = Path(tempfile.mkdtemp(prefix=f".{folder.name}-", dir=folder.parent))
        try:
            for name, content in contents.items():
                (staging / name).write_bytes(content)
            folder.mkdir(exist_ok=True)
            for name in contents:
                (staging / name).replace(folder / name)
        finally:
            shutil.rmtree(staging, ignore_errors=True)
    except OSError as error:
        kind = StorageFull if error.errno == errno.ENOSPC else Invalid
        raise kind(f"{folder}: cannot be written ({error.strerror}).") from error
