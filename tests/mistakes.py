"""The mistakes that docs/scenes.md tells of: those of the bank that the examples hide, and some that are not in it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import drjit as dr
import numpy as np
from numpy.typing import NDArray

from reference.image import quantise
from reference.mistakes import MISTAKES as BANK
from reference.model import DOCUMENT, Model, Number, beyond, sphere_distances
from reference.scene import Scene, merge_coincident
from reference.tracer import render
from reference.world import View

Levels = NDArray[Any]
Picture = NDArray[np.uint8]

SIDE = 200  # pixels
DEPTH = 3  # bounces that are followed


@dataclass(frozen=True)
class Mistake:
    """One mistake; `draw` makes the picture of a scene that a tracer with this mistake alone would make."""

    summary: str
    draw: Callable[[Scene], Picture]
    rounding: bool = False  # changes no more than one level


def levels(scene: Scene, model: Model = DOCUMENT, depth: int = DEPTH) -> Levels:
    return render(scene, model, width=SIDE, height=SIDE, depth=depth, dtype=float)


@cache
def right(scene: Scene) -> Picture:
    return quantise(levels(scene))


@cache
def share(scene: Scene, mistake: Mistake) -> float:
    """The share of pixels that are off by more than 8 levels; by any, where the mistake is one of rounding."""
    error = np.abs(right(scene).astype(int) - mistake.draw(scene)).max(axis=-1)
    return float(np.mean(error > (0 if mistake.rounding else 8)))


def known(key: str) -> Mistake:
    """A mistake of the bank."""
    mistake, view = BANK[key], View(SIDE, SIDE, DEPTH)
    return Mistake(mistake.title, lambda scene: quantise(mistake.draw(scene, view)), mistake.rounding)


def replacing(summary: str, **steps: Any) -> Mistake:
    """The mistake of a model that is the document's but for these steps."""
    model = replace(DOCUMENT, **steps)
    return Mistake(summary, lambda scene: quantise(levels(scene, model)))


def two_roots(*ray: Any) -> tuple[Number, Number]:
    near, far = sphere_distances(*ray)
    return dr.select(near < far, near, dr.nan), dr.select(near < far, far, dr.nan)


def last_listed_first(scene: Scene) -> Scene:
    return merge_coincident(replace(scene, spheres=scene.spheres[::-1], planes=scene.planes[::-1]))


HIDDEN: tuple[str, ...] = ("C8", "C9", "C10", "I4", "P4", "P5", "S3", "S5", "S7", "L8", "A1", "R5", "R7")
HIDDEN += ("R12/0", "R12/1", "R12/2", "R13", "Q1", "Q2", "Q3")


# Letter and number are those of the project's list of classic mistakes; the mistakes named by a word are not in it.
MISTAKES = {key: known(key) for key in HIDDEN} | {
    "tie": replacing("of two surfaces at the same distance the last listed wins", surfaces=last_listed_first),
    "touch": replacing("a ray that touches a sphere in one point misses it", sphere_distances=two_roots),
    "grazing": replacing("the camera misses planes where d.n is less than 1", camera=beyond(1, 1)),
    "far": replacing(
        "planes at t > 100000 are not seen",
        camera=replace(
            DOCUMENT.camera, plane=lambda t, facing, leaving: (t < 1e5) & DOCUMENT.camera.plane(t, facing, leaving)
        ),
    ),
}
