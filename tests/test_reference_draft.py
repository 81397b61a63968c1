"""Drafts in single precision: never farther than a hundredth of a level from double precision."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import drjit as dr
import numpy as np
import pytest
from random_scenes import random_scene

from reference import draft
from reference.device import array_types
from reference.draft import Draft, is_draftable
from reference.model import CONVENTIONS, DOCUMENT, EXACT, PUBLISHED
from reference.scene import Plane, Scene, Sphere
from reference.tracer import render
from reference.world import View, World

SCENES = Path(__file__).parent.parent / "scenes"
EXAMPLES = sorted(SCENES.glob("example?.txt"))
FILES = EXAMPLES + sorted((SCENES / "diagnostic").glob("*.txt"))
FLOOR = Plane((90, 120, 60), (0, -100, 0), (0, 1, 0), 0.6, 0.8)
BALL = Sphere((250, 200, 0), (20, -30, 300), 40, 0.7, 0.5)
ROOM = Scene((255, 240, 200), 0.2, (BALL,), (FLOOR,))

pytestmark = pytest.mark.filterwarnings("ignore::reference.errors.SceneWarning")


def names(path: Path) -> str:
    return path.stem


def difference(scene: Scene, **options: Any) -> float:
    """The worst in what is seen of the picture, in levels."""
    auto, double = (np.clip(render(scene, precision=precision, **options), 0, 255) for precision in ("auto", "double"))
    return float(np.abs(auto - double).max())


def share_in_doubt(scene: Scene) -> float:
    world = World(scene, DOCUMENT, array_types("double"), array_types("single"))
    drafted = Draft(world, array_types("single"))
    pixel = dr.arange(drafted.search.Index, 90000)
    _, doubt = drafted.colours(View(300, 300, 3), pixel * 0, pixel % 300, pixel // 300)
    return float(np.mean(doubt.numpy()))


@pytest.mark.parametrize("convention", CONVENTIONS)
@pytest.mark.parametrize("path", FILES, ids=names)
def test_files_are_drawn_as_in_double_precision(path: Path, convention: str) -> None:
    scene = Scene.load(path)
    assert difference(scene, model=CONVENTIONS[convention], width=150, height=130) <= 0.01


@pytest.mark.parametrize("depth", [0, 1, 8, 100])
@pytest.mark.parametrize("path", EXAMPLES, ids=names)
def test_whatever_the_depth(path: Path, depth: int) -> None:
    assert difference(Scene.load(path), width=200, height=200, depth=depth) <= 0.01


@pytest.mark.parametrize("seed", range(40))
def test_random_scenes_are_drawn_as_in_double_precision(seed: int) -> None:
    model = list(CONVENTIONS.values())[seed % 3]
    assert difference(random_scene(seed), model=model, width=211, height=97) <= 0.01


@pytest.mark.parametrize("path", EXAMPLES, ids=names)
def test_few_pixels_are_in_doubt(path: Path) -> None:
    assert 0 < share_in_doubt(Scene.load(path)) < 0.05


def test_without_proofs_differences_would_show(monkeypatch: pytest.MonkeyPatch) -> None:
    drafted = Draft.colours

    def certain(self: Draft, *places: Any) -> Any:
        colour, doubt = drafted(self, *places)
        return colour, doubt & False

    monkeypatch.setattr(Draft, "colours", certain)
    assert difference(Scene.load(EXAMPLES[0]), width=400, height=400) > 1


def test_what_a_colour_may_lose_decides(monkeypatch: pytest.MonkeyPatch) -> None:
    doubt = share_in_doubt(ROOM)
    monkeypatch.setattr(draft, "FAITHFUL", 0.0)
    assert share_in_doubt(ROOM) > 0.4 > doubt


@pytest.mark.parametrize(
    "surface",
    [
        replace(BALL, radius=1e-3),
        replace(BALL, radius=1.0, centre=(0.3, 0.2, 150.7)),
        replace(BALL, centre=(0.1, 0.1, 1.2e5), radius=1e5),
        replace(BALL, centre=(1e6, 2e5, 3e6), radius=1e6),
        replace(BALL, centre=(0, 0, 1e30), radius=1e29),
        replace(BALL, centre=(0, 0, 1e90), radius=1e89),
        replace(BALL, centre=(0, -60, 300), radius=40),
        replace(BALL, colour=(1e6, -1e6, 0)),
        replace(BALL, colour=(1e200, 0, 0)),
        replace(BALL, diffuse=-3, reflection=-2),
        replace(BALL, reflection=30),
        replace(BALL, colour=(0, 0, 0)),
        replace(BALL, centre=(500, 500, 560), radius=55),
        replace(BALL, centre=(500, 500, 900), radius=500),
    ],
)
def test_extreme_spheres_are_drawn_as_in_double_precision(surface: Sphere) -> None:
    scene = replace(ROOM, spheres=(BALL, surface))
    assert difference(scene, width=150, height=150, depth=5) <= 0.01


@pytest.mark.parametrize(
    "plane",
    [
        Plane((9, 9, 200), (0, 500.001, 0), (0, 1, 0), 1, 1),
        Plane((9, 9, 200), (0, 500, 0), (0, -1, 0), 1, 1),
        Plane((9, 9, 200), (0, 0, 1e6), (1, 2, 3), 1, 1),
        Plane((9, 9, 200), (0, -100, 0), (1e-5, 1, 0), 1, 1),
        Plane((9, 9, 200), (0, -1e-3, 0), (0, 1, 0), 1, 1),
        Plane((9, 9, 200), (0, -100, 0), (0, -2, 0), 1, 1),
        Plane((9, 9, 200), (0, 0, 1e60), (0.1, 0.1, 1), 1, 1),
    ],
)
def test_extreme_planes_are_drawn_as_in_double_precision(plane: Plane) -> None:
    scene = replace(ROOM, planes=(FLOOR, plane))
    assert difference(scene, width=150, height=150, depth=5) <= 0.01
    assert difference(replace(scene, spheres=()), width=150, height=150) <= 0.01


@pytest.mark.parametrize("radius", [1e4, 5e6, 5e7, 1e9, 1e11, 1e13, 1e30])
def test_giant_spheres_are_seen(radius: float) -> None:
    scene = replace(ROOM, spheres=(replace(BALL, centre=(0, 0, radius + 150), radius=radius),), planes=())
    assert difference(scene, width=100, height=100) <= 0.01
    scene = replace(ROOM, spheres=(replace(BALL, centre=(0, -radius - 150, 200 + radius), radius=radius),), planes=())
    assert difference(scene, width=100, height=100) <= 0.01


@pytest.mark.parametrize("count", [15, 40])
def test_many_spheres_are_drawn_as_in_double_precision(count: int) -> None:
    row = [replace(BALL, centre=(12.7 * i - 90, 5.1 * (i % 7) - 40, 200 + 31.3 * i), radius=9.3) for i in range(count)]
    scene = replace(ROOM, spheres=tuple(row))
    assert is_draftable(scene, DOCUMENT)
    assert difference(scene, width=120, height=120) <= 0.01


def test_drafts_are_of_conventions_only() -> None:
    assert all(is_draftable(ROOM, model) for model in CONVENTIONS.values())
    assert not is_draftable(ROOM, replace(EXACT, camera_direction=lambda *pixel: (*pixel[:2], 1)))
    assert not is_draftable(ROOM, replace(DOCUMENT, cosine=lambda normal, to_light: 1))
    assert not is_draftable(ROOM, replace(DOCUMENT, reflection=EXACT.reflection))


def test_published_rays_start_on_the_side_of_the_normal() -> None:
    """By 1e-4, which a small mirror shows: drafts have planes' normals toward the eye."""
    away, small = replace(FLOOR, normal=(0, -1, 0), reflection=1), replace(BALL, radius=0.02, centre=(0, -99.9, 210))
    scene = replace(ROOM, spheres=(small,), planes=(away,))
    assert is_draftable(scene, DOCUMENT)
    assert not is_draftable(scene, PUBLISHED)
    assert is_draftable(replace(scene, planes=(FLOOR,)), PUBLISHED)
    assert difference(scene, model=PUBLISHED, width=100, height=600) <= 0.01


@pytest.mark.parametrize(
    "scene",
    [
        replace(ROOM, spheres=(replace(BALL, centre=(0, 0, 90)),)),
        replace(ROOM, spheres=(replace(BALL, centre=(500, 500, 500)),)),
        replace(ROOM, planes=(Plane((9, 9, 9), (0, -40, 0), (0, 1, 0), 1, 0),)),
        replace(ROOM, planes=(Plane((9, 9, 9), (0, 500, 0), (0, 1, 0), 1, 0),)),
        replace(ROOM, planes=(Plane((9, 9, 9), (400, 0, 0), (1, 0, 0), 1, 0),)),
    ],
    ids=["before the screen", "around the light", "through the screen", "through the light", "before the light"],
)
def test_drafts_need_a_clear_view_and_light(scene: Scene) -> None:
    assert not is_draftable(scene, DOCUMENT)
    assert difference(scene, width=100, height=100) == 0
