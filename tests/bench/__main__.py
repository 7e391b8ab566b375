"""python -m tests.bench [NAME...] [--bundles FOLDER] [--method NAME] [--seeds N] [--snapshots N] [--quick]"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

from . import accuracy, baselines, compare, factors, findings, grid, live, moonshot, pairs, speed

BENCHES: dict[str, Callable[[argparse.Namespace], None]] = {
    "accuracy": lambda asked: accuracy.run(asked.bundles, asked.method),
    "speed": lambda asked: speed.run(asked.bundles, asked.method, asked.quick),
    "live": lambda asked: live.run(asked.bundles),
    "grid": lambda asked: grid.run(asked.seeds or 5),
    "factors": lambda asked: factors.run(asked.seeds or 3, asked.quick),
    "baselines": lambda asked: baselines.run(asked.bundles, asked.quick),
    "pairs": lambda asked: pairs.run(),
    "compare": lambda asked: compare.run(),
    "findings": lambda asked: findings.run(asked.seeds or findings.SEEDS),
    "moonshot": lambda asked: moonshot.run(asked.snapshots),
}
USUAL = ("accuracy", "speed", "live")


def main() -> None:
    """Run the benches that were asked for, the usual ones where none was."""
    parser = argparse.ArgumentParser(prog="tests.bench")
    parser.add_argument("benches", nargs="*", metavar="NAME", help=", ".join(BENCHES))
    parser.add_argument("--bundles", type=Path, help="folder with bundles that have a truth")
    parser.add_argument("--method", default="auto")
    parser.add_argument("--seeds", type=int, help="ponds a case, of the grid, the factors and the findings")
    parser.add_argument("--snapshots", type=int, default=moonshot.GOAL, help="how far the moonshot goes")
    parser.add_argument("--quick", action="store_true", help="leave out what takes long")
    asked = parser.parse_args()
    if unknown := set(asked.benches) - set(BENCHES):
        parser.error(f"there is no bench {', '.join(sorted(unknown))}")
    for name in asked.benches or USUAL:
        BENCHES[name](asked)


if __name__ == "__main__":
    main()
