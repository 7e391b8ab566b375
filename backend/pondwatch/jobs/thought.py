"""Joint decisions that are made beside a worker, so that snapshots that come meanwhile are shown at once.

A child process by `fork` sees all that the corrector holds at that moment, without a copy of it, and takes nothing
from the worker but what the system gives it. What it decides comes back through a pipe; values that the worker holds
too (`Deliberates.held`) are named in it, not sent.
"""

from __future__ import annotations

import ctypes
import gc
import io
import os
import pickle
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from typing import Any, NoReturn, Protocol

from pondwatch.core.corrector import Deliberates

_NICER = 4  # than its worker: what is shown now comes before what may be shown better
_CHUNK = 1 << 20
_PR_SET_PDEATHSIG = 1


class Thought(Protocol):
    """A decision that is being made."""

    @property
    def ready(self) -> bool:
        """Whether it is made."""

    def result(self) -> Any:
        """The decision; None where it failed."""

    def drop(self) -> None:
        """Nobody waits for it any more."""


Begin = Callable[[Deliberates], Thought]


class _Answered:
    """What is made elsewhere and answered once."""

    def __init__(self) -> None:
        self._answer: Future[Any] = Future()

    @property
    def ready(self) -> bool:
        """Whether it is made."""
        return self._answer.done()

    def result(self) -> Any:
        """The decision; None where it failed."""
        return self._answer.result()


class ThreadThought(_Answered):
    """In a thread of this process, with which it shares a core."""

    def __init__(self, corrector: Deliberates) -> None:
        super().__init__()
        threading.Thread(target=self._run, args=(corrector,), name="deliberation", daemon=True).start()

    def drop(self) -> None:
        """It ends by itself."""

    def _run(self, corrector: Deliberates) -> None:
        self._answer.set_result(_decided(corrector))


class ForkThought(_Answered):
    """In a child process."""

    def __init__(self, corrector: Deliberates) -> None:
        super().__init__()
        self._held = corrector.held()
        source, sink = os.pipe()
        self._child = os.fork()
        if self._child == 0:
            answer(lambda: _decided(corrector), self._held, sink, _NICER)
        os.close(sink)
        threading.Thread(target=self._read, args=(source,), name="deliberation", daemon=True).start()

    def drop(self) -> None:
        """End the child."""
        if not self._answer.done():
            os.kill(self._child, signal.SIGKILL)  # not waited for yet, so no other process has its number

    def _read(self, source: int) -> None:
        content, decision = whole(source), None
        try:
            decision = loads(content, self._held) if content else None
        except (pickle.UnpicklingError, EOFError):  # the child was killed in mid-sentence
            traceback.print_exc()
        self._answer.set_result(decision)
        os.waitpid(self._child, 0)


def _decided(corrector: Deliberates) -> Any:
    try:
        return corrector.deliberate()
    except Exception:  # a border: the poses stay as they are until all is settled, which tells of it
        traceback.print_exc()
        return None


def answer(work: Callable[[], Any], held: Sequence[object], sink: int, nicer: int = 0) -> NoReturn:
    """The whole life of a child by `fork`: do the work, write its result into a pipe, and leave without a trace of the
    parent's own endings."""
    try:
        _stand_alone(sink, nicer)
        content = memoryview(dumps(work(), held))
        while content:
            content = content[os.write(sink, content[:_CHUNK]) :]
    except Exception:  # a border: the parent sees that nothing came
        traceback.print_exc()
    finally:
        os._exit(0)


def whole(source: int) -> bytes:
    """All that comes through a pipe until its other end is closed."""
    with open(source, "rb", buffering=0) as pipe:
        return pipe.readall()


def _stand_alone(sink: int, nicer: int) -> None:
    """End with the parent, and keep open nothing by which others hear of the parent's end."""
    if sys.platform == "linux":  # elsewhere it outlives a parent that is killed, by the rest of its work
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    os.closerange(3, sink)
    os.closerange(sink + 1, 1 << 20)
    os.nice(nicer)
    gc.disable()  # a look at every object would copy all that is shared with the parent


class _Naming(pickle.Pickler):
    def __init__(self, out: io.BytesIO, held: Sequence[object]) -> None:
        super().__init__(out, pickle.HIGHEST_PROTOCOL)
        self._names = {id(value): name for name, value in enumerate(held)}

    def persistent_id(self, value: object) -> int | None:
        return self._names.get(id(value))


class _Named(pickle.Unpickler):
    def __init__(self, content: bytes, held: Sequence[object]) -> None:
        super().__init__(io.BytesIO(content))
        self._held = held

    def persistent_load(self, name: int) -> object:
        return self._held[name]


def dumps(value: object, held: Sequence[object]) -> bytes:
    """A value as bytes; what is in `held`, by identity, only by its number there."""
    out = io.BytesIO()
    _Naming(out, held).dump(value)
    return out.getvalue()


def loads(content: bytes, held: Sequence[object]) -> Any:
    """Undoes `dumps`, with the same `held`."""
    return _Named(content, held).load()
