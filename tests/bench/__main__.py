"""python -m tests.bench [accuracy] [speed] [live] [grid] [pairs] [--bundles FOLDER] [--method NAME]"""

from __future__ import annotations

import argparse
from pathlib import Path

from . import accuracy, grid, live, pairs, speed


def main() -> None:
    """Run the benches that were asked for, all where none was."""
    parser = argparse.ArgumentParser(prog="tests.bench")
    parser.add_argument("benches", nargs="*", choices=("accuracy", "speed", "live", "grid", "pairs"))
    parser.add_argument("--bundles", type=Path, help="folder with bundles that have a truth")
    parser.add_argument("--method", default="auto")
    parser.add_argument("--seeds", type=int, default=4, help="of the grid")
    asked = parser.parse_args()
    if "accuracy" in asked.benches or not asked.benches:
        accuracy.run(asked.bundles, asked.method)
    if "speed" in asked.benches or not asked.benches:
        speed.run(asked.bundles, asked.method)
    if "live" in asked.benches or not asked.benches:
        live.run(asked.bundles)
    if "grid" in asked.benches:
        grid.run(asked.seeds)
    if "pairs" in asked.benches:
        pairs.run()


if __name__ == "__main__":
    main()
