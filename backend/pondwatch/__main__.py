"""The program's entry. It imports nothing by itself: every worker process begins by importing what its server ran."""

from __future__ import annotations


def main() -> None:
    """Run a command."""
    from .cli import main as run

    run()


if __name__ == "__main__":
    main()
