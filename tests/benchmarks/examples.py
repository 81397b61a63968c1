"""The document's examples: tracing, proving, the first call, and the whole process from scene file to picture file."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

from peers import CORES, DEPTH, OURS, SCALAR, Task, missing
from turns import Pace, Run, in_turn, seconds

from reference import Scene
from reference.certification import certify
from translator.contract import Settings
from translator.registry import adapter
from translator.run import write_export

ROOT = Path(__file__).resolve().parent.parent.parent
ENOUGH = 100.0  # seconds a contender, for all the rounds
PEERS = ["povray", "tachyon", "mitsuba", "radiance", *SCALAR]

FIRST_CALL = """
import sys
from time import perf_counter
start = perf_counter()
from reference import Scene, render
scene = Scene.load(sys.argv[1])
ready = perf_counter()
render(scene, width=int(sys.argv[2]), height=int(sys.argv[2]), precision=sys.argv[3], device="cpu")
print(ready - start, perf_counter() - ready)
"""


def scenes(number: int | None = None) -> Iterator[tuple[Path, Scene]]:
    """The paths and scenes of the examples, the first few or all."""
    for path in sorted((ROOT / "scenes").glob("example?.txt"))[:number]:
        yield path, Scene.load(path)


def measure_examples(pace: Pace, side: int = 1000, number: int | None = None) -> dict[str, Any]:
    """Tracing by everyone, proving by crossray."""
    pace = replace(pace, budget=ENOUGH)
    absent = missing(PEERS)
    present = [name for name in PEERS if name not in absent]
    rows: dict[str, Any] = {}
    for path, scene in scenes(number):
        print(f"examples: {path.stem}", file=sys.stderr)
        task = Task(scene, side, pace)
        rows[path.stem] = in_turn({**task.contenders(present), "certify": partial(_certify, task)}, pace)
    firsts = {path.stem: first_calls(path, side) for path, _ in scenes(number)}
    return {"side": side, "depth": DEPTH, "missing": absent, "rows": rows, "first": firsts}


def _certify(task: Task) -> Run:
    prove = partial(certify, task.scene, width=task.side, height=task.side)
    prove()
    return Run(median(seconds(prove) for _ in range(task.pace.renders)))


def first_calls(path: Path, side: int) -> dict[str, float]:
    """Seconds of the first call of `render` in a process that never rendered, without and with kernels on disk."""
    with tempfile.TemporaryDirectory(prefix="crossray-") as home:  # Dr.Jit keeps its kernels in the home folder
        command = [sys.executable, "-c", FIRST_CALL, str(path), str(side), OURS]
        run = partial(subprocess.run, command, check=True, capture_output=True, text=True, cwd=ROOT)
        said = [run(env=os.environ | {"HOME": home}).stdout.split() for _ in range(2)]
    return {"import": float(said[1][0]), "cold": float(said[0][1]), "warm": float(said[1][1])}


def measure_process(pace: Pace, side: int = 1000, number: int | None = None) -> dict[str, Any]:
    """The whole process of crossray, its kernels on disk, and of POV-Ray on the same scene."""
    pace = replace(pace, budget=ENOUGH)
    rows: dict[str, Any] = {}
    for path, scene in scenes(number):
        print(f"process: {path.stem}", file=sys.stderr)
        export = adapter("povray").export(scene, Settings(side, side, DEPTH, CORES))
        with tempfile.TemporaryDirectory(prefix="crossray-") as folder:
            write_export(export, folder)
            ours = [sys.executable, "-m", "crossray", "render", str(path), "-o", str(Path(folder, "scene.jpg"))]
            commands: dict[str, list[str]] = {OURS: [*ours, "--size", f"{side}x{side}", "--device", "cpu"]}
            if "povray" not in missing(["povray"]):
                commands["povray"] = list(export.command)
            environment = {**os.environ, **export.environment}
            run = partial(subprocess.run, cwd=folder, env=environment, check=True, capture_output=True)
            rows[path.stem] = in_turn({name: partial(_timed, run, words) for name, words in commands.items()}, pace)
    return {"side": side, "depth": DEPTH, "rows": rows, "missing": missing(["povray"])}


def _timed(run: Any, command: list[str]) -> Run:
    return Run(seconds(partial(run, command)))
