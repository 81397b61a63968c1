"""The certified truth, as a renderer like the others: a crash in it costs one picture, not the run."""

from __future__ import annotations

from reference.scene import Scene
from reference.text import dump
from translator.contract import PYTHON, Export, Settings

TITLE = "Certified truth"
LICENCE = "MIT"
INSTALL = "pip install crossray"
VERSION = ((PYTHON, "-m", "crossray", "--version"), r"crossray (\S+)")
TIMING = r"certified in ([0-9.e-]+) s"
SUMMARY = r"\d+ pixels: .*"


def export(scene: Scene, settings: Settings) -> Export:
    """The scene file itself and the command that proves its pixels by the `exact` convention."""
    size = f"{settings.width}x{settings.height}"
    command = (PYTHON, "-m", "crossray", "certify", "scene.txt", "-o", "scene.exr")
    return Export({"scene.txt": dump(scene)}, (*command, "--size", size, "--depth", str(settings.depth)), "scene.exr")
