"""Render an export for Mitsuba as quickly as it can: run in its folder, beside its program `whitted.py`.

    python mitsuba_warm.py scene.xml scene.exr --threads 2 --renders 5 --long 1

A call of `mi.render` computes with a kernel that was compiled before, but Dr.Jit goes through all shapes again to find
that it is the same; `dr.freeze` saves that, and costs a little of its own. Both are timed, and the faster one counts.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from statistics import median
from time import perf_counter
from typing import Any


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("scene")
    parser.add_argument("picture")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--renders", type=int, default=5)
    parser.add_argument("--long", type=float, default=1.0, help="seconds from which on one rendering is enough")
    options = parser.parse_args()
    sys.path.insert(0, str(Path.cwd()))
    whitted = import_module("whitted")  # which chooses an LLVM before Mitsuba is loaded
    dr, mi = import_module("drjit"), import_module("mitsuba")
    dr.set_thread_count(max(whitted.FEWEST_THREADS, options.threads))
    mi.register_integrator("whitted", whitted.Whitted)
    start = perf_counter()
    scene = mi.load_file(options.scene)
    dr.sync_thread()
    loaded = perf_counter() - start

    def timed(render: Callable[[Any], Any]) -> float:
        start = perf_counter()
        dr.eval(render(scene))
        dr.sync_thread()
        return perf_counter() - start

    mi.Bitmap(mi.render(scene)).write(options.picture)
    found = []
    for render in (dr.freeze(lambda scene: mi.render(scene)), mi.render):
        timed(render)  # which also freezes
        first = timed(render)
        found.append(median([first, *(timed(render) for _ in range(options.renders if first < options.long else 0))]))
    print(f"loaded in {loaded:.4f} s")
    print(f"traced in {min(found):.4f} s")


if __name__ == "__main__":
    main()
