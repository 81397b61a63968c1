"""crossray beside POV-Ray and Mitsuba, in one run on one machine: medians, ratios first.

    make bench

Tracing: the tracer's own time for 1000 x 1000 pixels and three bounces, in double precision, with a warm kernel, up to
the picture in memory; for the others the time that they report themselves. Whole process: from the command to the
picture on disk, for crossray with a warm kernel cache.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from statistics import median
from time import perf_counter

from rich.console import Console
from rich.table import Table

from reference import Scene, render
from reference.errors import RendererError
from translator.contract import Settings
from translator.registry import adapter
from translator.run import command_line, draw, installed_version, write_export

ROOT = Path(__file__).parent.parent.parent
RUNS = 7
PEERS = ("povray", "mitsuba")


def seconds(action: Callable[[], object]) -> float:
    start = perf_counter()
    action()
    return perf_counter() - start


def trace_seconds(name: str, scene: Scene) -> float:
    """What the renderer says its tracing took."""
    renderer, settings = adapter(name), Settings()
    _, log = draw(renderer.export(scene, settings), settings, timeout=600)
    found = re.search(renderer.TIMING, log)
    if not found:
        raise RendererError(f"{renderer.TITLE} did not say how long it took", log)
    return float(found[1])


def process_seconds(path: Path, scene: Scene, folder: Path) -> tuple[float, float]:
    """crossray's and POV-Ray's whole process on the same scene, run in turn; medians."""
    export = adapter("povray").export(scene, Settings())
    write_export(export, folder)
    ours = [sys.executable, "-m", "crossray", "render", str(path), "-o", str(folder / "scene.jpg")]
    theirs = ["sh", "-c", "exec " + command_line(export)]
    times: dict[str, list[float]] = {"ours": [], "theirs": []}
    for _ in range(RUNS + 1):
        for name, command in (("ours", ours), ("theirs", theirs)):
            times[name].append(seconds(partial(subprocess.run, command, cwd=folder, check=True, capture_output=True)))
    return median(times["ours"][1:]), median(times["theirs"][1:])


def main() -> None:
    peers = [name for name in PEERS if installed_version(name)]
    tracing = Table("scene", *(f"{name} / crossray" for name in peers), "crossray double", "single", *peers)
    processes = Table("scene", "povray / crossray", "crossray render", "povray")
    for path in sorted((ROOT / "scenes").glob("example?.txt")):
        scene = Scene.load(path)
        ours = {
            precision: median([seconds(partial(render, scene, precision=precision)) for _ in range(RUNS + 2)][2:])
            for precision in ("double", "single")
        }
        theirs = [median(trace_seconds(name, scene) for _ in range(RUNS)) for name in peers]
        ratios = [f"{time / ours['double']:.1f}x" for time in theirs]
        tracing.add_row(path.stem, *ratios, *(f"{1000 * time:.1f} ms" for time in (*ours.values(), *theirs)))
        if shutil.which("povray"):
            with tempfile.TemporaryDirectory(prefix="crossray-") as folder:
                whole, povray = process_seconds(path, scene, Path(folder))
            processes.add_row(path.stem, f"{povray / whole:.1f}x", f"{whole:.2f} s", f"{povray:.2f} s")
    console = Console(width=110)
    console.print("Tracing, 1000 x 1000, three bounces, medians:", tracing)
    console.print("Whole process, scene file to picture file, medians:", processes)


if __name__ == "__main__":
    main()
