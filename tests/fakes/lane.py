"""A lane without a process: the desk answers in the calling thread. It can be told to fail, or to be lost."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from pondwatch.jobs.lanes import TaskFailed
from pondwatch.jobs.tasks import Failed
from pondwatch.jobs.worker import Desk, answered

Fault = Callable[[str, tuple[Any, ...]], None]


class InlineLane:
    """`jobs.lanes.Lane` in this thread. calls: the methods called so far. fault: may raise before a call."""

    def __init__(self, fault: Fault | None = None) -> None:
        self.desk = Desk()
        self.calls: list[str] = []
        self.fault = fault

    def call(self, method: str, *args: Any) -> Any:
        """The desk's answer, with the same errors as from a process."""
        self.calls.append(method)
        if self.fault is not None:
            self.fault(method, args)
        answer = answered(self.desk, method, *args)
        if isinstance(answer, Failed):
            raise TaskFailed(answer.message)
        return answer

    def lose(self) -> None:
        """The worker died: what it held is gone."""
        self.desk = Desk()

    def close(self) -> None:
        """Nothing to end."""
