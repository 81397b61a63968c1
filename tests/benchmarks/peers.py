"""How each contender's time is had: seconds from a scene at hand to the picture in memory.

crossray: preparing the scene and drawing it, warm, each known alone. Mitsuba: a rendering in a process that has
rendered before, by mitsuba_warm.py. POV-Ray, Tachyon and Radiance: what they report of tracing alone; each run is a new
process. The C++ tracer: what it measures itself, warm. All use every core.
"""

from __future__ import annotations

import re
import subprocess
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from statistics import median
from time import perf_counter

import numpy as np
from numpy.typing import NDArray
from turns import Pace, Run, seconds

from reference import Scene
from reference.device import PRECISIONS as KNOWN
from reference.errors import RendererError
from reference.mosaic import Mosaic
from reference.text import dump
from reference.tracer import prepare
from reference.world import View, World
from translator.contract import Export, Settings
from translator.process import find_program, usable_cores
from translator.registry import adapter
from translator.run import draw, export_scene, installed_version

DEPTH = 3  # bounces
PRECISIONS = tuple(name for name in ("auto", "double", "single") if name in KNOWN)
OURS = PRECISIONS[0]  # what ratios are to
SCALAR = {"c++ double": "double", "c++ float": "float"}
SOURCE = Path(__file__).with_name("scalar.cpp")
WARM = Path(__file__).with_name("mitsuba_warm.py")
COMPILE = ("g++", "-O3", "-march=native", "-ffast-math", "-fopenmp")
COUNTING = ("g++", "-O1", "-DCOUNT", "-Wno-unknown-pragmas")
LONG = 1.0  # seconds of a rendering from which on one a round is enough; so it is in scalar.cpp
CORES = len(usable_cores())
PREPARED = {  # what a peer says that preparing the scene for tracing took, files not included
    "povray": r"Bounding Time:.*\(([0-9.]+) seconds\)",
    "tachyon": r"Preprocessing Time: +([0-9.]+) seconds",
    "mitsuba": r"loaded in ([0-9.]+) s",
}


def titles() -> dict[str, str]:
    """The names of contenders as people know them."""
    peers = {name: adapter(name).TITLE for name in ("povray", "tachyon", "mitsuba", "radiance")}
    return peers | {name: name.replace("c++", "C++") for name in SCALAR} | {p: f"crossray {p}" for p in PRECISIONS}


def missing(names: list[str]) -> dict[str, str]:
    """The contenders that this machine lacks, and what to type."""
    lacking = {name: adapter(name).INSTALL for name in names if name not in SCALAR and not installed_version(name)}
    if not find_program("g++"):
        lacking |= {name: "apt-get install g++" for name in names if name in SCALAR}
    return lacking


@dataclass(frozen=True)
class Task:
    """A scene to draw, `side` pixels wide and high."""

    scene: Scene
    side: int
    pace: Pace
    exports: dict[str, Export] = field(default_factory=dict, repr=False)  # that were made

    def contenders(self, names: list[str], ours: tuple[str, ...] = PRECISIONS) -> Mapping[str, Callable[[], Run]]:
        """What draws it: crossray in double precision first, whose picture the others are compared with."""
        order = sorted(ours, key=lambda precision: precision != "double")
        peers = {name: partial(self.scalar if name in SCALAR else self.peer, name) for name in names}
        return {precision: partial(self.crossray, precision) for precision in order} | peers

    def crossray(self, precision: str) -> Run:
        """Preparing the scene, and drawing it as often as wanted."""

        def ready() -> World | Mosaic:
            return prepare(self.scene, precision=precision, device="cpu")

        def draw_it() -> NDArray[np.float32]:
            pixels: NDArray[np.float32] = artist.draw(View(self.side, self.side, DEPTH), 0, self.side).numpy()
            return pixels.reshape(self.side, self.side, 3)

        artist = ready()
        start = perf_counter()
        picture = draw_it()  # the first to warm up, and to compare
        renders = self.pace.renders if perf_counter() - start < LONG else 1
        drawing = median(seconds(draw_it) for _ in range(renders))
        preparing = median(seconds(ready) for _ in range(renders))
        return Run(drawing + preparing, preparing, picture)

    @property
    def settings(self) -> Settings:
        return Settings(self.side, self.side, DEPTH, CORES)

    def peer(self, name: str) -> Run:
        """Another renderer, through its adapter."""
        if name not in self.exports:
            export = export_scene(name, self.scene, self.settings)
            self.exports[name] = self.warm(export) if name == "mitsuba" else export
        picture, log = draw(self.exports[name], self.settings, self.pace.timeout)
        found = _number(adapter(name).TIMING, log)
        if found is None:
            raise RendererError(f"{adapter(name).TITLE} did not say how long it took", log)
        return Run(found, _number(PREPARED.get(name, r"(?!)"), log), picture)

    def warm(self, export: Export) -> Export:
        """Mitsuba's export with a program of ours that draws it as quickly as it can."""
        options = ("--threads", str(CORES), "--renders", str(self.pace.renders), "--long", str(LONG))
        command = (*export.command[:1], WARM.name, "scene.xml", export.image, *options)
        return replace(export, files={**export.files, WARM.name: WARM.read_text()}, command=command)

    def scalar(self, name: str) -> Run:
        """The plain C++ tracer."""
        with tempfile.TemporaryDirectory(prefix="crossray-") as folder:
            picture = Path(folder, "picture")
            program = compiled(*COMPILE, f"-DREAL={SCALAR[name]}")
            said = self._run_scalar(program, folder, str(self.pace.renders + 1), str(picture))
            pixels = np.fromfile(picture, np.float32).reshape(self.side, self.side, 3)
        times = list(map(float, said.split()))
        return Run(median(times[1:] or times), None, pixels)

    def counts(self) -> list[int]:
        """What the C++ tracer computes for the picture: sums, products, comparisons, quotients, square roots."""
        with tempfile.TemporaryDirectory(prefix="crossray-") as folder:
            return list(map(int, self._run_scalar(compiled(*COUNTING), folder, "1").split()))

    def _run_scalar(self, program: str, folder: str, *words: str) -> str:
        path = Path(folder, "scene.txt")
        path.write_text(dump(self.scene))
        command = [program, str(path), str(self.side), str(DEPTH), *words]
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def _number(pattern: str, log: str) -> float | None:
    found = re.search(pattern, log)
    return float(found[1]) if found else None


_programs = tempfile.TemporaryDirectory(prefix="crossray-")


def compiled(*command: str) -> str:
    """The C++ tracer, compiled by that command once."""
    program = Path(_programs.name, str(abs(hash(command))))
    if not program.exists():
        subprocess.run([*command, str(SOURCE), "-o", str(program)], check=True, capture_output=True)
    return str(program)
