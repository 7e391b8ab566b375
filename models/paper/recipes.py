"""How the networks are trained: the paper's recipe, and one for two CPU cores."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Recipe:
    """instances: noise instances a pond that are trained on, 0 is all. ponds_a_batch: its sets come from so many."""

    name: str
    epochs: int
    instances: int
    learning_rate: float
    width: int
    snapshot_px: tuple[int, int]
    canvas_px: int
    batch: int = 24
    ponds_a_batch: int = 4
    decay: bool = False  # of the learning rate, to 0 along a cosine


FULL = Recipe("full", 60, 0, 1e-4, 4, (160, 110), 256)
REDUCED = Recipe("reduced", 40, 25, 1e-3, 1, (20, 14), 48, decay=True)
RECIPES = {recipe.name: recipe for recipe in (FULL, REDUCED)}


def told(recipe: Recipe) -> str:
    """One sentence."""
    sets = f"{recipe.instances} of each pond's 100 noise instances" if recipe.instances else "all sets"
    width, height = recipe.snapshot_px
    return (
        f"recipe `{recipe.name}`: {sets}, {recipe.epochs} epochs, batch {recipe.batch}, Adam (0.9, 0.999) at "
        f"{recipe.learning_rate:g}{' with cosine decay' if recipe.decay else ''}, layers {recipe.width} times the "
        f"least width, snapshots at {width} x {height} px, mask or stitched image at {recipe.canvas_px} px"
    )
