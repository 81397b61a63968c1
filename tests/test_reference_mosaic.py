"""Tiles that see planes alone: never a sphere or shadow in them, never farther off than was claimed."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import drjit as dr
import numpy as np
import pytest
from random_scenes import random_scene

from reference import beams
from reference.device import array_types
from reference.draft import FAITHFUL, is_draftable
from reference.model import CONVENTIONS, DOCUMENT, Model
from reference.mosaic import Mosaic, Part
from reference.scene import Plane, Scene, Sphere
from reference.tables import PIXELS, TILE, tile_corners
from reference.tracer import render
from reference.walls import radiance
from reference.world import View, World

SCENES = Path(__file__).parent.parent / "scenes"
EXAMPLES = sorted(SCENES.glob("example?.txt"))
FILES = EXAMPLES + sorted((SCENES / "diagnostic").glob("*.txt"))
SIZE = (211, 150)
FLOOR = Plane((90, 120, 60), (0, -100, 0), (0, 1, 0), 0.6, 0.8)
BALL = Sphere((250, 200, 0), (20, -30, 300), 40, 0.7, 0.5)

pytestmark = pytest.mark.filterwarnings("ignore::reference.errors.SceneWarning")


def names(path: Path) -> str:
    return path.stem


def mosaic(scene: Scene, model: Model = DOCUMENT) -> Mosaic:
    return Mosaic(World(scene, model, array_types("double"), array_types("single")), array_types("single"))


def pixels(flags: Any, view: View) -> np.ndarray[Any, Any]:
    """What is so of tiles, as a picture of its pixels."""
    tiles = np.asarray(flags).reshape(-(-view.height // TILE), -(-view.width // TILE))
    return np.repeat(np.repeat(tiles, TILE, 0), TILE, 1)[: view.height, : view.width]


def plain_tiles(scene: Scene, model: Model, view: View) -> tuple[Any, Any]:
    """Which pixels are of plain tiles, as far as colours are right or not; and how far off colours may be."""
    drawn = mosaic(scene, model)
    corners, middle, spread = drawn.tiles(view, view.height, drawn.Index(0))
    plain, error = beams.plain(drawn.draft.search, drawn.walls, middle, spread, drawn.Index(view.depth))
    all_of_them = dr.zeros(drawn.Float, len(corners))
    return pixels((plain & (all_of_them == 0)).numpy(), view), pixels((error + all_of_them).numpy(), view)


def scenes() -> Iterator[Any]:
    yield from (pytest.param(Scene.load(path), id=path.stem) for path in FILES)
    yield from (pytest.param(random_scene(seed), id=f"random {seed}") for seed in range(60))


@pytest.mark.parametrize("scene", list(scenes()))
def test_plain_tiles_see_planes_alone(scene: Scene) -> None:
    """Their double precision pictures are the same without any sphere, bit for bit; single precision is as claimed."""
    view = View(*SIZE, 3)
    asked: dict[str, Any] = {"width": view.width, "height": view.height, "precision": "double", "dtype": float}
    for model in CONVENTIONS.values():
        seen = model.surfaces(scene)
        if not is_draftable(seen, model):
            continue
        plain, claimed = plain_tiles(scene, model, view)
        whole, empty = render(scene, model, **asked), render(replace(seen, spheres=()), model, **asked)
        assert np.array_equal(whole[plain], empty[plain])
        alone = alone_in_single(seen, model, view)
        assert (np.abs(alone - whole).max(axis=-1) <= claimed)[plain].all()


def alone_in_single(scene: Scene, model: Model, view: View) -> Any:
    drawn = mosaic(scene, model)
    pixel = dr.arange(drawn.Index, view.width * view.height)
    camera = drawn.directions(view, drawn.Index(0), pixel % view.width, pixel // view.width)
    colour = radiance(drawn.walls, camera, drawn.Index(view.depth)) + dr.zeros(drawn.Vector, len(pixel))
    return dr.ravel(colour).numpy().reshape(view.height, view.width, 3)


@pytest.mark.parametrize(("path", "least"), list(zip(EXAMPLES, (0.5, 0.7, 0.6, 0.75), strict=True)))
def test_most_of_the_examples_is_plain(path: Path, least: float) -> None:
    plain, claimed = plain_tiles(Scene.load(path), DOCUMENT, View(1000, 1000, 3))
    assert np.mean(plain & (claimed < FAITHFUL)) > least


@pytest.mark.parametrize("path", EXAMPLES, ids=names)
@pytest.mark.parametrize("blind", ["_touched", "_shaded"])
def test_what_beams_look_for_matters(path: Path, blind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: dict[str, Any] = {"width": 200, "height": 200}
    right = render(Scene.load(path), precision="double", **asked)
    assert np.abs(render(Scene.load(path), **asked) - right).max() <= 0.01
    looked = getattr(beams, blind)

    def overlook(*beam: Any) -> Any:
        found = looked(*beam)
        return (found[0] & False, found[1]) if isinstance(found, tuple) else found & False

    monkeypatch.setattr(beams, blind, overlook)
    assert np.abs(render(Scene.load(path), **asked) - right).max() > 8


def test_single_precision_that_is_too_far_off_is_not_used() -> None:
    """A dazzling floor: single precision loses more than a hundredth of a level, which is known."""
    scene = Scene((255, 255, 255), 0.1, (BALL,), (replace(FLOOR, colour=(9e6, 9e6, 9e6)),))
    view = View(100, 100, 3)
    plain, claimed = plain_tiles(scene, DOCUMENT, view)
    lost = np.abs(alone_in_single(scene, DOCUMENT, view) - render(scene, precision="double", width=100, height=100))
    assert lost[plain].max() > 0.01
    assert (
        np.abs(render(scene, width=100, height=100) - render(scene, precision="double", width=100, height=100)).max()
        < 0.01
    )
    assert (lost.max(axis=-1) <= claimed)[plain].all()


def test_kernels_are_launched_again_for_other_views() -> None:
    """What was traced for one view does not show in another, nor in other rows of it."""
    scene = Scene.load(EXAMPLES[2])
    drawn = mosaic(scene)
    for view, top, count in [
        (View(100, 90, 3), 0, 90),
        (View(100, 90, 3), 16, 40),
        (View(100, 90, 1), 0, 90),
        (View(90, 100, 3), 0, 90),
        (View(61, 7, 2), 0, 7),
        (View(100, 90, 3), 0, 90),
        (View(100, 90, 3), 48, 40),
    ]:
        again = drawn.draw(view, top, count).numpy()
        assert np.array_equal(again, mosaic(scene).draw(view, top, count).numpy())


def test_pictures_of_one_kind_of_tile() -> None:
    wall = Plane((90, 120, 60), (0, 0, 2000), (0, 0, -1), 0.6, 0)
    empty = Scene((255, 255, 255), 0.1, (), (wall,))
    full = Scene((255, 255, 255), 0.1, (Sphere((250, 200, 0), (0, 0, 900), 600, 0.7, 0.5),))
    for scene, all_plain in ((empty, True), (full, False), (Scene((0, 0, 0), 0), True)):
        plain, _ = plain_tiles(scene, DOCUMENT, View(400, 300, 3))
        assert plain.all() if all_plain else not plain.any()
        drawn, right = (render(scene, width=400, height=300, precision=name) for name in ("auto", "double"))
        assert np.abs(drawn - right).max() <= 0.01


def test_tiles_have_every_pixel_once() -> None:
    drawn = mosaic(Scene.load(EXAMPLES[0]))
    width, height = 37, 21
    across, down = -(-width // TILE), -(-height // TILE)
    corners = tile_corners(drawn.walls, width, dr.arange(drawn.Index, across * down))
    column, row = Part(corners, dr.arange(drawn.Index, across * down * PIXELS)).places()
    places = list(zip(column.numpy().tolist(), row.numpy().tolist(), strict=True))
    assert len(set(places)) == len(places)
    assert {(x, y) for x in range(width) for y in range(height)} <= set(places)
