"""What was found in a picture, as text for people."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Mapping
from typing import Any

from reports.credit import named

WIDTH = 110
LISTED = 3  # causes and blobs


def picture_lines(picture: Mapping[str, Any]) -> Iterator[str]:
    """The verdict; for a wrong picture what probably went wrong, what to do, where to look, and the worst pixel."""
    yield verdict_line(picture)
    if picture["verdict"] != "wrong":
        return
    if not named(picture):
        yield from _wrapped(f"   None of the known mistakes. {picture['advice']}", "     ")
    for number, cause in enumerate(picture["causes"][:LISTED], 1):
        likely = "most likely" if number == 1 and cause["named"] else "perhaps"
        yield from _wrapped(f"{number}. {likely} {cause['id']}: {cause['title']}", "   ")
        yield from _wrapped(f"   Why: {cause['evidence']}", "        ")
        yield from _wrapped(f"   What to do: {cause['hint']}", "        ")
    for blob in picture["blobs"][:LISTED]:
        yield from _wrapped(f"   {blob_text(blob)}", "     ")
    if (more := picture["blob_count"] - LISTED) > 0:
        yield f"   and {more} more places"
    if worst := picture["worst"]:
        yield from _wrapped(f"   {worst['text']}", "     ")


def verdict_line(picture: Mapping[str, Any]) -> str:
    """One line: whose picture of which scene, the verdict, and the reason."""
    word = picture["verdict"] or "not graded"
    cause = named(picture)
    tail = f" · {cause['id']} {cause['title']}" if cause else ""
    return f"{picture['picture'] or picture['student']}: {picture['scene']}: {word}: {picture['reason']}{tail}"


def blob_text(blob: Mapping[str, Any]) -> str:
    """One place of a difference: its size, where it is and on what."""
    left, top, right, bottom = blob["box"]
    size = "1 pixel" if blob["pixels"] == 1 else f"{blob['pixels']} pixels"
    objects = f", on {', '.join(blob['objects'])}" if blob["objects"] else ""
    return f"{size} within columns {left} to {right}, rows {top} to {bottom}{objects}"


def class_lines(results: Mapping[str, Any]) -> Iterator[str]:
    """Who has which verdict, and which mistakes are common."""
    pictures = {(picture["student"], picture["scene"]): picture for picture in results["pictures"]}
    for student in results["students"]:
        name = student["student"]
        verdicts = [f"{scene['scene']} {_word(pictures[name, scene['scene']])}" for scene in results["scenes"]]
        yield f"{name}: {student['points']:g} of {student['most']:g} points: {', '.join(verdicts)}"
    for mistake in results["mistakes"]:
        count = len(mistake["students"])
        yield f"{count} student{'' if count == 1 else 's'}: {mistake['id']} {mistake['title']}"


def _word(picture: Mapping[str, Any]) -> str:
    cause = named(picture)
    return (picture["verdict"] or "not graded") + (f" ({cause['id']})" if cause else "")


def _wrapped(text: str, indent: str) -> list[str]:
    return textwrap.wrap(text, WIDTH, subsequent_indent=indent)
