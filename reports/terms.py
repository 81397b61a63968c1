"""The terms of a picture, each alone: ambient + diffuse - shadow + reflection is the picture before it is clamped.

`ambient` and `diffuse` are those of the surface that the eye sees, `diffuse` as if nothing blocked the light, `shadow`
what blockers take away of it, and `reflection` everything that bounces bring, with the terms of what they meet. All are
height x width x 3 in levels, not clamped, and none is below 0.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference.errors import RendererError
from reference.model import EXACT, Window
from reference.scene import Scene
from reference.tracer import render
from reports.metrics import TOLERANCE, error_map
from reports.recording import Recording

Terms = dict[str, NDArray[np.float64]]

LARGEST = 1 << 22  # pixels of a picture that has its terms drawn
NOTHING = Window(sphere=lambda t, leaving: (t > 0) & (t < 0), plane=lambda t, facing, leaving: (t > 0) & (t < 0))
UNSHADOWED = replace(EXACT, name="unshadowed", summary="nothing blocks the light", shadow=NOTHING)
VARIED = ("ambient", "light")  # the terms that a variant of the scene shows in any renderer
SEPARABLE = (*VARIED, "reflection")  # and the one that is what they leave of the whole picture
TITLES = {
    "ambient": "ambient",
    "diffuse": "diffuse, as if nothing blocked the light",
    "shadow": "shadow: what it takes away",
    "light": "diffuse less shadow",
    "reflection": "reflection: what bounces bring",
}


def terms(scene: Scene, *, width: int, height: int, depth: int) -> Terms:
    """The four terms of the `exact` convention, and `light`: diffuse less shadow."""
    shape: dict[str, Any] = {"width": width, "height": height, "dtype": np.float64}
    full = np.asarray(render(scene, EXACT, depth=depth, **shape))
    ambient = np.asarray(render(without_diffuse(scene), EXACT, depth=0, **shape))
    light = np.asarray(render(without_ambient(scene), EXACT, depth=0, **shape))
    diffuse = np.asarray(render(without_ambient(scene), UNSHADOWED, depth=0, **shape))
    return {
        "ambient": ambient,
        "diffuse": diffuse,
        "shadow": diffuse - light,
        "light": light,
        "reflection": full - ambient - light,
    }


def variants(scene: Scene) -> dict[str, Scene]:
    """Scenes whose pictures are those of a term, for renderers that can draw nothing but whole pictures."""
    return {
        "ambient": without_reflection(without_diffuse(scene)),
        "light": without_reflection(without_ambient(scene)),
    }


def compare_terms(
    right: Terms, full: NDArray[Any] | None, pictures: dict[str, NDArray[Any] | None]
) -> dict[str, dict[str, Any]]:
    """What is known of a renderer's SEPARABLE terms, from its picture and those of the variants.

    The largest error in levels, and how many pixels are `over` half a level, knife edges too. Pictures are clamped
    before reflection is what is left of them, as some renderers write nothing above 255.
    """
    found = {name: picture for name, picture in pictures.items() if picture is not None}
    errors = {name: error_map(right[name], found[name]) for name in VARIED if name in found}
    if full is not None and len(found) == len(pictures):
        whole = right["ambient"] + right["light"] + right["reflection"]
        errors["reflection"] = _error(_left(whole, right), _left(full, found))
    return {
        name: {"max_error": round(float(error.max()), 4), "over": int(np.count_nonzero(error > TOLERANCE))}
        for name, error in errors.items()
    }


def _left(full: NDArray[Any], terms: Mapping[str, NDArray[Any]]) -> NDArray[np.float64]:
    """What ambient and light leave of a picture, all of them clamped."""
    clamped = [np.clip(levels, 0, 255).astype(np.float64) for levels in (full, *(terms[name] for name in VARIED))]
    return np.asarray(clamped[0] - clamped[1] - clamped[2])


def _error(right: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.float64]:
    """The largest channel's error of each pixel, in levels; not a number counts as 255."""
    return np.asarray(np.nan_to_num(np.abs(right - other).max(axis=-1), nan=255.0))


def record_terms(run: Recording, entry: dict[str, Any], draw: Callable[[list[str], Path], object]) -> Terms | None:
    """Record the terms of a scene that `run` has begun; None where that is too much or does not work.

    They are drawn in a process of their own, as all pictures are: `draw` runs a command in a folder.
    """
    if entry["width"] * entry["height"] > LARGEST:
        return None
    shape = [str(entry[key]) for key in ("width", "height", "depth")]
    with TemporaryDirectory(prefix="crossray-") as name:
        folder = Path(name)
        (folder / "scene.txt").write_text(entry["text"], encoding="utf-8")
        try:
            draw([sys.executable, "-m", "reports.terms", "scene.txt", "terms.npz", *shape], folder)
        except RendererError:
            return None
        with np.load(folder / "terms.npz") as stored:
            found = {term: stored[term] for term in TITLES}
    run.add_terms(entry, {name: (TITLES[name], found[name]) for name in TITLES})
    return found


def record_comparisons(
    run: Recording,
    entry: dict[str, Any],
    right: Terms | None,
    renderer: tuple[str, str],
    full: NDArray[Any] | None,
    pictures: dict[str, NDArray[Any] | None],
) -> None:
    """Record how the terms of a renderer (name, title) compare with the `right` ones, where these are known."""
    if right is None:
        return
    for term, numbers in compare_terms(right, full, pictures).items():
        run.add_term_comparison(entry, term, {"renderer": renderer[0], "title": renderer[1], **numbers})


def main() -> None:
    """Draw the terms of a scene file: `python -m reports.terms SCENE PICTURES.npz WIDTH HEIGHT DEPTH`."""
    scene, pictures, *shape = sys.argv[1:]
    width, height, depth = map(int, shape)
    warnings.simplefilter("ignore")
    np.savez(pictures, **terms(Scene.load(scene), width=width, height=height, depth=depth))  # type: ignore[arg-type]


def without_diffuse(scene: Scene) -> Scene:
    """The scene with kd = 0 everywhere."""
    spheres, planes = scene.spheres, scene.planes
    return replace(
        scene,
        spheres=tuple(replace(sphere, diffuse=0.0) for sphere in spheres),
        planes=tuple(replace(plane, diffuse=0.0) for plane in planes),
    )


def without_reflection(scene: Scene) -> Scene:
    """The scene with kr = 0 everywhere."""
    spheres, planes = scene.spheres, scene.planes
    return replace(
        scene,
        spheres=tuple(replace(sphere, reflection=0.0) for sphere in spheres),
        planes=tuple(replace(plane, reflection=0.0) for plane in planes),
    )


def without_ambient(scene: Scene) -> Scene:
    """The scene with ka = 0."""
    return replace(scene, ambient_coefficient=0.0)


if __name__ == "__main__":
    main()
