"""What a run looks like on a terminal."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from reference.errors import plain
from reports.page import outcome


def summary_lines(results: dict[str, Any]) -> Iterator[str]:
    """One line for each comparison, and for each reference that is missing."""
    for scene in results["scenes"]:
        reference = scene["reference"]
        if reference["status"] != "rendered":
            yield plain(f"{scene['scene']}  {reference['renderer']}  {reference['status']}: {reference['reason']}")
        for picture in scene["comparisons"]:
            yield plain(f"{scene['scene']}  {picture['renderer']}  {outcome(picture)}: {_finding(picture)}")


def _finding(picture: dict[str, Any]) -> str:
    if not picture["pixels"]:
        return str(picture["reason"])
    pixels = picture["pixels"]
    explained = "".join(f", {number} {kind}" for kind, number in pixels["explained"].items())
    largest = f"largest error {picture['metrics']['max_error']:.3g} levels"
    approved = ""
    if approval := picture.get("approval"):
        word = "approval expired" if approval["expired"] else "approved until"
        approved = f", {approval['pixels']} {word} {approval['until']}"
    return f"{pixels['unexplained']} of {pixels['total']} pixels unexplained{approved}{explained}; {largest}"


@contextmanager
def progress_lines(quiet: bool, verbose: bool, totals: Mapping[str, int]) -> Iterator[Callable[[str, str, int], None]]:
    """A line for each name, with a bar of as many steps, on a terminal; elsewhere what is said, if asked for.

    Call it, from any thread, with a name, what it does, and how many steps of it that completes.
    """
    if quiet or not sys.stderr.isatty():
        yield lambda name, text, done: _tell(plain(f"{name}: {text}") + "\n") if verbose and not quiet else None
        return
    from rich.console import Console
    from rich.markup import escape
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
    from rich.table import Column

    columns = (
        TextColumn("{task.fields[name]}"),
        BarColumn(bar_width=20),
        TextColumn("{task.completed}/{task.total}"),
        TimeElapsedColumn(),
        TextColumn("{task.description}", table_column=Column(ratio=1, no_wrap=True)),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True, expand=True) as bars:
        tasks = {name: bars.add_task("", total=total, start=False, name=name) for name, total in totals.items()}

        def show(name: str, text: str, done: int) -> None:
            task = tasks[name]
            bars.start_task(task)
            bars.update(task, description=escape(plain(text)), advance=done)

        yield show


def _tell(line: str) -> None:
    sys.stderr.write(line)  # in one piece, as threads may tell at the same time
    sys.stderr.flush()
