"""Whether certified pixels are right: every pixel of the examples and of random scenes, proven a second time by Arb.

    python tests/benchmarks/soundness.py [--examples 1000] [--random 200] [--scenes 30]

The sides are in pixels, 0 for none. Prints a line a scene and ends with 1 if any certified colour is farther from Arb's
ball than its own radius, which is what the proof claims, or than 1e-6 level.
"""

from __future__ import annotations

import argparse
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from itertools import repeat
from multiprocessing import get_context
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "tests"))

import numpy as np  # noqa: E402
from random_scenes import random_scene  # noqa: E402

from reference.proof import PROVEN, Prover  # noqa: E402
from reference.scene import Scene  # noqa: E402

DEPTH = 3


def prove_rows(scene: Scene, side: int, rows: range) -> np.ndarray:
    """Value and radius of each channel of each pixel of some rows, NaN where there is more than one colour."""
    prover = Prover(scene, width=side, height=side, depth=DEPTH)
    balls = np.full((len(rows), side, 2, 3), np.nan)
    for place, row in enumerate(rows):
        for column in range(side):
            found = prover.admissible(column, row)
            if found.proven:
                balls[place, column] = found.colours[0]
    return balls


def check(name: str, scene: Scene, side: int, workers: ProcessPoolExecutor) -> int:
    """Compare one scene's certified colours with Arb's; returns how many are outside."""
    from reference.sweep import sweep

    picture, radius = sweep(scene, width=side, height=side, depth=DEPTH)
    proven = radius <= PROVEN
    start = time.perf_counter()
    bands = [range(top, min(top + 10, side)) for top in range(0, side, 10)]
    balls = np.concatenate(list(workers.map(prove_rows, repeat(scene), repeat(side), bands)))
    error = (np.abs(picture - balls[:, :, 0]) - balls[:, :, 1]).max(axis=-1)
    outside = proven & ~(error <= radius)
    largest = error[proven].max() if proven.any() else 0
    share = (error[proven] / radius[proven]).max() if proven.any() else 0
    seconds = time.perf_counter() - start
    print(f"{name}: {proven.sum()} of {side * side} pixels certified in double precision,", end=" ")
    print(f"{outside.sum()} outside of Arb's ball;", end=" ")
    print(f"largest error {largest:.2g} level, at most {share:.2g} of the radius; Arb {seconds:.0f} s", flush=True)
    return int(outside.sum())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--examples", type=int, default=1000)
    parser.add_argument("--random", type=int, default=200)
    parser.add_argument("--scenes", type=int, default=30)
    options = parser.parse_args()
    outside = 0
    with ProcessPoolExecutor(mp_context=get_context("spawn")) as workers:
        for path in sorted((ROOT / "scenes").glob("example*.txt")) if options.examples else []:
            outside += check(path.stem, Scene.load(path), options.examples, workers)
        for seed in range(options.scenes if options.random else 0):
            outside += check(f"random scene {seed}", random_scene(seed), options.random, workers)
    sys.exit(outside > 0)


if __name__ == "__main__":
    main()
