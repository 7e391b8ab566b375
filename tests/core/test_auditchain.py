"""The hash chain: what it is by hand, and that no change to it goes unnoticed."""

from __future__ import annotations

import hashlib
import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pondwatch.core.auditchain import BrokenChain, Head, linked, read

BODIES = [{"kind": "a"}, {"kind": "b", "x": 0.1}, "c", None, 5]


def chain(bodies=BODIES, after=None):
    made = list(linked(bodies, after))
    return [line for line, _ in made], made[-1][1] if made else Head()


def test_a_line_holds_the_digest_of_the_line_before_it():
    lines, head = chain([{"b": 1, "a": "é"}, 2])

    first = '{"body":{"a":"é","b":1},"number":1,"previous":"' + "0" * 64 + '"}'
    assert lines[0].decode() == first
    assert json.loads(lines[1]) == {"body": 2, "number": 2, "previous": hashlib.sha256(first.encode()).hexdigest()}
    assert head == Head(2, hashlib.sha256(lines[1]).hexdigest())


def test_an_untouched_chain_is_read_back():
    lines, head = chain()

    assert list(read(lines, head)) == BODIES
    assert list(read([], Head())) == []


def test_a_chain_goes_on_from_its_head():
    first, head = chain(BODIES[:2])
    more, whole = chain(BODIES[2:], head)

    assert ([*first, *more], whole) == chain()


@pytest.mark.parametrize(
    ("change", "record", "said"),
    [
        (lambda ls: ls[:2] + ls[3:], 3, "numbered 4"),
        (lambda ls: [ls[0], ls[2], ls[1], *ls[3:]], 2, "numbered 3"),
        (lambda ls: ls[:-1], 5, "end after 4 of 5"),
        (lambda ls: [*ls, ls[-1]], 6, "numbered 5"),
        (lambda ls: [ls[0], ls[1].replace(b'"b"', b'"d"'), *ls[2:]], 3, "does not follow"),
        (lambda ls: [*ls[:-1], ls[-1].replace(b'"body":5', b'"body":6')], 5, "the last, was changed"),
        (lambda ls: [*ls[:3], b"", ls[4]], 4, "not a record"),
        (lambda ls: [*ls[:3], b'{"body":1}', ls[4]], 4, "not a record"),
    ],
    ids=["removed", "swapped", "cut tail", "added", "changed", "last changed", "emptied", "stripped"],
)
def test_what_was_done_to_a_chain_is_named(change, record, said):
    lines, head = chain()

    with pytest.raises(BrokenChain, match=said) as broken:
        list(read(change(lines), head))

    assert broken.value.facts == {"record": record}


def test_a_record_forged_with_its_number_and_link_does_not_fit_the_next():
    lines, head = chain()
    forged = json.loads(lines[2]) | {"body": "forged"}

    with pytest.raises(BrokenChain, match="record 4 does not follow"):
        list(read([*lines[:2], json.dumps(forged).encode(), *lines[3:]], head))


@given(st.data())
def test_any_changed_bit_of_any_line_is_found(data):
    lines, head = chain()
    which = data.draw(st.integers(0, len(lines) - 1))
    line = bytearray(lines[which])
    line[data.draw(st.integers(0, len(line) - 1))] ^= 1 << data.draw(st.integers(0, 7))

    with pytest.raises(BrokenChain):
        list(read([*lines[:which], bytes(line), *lines[which + 1 :]], head))
