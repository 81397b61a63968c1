"""A run made of small pictures, its texts full of markup: shared by the tests of the reports."""

from pathlib import Path
from typing import Any

import numpy as np

from reference.image import Picture
from reports.recording import Recording
from reports.writing import write_reports

WIDTH, HEIGHT = 120, 80
NAME = """<img src=x onerror=alert(1)>&"'"""
HOSTILE = (
    "</pre></script><script>alert(2)</script>\0\x1b[31m\x07\x85\ufffe ]]> &amp; {{ 7 * 7 }} "
    "<img src=x onerror=alert(3)>"
)
GREY = np.full((HEIGHT, WIDTH, 3), 100.0)


def altered(*pixels: tuple[int, int, float]) -> Picture:
    picture = GREY.copy()
    for column, row, level in pixels:
        picture[row, column] = level
    return picture


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
    }


def record(folder: Path, scenes: dict[str, list[tuple[dict[str, Any], Picture | None]]]) -> Path:
    run = Recording(folder, "0.1.0")
    for path, pictures in scenes.items():
        entry = run.add_scene(path, WIDTH, HEIGHT, depth=3, convention="exact", text=f"255 255 255\n{HOSTILE}\n")
        for about, levels in pictures:
            run.add_picture(entry, about, levels)
    write_reports(folder)
    return folder


def record_everything(folder: Path) -> Path:
    """One scene of each kind of verdict, and one with all of them."""
    native = (facts("native"), GREY)
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
        },
    )
