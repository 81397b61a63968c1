"""The page of a grade: a pure function of the records and pictures in a folder, one file that needs no network."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from reports.credit import MEANING, named
from reports.gradeimages import AMPLIFIED
from reports.gradelines import blob_text

MEDIA = {".png": "image/png", ".jpg": "image/jpeg"}
RANKS = ("failed", "unreadable", "wrong", "right")
SMALLEST_MARK = 1 / 60  # of the picture's larger side


def page(folder: Path, results: Mapping[str, Any], *, student: str | None = None) -> str:
    """HTML for the results of a grade whose pictures are in `folder`: of one student with large pictures, or of all.

    A class's page keeps to small pictures, so that 800 of them make some ten megabytes.
    """
    environment = Environment(
        loader=PackageLoader("reports", "assets"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"level": _level, "byte": _byte, "points": _points}
    students = [_joined(results, entry) for entry in results["students"] if student in (None, entry["student"])]
    full = student is not None or len(students) == 1
    if not full:
        students.sort(key=lambda entry: (entry["points"], entry["student"].lower()))
    numbers = _scene_numbers(results)
    return environment.get_template("grade.html").render(
        results=results,
        students=students,
        title=_title(students),
        summary=summary(students),
        full=full,
        embed=lambda name: _embed(folder, name),
        named=named,
        brief=_brief,
        rank=lambda picture: RANKS.index(picture["verdict"] or "failed"),
        scene_number=lambda picture: numbers.get((picture["scene"], picture["images"].get("right_small"))),
        around=_around,
        blob_text=blob_text,
        meaning=MEANING,
        amplified=AMPLIFIED,
        style=_asset("grade.css") + ("" if full else _scene_styles(folder, numbers)),
        script=_asset("grade.js"),
    )


def _joined(results: Mapping[str, Any], entry: Mapping[str, Any]) -> dict[str, Any]:
    """A student with all pictures, the verdicts and mistakes among them, as the filters want them."""
    pictures = [results["pictures"][place] for place in entry["pictures"]]
    verdicts = {picture["verdict"] or "failed" for picture in pictures}
    if verdicts != {"right"}:
        verdicts.discard("right")  # the filter means: all right
    if entry["review"]:
        verdicts.add("review")
    mistakes = sorted({part for p in pictures if (cause := named(p)) for part in cause["id"].split("+")})
    return {**entry, "pictures": pictures, "verdicts": " ".join(sorted(verdicts)), "mistakes": mistakes}


def _brief(picture: Mapping[str, Any]) -> str:
    """A few words for a picture without a cause."""
    if picture["picture"] is None:
        return "missing"
    return "no known mistake" if picture["verdict"] == "wrong" else str(picture["reason"])[:60]


def _title(students: Sequence[Mapping[str, Any]]) -> str:
    if len(students) != 1:
        return f"{len(students)} students"
    pictures = students[0]["pictures"]
    name = (
        Path(pictures[0]["picture"]).name if len(pictures) == 1 and pictures[0]["picture"] else students[0]["student"]
    )
    bad = sum(picture["verdict"] != "right" for picture in pictures)
    if not bad:
        return f"{name}: all right" if len(pictures) > 1 else f"{name} is right"
    return f"{name}: {bad} of {len(pictures)} not right" if len(pictures) > 1 else f"{name} is not right"


def summary(students: Sequence[Mapping[str, Any]]) -> str:
    """One sentence on all pictures."""
    pictures = [picture for student in students for picture in student["pictures"]]
    counts = {rank: sum((picture["verdict"] or "failed") == rank for picture in pictures) for rank in reversed(RANKS)}
    words = {"failed": "not graded"}
    told = [f"{count} {words.get(rank, rank)}" for rank, count in counts.items() if count]
    return f"{len(pictures)} picture{'' if len(pictures) == 1 else 's'}: {', '.join(told)}."


def _scene_numbers(results: Mapping[str, Any]) -> dict[tuple[str, str], int]:
    """A number for each right picture that is shown beside wrong ones."""
    pairs = {
        (picture["scene"], picture["images"]["right_small"]): None
        for picture in results["pictures"]
        if "right_small" in picture["images"]
    }
    return {pair: number for number, pair in enumerate(pairs, 1)}


def _scene_styles(folder: Path, numbers: Mapping[tuple[str, str], int]) -> str:
    """The right pictures, each once however often it is shown."""
    return "".join(
        f'.copy[data-scene="{number}"] {{ background-image: url({_embed(folder, name)}); }}\n'
        for (_, name), number in numbers.items()
    )


def _around(blob: Mapping[str, Any], picture: Mapping[str, Any]) -> tuple[float, float, float, float]:
    """Left, top, width and height of a mark around a blob, none too small to be seen."""
    left, top, right, bottom = blob["box"]
    if (right - left) * (bottom - top) > picture["width"] * picture["height"] / 2:
        return 0, 0, 0, 0  # a mark would say nothing
    least = max(picture["width"], picture["height"]) * SMALLEST_MARK
    width, height = max(right - left + 1 + least / 2, least), max(bottom - top + 1 + least / 2, least)
    return (left + right + 1 - width) / 2, (top + bottom + 1 - height) / 2, width, height


def _embed(folder: Path, name: str) -> str:
    data = (folder / name).read_bytes()
    return f"data:{MEDIA[Path(name).suffix]};base64," + base64.b64encode(data).decode("ascii")


def _asset(name: str) -> str:
    return resources.files("reports").joinpath("assets", name).read_text(encoding="utf-8")


def _level(value: float) -> str:
    """At most one digit after the point."""
    return f"{value:.1f}".removesuffix(".0")


def _byte(value: float) -> int:
    return int(min(255.0, max(0.0, value)))


def _points(value: float) -> str:
    return f"{value:.1f}".removesuffix(".0")
