"""docs/benchmarks.md and its plots, from what was measured and nothing else."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from statistics import median

from derived import TITLES, Results, contenders, example_ratios, nanoseconds, ours, time_of, tracing_only
from objects import growth
from plots import draw_bars, draw_lines
from sections import SECTIONS
from tables import factor, known, table

TARGETS = {"povray": 30.0, "tachyon": 7.0, "mitsuba": 5.0, "c++ double": 3.5}  # times faster on the worst example
GROWTH, GROWTH_FROM, GROWTH_TO = 0.35, 1_000, 1_000_000  # of the exponent, over so many spheres
LARGEST, USUAL, DEARER = "16384", "1000", 1.3  # sides, and how much dearer a pixel of the first may be


def targets(results: Results) -> Iterator[list[str]]:
    """What was aimed at, what was measured, and whether that is enough."""
    if part := results.get("examples"):
        ratios = example_ratios(part)
        for name, least in TARGETS.items():
            found = {scene: row[name] for scene, row in ratios.items() if name in row}
            if found:
                scene = min(found, key=lambda scene: found[scene])
                yield _verdict(
                    f"{TITLES[name]} / ours, at least {least:g}x",
                    f"{factor(found[scene])} ({scene})",
                    found[scene] >= least,
                )
            else:
                yield _verdict(f"{TITLES[name]} / ours, at least {least:g}x", "not measured", False)
    if part := results.get("objects"):
        mine = ours(part)
        ends = [
            known(part["rows"].get(str(n), {"contenders": {}})["contenders"].get(mine))
            for n in (GROWTH_FROM, GROWTH_TO)
        ]
        value = growth(part["rows"], mine, time_of(mine)) if all(ends) else None
        shown = "not measured up to there" if value is None else f"{value:.2f}"
        yield _verdict(
            f"growth with the number of spheres, {GROWTH_FROM:,} to {GROWTH_TO:,}: exponent at most {GROWTH:g}",
            shown,
            value is not None and value <= GROWTH,
        )
    if part := results.get("sizes"):
        mine, rows = ours(part), part["rows"]
        large, usual = (
            nanoseconds(rows[s]["contenders"].get(mine), s) if s in rows else None for s in (LARGEST, USUAL)
        )
        dearer = large / usual if large and usual else None
        shown = "not measured" if dearer is None else f"{dearer:.2f}x"
        yield _verdict(
            f"a pixel at {LARGEST} x {LARGEST}, at most {DEARER:g}x the time of one at {USUAL} x {USUAL}",
            shown,
            dearer is not None and dearer <= DEARER,
        )


def _verdict(target: str, measured: str, met: bool) -> list[str]:
    return [target, measured, "met" if met else "**missed**"]


def page(results: Results) -> str:
    """The text of docs/benchmarks.md."""
    parts = [results[name] for name in SECTIONS if name in results]
    if not parts:
        return "# Benchmarks\n\nNothing was measured.\n"
    machine = parts[0]["machine"]
    versions = ", ".join(f"{name} {found or 'missing'}" for name, found in machine["versions"].items())
    sections = [section(results[name]) for name, section in SECTIONS.items() if name in results]
    dates = sorted(part["machine"]["date"] for part in parts)
    head = HEAD.format(
        **{**machine, "versions": versions, "ours": TITLES[machine["ours"]]},
        dates=" to ".join(dict.fromkeys([dates[0], dates[-1]])),
        quick="\n**A quick trial: these numbers mean nothing.**\n" if any(part["quick"] for part in parts) else "",
        targets=table(["target", "measured", ""], targets(results)),
    )
    return "\n".join([head, *sections])


def draw_plots(results: Results, folder: Path) -> None:
    """The plots that the page shows, beside it."""
    if part := results.get("examples"):
        label = f"time / time of {TITLES[ours(part)]}"
        title = f"The examples, {part['side']} x {part['side']} pixels, three bounces (black lines: targets)"
        draw_bars(folder / "benchmarks-examples.svg", example_ratios(part), TITLES, TARGETS, title, "", label)
    if part := results.get("objects"):
        rows = tracing_only(part["rows"])
        series = {
            name: [(int(n), median(row[name]["seconds"])) for n, row in rows.items() if known(row.get(name))]
            for name in contenders(rows)
        }
        title = f"Tracing against the number of spheres, {part['side']} x {part['side']} pixels, three bounces"
        draw_lines(folder / "benchmarks-objects.svg", series, TITLES, title, "spheres", "tracing, s")
    if part := results.get("sizes"):
        by_side = {side: row["contenders"] for side, row in part["rows"].items()}
        series = {
            name: [(int(side), value) for side, row in by_side.items() if (value := nanoseconds(row.get(name), side))]
            for name in contenders(by_side)
        }
        title = f"Time per pixel against the size of the picture, {part['scene']}, three bounces"
        draw_lines(folder / "benchmarks-sizes.svg", series, TITLES, title, "pixels a side", "ns per pixel")


HEAD = """\
# Benchmarks

This page is written by `make bench`, which takes about a quarter of an hour on two cores. A part alone is repeated by
`.venv/bin/python tests/benchmarks/bench.py objects page`, for example; raw numbers are left in `out/benchmarks`.
{quick}
- Machine: {processor}, {cores} cores, {system}
- When: {dates}
- Versions: {versions}
- C++: `g++ {flags}`

Everyone draws the same scenes with {depth} bounces and all cores, in the same run, in turn: one round that does not
count, then five. A ratio is the median of the ratios round by round, above 1 where crossray is faster; a time is the
median with the least and the largest. Where one run takes long, there are fewer rounds, down to one. Ours is
{ours} on the processor.

What is timed:

- crossray: drawing a prepared scene up to the picture in memory, float32, with its kernel compiled, and preparing it:
  both the median of five a round.
- Mitsuba 3: a rendering by our plugin in a process that has rendered before, the median of five, with `dr.freeze` or
  without, whichever is faster. `crossray check` shows the time without.
- POV-Ray and Tachyon: what they report of tracing alone, without parsing, bounding or preprocessing and files. Each
  round is a new process, as they draw once in each.
- Radiance: its `rtrace` processes, from start to end, for both layers of the picture.
- C++: a [plain tracer](../tests/benchmarks/scalar.cpp) of our own, every ray against every surface, warm, five
  renderings a round.

Not timed, unless it says so: start-up, compiling, reading and writing files.

{targets}"""
