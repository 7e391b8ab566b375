"""`pondwatch pond`: layouts made, checked and given to a server; inventories imported and reconciled."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from pondwatch.core.values import Pond

app = typer.Typer(no_args_is_help=True, help="Ponds: their layouts, and what is declared to be in them.")

Pitch = Annotated[float, typer.Option(help="Distance between neighbours, m.")]
Columns = Annotated[int, typer.Option(help="Rods in a row.")]
Rows = Annotated[int, typer.Option(help="Rows.")]
Outer = Annotated[float | None, typer.Option(help="Outer radius, m; 0.36 of the pitch if not given.")]
Inner = Annotated[float | None, typer.Option(help="Inner radius, m; 0.23 of the pitch if not given.")]
Margin = Annotated[float | None, typer.Option(help="From the outermost centres to the walls, m; a pitch if not given.")]
Out = Annotated[Path, typer.Option(metavar="FILE", help="A .json or .csv file.")]
Server = Annotated[str, typer.Option(help="The server.")]
Width = Annotated[float | None, typer.Option(help="The pond's width, m, for a CSV.")]
Height = Annotated[float | None, typer.Option(help="The pond's height, m, for a CSV.")]
LayoutFile = Annotated[Path, typer.Argument(metavar="FILE", help="A layout: .json, a session.json, or .csv.")]


@app.command("hex")
def hexagonal(
    pitch: Pitch,
    columns: Columns,
    rows: Rows,
    out: Out,
    outer: Outer = None,
    inner: Inner = None,
    margin: Margin = None,
) -> None:
    """Make the layout of a hexagonal lattice: every second row is moved by half a pitch."""
    _make("hex", pitch, columns, rows, out, (outer, inner, margin))


@app.command("square")
def square(
    pitch: Pitch,
    columns: Columns,
    rows: Rows,
    out: Out,
    outer: Outer = None,
    inner: Inner = None,
    margin: Margin = None,
) -> None:
    """Make the layout of a square lattice."""
    _make("square", pitch, columns, rows, out, (outer, inner, margin))


def _make(
    kind: str, pitch: float, columns: int, rows: int, out: Path, sizes: tuple[float | None, float | None, float | None]
) -> None:
    from pondwatch.core.errors import Invalid
    from pondwatch.core.layouts import csv_of, document_of, lattice

    if out.suffix not in (".json", ".csv"):
        raise Invalid(f"{out.name}: must end in .json or .csv.")
    pond = lattice(kind, pitch, columns, rows, *sizes)
    text = csv_of(pond) if out.suffix == ".csv" else json.dumps(document_of(pond), indent=1) + "\n"
    out.write_text(text, encoding="utf-8")
    print(f"{len(pond.rods)} rods in {pond.width_m:g} x {pond.height_m:g} m are in {out}.")


@app.command("check")
def check(layout: LayoutFile, width: Width = None, height: Height = None) -> None:
    """Say whether a layout can be used; what is wrong is named by its line."""
    pond = _read(layout, width, height)
    print(f"{len(pond.rods)} rods in {pond.width_m:g} x {pond.height_m:g} m.")


def _read(path: Path, width: float | None, height: float | None) -> Pond:
    from pondwatch.core.errors import Invalid, InvalidLayout
    from pondwatch.core.layouts import from_csv, from_json

    content = _content(path)
    try:
        if path.suffix == ".csv":
            if width is None or height is None:
                raise Invalid("a CSV has only rods; give --width and --height.")
            return from_csv(content, width, height)
        return from_json(content)
    except InvalidLayout as error:
        raise InvalidLayout(f"{path.name}: {error.message}", **error.facts) from error


def _content(path: Path) -> bytes:
    from pondwatch.core.errors import Invalid

    try:
        return path.read_bytes()
    except OSError as error:
        raise Invalid(f"{path.name}: cannot be read ({error.strerror}).") from error


@app.command("add")
def add(
    layout: LayoutFile,
    url: Server,
    name: Annotated[str, typer.Option(help="The pond's name; one that is there gets a further version.")],
    width: Width = None,
    height: Height = None,
) -> None:
    """Give a server a pond, or a further version of its layout."""
    from pondwatch.core.layouts import document_of

    document = document_of(_read(layout, width, height))
    known = {str(p["name"]): str(p["id"]) for p in _ask(url, "GET", "/api/ponds")["ponds"]}
    if name in known:
        made = _ask(url, "POST", f"/api/ponds/{known[name]}/layouts", json=document)
    else:
        made = _ask(url, "POST", "/api/ponds", params={"name": name}, json=document)
    print(f"pond {made['id']} has layout {made['layout_version']}, {made['rods']} rods")


@app.command("declare")
def declare(
    inventory: Annotated[Path, typer.Argument(metavar="FILE", help="CSV: item,position,state,date.")],
    url: Server,
    pond: Annotated[str, typer.Option(metavar="ID", help="The pond.")],
) -> None:
    """Import a declared inventory; one faulty line refuses all of it."""
    content = _content(inventory)
    made = _ask(
        url, "POST", f"/api/ponds/{pond}/inventories", params={"name": inventory.name}, content=content,
        headers={"content-type": "text/csv"},
    )  # fmt: skip
    print(f"inventory {made['id']} has {made['lines']} lines")


@app.command("reconcile")
def reconcile(
    session: Annotated[str, typer.Argument(metavar="ID", help="The session.")],
    url: Server,
    inventory: Annotated[str, typer.Option(metavar="ID", help="Which; the last that was imported.")] = "latest",
) -> None:
    """Say how a session agrees with a declared inventory. Exit status 1 where there is a discrepancy."""
    told = _ask(url, "GET", f"/api/sessions/{session}/reconcile", params={"inventory": inventory})
    for line in told["lines"]:
        if line["outcome"] == "disagree":
            words = f"declared {line['declared']}, observed {line['observed']['state']}"
            print(f"discrepancy: line {line['line']}, {line['item']} at {line['position']}: {words}")
    print(", ".join(f"{name.replace('_', ' ')} {count}" for name, count in told["counts"].items()))
    if told["counts"]["disagree"]:
        raise typer.Exit(1)


def _ask(url: str, method: str, path: str, **said: Any) -> dict[str, Any]:
    """The server's answer. Raises Invalid, Unavailable: in its own words."""
    import httpx

    from pondwatch.core.errors import Invalid, Unavailable

    try:
        answer = httpx.request(method, url.rstrip("/") + path, timeout=30, **said)
        body: dict[str, Any] = answer.json()
    except (httpx.HTTPError, httpx.InvalidURL, ValueError) as error:
        raise Unavailable(f"{url}: no answer that can be read ({type(error).__name__}).") from error
    if answer.is_error:
        raise Invalid(str(body.get("detail", f"The server answered {answer.status_code}.")))
    return body
