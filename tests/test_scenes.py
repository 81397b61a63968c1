"""The diagnostic scenes: what each is for, and that it reveals it."""

import runpy
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers import ROOT
from mistakes import DEPTH, MISTAKES, levels, share

from reference.image import quantise
from reference.model import DOCUMENT, pixel_direction
from reference.scene import Scene

PATHS = sorted((ROOT / "scenes" / "diagnostic").glob("*.txt"))
# What a scene must show in more than a few pixels: no example does, or hardly.
CLEAR = ["C8", "C9", "C10", "I4", "P4", "P5", "S7", "A1", "R5", "R13", "Q2", "Q3"]
TIES = ("corner_tie", "tangent")


@pytest.fixture(scope="module")
def documentation() -> dict[str, Any]:
    return runpy.run_path(str(ROOT / "docs" / "scenes.py"))


@pytest.mark.parametrize("path", PATHS, ids=lambda path: path.stem)
def test_scenes_are_small_and_ordinary(path: Path) -> None:
    """A scene that warns is an error here."""
    Scene.load(path)
    assert len(path.read_text().splitlines()) <= 40


@pytest.mark.parametrize("name", MISTAKES)
def test_every_mistake_is_revealed(name: str) -> None:
    found = max(share(Scene.load(path), MISTAKES[name]) for path in PATHS)
    assert found > (0.0005 if name in CLEAR and not MISTAKES[name].rounding else 0)


def test_every_depth_limit_is_told_apart() -> None:
    scene = Scene.load(ROOT / "scenes" / "diagnostic" / "facing_mirrors.txt")
    pictures = [quantise(levels(scene, depth=depth)).astype(int) for depth in range(DEPTH + 1)]
    for one, other in combinations(pictures, 2):
        assert np.mean(np.abs(one - other).max(axis=-1) > 8) > 0.05


@pytest.mark.parametrize("path", [path for path in PATHS if path.stem not in TIES], ids=lambda path: path.stem)
def test_no_edge_runs_through_pixel_centres(path: Path) -> None:
    """Moving the pixels by 1e-8 moves no pixel across an edge."""

    def moved(*pixel: Any) -> tuple[Any, Any, Any]:
        x, y, z = pixel_direction(*pixel)
        return x + 1e-8, y - 1.3e-8, z

    scene = Scene.load(path)
    assert np.abs(levels(scene) - levels(scene, replace(DOCUMENT, camera_direction=moved))).max() < 0.5


def test_every_scene_has_a_purpose(documentation: dict[str, Any]) -> None:
    assert sorted(documentation["PURPOSES"]) == [path.stem for path in PATHS]


def test_the_page_is_up_to_date(documentation: dict[str, Any]) -> None:
    written = (ROOT / "docs" / "scenes.md").read_text(encoding="utf-8")
    assert written == documentation["page"](), "docs/scenes.md is not what would be written now: `make docs` writes it"
