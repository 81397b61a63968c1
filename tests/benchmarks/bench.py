"""Time crossray beside its peers and write docs/benchmarks.md with its plots: `make bench`.

    python tests/benchmarks/bench.py [PART ...] [--quick] [--out out/benchmarks] [--docs docs]

Parts: examples, objects, sizes, process, roofline, page. Each but the last measures and keeps its raw numbers as JSON
in the `out` folder; `page` makes the page of what lies there. Without a part, all of them. `--quick` is a trial of a
few seconds, whose numbers mean nothing.
"""

from __future__ import annotations

import argparse
import json
import platform
import sys
from collections.abc import Callable
from datetime import UTC, datetime
from functools import partial
from importlib.metadata import version
from pathlib import Path
from time import perf_counter
from typing import Any

from examples import measure_examples, measure_process
from objects import measure_objects
from page import draw_plots, page
from peers import COMPILE, CORES, DEPTH, OURS
from pixels import measure_sizes
from roofline import measure_roofline
from turns import QUICK, Pace

from reference.errors import RendererError
from reference.files import make_folder, write_text
from translator.process import run_process
from translator.registry import adapter
from translator.run import installed_version

ROOT = Path(__file__).resolve().parent.parent.parent
Part = Callable[[Pace], dict[str, Any]]
PARTS: dict[str, Part] = {
    "examples": measure_examples,
    "objects": measure_objects,
    "sizes": measure_sizes,
    "process": measure_process,
    "roofline": measure_roofline,
}
TRIALS: dict[str, Part] = {
    "examples": partial(measure_examples, side=64, number=1),
    "objects": partial(measure_objects, side=64, numbers=(10, 100)),
    "sizes": partial(measure_sizes, sides=(64,)),
    "process": partial(measure_process, side=64, number=1),
    "roofline": partial(measure_roofline, side=64, number=1),
}


def machine() -> dict[str, Any]:
    """What the numbers were taken on, and with what."""
    renderers = {adapter(name).TITLE: installed_version(name) for name in ("povray", "tachyon", "mitsuba", "radiance")}
    packages = {name: version(name) for name in ("drjit", "numpy", "crossray")}
    return {
        "processor": processor(),
        "cores": CORES,
        "system": platform.platform(),
        "versions": {"Python": platform.python_version(), **packages, **renderers, "g++": compiler()},
        "flags": " ".join(COMPILE[1:]),
        "ours": OURS,
        "depth": DEPTH,
        "date": datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
    }


def processor() -> str:
    """What the system calls its processor."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


def compiler() -> str | None:
    """The version of g++."""
    try:
        return run_process(["g++", "-dumpfullversion"], ROOT, {}, 60).strip()
    except RendererError:
        return None


def read_results(folder: Path) -> dict[str, Any]:
    """What was measured, by part."""
    return {part: json.loads(path.read_text()) for part in PARTS if (path := folder / f"{part}.json").exists()}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", metavar="PART", choices=[*PARTS, "page", []], help="which; all by default")
    parser.add_argument("--quick", action="store_true", help="few, small pictures, once")
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "benchmarks", help="where raw numbers are")
    parser.add_argument("--docs", type=Path, default=ROOT / "docs", help="where the page goes")
    options = parser.parse_args()
    parts = options.parts or [*PARTS, "page"]
    make_folder(options.out)
    make_folder(options.docs)
    for part in [part for part in PARTS if part in parts]:
        start = perf_counter()
        found = (TRIALS if options.quick else PARTS)[part](QUICK if options.quick else Pace())
        found |= {"machine": machine(), "quick": options.quick}
        write_text(options.out / f"{part}.json", json.dumps(found, indent=1) + "\n")
        print(f"{part}: {perf_counter() - start:.0f} s", file=sys.stderr)
    if "page" in parts:
        results = read_results(options.out)
        draw_plots(results, options.docs)
        write_text(options.docs / "benchmarks.md", page(results))
        print(options.docs / "benchmarks.md")


if __name__ == "__main__":
    main()
