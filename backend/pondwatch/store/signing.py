"""The key that closed inspections are signed with: one a data folder, made when it is first needed."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from cryptography.exceptions import UnsupportedAlgorithm
from cryptography.hazmat.primitives import serialization
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

from pondwatch.core.errors import Unavailable

from .blobs import storage_error, sync_folder

KEY_FILE = "signing.key"


class Signer:
    """Signs with the data folder's Ed25519 key (RFC 8032). The file is read, or made, at first use."""

    def __init__(self, folder: Path) -> None:
        self._path = folder / KEY_FILE
        self._key: Ed25519PrivateKey | None = None

    def sign(self, message: bytes) -> bytes:
        """64 bytes.

        Raises:
            Unavailable, StorageFull: there is no key and none can be made, or the file holds none.
        """
        return self._loaded().sign(message)

    @property
    def public(self) -> str:
        """The public key, 32 bytes in hexadecimal."""
        return self._loaded().public_key().public_bytes_raw().hex()

    @property
    def public_pem(self) -> bytes:
        """The public key as PEM (SubjectPublicKeyInfo)."""
        form = serialization.PublicFormat.SubjectPublicKeyInfo
        return self._loaded().public_key().public_bytes(serialization.Encoding.PEM, form)

    def _loaded(self) -> Ed25519PrivateKey:
        if self._key is None:
            if not self._path.exists():
                self._make()
            self._key = self._read()
        return self._key

    def _read(self) -> Ed25519PrivateKey:
        try:
            key = serialization.load_pem_private_key(self._path.read_bytes(), None)
        except (OSError, ValueError, TypeError, UnsupportedAlgorithm) as error:
            raise Unavailable(f"The signing key cannot be read ({type(error).__name__}).") from error
        if not isinstance(key, Ed25519PrivateKey):
            raise Unavailable("The signing key is not an Ed25519 key.")
        return key

    def _make(self) -> None:
        """Written aside and linked into place: whole or not there, and never over another."""
        pem = Ed25519PrivateKey.generate().private_bytes(
            serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
        )
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
            handle, aside = tempfile.mkstemp(dir=self._path.parent, prefix=".key-")  # mode 0600
            try:
                with os.fdopen(handle, "wb") as file:
                    file.write(pem)
                    file.flush()
                    os.fsync(file.fileno())
                if not self._path.exists():
                    os.link(aside, self._path)
            finally:
                Path(aside).unlink()
            sync_folder(self._path.parent)
        except FileExistsError:
            return  # another was quicker
        except OSError as error:
            raise storage_error(error) from error
