"""What the arithmetic alone must cost on this machine, and how far tracing is from that.

The operations are those that the plain C++ tracer carries out, counted by a number type that counts: an early exit
saves what it saves there. The machine's speed is that of Dr.Jit kernels which do nothing else.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable
from functools import partial
from typing import Any

from examples import scenes
from peers import DEPTH, PRECISIONS, Task, missing
from turns import Pace, Run, in_turn, seconds

from reference.device import load_drjit

LANES, CHAINS, LENGTH, TURNS = 1 << 15, 12, 16, 64  # values at a time, of which each is the end of so long a chain
BYTES = 1 << 28  # of an array that is filled
OPERATIONS = ("sums", "products", "comparisons", "quotients", "roots")
FLOATS = {"single": "Float32", "double": "Float64"}


def chain(operation: str, precision: str) -> Callable[[], object]:
    """A kernel of independent chains of one operation, CHAINS * LENGTH * TURNS of them for each of LANES."""
    dr, llvm = load_drjit(), importlib.import_module("drjit.llvm")
    real = getattr(llvm, FLOATS[precision])
    factor, offset = dr.opaque(real, 0.999), dr.opaque(real, 0.7)
    steps: dict[str, Callable[[Any], Any]] = {
        "multiply-add": lambda x: dr.fma(x, factor, offset),
        "quotient": lambda x: offset / x,
        "root": lambda x: dr.sqrt(x),
    }
    step = steps[operation]

    def body(turn: Any, *values: Any) -> tuple[Any, ...]:
        for _ in range(LENGTH):
            values = tuple(map(step, values))
        return (turn + 1, *values)

    def run() -> None:
        start = dr.arange(real, LANES) + offset
        values = tuple(start + index for index in range(CHAINS))
        turns = dr.opaque(llvm.UInt32, TURNS)
        _, *ends = dr.while_loop((llvm.UInt32(0), *values), lambda turn, *_: turn < turns, body)
        dr.eval(sum(ends))
        dr.sync_thread()

    return run


def fill() -> None:
    """Write BYTES of new values into memory."""
    dr, llvm = load_drjit(), importlib.import_module("drjit.llvm")
    dr.eval(dr.arange(llvm.Float32, BYTES // 4))
    dr.sync_thread()


def speeds(pace: Pace) -> dict[str, dict[str, float]]:
    """Operations a second of each kind in each precision, on all cores, and bytes written a second."""
    found: dict[str, dict[str, float]] = {}
    for precision in FLOATS:
        found[precision] = {}
        for operation in ("multiply-add", "quotient", "root"):
            run = chain(operation, precision)
            run()
            fastest = min(seconds(run) for _ in range(pace.rounds + 2))
            found[precision][operation] = LANES * CHAINS * LENGTH * TURNS / fastest
    fill()
    bandwidth = BYTES / min(seconds(fill) for _ in range(pace.rounds + 2))
    for precision in FLOATS:
        found[precision]["bytes"] = bandwidth
    return found


def shares(counts: dict[str, float], speed: dict[str, float]) -> dict[str, float]:
    """Nanoseconds a pixel that each resource is busy at least: arithmetic, division and roots, memory.

    A multiply-add does a product and a sum at once; comparisons are done by the same units. Quotients and roots share a
    unit. The picture is written once, 12 bytes a pixel.
    """
    arithmetic = max(counts["sums"], counts["products"]) + counts["comparisons"]
    return {
        "arithmetic": 1e9 * arithmetic / speed["multiply-add"],
        "division and roots": 1e9 * (counts["quotients"] / speed["quotient"] + counts["roots"] / speed["root"]),
        "memory": 1e9 * 12 / speed["bytes"],
    }


def measure_roofline(pace: Pace, side: int = 1000, number: int | None = None) -> dict[str, Any]:
    """Operations a pixel of each example, the machine's speed, and crossray's time."""
    if absent := missing(["c++ double"]):
        return {"missing": absent, "rows": {}}
    rows: dict[str, Any] = {}
    for path, scene in scenes(number):
        print(f"roofline: {path.stem}", file=sys.stderr)
        task = Task(scene, side, pace)
        counts = dict(zip(OPERATIONS, (count / side**2 for count in task.counts()), strict=True))
        times = in_turn({name: partial(_render, task, name) for name in PRECISIONS}, pace)
        rows[path.stem] = {"counts": counts, "contenders": times}
    return {"side": side, "depth": DEPTH, "missing": {}, "rows": rows, "speeds": speeds(pace)}


def _render(task: Task, precision: str) -> Run:
    return Run(task.crossray(precision).seconds)
