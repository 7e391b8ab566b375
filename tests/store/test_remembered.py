"""Values that are worked out once a key, the last so many of them."""

from __future__ import annotations

from pondwatch.store.remembered import Remembered


def test_a_value_is_made_once_until_as_many_others_were_asked_for() -> None:
    kept, made = Remembered(2), list[str]()

    def ask(key: str) -> str:
        return kept.get(key, lambda: made.append(key) or key.upper())

    assert [ask(key) for key in "abacab"] == list("ABACAB")
    assert made == list("abcb")  # a was asked for again before c came, so b went
