"""docs/paper.md: its tables between markers and its pictures, from what was measured; and the tables on a terminal."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from pondwatch.core.paperinputs import Grey, binarised, covered, denormalised, stitched, tile_size
from pondwatch.core.values import Float
from pondwatch.simulator.sfp10 import CAMERA, HEIGHT_PX, WIDTH_PX, PondSets, layout
from pondwatch.simulator.sfp10_files import load_pond, load_spec

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "paper.md"
PICTURES = ROOT / "docs" / "pictures"
Found = dict[str, Any]

# arXiv 2503.02752, its ablation: MSE, MAE, R² of x, y, theta; IoU.
PUBLISHED: dict[str, tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...], float]] = {
    "a": ((0.0897, 0.0901, 0.3639), (0.2514, 0.2520, 0.5092), (-0.1047, -0.1215, -0.0821), 0.1894),
    "b": ((0.0807, 0.0807, 0.3328), (0.2395, 0.2405, 0.4878), (0.0060, -0.005, 0.0115), 0.2032),
    "c": ((0.1384, 0.1243, 0.5250), (0.3007, 0.2874, 0.5870), (-0.7023, -0.5527, -0.5624), 0.4347),
    "ours": ((0.0019, 0.0022, 0.0091), (0.0156, 0.0163, 0.0329), (0.9503, 0.9411, 0.9465), 0.8797),
}
NAMES = {
    "identity": "identity: the input handed back",
    "middle": "always the middle of the pond",
    "lattice": "Pondwatch's `lattice` method",
    "a": "(a) coordinates",
    "a-longer": "(a), trained four times as long",
    "b": "(b) + snapshots",
    "c": "(c) + noisy stitched image",
    "ours": "the paper's: + mask of noisy poses",
    "ours-longer": "the paper's, trained four times as long",
    "ours-oracle": "the paper's, mask of true poses (**oracle**)",
    "corrections": "the paper's, predicting corrections",
}
HEAD = (
    "method",
    "MSE x",
    "MSE y",
    "MSE theta",
    "MAE x",
    "MAE y",
    "MAE theta",
    "R² x",
    "R² y",
    "R² theta",
    "IoU",
    "sets",
)
PANEL_PX = 300


def tables(found: Sequence[Found]) -> Iterator[str]:
    """A table for each noise and split, the published rows under each."""
    for noise, split in sorted({(f["noise"], f["split"]) for f in found}, key=lambda p: (p[0], p[1] != "shared")):
        rows = {f["method"]: f for f in found if (f["noise"], f["split"]) == (noise, split)}
        lines = [_row(_named(f), f["mse"], f["mae"], f["r2"], f["iou"], str(f["sets"]))
                 for f in (rows[m] for m in NAMES if m in rows)]  # fmt: skip
        lines += [_row(f"*published* {NAMES[m]}", *PUBLISHED[m], "1000") for m in PUBLISHED]
        head = ["| " + " | ".join(HEAD) + " |", "| --- |" + " ---: |" * (len(HEAD) - 1)]
        yield f"### Noise `{noise}`, poses {split}\n\n" + "\n".join([*head, *lines])


def _named(row: Found) -> str:
    """A method's name, and its recipe where it was trained: `how` begins with it, between back-quotes."""
    recipe = f" [{row['how'].split('`')[1]} recipe]" if row["how"] else ""
    return NAMES[row["method"]] + recipe


def _row(name: str, mse: Sequence[float], mae: Sequence[float], r2: Sequence[float], iou: float, sets: str) -> str:
    cells = [name, *(_number(v) for v in (*mse, *mae)), *(f"{v:.4f}" for v in r2), f"{100 * iou:.2f} %", sets]
    return "| " + " | ".join(cells) + " |"


def _number(value: float) -> str:
    return f"{value:.4f}" if value >= 0.001 else f"{value:.1e}"


def recipe_lines(found: Sequence[Found]) -> str:
    """How the rows were made: recipes, seeds, commits, seconds."""
    hows = sorted({f["how"].split(", seed")[0] for f in found if f["how"]})
    commits = ", ".join(sorted({f["commit"].rstrip("+") for f in found}))
    seeds = ", ".join(sorted({str(f["seed"]) for f in found}))
    spent = [f"{NAMES[f['method']]} {f['seconds']:.2g} s" for f in found
             if f["method"] in ("ours", "lattice") and (f["noise"], f["split"]) == ("paper", "disjoint")]  # fmt: skip
    ious = sorted({f["iou_sets"] for f in found if f["method"] != "lattice"})
    lines = [
        "Networks: " + "; ".join(hows) + ".",
        f"Data set seed {seeds}; at commits {commits}. IoU over {', '.join(map(str, ious))} of a row's sets "
        "(`lattice`: all of its).",
        "CPU time a set: " + ", ".join(spent) + ".",
    ]
    return "\n".join(lines)


def print_tables(found: Sequence[Found]) -> None:
    """On a terminal."""
    print("\n\n".join([*tables(found), recipe_lines(found)]) if found else "Nothing was measured yet.")


def write_page(found: Sequence[Found], folders: Sequence[Path], runs: Path) -> None:
    """The tables between the page's markers; a picture for each data set given, of its first test pond."""
    text = PAGE.read_text(encoding="utf-8")
    before, _, rest = text.partition("<!-- table:begin -->\n")
    _, _, after = rest.partition("<!-- table:end -->")
    if not after:
        raise SystemExit(f"{PAGE}: has no markers table:begin and table:end")
    block = "\n\n".join([recipe_lines(found), *tables(found)])
    PAGE.write_text(f"{before}<!-- table:begin -->\n{block}\n<!-- table:end -->{after}", encoding="utf-8")
    for folder in folders:
        spec = load_spec(folder)
        name = f"paper-{spec.split}-{spec.noise}.png"
        cv2.imwrite(str(PICTURES / name), comparison(folder, runs), [cv2.IMWRITE_PNG_COMPRESSION, 9])


def comparison(folder: Path, runs: Path) -> Grey:
    """As the paper's comparison figure, of a data set's first test pond and middle noise instance."""
    sets, instance = load_pond(folder, "test", 0), len(load_pond(folder, "test", 0).noisy) // 2
    panels = [("noisy, stitched", sets.noisy[instance].astype(np.float64))]
    panels += list(_estimates(sets, instance, runs / load_spec(folder).noise))
    panels += [("truth", sets.truth)]
    drawn = [_panel(name, _stitched(sets, poses)) for name, poses in panels]
    drawn.append(_panel("mask of noisy", covered(panels[0][1], CAMERA, layout()).astype(np.float32)))
    rows = [np.hstack(drawn[i : i + 4]) for i in range(0, len(drawn), 4)]
    return np.vstack([np.pad(r, ((0, 0), (0, drawn[0].shape[1] * 4 - r.shape[1])), constant_values=255) for r in rows])


def _estimates(sets: PondSets, instance: int, runs: Path) -> Iterator[tuple[str, Float]]:
    from . import data, predict, train

    for net in ("a", "b", "c", "ours", "corrections"):
        if not (runs / net / "checkpoint.pt").is_file():
            continue
        network, made = train.load(runs / net)
        one = PondSets(
            sets.raster, sets.snapshots, sets.truth, sets.noisy[[instance]], sets.masks[[instance]], sets.fills
        )
        estimate, _ = predict.predict(network, data.as_tensors(one, network.shape, 0, made["poses"]))
        yield (
            {"ours": "the paper's"}.get(net, f"({net})" if len(net) == 1 else net),
            denormalised(estimate[0], layout()),
        )


def _stitched(sets: PondSets, poses: Float) -> NDArray[np.float32]:
    pond = layout()
    return stitched(binarised(sets.snapshots, tile_size(CAMERA, pond, PANEL_PX)), poses, CAMERA, pond, PANEL_PX)


def _panel(name: str, canvas: NDArray[np.float32]) -> Grey:
    height = round(PANEL_PX * HEIGHT_PX / WIDTH_PX)
    picture = cv2.resize(np.asarray(canvas * 255, np.uint8), (PANEL_PX, height), interpolation=cv2.INTER_AREA)
    framed = cv2.copyMakeBorder(picture, 22, 6, 4, 4, cv2.BORDER_CONSTANT, value=(255,))
    cv2.putText(framed, name, (6, 15), cv2.FONT_HERSHEY_SIMPLEX, 0.45, (0,), 1, cv2.LINE_AA)
    return np.asarray(framed, np.uint8)
