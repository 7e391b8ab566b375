"""Work on other cores: the same results in the same order, whatever becomes of the children."""

from __future__ import annotations

import os
import signal
import time
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from pondwatch.core.ports import both
from pondwatch.jobs import spreading
from pondwatch.jobs.spreading import LEAST, beside, spread_out

SELF, OPEN = os.getpid(), Path("/proc/self/fd")  # files that are open, where the system tells


@pytest.fixture(params=[1, 2, 3])
def cores(request, monkeypatch):
    monkeypatch.setattr(spreading, "cores", lambda: request.param)
    return request.param


@pytest.mark.parametrize("count", [0, 1, LEAST - 1, LEAST, 2 * LEAST + 1])
def test_results_come_in_the_order_of_the_things(cores, count):
    assert spread_out(lambda k: k * k, range(count), ()) == [k * k for k in range(count)]


def _who(rest_s):
    """Which process did something that took a while."""
    time.sleep(rest_s)
    return os.getpid()


def test_as_many_processes_work_as_there_are_cores(cores):
    assert len(set(spread_out(lambda _: _who(0.02), range(3 * LEAST), ()))) == cores


def test_few_large_things_are_spread_too_each_to_one_process(cores):
    spread = partial(spread_out, large=True)

    assert spread(lambda k: k * k, range(2), ()) == [0, 1]
    assert len(set(spread(lambda _: _who(0.5), range(2), ()))) == min(cores, 2)
    assert spread(lambda k: k, [], ()) == []


@pytest.mark.parametrize("slow", [range(LEAST), range(LEAST, 2 * LEAST)], ids=["here", "there"])
def test_who_is_done_with_its_own_helps_the_others(monkeypatch, slow):
    """Of two halves all of one takes long."""
    monkeypatch.setattr(spreading, "cores", lambda: 2)

    done = spread_out(lambda k: _who(0.05 if k in slow else 0.0), range(2 * LEAST), ())

    by_this = [done[k] == SELF for k in slow]
    assert 0 < sum(by_this) < LEAST  # all or nothing, where nobody helps


def test_what_is_shared_comes_back_as_itself_and_the_rest_as_its_equal(cores):
    things = [np.full(4, k) for k in range(2 * LEAST)]

    done = spread_out(lambda thing: (thing, thing + 1), things, things)

    assert all(same is thing for (same, _), thing in zip(done, things, strict=True))
    assert all((more == thing + 1).all() for (_, more), thing in zip(done, things, strict=True))


@pytest.mark.parametrize("end", [lambda: os.kill(os.getpid(), signal.SIGKILL), lambda: 1 / 0], ids=["killed", "error"])
def test_what_a_child_leaves_undone_is_done_here(cores, end):
    def work(k):
        if os.getpid() != SELF and k >= LEAST:
            end()
        time.sleep(0.01)
        return k

    assert spread_out(work, range(2 * LEAST), ()) == list(range(2 * LEAST))


def test_an_error_in_the_work_is_raised_here(cores):
    with pytest.raises(ZeroDivisionError):
        spread_out(lambda k: 1 / (k - 2 * LEAST + 1), range(2 * LEAST), ())


def test_work_begun_beside_gives_its_result_when_asked(cores):
    made = beside(lambda: (os.getpid() != SELF, "made"))

    assert made() == (cores > 1, "made")


def test_two_pieces_of_work_beside_each_other_give_each_its_own_result(cores):
    first, second = both(spread_out, lambda: ("first", _who(0.5)), lambda: [_who(0.5)])

    assert first[0] == "first"
    assert len({first[1], *second}) == min(cores, 2)


def test_no_child_and_no_pipe_is_left(cores):
    before = sorted(OPEN.glob("*"))

    children = set(spread_out(lambda _: _who(0.02), range(3 * LEAST), ())) - {SELF}

    assert len(children) == cores - 1
    assert len(sorted(OPEN.glob("*"))) == len(before)
    for child in children:
        with pytest.raises(ProcessLookupError):
            os.kill(child, 0)
