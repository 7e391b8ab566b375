"""Who used how much of the machine: processor seconds and memory of a process and all that it started."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

_TICK_S = 1 / os.sysconf("SC_CLK_TCK")


@dataclass(frozen=True, slots=True)
class Spent:
    """Processor seconds since the machine started: of some trees of processes by name, and of everybody."""

    by: dict[str, float]
    everybody: float

    def since(self, before: Spent) -> Spent:
        """What was spent in between."""
        return Spent({k: v - before.by.get(k, 0.0) for k, v in self.by.items()}, self.everybody - before.everybody)

    @property
    def others(self) -> float:
        """Of processes that belong to none of the trees."""
        return max(0.0, self.everybody - sum(self.by.values()))


def spent(roots: dict[str, int]) -> Spent:
    """As of now. A root that lies within another's tree counts for itself alone."""
    parents, seconds = {}, {}
    for pid, fields in _processes():
        parents[pid] = int(fields[1])
        seconds[pid] = sum(map(int, fields[11:15])) * _TICK_S  # with children that ended
    by = dict.fromkeys(roots, 0.0)
    owners = {pid: name for name, pid in roots.items()}
    for pid, s in seconds.items():
        owner: int | None = pid
        while owner is not None and owner not in owners:
            owner = parents.get(owner)
        if owner is not None:
            by[owners[owner]] += s
    user, nice, system, *_ = (int(x) for x in Path("/proc/stat").read_text().split()[1:4])
    return Spent(by, (user + nice + system) * _TICK_S)


def find(*words: str) -> int:
    """The first process of this one's tree whose command line has all these words.

    Raises:
        LookupError: there is none.
    """
    parents = {pid: int(fields[1]) for pid, fields in _processes()}
    for pid in sorted(parents):
        if _is_within(pid, os.getpid(), parents) and all(word in _command(pid) for word in words):
            return pid
    raise LookupError(f"no process that has {words}")


def children(root: int) -> list[int]:
    """What a process started and has not ended."""
    return sorted(pid for pid, fields in _processes() if int(fields[1]) == root)


def memory_mb(root: int) -> float:
    """Of a process and all that it started, what they share counted once, MB."""
    parents = {pid: int(fields[1]) for pid, fields in _processes()}
    return sum(_pss_kb(pid) for pid in parents if _is_within(pid, root, parents)) / 1000


def _is_within(pid: int, root: int, parents: dict[int, int]) -> bool:
    at: int | None = pid
    while at is not None and at != root:
        at = parents.get(at)
    return at == root


def _command(pid: int) -> str:
    try:
        return (Path("/proc") / str(pid) / "cmdline").read_text().replace("\0", " ")
    except (FileNotFoundError, ProcessLookupError):
        return ""


def _processes() -> Iterator[tuple[int, list[str]]]:
    """Each process and the fields of its `stat` from the state on."""
    for folder in Path("/proc").iterdir():
        if folder.name.isdecimal():
            try:
                text = (folder / "stat").read_text()
            except (FileNotFoundError, ProcessLookupError):
                continue  # it ended in between
            yield int(folder.name), text.rpartition(")")[2].split()


def _pss_kb(pid: int) -> int:
    try:
        lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
    except (FileNotFoundError, ProcessLookupError, PermissionError):
        return 0
    return next((int(line.split()[1]) for line in lines if line.startswith("Pss:")), 0)
