"""The sections of docs/benchmarks.md, one a part."""

from __future__ import annotations

from collections.abc import Callable
from statistics import median

from derived import (
    OURS,
    TITLES,
    Results,
    alone,
    contenders,
    example_ratios,
    nanoseconds,
    others,
    ours,
    time_of,
    tracing_only,
)
from objects import growth
from roofline import shares
from tables import NONE, factor, prepared, spread, table, time, times_faster
from turns import Entry


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
            ["", *rows], ([TITLES[n], *(spread(alone(n, row.get(n, {}))) for row in rows.values())] for n in everyone)
        ),
        ready=table(
            ["", *rows],
            ([TITLES[n], *(time(prepared(row.get(n)) or 0) for row in rows.values())] for n in everyone if n in OURS),
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


def _missing(part: Results) -> str:
    return "".join(f"\n{TITLES[name]} was not there (`{line}`).\n" for name, line in part.get("missing", {}).items())


EXAMPLES = """\
## The document's examples

{side} x {side} pixels; how many times as long as {ours} the others take. **Bold**: the worst scene. Times are of
tracing up to the picture in memory, crossray's without preparing the scene, as peers report theirs; preparing stands
below.

{ratios}
![ratios](benchmarks-examples.svg)

The times:

{times}
Preparing the scene in crossray, in every call of `render`:

{ready}
Pixels over half a level off crossray's picture in double precision:

{off}
Proving every pixel:

{proving}
The first call of `render` in a new process, of {ours}, once; Dr.Jit keeps compiled kernels in the home folder:

{first}{missing}"""
OBJECTS = """\
## The number of spheres

A hill of spheres at random, with a floor and a wall; {side} x {side} pixels. Times are of tracing alone, as peers
report theirs; crossray's are without preparing the scene up to 1,000 spheres, and with it beyond.

{ratios}
![time against the number of spheres](benchmarks-objects.svg)

The times:

{times}
Time grows as the number of spheres to the power of (fitted from 1,000 on): {growth}.

Preparing the scene: of crossray, from the scene in memory, in every call of `render`; of POV-Ray its bounding, of
Tachyon its preprocessing, of Mitsuba loading the scene file, compiling excluded.
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
SECTIONS: dict[str, Callable[[Results], str]] = {
    "examples": examples_section,
    "objects": objects_section,
    "sizes": sizes_section,
    "process": process_section,
    "roofline": roofline_section,
}
