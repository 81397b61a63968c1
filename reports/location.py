"""Which feature a difference of unknown cause lies in, where that can be told from the place alone."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import drjit as dr
import numpy as np
from numpy.typing import NDArray

from reference.model import DOCUMENT, Window
from reference.scene import Scene
from reference.tracer import render
from reference.world import View
from reports.verdict import worst_channel

Mask = NDArray[np.bool_]

ROUNDING = 1.0  # level
INSIDE = 0.98  # of the difference lies in a feature's region that it is told to lie in
LARGEST = 0.8  # of the picture that a region may be: what lies everywhere tells nothing
NEAR = 2  # pixels from an outline

_NOTHING = Window(sphere=lambda t, leaving: t > dr.inf, plane=lambda t, facing, leaving: t > dr.inf)
UNSHADOWED = replace(DOCUMENT, name="unshadowed", summary="nothing blocks the light", shadow=_NOTHING)


def locate(scene: Scene, view: View, excess: NDArray[np.floating[Any]]) -> tuple[str, ...]:
    """The features in whose region nearly all wrong pixels lie, or none: those of the smallest region.

    `excess` is how far each channel is off, in levels, H x W x 3, 0 where it is right.
    """
    worst = worst_channel(np.asarray(excess))
    wrong = worst > 0
    if not wrong.any():
        return ()
    if worst.max() <= ROUNDING:
        return ("quantisation",)
    fitting = [
        (float(region.mean()), feature)
        for feature, region in _regions(scene, view)
        if region.mean() <= LARGEST and wrong[region].sum() >= INSIDE * wrong.sum()
    ]
    return (min(fitting)[1],) if fitting else ()


def _regions(scene: Scene, view: View) -> Iterator[tuple[str, Mask]]:
    right = _draw(scene, view, DOCUMENT)
    yield "shadows", _differ(right, _draw(scene, view, UNSHADOWED))
    yield "reflections", _differ(right, _draw(scene, replace(view, depth=0), DOCUMENT))
    yield "geometry", _outlines(scene, view)


def _outlines(scene: Scene, view: View) -> Mask:
    """Near where one surface gives way to another."""
    count = len(scene.spheres) + len(scene.planes)
    colours = iter([(float(n & 255), float(n >> 8 & 255), float(n >> 16)) for n in range(1, count + 1)])
    flat = Scene(
        (256.0, 256.0, 256.0),
        1.0,
        tuple(replace(sphere, colour=next(colours), diffuse=0.0, reflection=0.0) for sphere in scene.spheres),
        tuple(replace(plane, colour=next(colours), diffuse=0.0, reflection=0.0) for plane in scene.planes),
    )
    ids = _draw(flat, view, DOCUMENT)
    edges = np.zeros(ids.shape[:2], bool)
    for axis in (0, 1):
        steps = (np.abs(np.diff(ids, axis=axis)) > 0.5).any(axis=-1)
        edges |= np.pad(steps, [(0, int(a == axis)) for a in (0, 1)]) | np.pad(
            steps, [(int(a == axis), 0) for a in (0, 1)]
        )
    return _grown(edges, NEAR)


def _grown(mask: Mask, by: int) -> Mask:
    """The mask and all within so many pixels of it."""
    for _ in range(by):
        padded = np.pad(mask, 1)
        mask = padded[1:-1, 1:-1] | padded[:-2, 1:-1] | padded[2:, 1:-1] | padded[1:-1, :-2] | padded[1:-1, 2:]
    return mask


def _differ(one: NDArray[Any], other: NDArray[Any]) -> Mask:
    """Where they do by more than half a level, and next to that, as far as JPEG and antialiasing smear it."""
    return _grown(worst_channel(np.abs(one - other)) > 0.5, 1)


def _draw(scene: Scene, view: View, model: Any) -> NDArray[np.float64]:
    picture = render(scene, model, width=view.width, height=view.height, depth=view.depth, dtype=np.float64)
    return np.asarray(np.clip(picture, 0, 255))
