"""What tells an evidence bundle from any other file: for those who write one, and for those who check one and have no
database."""

from __future__ import annotations

import hashlib
from typing import IO

FORMAT = "pondwatch-evidence/1"
ARCHIVE = b"pondwatch-evidence/1 archive\n"
SIGNATURE_CHARS = 128
_CHUNK = 1 << 20


def digest_of_first(file: IO[bytes], size: int) -> bytes:
    """SHA-256 of a file's first bytes."""
    digest = hashlib.sha256()
    file.seek(0)
    while size > 0 and (part := file.read(min(size, _CHUNK))):
        digest.update(part)
        size -= len(part)
    return digest.digest()
