"""The command line. Each command imports what it needs when it runs, so that `--help` is quick."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from rich.progress import Progress

    from pondwatch.basestation.correcting import CorrectedBundle

app = typer.Typer(no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False)


@app.callback()
def pondwatch() -> None:
    """Live, corrected mosaics of spent-fuel ponds, and every rod's fill state, from snapshots with wrong poses."""


BundlePath = Annotated[Path, typer.Argument(metavar="BUNDLE", help="A session bundle: a folder or a .zip.")]


def main() -> None:
    """Run a command. Exit status 2 and one line on standard error where its input is unusable."""
    from pondwatch.core.errors import PondwatchError

    try:
        app(prog_name="pondwatch")
    except PondwatchError as error:
        print(f"pondwatch: {' '.join(error.message.split())}", file=sys.stderr)
        sys.exit(2)


@app.command()
def correct(
    bundle: BundlePath,
    out: Annotated[Path, typer.Option(metavar="RESULT", help="Folder for the result.")],
    method: Annotated[str, typer.Option(help="Correction method.")] = "auto",
) -> None:
    """Correct a bundle without a server: poses.csv, rods.csv, mosaic.png, mosaic.pgw and mosaic.tif."""
    from pondwatch.basestation.bundle import Bundle
    from pondwatch.basestation.correcting import correct_bundle

    with Bundle(bundle) as opened, _progress() as bar:
        task = bar.add_task("Reading", total=None)
        result = correct_bundle(
            opened, method, lambda what, done, total: bar.update(task, description=what, completed=done, total=total)
        )
        height_m = opened.inspection.pond.height_m
    _write_result(out, result, height_m)
    for fault in result.faults:
        print(f"rejected: {fault}", file=sys.stderr)
    print(result.quality.sentence)


def _write_result(out: Path, result: CorrectedBundle, height_m: float) -> None:
    from pondwatch.basestation.files import replace_files
    from pondwatch.jobs import exports

    replace_files(
        out,
        {
            "poses.csv": exports.poses_csv(result.poses),
            "rods.csv": exports.rods_csv(result.rods),
            "mosaic.png": exports.mosaic_png(result.mosaic),
            "mosaic.pgw": exports.world_file(result.metres_per_pixel, height_m),
            "mosaic.tif": exports.mosaic_tif(result.mosaic, result.metres_per_pixel, height_m),
        },
    )


@contextmanager
def _progress() -> Iterator[Progress]:
    """A bar on standard error, where that is a terminal; nothing where it is not."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, disable=not console.is_terminal) as progress:
        yield progress
