"""The commands that hand out what was found, and that check it: `export`, `verify` and `key`."""

from __future__ import annotations

import contextlib
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import IO, TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from pondwatch.config import Settings

Data = Annotated[Path | None, typer.Option(help="Folder of all that is kept.")]
Out = Annotated[Path, typer.Option(metavar="FILE", help="The file to write.")]


def add_commands(app: typer.Typer) -> None:
    """Make them commands of the program."""
    for command in (export, verify, key):
        app.command()(command)


def export(
    what: Annotated[str, typer.Argument(metavar="SESSION", help="A session's id; or, with --of, a result's folder.")],
    out: Out,
    form: Annotated[
        str, typer.Option("--format", help="bundle, pdf, csv, json, mosaic, layers, png, mcap or ifdo")
    ] = "pdf",
    url: Annotated[str | None, typer.Option(help="The server; without it the data folder is read.")] = None,
    of: Annotated[Path | None, typer.Option(metavar="BUNDLE", help="The bundle that a result is of.")] = None,
    view: Annotated[
        str | None, typer.Option(metavar="W,S,E,N", help="Of png: west, south, east and north of it, metres.")
    ] = None,
    data: Data = None,
) -> None:
    """Write a session as a file. While the server runs it holds its data folder: then name it by --url."""
    from pondwatch.jobs.forms import form_of

    form_of(form)
    sides = _view(view)
    with _whole(out) as file:
        if url is not None:
            _fetch(url, f"/api/sessions/{what}/export/{form}", sides, file)
        elif of is not None:
            _of_result(Path(what), of, form, sides, file)
        else:
            _of_store(what, form, sides, data, file)
    print(f"{out} is written.")


def _view(text: str | None) -> dict[str, str]:
    from pondwatch.core.errors import Invalid

    if text is None:
        return {}
    sides = text.split(",")
    try:
        [float(side) for side in sides]
        return dict(zip(("west", "south", "east", "north"), sides, strict=True))
    except ValueError:
        raise Invalid(f"--view {text!r}: must be four numbers, metres: west,south,east,north.") from None


def _of_result(result: Path, of: Path, form: str, sides: dict[str, str], file: IO[bytes]) -> None:
    from pondwatch.basestation.bundle import Bundle
    from pondwatch.basestation.result import result_dossier
    from pondwatch.jobs.forms import view_from, write_dossier

    with Bundle(of) as opened:
        write_dossier(result_dossier(opened, result), form, file, view_from(sides))


def _of_store(session: str, form: str, sides: dict[str, str], data: Path | None, file: IO[bytes]) -> None:
    from pondwatch.jobs.forms import view_from, write_form
    from pondwatch.store.clock import SystemClock
    from pondwatch.store.store import Store

    settings = _settings(data)
    with Store(settings.data, settings.url) as store:
        write_form(store, session, form, file, int(SystemClock().now_s() * 1000), view_from(sides))


def verify(
    bundle: Annotated[Path, typer.Argument(metavar="BUNDLE", help="An evidence bundle.")],
    key: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Public key (PEM) that it must be signed with.")
    ] = None,
) -> None:
    """Check an evidence bundle, offline.

    Exit status 0: intact. 1: it is not what was signed, and one line says what is wrong. 2: it cannot be looked at.
    """
    from pondwatch.jobs.verify import Tampered, public_key_of
    from pondwatch.jobs.verify import verify as check

    try:
        found = check(bundle, None if key is None else public_key_of(key))
    except Tampered as error:
        print(f"NOT INTACT: {error.message}", file=sys.stderr)
        raise typer.Exit(1) from None
    print(
        f"INTACT: session {found.session} ({found.name}), finished {found.finished_at}, sealed {found.sealed_at}: "
        f"{found.records} records, {found.images} images."
    )
    said = (
        "the key that you named" if key else "this is the bundle's own word: compare it with the plant's, or give --key"
    )
    print(f"Signed with {found.key}; {said}.")


def key(
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Write it there, as PEM.")] = None,
    data: Data = None,
) -> None:
    """Show the public key that finished sessions are signed with; it is made where there is none yet."""
    from pondwatch.store.signing import Signer

    signer = Signer(_settings(data).data)
    print(signer.public)
    if out is not None:
        with _whole(out) as file:
            file.write(signer.public_pem)


@contextlib.contextmanager
def _whole(out: Path) -> Iterator[IO[bytes]]:
    """A file that takes its name only once it is whole."""
    from pondwatch.core.errors import Invalid

    try:
        with tempfile.NamedTemporaryFile(dir=out.parent, prefix=f".{out.name}-", delete=False) as file:
            aside = Path(file.name)
            try:
                yield file
                file.flush()
                aside.chmod(0o644)
                aside.replace(out)
            except BaseException:
                aside.unlink(missing_ok=True)
                raise
    except OSError as error:
        raise Invalid(f"{out}: cannot be written ({error.strerror}).") from error


def _fetch(url: str, path: str, query: dict[str, str], file: IO[bytes]) -> None:
    import httpx

    from pondwatch.basestation.uploader import Refused, connect
    from pondwatch.core.errors import Unavailable

    try:
        with connect(url, 600.0) as client, client.stream("GET", path, params=query) as answer:
            if answer.status_code != 200:
                told = answer.read()
                detail = httpx.Response(answer.status_code, content=told).json().get("detail", "")
                raise Refused(f"{url}: {detail or answer.status_code}", status=answer.status_code)
            for part in answer.iter_bytes():
                file.write(part)
    except (httpx.HTTPError, ValueError) as error:
        raise Unavailable(f"{url}: does not answer as a Pondwatch ({type(error).__name__}).") from error


def _settings(data: Path | None) -> Settings:
    from pondwatch.config import Settings

    settings = Settings()
    return settings if data is None else settings.model_copy(update={"data": data})
