"""How time and memory grow with the size of the picture, for the third example."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from statistics import median
from time import perf_counter
from typing import Any

from peers import DEPTH, OURS, Task, missing
from turns import Entry, Pace, Run, in_turn

from reference import Scene

ROOT = Path(__file__).resolve().parent.parent.parent
EXAMPLE = ROOT / "scenes" / "example3.txt"
SIDES = (250, 500, 1000, 2000, 4000, 8000, 16384)
PEERS = ["povray", "tachyon", "mitsuba"]
LARGEST_FOR_PEERS = 4000  # they hold the picture and its file in memory

# Bands are consumed as they come, as a file's writer does; peak memory is that of the whole process, Python included.
CHILD = """
import json, re, sys
from time import perf_counter
from reference import Scene
from reference.tracer import render_bands
scene, side, precision, times = Scene.load(sys.argv[1]), int(sys.argv[2]), sys.argv[3], []
for _ in range(int(sys.argv[4]) + 1):
    start, brightest = perf_counter(), 0.0
    for band in render_bands(scene, width=side, height=side, precision=precision, device="cpu"):
        brightest = max(brightest, float(band[0, 0, 0]))
    times.append(perf_counter() - start)
# Not ru_maxrss, which starts from what the process that started this one had.
largest = int(re.search(r"VmHWM:\\s+([0-9]+) kB", open("/proc/self/status").read())[1])
print(json.dumps({"seconds": times[1:], "memory": 1024 * largest}))
"""


def measure_sizes(pace: Pace, sides: tuple[int, ...] = SIDES) -> dict[str, Any]:
    """Bands by crossray in a process of its own, pictures by the others."""
    absent = missing(PEERS)
    rows: dict[str, Any] = {}
    for side in sides:
        print(f"sizes: {side}", file=sys.stderr)
        task = Task(Scene.load(EXAMPLE), side, pace)
        memory: list[int] = []

        def bands(side: int = side, memory: list[int] = memory) -> Run:
            start = perf_counter()
            renders = pace.renders if side < 4000 else 1
            command = [sys.executable, "-c", CHILD, str(EXAMPLE), str(side), OURS, str(renders)]
            said = json.loads(subprocess.run(command, check=True, capture_output=True, cwd=ROOT).stdout)
            memory.append(said["memory"])
            return Run(median(said["seconds"]), perf_counter() - start)

        peers = [name for name in PEERS if name not in absent and side <= LARGEST_FOR_PEERS]
        actions = {OURS: bands} | dict(task.contenders(peers, ours=()))
        row: dict[str, Entry] = in_turn(actions, pace)
        row |= {name: {"reason": f"not tried beyond {LARGEST_FOR_PEERS}"} for name in PEERS if name not in row}
        rows[str(side)] = {"contenders": row, "memory": max(memory)}
    return {"depth": DEPTH, "missing": absent, "rows": rows, "scene": EXAMPLE.stem}
