"""A run made of small pictures, its texts full of markup: shared by the tests of the reports."""

from pathlib import Path
from typing import Any

import numpy as np

from reference import DOCUMENT, EXACT, render
from reference.image import Picture
from reference.proof import Prover
from reference.text import parse
from reports.recording import Recording
from reports.writing import write_reports

WIDTH, HEIGHT = 120, 80
NAME = """<img src=x onerror=alert(1)>&"'"""
HOSTILE = (
    "</pre></script><script>alert(2)</script>\0\x1b[31m\x07\x85\ufffe ]]> &amp; {{ 7 * 7 }} "
    "<img src=x onerror=alert(3)>"
)
GREY = np.full((HEIGHT, WIDTH, 3), 100.0)

# Floor and back wall meet in the centres of the pixels of row EDGE. The light is behind the side wall; what pixel NEAR
# shows of the floor is 0.02 before that wall, 4e-5 of the way to the light, and lit by the document's text.
EDGES = """\
255 255 255
0.3
0
3
180 120 100
0 -325 0
0 1 0
0.6
0
90 90 220
0 0 800
0 0 -1
0.8
0
100 220 100
74.22 0 0
-1 0 0
0.6
0
"""
EDGES_PATH = "scenes/edges.txt"
EDGE, NEAR = 72, (72, 76)


def altered(*pixels: tuple[int, int, float]) -> Picture:
    picture = GREY.copy()
    for column, row, level in pixels:
        picture[row, column] = level
    return picture


def edges() -> tuple[Picture, Picture]:
    """EDGES as it is drawn, and the same where 3 pixels have the other colour that they may have, 1 the document's."""
    scene = parse(EDGES)
    truth = np.asarray(render(scene, EXACT, width=WIDTH, height=HEIGHT, dtype=np.float64))
    prover = Prover(scene, width=WIDTH, height=HEIGHT)
    truth[EDGE] = [prover.admissible(column, EDGE).colours[0].value for column in range(WIDTH)]
    other = truth.copy()
    for column in (3, 20, 50):
        other[EDGE, column] = prover.admissible(column, EDGE).colours[1].value
    other[NEAR[::-1]] = render(scene, DOCUMENT, width=WIDTH, height=HEIGHT, dtype=np.float64)[NEAR[::-1]]
    return truth, other


def facts(renderer: str, status: str = "rendered", reason: str | None = None, log: str = "") -> dict[str, Any]:
    ran = status in ("rendered", "failed")
    return {
        "renderer": renderer,
        "title": renderer.title(),
        "status": status,
        "version": None if status == "not-installed" else "1.2 <b>",
        "reason": reason,
        "seconds": 1.25 if ran else None,
        "trace_seconds": 0.01 if status == "rendered" else None,
        "command": f"{renderer} '<b>' && true" if ran else "",
        "log": log,
        "notes": ["a <b>note</b>"] if ran else [],
        "limits": {"precision": 2.0**-20, "gap": 0.01} if status == "rendered" else {},
        "summary": f"{renderer} <b>in short</b>" if status == "rendered" else None,
        "threads": 2,
    }


def record(folder: Path, scenes: dict[str, list[tuple[dict[str, Any], Picture | None]]]) -> Path:
    run = Recording(folder, "0.1.0")
    for path, pictures in scenes.items():
        text = EDGES if path == EDGES_PATH else f"255 255 255\n{HOSTILE}\n"
        entry = run.add_scene(path, WIDTH, HEIGHT, depth=3, convention="exact", text=text)
        for about, levels in pictures:
            run.add_picture(entry, about, levels)
    write_reports(folder)
    return folder


def record_everything(folder: Path) -> Path:
    """One scene of each kind of verdict, one with all of them, and one with differences that are explained."""
    native = (facts("native"), GREY)
    truth, explained = edges()
    wrong = explained.copy()
    wrong[30, 90] += 20
    return record(
        folder,
        {
            "scenes/fine.txt": [native, (facts("povray", log="all well"), altered((1, 1, 100.5)))],
            "scenes/slight.txt": [native, (facts("povray"), altered((5, 5, 101)))],
            "scenes/off.txt": [native, (facts("povray"), altered((5, 5, 101), (6, 5, 101)))],
            f"scenes/{NAME}.txt": [
                native,
                (facts("cycles"), GREY),
                (facts("radiance", "unsupported", HOSTILE), None),
                (facts("tachyon", "not-installed", "not installed; to have it: <b>"), None),
                (facts("povray"), altered((110, 60, 200), (3, 2, 150))),
                (facts("mitsuba-stock"), altered((7, 70, 255))),
                (facts("mitsuba", "failed", f"it failed {HOSTILE}", HOSTILE), None),
            ],
            "scenes/lost.txt": [
                (facts("native", "failed", "it was stopped by SIGSEGV"), None),
                (facts("povray"), GREY),
            ],
            EDGES_PATH: [(facts("native"), truth), (facts("mitsuba"), wrong), (facts("povray"), explained)],
        },
    )
