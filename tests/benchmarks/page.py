"""docs/benchmarks.md and its plots, from what was measured and nothing else."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from statistics import median
from typing import Any

from objects import growth
from plots import draw_bars, draw_lines
from roofline import shares
from tables import NONE, factor, known, prepared, spread, table, time, times_faster, tracing
from turns import Entry

Results = Mapping[str, Any]
TARGETS = {"povray": 30.0, "tachyon": 7.0, "mitsuba": 5.0, "c++ double": 3.5}  # times faster on the worst example
GROWTH, GROWTH_FROM, GROWTH_TO = 0.35, 1_000, 1_000_000  # of the exponent, over so many spheres
LARGEST, USUAL, DEARER = "16384", "1000", 1.3  # sides, and how much dearer a pixel of the first may be
TITLES = {
    "povray": "POV-Ray",
    "tachyon": "Tachyon",
    "mitsuba": "Mitsuba 3",
    "radiance": "Radiance",
    "c++ double": "C++ double",
    "c++ float": "C++ float",
    "auto": "crossray auto",
    "double": "crossray double",
    "single": "crossray single",
    "certify": "certify",
}
OURS = ("auto", "double", "single")


def ours(part: Results) -> str:
    """The precision that ratios are to."""
    return str(part["machine"]["ours"])


def contenders(rows: Mapping[str, Mapping[str, Entry]], among: Mapping[str, str] = TITLES) -> list[str]:
    """Who was measured anywhere, in the order of TITLES."""
    return [name for name in among if any(name in row for row in rows.values())]


def others(rows: Mapping[str, Mapping[str, Entry]]) -> list[str]:
    """All but crossray."""
    return [name for name in contenders(rows) if name not in (*OURS, "certify")]


def example_ratios(part: Results) -> dict[str, dict[str, float]]:
    """By example and contender, how many times faster crossray is."""
    found = {
        scene: {name: times_faster(row.get(name), row[ours(part)]) for name in others(part["rows"])}
        for scene, row in part["rows"].items()
    }
    return {scene: {name: value for name, value in row.items() if value} for scene, row in found.items()}


def examples_section(part: Results) -> str:
    """Ratios, times, agreement, proving and the first call."""
    rows, ratios, mine = part["rows"], example_ratios(part), ours(part)
    names = others(rows)
    worst = {name: min((row[name] for row in ratios.values() if name in row), default=None) for name in names}

    def cell(scene: str, name: str) -> str:
        value = ratios[scene].get(name)
        return f"**{factor(value)}**" if value and value == worst[name] else factor(value)

    everyone = contenders(rows)
    proving = [
        [s, factor(times_faster(row["certify"], row["double"])), spread(row["certify"])] for s, row in rows.items()
    ]
    first = [[s, *(time(taken[kind]) for kind in ("cold", "warm", "import"))] for s, taken in part["first"].items()]
    return EXAMPLES.format(
        side=part["side"],
        ours=TITLES[mine],
        ratios=table(
            ["scene", *(f"{TITLES[name]} / ours" for name in names)], ([s, *(cell(s, n) for n in names)] for s in rows)
        ),
        times=table(
            ["", *rows], ([TITLES[name], *(spread(row.get(name)) for row in rows.values())] for name in everyone)
        ),
        off=table(
            ["", *rows],
            (
                [TITLES[name], *(str(row.get(name, {}).get("off", NONE)) for row in rows.values())]
                for name in everyone
                if name != "certify"
            ),
        ),
        proving=table(["scene", "certify / crossray double", "certify"], proving),
        first=table(["scene", "no kernels on disk", "kernels on disk", "import and reading before"], first),
        missing=_missing(part),
    )


def tracing_only(rows: Mapping[str, Any]) -> dict[str, dict[str, Entry]]:
    """The contenders of each number of spheres, crossray's time without what preparing took, as peers report theirs."""
    return {
        number: {n: tracing(e) if n in OURS and known(e) else e for n, e in row["contenders"].items()}
        for number, row in rows.items()
    }


def objects_section(part: Results) -> str:
    """Ratios, times, preparing and growth."""
    rows, mine = tracing_only(part["rows"]), ours(part)
    names = contenders(rows)
    heads = [f"{int(number):,}" for number in rows]
    ready = [
        [
            TITLES[name],
            *(time(value) if (value := prepared(row.get(name))) is not None else NONE for row in rows.values()),
        ]
        for name in names
    ]
    reading = [f"{time(row['reading'])}, {row['bytes'] / 1e6:.3g} MB" for row in part["rows"].values()]
    exponents = [(TITLES[name], growth(part["rows"], name, time_of(name))) for name in names]
    return OBJECTS.format(
        side=part["side"],
        ours=TITLES[mine],
        ratios=table(
            ["", *heads],
            (
                [f"{TITLES[n]} / ours", *(factor(times_faster(row.get(n), row.get(mine))) for row in rows.values())]
                for n in others(rows)
            ),
        ),
        times=table(
            ["", *heads], ([TITLES[name], *(spread(row.get(name)) for row in rows.values())] for name in names)
        ),
        ready=table(["", *heads], [*ready, ["crossray: reading the scene file", *reading]]),
        off=table(
            ["", *heads],
            ([TITLES[name], *(str(row.get(name, {}).get("off", NONE)) for row in rows.values())] for name in names),
        ),
        growth=", ".join(f"{title} {value:.2f}" for title, value in exponents if value is not None) or NONE,
        missing=_missing(part),
    )


def time_of(name: str) -> Callable[[Entry], float]:
    """Median seconds of tracing alone."""
    return lambda entry: median((tracing(entry) if name in OURS else entry)["seconds"])


def sizes_section(part: Results) -> str:
    """Nanoseconds a pixel and memory."""
    rows = {side: row["contenders"] for side, row in part["rows"].items()}
    names = contenders(rows)
    memory = [f"{row['memory'] / 2**20:.0f} MiB" for row in part["rows"].values()]
    each = [[TITLES[n], *(_per_pixel(row.get(n), side) for side, row in rows.items())] for n in names]
    mine = ours(part)
    ratios = (
        [f"{TITLES[n]} / ours", *(factor(times_faster(row.get(n), row[mine])) for row in rows.values())]
        for n in others(rows)
    )
    return SIZES.format(
        scene=part["scene"],
        ours=TITLES[mine],
        ratios=table(["", *rows], ratios),
        each=table(["", *rows], [*each, [f"{TITLES[mine]}: peak memory", *memory]]),
        missing=_missing(part),
    )


def nanoseconds(entry: Entry | None, side: str) -> float | None:
    """Of a pixel."""
    return 1e9 * median(entry["seconds"]) / int(side) ** 2 if entry and known(entry) else None


def _per_pixel(entry: Entry | None, side: str) -> str:
    value = nanoseconds(entry, side)
    if value is None or not entry:
        return spread(entry)
    least, most = (1e9 * end(entry["seconds"]) / int(side) ** 2 for end in (min, max))
    return f"{value:.3g} ns ({least:.3g} to {most:.3g})" if len(entry["seconds"]) > 1 else f"{value:.3g} ns (once)"


def process_section(part: Results) -> str:
    """Whole processes."""
    mine = ours(part)
    rows = [
        [scene, factor(times_faster(row.get("povray"), row[mine])), spread(row[mine]), spread(row.get("povray"))]
        for scene, row in part["rows"].items()
    ]
    return PROCESS.format(
        rows=table(["scene", "POV-Ray / ours", "crossray render", "povray"], rows), missing=_missing(part)
    )


def roofline_section(part: Results) -> str:
    """Operations, speeds, and how near tracing comes to them."""
    if not part["rows"]:
        return "## The arithmetic that must be done\n\nNot counted.\n" + _missing(part)
    kinds = next(iter(part["rows"].values()))["counts"]
    counts = [[scene, *(f"{row['counts'][kind]:.1f}" for kind in kinds)] for scene, row in part["rows"].items()]
    speeds = [
        [kind, *(f"{part['speeds'][precision][kind] / 1e9:.3g}" for precision in ("single", "double"))]
        for kind in part["speeds"]["single"]
    ]
    distance = []
    for scene, row in part["rows"].items():
        for name, entry in row["contenders"].items():
            least = shares(row["counts"], part["speeds"]["double" if name == "double" else "single"])
            taken = 1e9 * median(entry["seconds"]) / part["side"] ** 2
            bound = max(least, key=lambda kind: least[kind])
            floating = row["counts"]["sums"] + row["counts"]["products"]
            reached = [f"{taken:.2f} ns", f"{floating / taken:.3g}", f"{100 * least[bound] / taken:.0f} % ({bound})"]
            distance += [[scene, TITLES[name], *(f"{value:.2f} ns" for value in least.values()), *reached]]
    head = ["scene", "", "arithmetic", "division and roots", "memory", "measured", "Gflop/s", "attained / limit"]
    return ROOFLINE.format(
        counts=table(["scene", *kinds], counts),
        speeds=table(["10^9 a second", "single", "double"], speeds),
        distance=table(head, distance),
        missing=_missing(part),
    )


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


def _missing(part: Results) -> str:
    return "".join(f"\n{TITLES[name]} was not there (`{line}`).\n" for name, line in part.get("missing", {}).items())


SECTIONS: dict[str, Callable[[Results], str]] = {
    "examples": examples_section,
    "objects": objects_section,
    "sizes": sizes_section,
    "process": process_section,
    "roofline": roofline_section,
}


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

- crossray: a call of `render`, from the scene in memory to the picture in memory, float32, with its kernel compiled;
  five calls a round.
- Mitsuba 3: a rendering by our plugin in a process that has rendered before, the median of five, with `dr.freeze` or
  without, whichever is faster. `crossray check` shows the time without.
- POV-Ray and Tachyon: what they report of tracing alone, without parsing, bounding or preprocessing and files. Each
  round is a new process, as they draw once in each.
- Radiance: its `rtrace` processes, from start to end, for both layers of the picture.
- C++: a [plain tracer](../tests/benchmarks/scalar.cpp) of our own, every ray against every surface, warm, five
  renderings a round.

Not timed, unless it says so: start-up, compiling, reading and writing files.

{targets}"""

EXAMPLES = """\
## The document's examples

{side} x {side} pixels; how many times as long as {ours} the others take. **Bold**: the worst scene.

{ratios}
![ratios](benchmarks-examples.svg)

The times:

{times}
Pixels over half a level off crossray's picture in double precision:

{off}
Proving every pixel:

{proving}
The first call of `render` in a new process, of {ours}, once; Dr.Jit keeps compiled kernels in the home folder:

{first}{missing}"""

OBJECTS = """\
## The number of spheres

A hill of spheres at random, with a floor and a wall; {side} x {side} pixels. Times are of tracing alone, crossray's
without preparing the scene, as peers report theirs; preparing stands below.

{ratios}
![time against the number of spheres](benchmarks-objects.svg)

The times:

{times}
Time grows as the number of spheres to the power of (fitted from 1,000 on): {growth}.

Preparing the scene: of crossray, what a picture of a single pixel takes, from the scene in memory, in every call of
`render`; of POV-Ray its bounding, of Tachyon its preprocessing, of Mitsuba loading the scene file, compiling excluded.
Reading is of crossray's own scene file, in Python.

{ready}
Pixels over half a level off crossray's picture in double precision, or in what comes next where that was not tried:

{off}{missing}"""

SIZES = """\
## The size of the picture

{scene} as a square; nanoseconds a pixel. {ours} draws band by band, as for a file, in a new process, whose peak memory
is given too, Python included.

{ratios}
![time per pixel against size](benchmarks-sizes.svg)

{each}{missing}"""

PROCESS = """\
## The whole process

From the command to the picture on disk, `crossray render` with its kernels on disk and `povray` on the exported scene.

{rows}{missing}"""

ROOFLINE = """\
## The arithmetic that must be done

On paper: the floating-point operations per pixel that the plain C++ tracer carries out, counted while it draws, by a
number type that counts. It does nothing twice, leaves a test as soon as it is decided, and follows no ray that ended,
so that this is what the algorithm asks for, every ray against every surface. Other algorithms may ask for less.

{counts}
This machine's speed, all cores: kernels of Dr.Jit that do nothing but independent chains of one operation, and one that
fills memory (bytes).

{speeds}
The least time per pixel follows: sums and products in pairs, comparisons at the same speed; quotients and roots; 12
bytes written. These overlap at best, so that the largest is the limit. `auto` is held against single precision, in
which most of it is done. In the distance from the limit: lanes that wait for others whose rays go on, tests that
compute what a branch would have skipped, fetching surfaces.

{distance}{missing}"""
