"""crossray beside POV-Ray and Mitsuba, in one run on one machine: medians, ratios first.

    make bench

Tracing: the tracer's own time for 1000 x 1000 pixels and three bounces, in double precision, with a warm kernel, up to
the picture in memory; for the others the time that they report themselves. Proving: every pixel, in the same process.
Whole process: from the command to the picture on disk, for crossray with a warm kernel cache.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from statistics import median
from time import perf_counter

from rich.console import Console
from rich.table import Table

from reference import Scene, render
from reference.certification import certify
from reference.errors import RendererError
from translator.contract import Settings
from translator.registry import adapter
from translator.run import command_line, draw, installed_version, write_export

ROOT = Path(__file__).parent.parent.parent
RUNS = 7  # rounds, after one that does not count
RENDERS = 5  # of crossray's in a round
PEERS = ("povray", "mitsuba")


def seconds(action: Callable[[], object]) -> float:
    start = perf_counter()
    action()
    return perf_counter() - start


def render_seconds(scene: Scene, precision: str) -> float:
    """crossray's tracing up to the picture in memory, the median of a few."""
    return median(seconds(partial(render, scene, precision=precision)) for _ in range(RENDERS))


def certify_seconds(scene: Scene) -> float:
    """Proving every pixel, the median of a few."""
    return median(seconds(partial(certify, scene)) for _ in range(RENDERS))


def trace_seconds(name: str, scene: Scene) -> float:
    """What another renderer says its tracing took."""
    renderer, settings = adapter(name), Settings()
    _, log = draw(renderer.export(scene, settings), settings, timeout=600)
    found = re.search(renderer.TIMING, log)
    if not found:
        raise RendererError(f"{renderer.TITLE} did not say how long it took", log)
    return float(found[1])


def in_turn(actions: Mapping[str, Callable[[], float]]) -> dict[str, list[float]]:
    """The seconds of each action, run in turn so that a change of the machine's speed meets all alike."""
    for action in actions.values():
        action()
    rounds = [{name: action() for name, action in actions.items()} for _ in range(RUNS)]
    return {name: [times[name] for times in rounds] for name in actions}


def ratio(theirs: list[float], ours: list[float]) -> str:
    """The median of the ratios round by round."""
    return f"{median(a / b for a, b in zip(theirs, ours, strict=True)):.1f}x"


def processes(path: Path, scene: Scene, folder: Path) -> Mapping[str, Callable[[], float]]:
    """crossray's and POV-Ray's whole process on the same scene."""
    export = adapter("povray").export(scene, Settings())
    write_export(export, folder)
    commands = {
        "crossray": [sys.executable, "-m", "crossray", "render", str(path), "-o", str(folder / "scene.jpg")],
        "povray": ["sh", "-c", "exec " + command_line(export)],
    }
    run = partial(subprocess.run, cwd=folder, check=True, capture_output=True)
    return {name: partial(seconds, partial(run, command)) for name, command in commands.items()}


def main() -> None:
    peers = [name for name in PEERS if installed_version(name)]
    tracing = Table("scene", *(f"{name} / crossray" for name in peers), "crossray double", "single", *peers)
    whole = Table("scene", "povray / crossray", "crossray render", "povray")
    proving = Table("scene", "certify / crossray double", "certify")
    for path in sorted((ROOT / "scenes").glob("example?.txt")):
        scene = Scene.load(path)
        ours = {name: partial(render_seconds, scene, name) for name in ("double", "single")}
        times = in_turn({"double": ours["double"], "certify": partial(certify_seconds, scene)})
        proving.add_row(
            path.stem, ratio(times["certify"], times["double"]), f"{1000 * median(times['certify']):.1f} ms"
        )
        times = in_turn(ours | {name: partial(trace_seconds, name, scene) for name in peers})
        ratios = [ratio(times[name], times["double"]) for name in peers]
        tracing.add_row(path.stem, *ratios, *(f"{1000 * median(taken):.1f} ms" for taken in times.values()))
        if "povray" in peers:
            with tempfile.TemporaryDirectory(prefix="crossray-") as folder:
                times = in_turn(processes(path, scene, Path(folder)))
            taken = [f"{median(times[name]):.2f} s" for name in ("crossray", "povray")]
            whole.add_row(path.stem, ratio(times["povray"], times["crossray"]), *taken)
    console = Console(width=110)
    console.print("Tracing, 1000 x 1000, three bounces, medians:", tracing)
    console.print("Proving every pixel, 1000 x 1000, three bounces, medians:", proving)
    console.print("Whole process, scene file to picture file, medians:", whole)


if __name__ == "__main__":
    main()
