"""A hash chain: records that cannot be changed, removed, added, cut off or put in another order unnoticed.

A record is one line of JSON, `{"body": ..., "number": k, "previous": "<hex>"}`, numbered from 1. `previous` is the
SHA-256 of the line before it, without its newline; 64 zeros before the first. The digest of the last line, the head,
stands for all of them: whoever keeps the head and the count can check the rest.

Pure: bytes in, bytes out. Lines are hashed as they are, so a reader needs no canonical form of its own.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from .errors import Invalid

GENESIS = "0" * 64


class BrokenChain(Invalid):
    """Records that are not those which the chain was made of. facts: record, the number of the first that is not."""


@dataclass(frozen=True, slots=True)
class Head:
    """What a chain comes to: how many records, and the digest of the last."""

    count: int = 0
    digest: str = GENESIS


def canonical(value: Any) -> bytes:
    """JSON in one spelling: sorted names, no spaces, UTF-8.

    Raises:
        ValueError: a number that is not finite.
    """
    return json.dumps(value, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False).encode()


def linked(bodies: Iterable[Any], after: Head | None = None) -> Iterator[tuple[bytes, Head]]:
    """The lines of a chain, without newlines, each with the head that it makes.

    Args:
        after: the head that they follow; a new chain where absent.
    """
    head = after or Head()
    for body in bodies:
        line = canonical({"body": body, "number": head.count + 1, "previous": head.digest})
        head = Head(head.count + 1, hashlib.sha256(line).hexdigest())
        yield line, head


def read(lines: Iterable[bytes], head: Head) -> Iterator[Any]:
    """The bodies of a chain's lines, checked as they are read.

    Raises:
        BrokenChain: they are not those that make this head. It comes no later than the end, so what was read before
            is not to be trusted until the last is.
    """
    last = Head()
    for line in lines:
        number = last.count + 1
        record = _record(line, number)
        if record["number"] != number:
            raise _broken(number, f"the record in place {number} is numbered {record['number']}")
        if record["previous"] != last.digest:
            said = "does not follow the one before it: one of the two was changed"
            raise _broken(number, f"record {number} {said}")
        last = Head(number, hashlib.sha256(line).hexdigest())
        if number > head.count:
            raise _broken(number, f"there are more records than {head.count}")
        yield record["body"]
    if last.count < head.count:
        raise _broken(last.count + 1, f"the records end after {last.count} of {head.count}")
    if last.digest != head.digest:
        raise _broken(last.count, f"record {last.count}, the last, was changed")


def _record(line: bytes, number: int) -> dict[str, Any]:
    try:
        record = json.loads(line)
    except (ValueError, RecursionError):
        record = None
    if not isinstance(record, dict) or record.keys() != {"body", "number", "previous"}:
        raise _broken(number, f"record {number} is not a record")
    return record


def _broken(number: int, what: str) -> BrokenChain:
    return BrokenChain(f"records.jsonl: {what}.", record=number)
