"""Write docs/renderers.md, what each renderer is, carries and agrees with: `make docs` (takes minutes)."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Sequence
from importlib.metadata import version
from itertools import chain, islice
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from reference import Scene
from reference.text import dump
from reports.recording import Recording
from reports.results import judge
from translator.concurrency import Job, run_jobs
from translator.contract import Export, Limits, Settings, Unsupported
from translator.process import usable_cores
from translator.registry import NATIVE, TRUTH, adapter, own_renderers
from translator.run import NOT_INSTALLED, RENDERED, Outcome, export_scene, installed_version

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "docs"))

from sizes import installed_size  # noqa: E402

PAGE = ROOT / "docs" / "renderers.md"
LARGE, SMALL = 1000, 200  # pixels a side: of the examples, and of the diagnostic scenes
TIMEOUT = 600.0  # seconds
ABSENT = "not installed here"
NEEDED = {"mitsuba": ["karellen-llvm-core"]}  # beyond what packages say: Mitsuba compiles the integrator with LLVM

Comparisons = dict[tuple[str, str], dict[str, Any]]


def names() -> list[str]:
    """The renderers that come with crossray, `native` first."""
    return sorted(own_renderers().keys() - {TRUTH}, key=lambda name: (name != NATIVE, name))


def load(folder: str, pattern: str) -> dict[str, Scene]:
    """Scenes by name."""
    return {path.stem: Scene.load(path) for path in sorted((ROOT / folder).glob(pattern))}


EXAMPLES, DIAGNOSTIC = load("scenes", "example?.txt"), load("scenes/diagnostic", "*.txt")


def exported(name: str, scene: str) -> Export | str:
    """What an adapter makes of a scene, or why it refuses it; no renderer is needed for that."""
    side = LARGE if scene in EXAMPLES else SMALL
    try:
        return export_scene(name, {**EXAMPLES, **DIAGNOSTIC}[scene], Settings(side, side))
    except Unsupported as refusal:
        return str(refusal)


def measure(scenes: dict[str, Scene], side: int, alone: bool) -> Comparisons:
    """The comparisons by scene and renderer, as reports have them; each picture drawn `alone` has all the cores."""
    order = (TRUTH, *names())
    jobs = [Job(name, title, scene, Settings(side, side), TIMEOUT) for title, scene in scenes.items() for name in order]
    outcomes = chain.from_iterable(run_jobs(batch, _tell) for batch in ([[job] for job in jobs] if alone else [jobs]))
    with TemporaryDirectory() as folder:
        run = Recording(Path(folder), version("crossray"))
        for title, scene in scenes.items():
            entry = run.add_scene(title, side, side, depth=3, convention="exact", text=dump(scene))
            for outcome in islice(outcomes, len(order)):
                facts = {key: value for key, value in vars(outcome).items() if key != "picture"}
                run.add_picture(entry, facts, outcome.picture)
        judged = judge(Path(folder), lambda text: print("comparing", text, file=sys.stderr))["scenes"]
    found = {}
    for title, entry in zip(scenes, judged, strict=True):
        if entry["reference"]["status"] != RENDERED:
            raise SystemExit(f"{title} was not certified: {entry['reference']['reason']}")
        found.update({(title, picture["renderer"]): picture for picture in entry["comparisons"]})
    return found


def _tell(job: Job, outcome: Outcome | None) -> None:
    if outcome:
        print(f"{job.renderer}: {job.title}: {outcome.status} {outcome.reason or ''}", file=sys.stderr)


def about(name: str) -> list[str]:
    """The row of a renderer: what its adapter says, then what is installed."""
    renderer = adapter(name)
    said = [f"{renderer.TITLE}", f"`{name}`", f"`{renderer.INSTALL}`", renderer.LICENCE]
    size = installed_size(renderer.INSTALL, NEEDED.get(name, ()))
    sizes = [_bytes(size.alone), _bytes(size.whole)] if size else ["–", "–"]
    return [*said, *([found, *sizes] if (found := installed_version(name)) else [ABSENT, "–", "–"])]


def limits() -> list[list[str]]:
    """The rows of what adapters declare for these scenes."""
    rows = []
    for name in names():
        exports = (exported(name, scene) for scene in (*EXAMPLES, *DIAGNOSTIC))
        declared = [export.limits for export in exports if isinstance(export, Export)] or [Limits()]
        plain = "{:.3g}".format
        written = {"precision": _power, "ahead": plain, "short": plain, "gap": plain, "far": _distance}
        ranges = (_range([getattr(one, field) for one in declared], text) for field, text in written.items())
        rows.append([_title(name), *ranges])
    return rows


def agreement(found: Comparisons) -> list[list[str]]:
    """The rows of the examples: pixels that are off, then times."""
    rows = []
    for name in names():
        pictures = [found[scene, name] for scene in EXAMPLES]
        cells = [cell(name, scene, found) for scene in EXAMPLES]
        times = [[picture[kind] for picture in pictures] for kind in ("seconds", "trace_seconds")]
        shown = (_range([value for value in kind if value is not None], "{:.2g}".format) for kind in times)
        rows.append([_title(name), *cells, *shown])
    return rows


def carried(found: Comparisons) -> list[list[str]]:
    """The rows of the diagnostic scenes."""
    return [
        [f"[{scene}](../scenes/diagnostic/{scene}.txt)", *(cell(name, scene, found) for name in names())]
        for scene in DIAGNOSTIC
    ]


def cell(name: str, scene: str, found: Comparisons) -> str:
    """How many pixels are off, in what classes; or why there is no picture."""
    picture = found[scene, name]
    if isinstance(exported(name, scene), str):
        return "refused"
    if picture["status"] == NOT_INSTALLED:
        return ABSENT
    if not picture["pixels"]:
        return f"**{picture['status']}**"
    classes = [f"{number} {kind}" for kind, number in picture["pixels"]["explained"].items()]
    unexplained = picture["pixels"]["unexplained"]
    return ", ".join([f"**{unexplained} unexplained**"] * bool(unexplained) + classes) or "0"


def refusals() -> str:
    """Every refusal of a scene, with the reason that a user reads."""
    return "".join(
        f"- {_title(name)}, {scene}: {reason}.\n"
        for name in names()
        for scene in (*EXAMPLES, *DIAGNOSTIC)
        if isinstance(reason := exported(name, scene), str)
    )


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table in Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "".join(f"| {' | '.join(row)} |\n" for row in lines)


def _title(name: str) -> str:
    return adapter(name).TITLE


def _range(values: Sequence[float], show: Any) -> str:
    """All the values as one, or from the least to the largest."""
    shown = dict.fromkeys(map(show, sorted(values)))
    return " to ".join([*shown][:: max(1, len(shown) - 1)]) or "–"


def _power(value: float) -> str:
    return f"2^{math.log2(value):.3g}" if value else "0"


def _distance(value: float) -> str:
    return f"{value:g}" if value else "any distance"


def _bytes(number: int) -> str:
    return f"{number / 1e6:.2g} MB" if number < 1e8 else f"{number / 1e6:.0f} MB"


def page() -> str:
    """The text of docs/renderers.md."""
    examples, diagnostic = measure(EXAMPLES, LARGE, alone=True), measure(DIAGNOSTIC, SMALL, alone=False)
    titles = [_title(name) for name in names()]
    return PARTS.format(
        renderers=table(RENDERERS, map(about, names())),
        limits=table(LIMITS, limits()),
        cores=len(usable_cores()),
        agreement=table(["renderer", *EXAMPLES, "whole time, s", "tracing, s"], agreement(examples)),
        carried=table(["scene", *titles], carried(diagnostic)),
        refusals=refusals(),
        large=LARGE,
        small=SMALL,
    )


RENDERERS = ("renderer", "name", "to install it", "licence", "version", "size", "with all that it needs")
LIMITS = ("renderer", "relative precision", "starts ahead by", "ends short by", "sees from", "to")
PARTS = """\
# The renderers

This page is written by `make docs`, from what the adapters in `translator/renderers` say and what was measured.

{renderers}
Sizes are on disk; a Python package needs other packages, among them many that crossray needs anyway, and a Debian
package libraries that not every Debian has.

## What their arithmetic cannot do better

Each adapter declares for each scene the relative error that points and directions may have, how far off a surface rays
start that leave it, as a share of the coordinates, how far before the light shadow rays end, as a share of the way, and
the distances up to which and from which on a ray may miss things, in the assignment's units. Where that explains a
pixel, it is explained; see [docs/truth.md](truth.md).

{limits}
## How they agree on the document's examples

At {large} x {large} pixels, three bounces: the pixels that are off by more than half a level from the certified
picture, by class. Times are from the fastest example to the slowest, with {cores} cores for each picture: the whole run
of the program, and what it says that tracing alone took.

{agreement}
## What each can carry

The [diagnostic scenes](scenes.md) at {small} x {small} pixels, the same way. A *knife edge* is a pixel that no
precision can decide: renderers may differ there and are right.

{carried}
## What is refused, and why

{refusals}"""


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
