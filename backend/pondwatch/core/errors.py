"""The error tree. It knows nothing of HTTP; `api/problems.py` holds the one table from error to status.

PondwatchError
├── Invalid                  what was handed in cannot be used
│   ├── InvalidPose          a pose with a value that is not finite
│   ├── InvalidImage         not an image, of another size or kind, or damaged
│   ├── InvalidLayout        a layout, camera or noise that contradicts itself
│   ├── InvalidInventory     a declared inventory with faulty lines; facts: line, lines, faults
│   ├── InvalidBundle        a bundle that cannot be read; facts: file, row
│   └── DigestMismatch       the bytes are not those that the digest was made of
├── Missing                  what was asked for is not there; facts: kind, id
├── Conflict                 it contradicts what is stored
│   ├── SnapshotConflict     same key, other content; facts: robot, boot, sequence, stored_digest
│   └── SessionFinished      the session takes no more uploads
├── TooLarge                 over a limit; facts: limit_bytes
├── Unavailable              not now: starting, stopping or over capacity
└── StorageFull              no room on the disk; nothing was stored
"""

from __future__ import annotations


class PondwatchError(Exception):
    """The root. `facts` are JSON values that a caller may act on; the message is for a person."""

    def __init__(self, message: str, **facts: str | int | float | None) -> None:
        super().__init__(message)
        self.message = message
        self.facts = facts


class Invalid(PondwatchError):
    """What was handed in cannot be used."""


class InvalidPose(Invalid):
    """A pose with a value that is not finite."""


class InvalidImage(Invalid):
    """Not an image, an image of another size or kind, or a damaged one."""


class InvalidLayout(Invalid):
    """A pond layout, camera or pose noise that contradicts itself."""


class InvalidInventory(Invalid):
    """A declared inventory with faulty lines; nothing of it is kept. facts: line (the first), lines, faults."""


class InvalidBundle(Invalid):
    """A session bundle that cannot be read. facts: file, and row where there is one."""


class DigestMismatch(Invalid):
    """The bytes that arrived are not those that the sender's digest was made of. facts: expected, found."""


class Missing(PondwatchError):
    """What was asked for is not there. facts: kind, id."""


class Conflict(PondwatchError):
    """It contradicts what is stored."""


class SnapshotConflict(Conflict):
    """The same robot, boot and sequence arrived before with other content. facts: robot, boot, sequence,
    stored_digest."""


class SessionFinished(Conflict):
    """The session is finished and takes no more uploads. facts: session."""


class TooLarge(PondwatchError):
    """Over a limit. facts: limit_bytes."""


class Unavailable(PondwatchError):
    """Not now: starting, stopping, or over capacity."""


class StorageFull(PondwatchError):
    """No room on the disk; nothing was stored."""
