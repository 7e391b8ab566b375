"""The command line. Each command imports what it needs when it runs, so that `--help` is quick."""

from __future__ import annotations

import signal
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from . import cli_ponds
from .cli_exports import add_commands

if TYPE_CHECKING:
    from rich.progress import Progress

    from pondwatch.basestation.uploader import Item, Uploader
    from pondwatch.config import Settings
    from pondwatch.simulator.radio import RadioSpec
    from pondwatch.simulator.simulation import Simulation

app = typer.Typer(no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False)
add_commands(app)
app.add_typer(cli_ponds.app, name="pond")


@app.callback()
def pondwatch() -> None:
    """Live, corrected mosaics of spent-fuel ponds, and every rod's fill state, from snapshots with wrong poses."""


BundlePath = Annotated[Path, typer.Argument(metavar="BUNDLE", help="A session bundle: a folder or a .zip.")]
Data = Annotated[Path | None, typer.Option(help="Folder of all that is kept.")]
Host = Annotated[str | None, typer.Option(help="Address to listen at.")]
Port = Annotated[int | None, typer.Option(help="Port to listen at; 0 lets the system choose.")]
Rate = Annotated[float, typer.Option(min=0, help="Snapshots a second; 0 is as fast as they are taken.")]
Finish = Annotated[bool, typer.Option(help="Finish the session at the end.")]


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
    method: Annotated[
        str, typer.Option(help="auto, lattice, graph, identity, paper-a, -b, -c, -ours or -corrections")
    ] = "auto",
) -> None:
    """Correct a bundle without a server: poses.csv, rods.csv, mosaic.png, mosaic.pgw and mosaic.tif, and beside them
    findings.json and findings.csv, what the floor shows that the layout does not."""
    from pondwatch.basestation.bundle import Bundle
    from pondwatch.basestation.correcting import correct_bundle, result_files
    from pondwatch.basestation.files import replace_files

    with Bundle(bundle) as opened, _progress() as bar:
        task = bar.add_task("Reading", total=None)
        result = correct_bundle(
            opened, method, lambda what, done, total: bar.update(task, description=what, completed=done, total=total)
        )
        replace_files(out, result_files(result, opened.inspection.pond))
    for fault in result.faults:
        print(f"rejected: {fault}", file=sys.stderr)
    print(result.quality.sentence)


@app.command()
def serve(data: Data = None, host: Host = None, port: Port = None) -> None:
    """Run the server until it is told to stop."""
    from pondwatch.jobs.nursery import prepare

    prepare()  # beside what the next line loads
    from pondwatch.app import serve as run

    run(_settings(data, host, port))


@app.command()
def demo(
    data: Data = None,
    host: Host = None,
    port: Port = None,
    snapshots: Annotated[int, typer.Option(help="Snapshots of the demo inspection.")] = 600,
    rate: Rate = 10.0,
) -> None:
    """Run the server, and a simulated inspection that uploads to it from a process of its own."""
    from pondwatch.jobs.nursery import prepare

    prepare()
    from pondwatch.app import create_app
    from pondwatch.app import serve as run
    from pondwatch.robots import DemoRobots

    robots, settings = DemoRobots(snapshots, rate), _settings(data, host, port)

    def begin(url: str) -> None:
        print(f"Pondwatch is at {url} and a demo inspection begins. Ctrl-C ends both.", flush=True)
        robots.begin(url)

    signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))  # so that the robots end with the server
    try:
        run(settings, begin, create_app(settings, robots=robots))
    finally:
        robots.end()


@app.command()
def upload(
    bundle: BundlePath,
    url: Annotated[str, typer.Option(help="The server.")],
    rate: Rate = 0.0,
    session: Annotated[str | None, typer.Option(metavar="ID", help="Go on with this session.")] = None,
    finish: Finish = True,
) -> None:
    """Send a bundle to a server. Again with its session's ID, it sends what is missing and doubles nothing."""
    from pondwatch.basestation.bundle import Bundle
    from pondwatch.basestation.uploader import Uploader, connect, item_of

    with Bundle(bundle) as opened, connect(url) as client:
        uploader = Uploader(client)
        taking = session or uploader.open_session(opened.document)
        items = (
            item_of(row.key, row.captured_at, row.pose, opened.content(row), Path(row.image).suffix)
            for row in opened.rows
        )
        _send(uploader, taking, items, len(opened.rows), rate, finish)


@app.command()
def dataset(
    name: Annotated[str, typer.Argument(metavar="SET", help="sfp10, the data set of arXiv 2503.02752 made anew.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder for it; what is there already is kept.")],
    train: Annotated[int, typer.Option(help="Training sets.")] = 10_000,
    test: Annotated[int, typer.Option(help="Test sets.")] = 1_000,
    seed: Annotated[int, typer.Option(help="The same seed gives the same sets.")] = 0,
    split: Annotated[str, typer.Option(help="shared or disjoint: the poses of test and training ponds.")] = "shared",
    noise: Annotated[str, typer.Option(help="paper, wide or scripts.")] = "paper",
    instances: Annotated[int, typer.Option(help="Noise instances a pond, a set each.")] = 100,
    workers: Annotated[int, typer.Option(help="Processes.")] = 2,
) -> None:
    """Make a data set for training and measuring correction methods; cut off, it goes on where it was."""
    from typing import Any

    from pondwatch.core.errors import Invalid
    from pondwatch.simulator.sfp10 import Sfp10Spec
    from pondwatch.simulator.sfp10_files import write_dataset

    if name != "sfp10":
        raise Invalid(f"dataset: there is no data set {name!r}; there is sfp10.")
    words: dict[str, Any] = {"split": split, "noise": noise}
    spec = Sfp10Spec(train=train, test=test, seed=seed, instances=instances, **words)
    with _progress() as bar:
        task = bar.add_task("Ponds", total=None)
        made = write_dataset(spec, out, workers, lambda done, total: bar.update(task, completed=done, total=total))
    print(f"{train} training and {test} test sets are in {out}, {made['bytes'] / 1e6:.0f} MB.")


@app.command()
def simulate(
    url: Annotated[str | None, typer.Option(help="Server to upload to.")] = None,
    out: Annotated[Path | None, typer.Option(metavar="BUNDLE", help="Write a bundle with its truth instead.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="The same seed gives the same bytes.")] = 1,
    snapshots: Annotated[int, typer.Option(help="Number of snapshots.")] = 221,
    robots: Annotated[int, typer.Option(help="Number of robots.")] = 7,
    lattice: Annotated[str, typer.Option(help="hexagonal or square.")] = "hexagonal",
    water: Annotated[str, typer.Option(help="clear or murky.")] = "clear",
    path: Annotated[str, typer.Option(help="uniform, smooth or sweep.")] = "smooth",
    noise: Annotated[str, typer.Option(help="independent or drift.")] = "independent",
    noise_pitch: Annotated[float, typer.Option(help="Noise of x and y, one sigma, in lattice pitches.")] = 0.32,
    setting: Annotated[
        list[str] | None, typer.Option("--set", metavar="NAME=VALUE", help="Any other value of the simulation.")
    ] = None,
    rate: Rate = 20.0,
    finish: Finish = True,
    demo: Annotated[bool, typer.Option("--demo", hidden=True)] = False,
) -> None:
    """Simulate an inspection by seed and upload it as a base station does, or write it as a bundle with its truth."""
    from pondwatch.core.errors import Invalid
    from pondwatch.simulator.options import specs_of
    from pondwatch.simulator.simulation import Simulation

    if (url is None) == (out is None):
        raise Invalid("simulate: give either --url or --out.")
    named = {"snapshots": snapshots, "robots": robots, "lattice": lattice, "water": water, "path": path}
    spec, radio = specs_of(named | {"noise": noise, "noise_pitch": noise_pitch}, setting or [])
    if out is not None:
        _simulate_bundle(Simulation(spec, seed), out)
    elif demo:
        _run_demo(str(url), snapshots, rate)
    else:
        _simulate_upload(Simulation(spec, seed), radio, str(url), rate, finish)


def _simulate_bundle(simulation: Simulation, out: Path) -> None:
    from pondwatch.simulator.bundle import write_bundle

    with _progress() as bar:
        task = bar.add_task("Simulating", total=len(simulation))
        write_bundle(simulation, out, progress=lambda done: bar.update(task, completed=done))
    print(f"{len(simulation)} snapshots of {len(simulation.inspection.pond.rods)} rods are in {out}.")


def _simulate_upload(simulation: Simulation, radio: RadioSpec, url: str, rate: float, finish: bool) -> None:
    from pondwatch.basestation.uploader import Uploader, connect
    from pondwatch.simulator.client import arrivals, items, open_session

    with connect(url) as client:
        uploader = Uploader(client)
        arriving = arrivals(simulation, radio)
        session = open_session(simulation, uploader)
        _send(uploader, session, items(simulation, arriving), len(arriving), rate, finish)


def _run_demo(url: str, snapshots: int, rate: float) -> None:
    from pondwatch.basestation.uploader import Uploader, connect
    from pondwatch.simulator.client import arrivals, demo_spec, items, next_demo, open_session
    from pondwatch.simulator.radio import RadioSpec
    from pondwatch.simulator.simulation import Simulation

    with connect(url) as client:
        uploader = Uploader(client)
        number, cut_short = next_demo(uploader)
        simulation = Simulation(demo_spec(number, snapshots), number)
        session = cut_short or open_session(simulation, uploader)
        arriving = arrivals(simulation, RadioSpec())
        _send(uploader, session, items(simulation, arriving), len(arriving), rate, finish=True)


def _send(uploader: Uploader, session: str, items: Iterable[Item], count: int, rate: float, finish: bool) -> None:
    """Send, show how far it is, and say what became of it. What was refused is told line by line."""
    print(f"session {session}", flush=True)
    stored, repeated, refused = 0, 0, 0
    with _progress() as bar:
        task = bar.add_task("Uploading", total=count)
        for outcome in uploader.upload(session, items, rate or None):
            stored += outcome.status == 201
            repeated += outcome.status == 200
            refused += not outcome.stored
            if not outcome.stored:
                key = outcome.key
                bar.print(f"refused ({outcome.status}): {key.robot} {key.sequence}: {outcome.detail}", markup=False)
            bar.advance(task)
    print(f"{stored} stored, {repeated} there before, {refused} refused")
    if finish:
        state = uploader.finish(session).get("state")
        print(state)
        if state == "failed":
            print(f"pondwatch: the last correction of session {session} failed; see its jobs.", file=sys.stderr)
            raise typer.Exit(1)


def _settings(data: Path | None, host: str | None, port: int | None) -> Settings:
    """Settings from the environment, and from the command line where it says otherwise."""
    from pondwatch.config import Settings

    given = {"data": data, "host": host, "port": port}
    return Settings.model_validate(Settings().model_dump() | {k: v for k, v in given.items() if v is not None})


@contextmanager
def _progress() -> Iterator[Progress]:
    """A bar on standard error, where that is a terminal; nothing where it is not."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, disable=not console.is_terminal) as progress:
        yield progress
