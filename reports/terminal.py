"""What a run looks like on a terminal."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from reports.page import outcome


def summary_lines(results: dict[str, Any]) -> Iterator[str]:
    """One line for each comparison, and for each reference that is missing."""
    for scene in results["scenes"]:
        reference = scene["reference"]
        if reference["status"] != "rendered":
            yield f"{scene['scene']}  {reference['renderer']}  {reference['status']}: {reference['reason']}"
        for picture in scene["comparisons"]:
            yield f"{scene['scene']}  {picture['renderer']}  {outcome(picture)}: {_finding(picture)}"


def _finding(picture: dict[str, Any]) -> str:
    if not picture["pixels"]:
        return str(picture["reason"])
    pixels = picture["pixels"]
    explained = "".join(f", {number} {kind}" for kind, number in pixels["explained"].items())
    largest = f"largest error {picture['metrics']['max_error']:.3g} levels"
    return f"{pixels['unexplained']} of {pixels['total']} pixels unexplained{explained}; {largest}"


@contextmanager
def progress_bar(quiet: bool, verbose: bool, total: int) -> Iterator[Callable[[str], None]]:
    """A bar of `total` steps on a terminal; elsewhere a line for each step, if asked for. Call it as a step begins."""
    if quiet or not sys.stderr.isatty():
        yield lambda text: print(text, file=sys.stderr) if verbose and not quiet else None
        return
    from rich.console import Console
    from rich.markup import escape
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (
        BarColumn(),
        TextColumn("{task.completed}/{task.total}"),
        TimeElapsedColumn(),
        TextColumn("{task.description}"),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task, begun = bar.add_task("", total=total), 0

        def advance(text: str) -> None:
            nonlocal begun
            bar.update(task, description=escape(text), completed=begun)
            begun += 1

        yield advance
