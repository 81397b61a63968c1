"""Time a class: students x the four examples at 1000 x 1000, graded on two cores; memory of all processes together.

    python tests/benchmarks/grading.py [--students 20] [--side 1000]

A third of the pictures are right (JPEG of several qualities, PNG), the rest make mistakes of the bank, each student's
own; some files are broken. Prints the time, what 200 students would take at that rate once the set-up is paid, and the
largest memory.
"""

from __future__ import annotations

import argparse
import io
import json
import os
import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent.parent
EXAMPLES = [ROOT / "scenes" / f"example{number}.txt" for number in (1, 2, 3, 4)]
CORES = 2
CLASS = 200  # students
BROKEN = 25  # every so many pictures, one file is cut off
QUALITIES = (60, 75, 90, 95)


def hand_in(folder: Path, students: int, side: int) -> None:
    """Make the class's pictures. Each wrong picture is drawn once and saved for all who make that mistake."""
    from PIL import Image

    from reference import Scene, render
    from reference.image import quantise
    from reference.mistakes import MISTAKES
    from reference.world import View

    luck = random.Random(7)
    ids = sorted(MISTAKES)
    chosen = [None if luck.random() < 1 / 3 else luck.choice(ids) for _ in range(students)]
    view = View(side, side, 3)
    for path in EXAMPLES:
        scene = Scene.load(path)
        drawn = {}
        for number, choice in enumerate(chosen):
            if choice not in drawn:
                levels = MISTAKES[choice].draw(scene, view) if choice else render(scene, width=side, height=side)
                drawn[choice] = Image.fromarray(quantise(np.asarray(levels)))
            data = io.BytesIO()
            if luck.random() < 0.3:
                drawn[choice].save(data, "PNG", compress_level=1)
            else:
                drawn[choice].save(data, "JPEG", quality=luck.choice(QUALITIES))
            target = folder / f"student{number:03}" / f"{path.stem}.jpg"
            target.parent.mkdir(parents=True, exist_ok=True)
            whole = data.getvalue()
            target.write_bytes(whole[: len(whole) // 2] if luck.randrange(BROKEN) == 0 else whole)


def memory(process: int) -> int:
    """Bytes of a process and all below it, what they share counted once."""
    total = 0
    for task in Path(f"/proc/{process}/task").glob("*/children"):
        total += sum(memory(int(child)) for child in task.read_text().split())
    rollup = Path(f"/proc/{process}/smaps_rollup").read_text()
    return total + 1024 * int(next(line for line in rollup.splitlines() if line.startswith("Pss:")).split()[1])


def timed(folder: Path, out: Path) -> tuple[float, float, int, int]:
    """Seconds, CPU seconds, bytes at most, exit code."""
    scenes = [word for path in EXAMPLES for word in ("--scene", str(path))]
    command = [sys.executable, "-m", "crossray", "grade", *scenes, str(folder), "--out", str(out), "--quiet"]
    before, start, most = os.times(), time.perf_counter(), 0
    with subprocess.Popen(command, stdout=subprocess.DEVNULL) as process:
        while process.poll() is None:
            try:
                most = max(most, memory(process.pid))
            except (OSError, StopIteration):
                continue  # something has just ended
            time.sleep(0.2)
    after = os.times()
    cpu = after.children_user + after.children_system - before.children_user - before.children_system
    return time.perf_counter() - start, cpu, most, process.returncode


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--students", type=int, default=20)
    parser.add_argument("--side", type=int, default=1000)
    asked = parser.parse_args()
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:CORES])
    with tempfile.TemporaryDirectory() as name:
        folder, out = Path(name) / "class", Path(name) / "out"
        hand_in(folder, asked.students, asked.side)
        seconds, cpu, most, code = timed(folder, out)
        results = json.loads((out / "grade.json").read_text())
        size = (out / "grade.html").stat().st_size
    pictures = results["pictures"]
    own = sum(picture["seconds"] for picture in pictures)
    whole = seconds + (CLASS * len(EXAMPLES) - len(pictures)) * (own / len(pictures)) / CORES
    verdicts = [picture["verdict"] or "failed" for picture in pictures]
    print(f"{asked.students} students x {len(EXAMPLES)} scenes, {asked.side} x {asked.side}, {CORES} cores")
    print(f"{seconds:.1f} s ({cpu:.1f} s of processor time), exit code {code}")
    print({verdict: verdicts.count(verdict) for verdict in sorted(set(verdicts))})
    print(f"{own / len(pictures):.3f} s for a picture; {CLASS} students would take about {whole:.0f} s")
    print(f"at most {most / 2**20:.0f} MiB in all processes; grade.html {size / 2**20:.1f} MiB")


if __name__ == "__main__":
    main()
