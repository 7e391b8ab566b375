"""SFP10 on disk: made in parallel, taken up again where it was cut off, checked by digests, loaded pond by pond.

A folder holds `spec.json`, what was asked for, written first; `train/` and `test/` with a `pond-NNNN.npz` (snapshots
once, truth, noisy poses and masks of all its sets) and `pond-NNNN.png` (the pond's image) for each pond; `previews/`;
`README.md`, its card; and `manifest.json`, written last: what is listed there is whole.
"""

from __future__ import annotations

import hashlib
import io
import json
import multiprocessing
import os
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from pondwatch.core.errors import Invalid, InvalidBundle
from pondwatch.core.paperinputs import CANVAS_PX

from .sfp10 import Part, PondSets, Sfp10Spec, make_pond
from .sfp10_card import card, previews

FORMAT = "sfp10/1"
_PNG = [cv2.IMWRITE_PNG_COMPRESSION, 6]


def write_dataset(
    spec: Sfp10Spec, folder: Path, workers: int = 2, progress: Callable[[int, int], None] = lambda *_: None
) -> dict[str, Any]:
    """Make a data set; again with the same spec it makes what is missing.

    Args:
        workers: processes; 1 works in this one. What is made does not depend on it.
        progress: called with the ponds done and all ponds.

    Returns:
        The manifest.

    Raises:
        Invalid: a value out of its range, or a folder that holds something else.
    """
    spec.check()
    _claim(spec, folder)
    ponds = spec.ponds()
    missing = [(part, number) for part, number in ponds if not _files(folder, part, number)[0].is_file()]
    done = len(ponds) - len(missing)
    progress(done, len(ponds))
    for count, _ in enumerate(_made(spec, folder, missing, workers), start=done + 1):
        progress(count, len(ponds))
    firsts = dict(reversed(ponds))  # the first pond of each part
    shown = {f"{part}-{number:04d}": load_pond(folder, part, number) for part, number in firsts.items()}
    for name, picture in previews(shown).items():
        _replace(folder / "previews" / name, picture)
    _replace(folder / "README.md", card(spec).encode())
    return _write_manifest(spec, folder)


def load_spec(folder: Path) -> Sfp10Spec:
    """What a folder was made from.

    Raises:
        InvalidBundle: there is no data set, or it was not finished.
    """
    manifest = _manifest(folder)
    return Sfp10Spec(**manifest["spec"])


def load_pond(folder: Path, part: Part, number: int) -> PondSets:
    """One pond with all its sets.

    Raises:
        InvalidBundle: the file is not there, or is not what the data set holds.
    """
    arrays, picture = _files(folder, part, number)
    try:
        with np.load(arrays) as held:
            masks = np.unpackbits(held["masks"], axis=-1).reshape(-1, CANVAS_PX, CANVAS_PX).astype(np.bool_)
            snapshots, truth, noisy, fills = (held[k] for k in ("snapshots", "truth", "noisy", "fills"))
        raster = cv2.imdecode(np.frombuffer(picture.read_bytes(), np.uint8), cv2.IMREAD_GRAYSCALE)
    except (OSError, ValueError, KeyError) as error:
        raise InvalidBundle(f"{arrays}: cannot be read ({error}).", file=arrays.name) from error
    return PondSets(np.asarray(raster, np.uint8), snapshots, truth, noisy, masks, fills)


def damaged(folder: Path) -> list[str]:
    """The files that are missing or not what the manifest says, by name.

    Raises:
        InvalidBundle: there is no data set, or it was not finished.
    """
    listed: dict[str, str] = _manifest(folder)["files"]
    return [name for name, digest in listed.items() if _digest(folder / name) != digest]


def _manifest(folder: Path) -> dict[str, Any]:
    path = folder / "manifest.json"
    try:
        manifest: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InvalidBundle(f"{folder}: holds no finished SFP10 data set ({error}).", file="manifest.json") from error
    if manifest.get("format") != FORMAT:
        raise InvalidBundle(f"{path}: format is {manifest.get('format')!r}, not {FORMAT!r}.", file="manifest.json")
    return manifest


def _claim(spec: Sfp10Spec, folder: Path) -> None:
    """The folder is new, empty, or holds the same data set."""
    told = {"format": FORMAT, "spec": asdict(spec)}
    path = folder / "spec.json"
    if path.is_file():
        if json.loads(path.read_text(encoding="utf-8")) != told:
            raise Invalid(f"{folder}: holds an SFP10 data set of another spec, in {path.name}; give another folder.")
    elif folder.exists() and any(folder.iterdir()):
        raise Invalid(f"{folder}: is not empty; a data set is written to a folder of its own.")
    for part in ("train", "test", "previews"):
        (folder / part).mkdir(parents=True, exist_ok=True)
    _replace(path, (json.dumps(told, indent=1) + "\n").encode())


def _made(spec: Sfp10Spec, folder: Path, ponds: list[tuple[Part, int]], workers: int) -> Iterator[None]:
    if workers <= 1 or len(ponds) <= 1:
        for part, number in ponds:
            _make(spec, folder, part, number)
            yield
        return
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers, mp_context=context) as pool:
        for future in as_completed([pool.submit(_make, spec, folder, part, number) for part, number in ponds]):
            future.result()
            yield


def _make(spec: Sfp10Spec, folder: Path, part: Part, number: int) -> None:
    """The pond's image first: where the arrays are, the pond is whole."""
    cv2.setNumThreads(1)
    sets = make_pond(spec, part, number)
    arrays, picture = _files(folder, part, number)
    _replace(picture, cv2.imencode(".png", sets.raster, _PNG)[1].tobytes())
    packed = np.packbits(sets.masks.reshape(len(sets.masks), -1), axis=-1)
    _replace(arrays, _npz(snapshots=sets.snapshots, truth=sets.truth, noisy=sets.noisy, masks=packed, fills=sets.fills))


def _npz(**arrays: NDArray[Any]) -> bytes:
    out = io.BytesIO()
    np.savez_compressed(out, allow_pickle=False, **arrays)
    return out.getvalue()


def _files(folder: Path, part: Part, number: int) -> tuple[Path, Path]:
    stem = folder / part / f"pond-{number:04d}"
    return stem.with_suffix(".npz"), stem.with_suffix(".png")


def _replace(path: Path, content: bytes) -> None:
    beside = path.with_name(f".{path.name}.{os.getpid()}")
    beside.write_bytes(content)
    beside.replace(path)


def _digest(path: Path) -> str:
    return "sha256:" + hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else "none"


def _write_manifest(spec: Sfp10Spec, folder: Path) -> dict[str, Any]:
    files = sorted(f for part, number in spec.ponds() for f in _files(folder, part, number))
    listed = {f.relative_to(folder).as_posix(): _digest(f) for f in files}
    manifest = {
        "format": FORMAT,
        "spec": asdict(spec),
        "sets": {"train": spec.train, "test": spec.test},
        "bytes": sum(f.stat().st_size for f in files),
        "files": listed,
    }
    _replace(folder / "manifest.json", (json.dumps(manifest, indent=1) + "\n").encode())
    return manifest
