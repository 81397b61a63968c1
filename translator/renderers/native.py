"""crossray's own tracer, as a renderer like the others: a crash in it costs one picture, not the run."""

from __future__ import annotations

from reference.scene import Scene
from reference.text import dump
from translator.contract import PYTHON, Export, Limits, Settings

TITLE = "crossray"
LICENCE = "MIT"
INSTALL = "pip install crossray"
VERSION = ((PYTHON, "-m", "crossray", "--version"), r"crossray (\S+)")
TIMING = r"traced in ([0-9.e-]+) s"

LIMITS = Limits(precision=2.0**-44)


def export(scene: Scene, settings: Settings) -> Export:
    """The scene file itself and the command that draws it by the `exact` convention, in double precision."""
    size = f"{settings.width}x{settings.height}"
    command = (PYTHON, "-m", "crossray", "render", "scene.txt", "-o", "scene.exr")
    options = ("--size", size, "--depth", str(settings.depth), "--convention", "exact", "--precision", "double")
    return Export({"scene.txt": dump(scene)}, (*command, *options, "--time"), "scene.exr", limits=LIMITS)
