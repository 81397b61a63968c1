"""Shared by the tests of translators, reports and the command line."""

import os
import re
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import NoReturn

import numpy as np
import pytest
from numpy.typing import NDArray

from reference import EXACT, Plane, Scene, Sphere, render
from reference.image import Picture
from reference.scene import Triple
from translator.contract import Settings
from translator.run import Outcome, installed_version, run_renderer

ROOT = Path(__file__).resolve().parent.parent
EXAMPLE = ROOT / "scenes" / "example1.txt"
EXPECTED = ROOT / "tests" / "expected"
NUMBER = re.compile(r"(?<![\w.])-?[0-9]+(\.[0-9]+)?(e[+-]?[0-9]+)?(?![\w.])")

# Coloured ambient; a sphere before the screen; kr > 1; a twin of the second sphere that is listed later and vanishes;
# a wall lit from the side that the eye does not see, its normal 5000 long; a floor that the screen cuts.
TRICKY = """\
10 200 90
0.3
3
255 0 0
5 5 90
8
0.5
0.25
0 255 0
0 0 300
40
1
1.5
0 0 255
0 0 300
40
0.2
0
2
200 100 50
0 0 400
0 3000 4000
0.5
0.75
60 70 80
0 -20 0
0 1 0
1
0.1
"""


def need(program: str) -> str:
    """The path of a program; without it the test is skipped, and in continuous integration it fails."""
    path = shutil.which(program)
    if path is None:
        _miss(program)
    return path


def need_module(name: str) -> None:
    """Go on only with a Python package; without it the test is skipped, and in continuous integration it fails."""
    if find_spec(name) is None:
        _miss(name)


def need_renderer(name: str) -> None:
    """Go on only with that renderer; without it the test is skipped, and in continuous integration it fails."""
    if installed_version(name) is None:
        _miss(name)


def _miss(name: str) -> NoReturn:
    if os.environ.get("CI") == "true":
        pytest.fail(f"{name} is not installed")
    pytest.skip(f"{name} is not installed")


def scene_of(*surfaces: Sphere | Plane, ambient: Triple = (255, 255, 255)) -> Scene:
    spheres = tuple(surface for surface in surfaces if isinstance(surface, Sphere))
    planes = tuple(surface for surface in surfaces if isinstance(surface, Plane))
    return Scene(ambient, 0.1, spheres, planes)


def expect_text(file: str, text: str) -> None:
    """The text is that of a file in `expected`, which CROSSRAY_REFRESH=1 writes anew."""
    expected = EXPECTED / file
    if os.environ.get("CROSSRAY_REFRESH") == "1":
        expected.write_text(text, encoding="utf-8")
    assert text == expected.read_text(encoding="utf-8")


def rendered(name: str, scene: Scene, settings: Settings) -> tuple[Picture, Outcome]:
    """The picture by the real renderer, asked for its version anew, and all that is told of it."""
    installed_version.cache_clear()
    outcome = run_renderer(name, scene, settings, 120)
    assert outcome.status == "rendered", outcome
    assert outcome.picture is not None
    assert outcome.version
    assert outcome.trace_seconds is not None
    assert outcome.trace_seconds <= (outcome.seconds or 0)
    return outcome.picture, outcome


def exact(scene: Scene, width: int, height: int, depth: int = 3) -> NDArray[np.float64]:
    return np.asarray(render(scene, EXACT, width=width, height=height, depth=depth, dtype=np.float64))


def pixels_over(a: NDArray[np.floating], b: NDArray[np.floating], level: float = 0.5) -> int:
    """How many pixels differ by more than `level` in any channel, both clamped."""
    error = np.abs(np.clip(a, 0, 255).astype(float) - np.clip(b, 0, 255))
    return int((~(error <= level)).any(axis=-1).sum())


def crossray(*words: str | Path, stdin: str = "", cwd: Path | None = None, path: str | None = None) -> "Finished":
    """Run the command line in its own process."""
    environment = os.environ | ({} if path is None else {"PATH": path})
    command = [sys.executable, "-m", "crossray", *map(str, words)]
    return subprocess.run(
        command, input=stdin, cwd=cwd, env=environment, capture_output=True, text=True, timeout=120, check=False
    )


Finished = subprocess.CompletedProcess[str]
