"""Differences that somebody accepts, with a reason and until a day, in a file beside the scene.

`homework.txt` has them in `homework.approved.json`. An approval is of one renderer on one scene at one size: it names
every pixel that was unexplained and the colour that it had. Another pixel, or another colour, is not approved by it.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterable
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference.errors import InputError
from reference.files import write_text
from reports.metrics import TOLERANCE

MOST = 10_000  # pixels in an approval: more than that is no exception
SHAPE = ("width", "height", "depth")


def approvals_path(scene: str) -> Path:
    """The file with the approvals of a scene. Raises InputError for standard input, which has no place."""
    if scene == "-":
        raise InputError("-:1:1: expected a scene file, beside which approvals are kept, found standard input")
    return Path(scene).with_suffix(".approved.json")


def read_approvals(path: Path) -> list[dict[str, Any]]:
    """The approvals in a file, none where it is missing. Raises InputError for what is no such file."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return []
    except json.JSONDecodeError as error:
        raise InputError(f"{path}:{error.lineno}:{error.colno}: expected JSON, found {error.msg.lower()}") from error
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(f"{path}:1:1: expected a file of approvals, found {error}") from error
    match content:
        case {"version": 1, "approvals": list(found)}:
            pass
        case _:
            raise InputError(f'{path}:1:1: expected {{"version": 1, "approvals": [...]}}, found something else')
    for number, approval in enumerate(found, 1):
        if not _is_sound(approval):
            raise InputError(f"{path}:1:1: expected approvals as crossray approve writes them, found another, {number}")
    return found


def _is_sound(approval: object) -> bool:
    match approval:
        case {
            "renderer": str(),
            "because": str(),
            "until": str(until),
            "text": str(),
            "width": int(),
            "height": int(),
            "depth": int(),
            "pixels": list(pixels),
        }:
            return _is_day(until) and all(_is_pixel(pixel) for pixel in pixels)
    return False


def _is_pixel(pixel: object) -> bool:
    match pixel:
        case [int(), int(), int() | float() as red, int() | float() as green, int() | float() as blue]:
            return all(map(math.isfinite, (red, green, blue)))
    return False


def _is_day(text: str) -> bool:
    try:
        return date.fromisoformat(text).isoformat() == text
    except ValueError:
        return False


def approve(
    path: Path,
    entry: dict[str, Any],
    renderer: str,
    levels: NDArray[Any],
    places: Iterable[tuple[int, int]],
    *,
    because: str,
    until: date,
) -> int:
    """Accept these pixels (row, column) of a renderer's picture of a recorded scene; returns how many.

    What was approved of that renderer on that scene before, at that size, is replaced. Raises InputError where there is
    nothing to approve, or more than an exception, or what is no number.
    """
    found = list(places)
    if not found:
        raise InputError(f"{path}: expected unexplained pixels of {renderer} to approve, found none")
    if len(found) > MOST:
        raise InputError(f"{path}: expected at most {MOST} unexplained pixels to approve, found {len(found)}")
    if not because.strip():
        raise InputError(f"{path}: expected a reason for the approval, found none")
    colours = [_clamped(levels, row, column) for row, column in found]
    if not np.isfinite(colours).all():
        raise InputError(f"{path}: expected colours to approve, found pixels that are not numbers")
    approval = {
        "renderer": renderer,
        "because": because,
        "until": until.isoformat(),
        "text": fingerprint(entry["text"]),
        **{key: entry[key] for key in SHAPE},
        "pixels": [
            [int(column), int(row), *(round(value, 3) for value in colour)]
            for (row, column), colour in zip(found, colours, strict=True)
        ],
    }
    kept = [other for other in read_approvals(path) if not _is_about(other, entry, renderer)]
    lines = ",\n".join(json.dumps(other, ensure_ascii=False) for other in [*kept, approval])
    write_text(path, f'{{"version": 1, "approvals": [\n{lines}\n]}}\n')
    return len(found)


def find_approval(entry: dict[str, Any], renderer: str) -> dict[str, Any] | None:
    """What is approved of a renderer on a recorded scene: the last one said of the same text, size and depth."""
    found = [other for other in entry.get("approvals") or () if _is_about(other, entry, renderer)]
    return found[-1] if found else None


def is_expired(approval: dict[str, Any], started: str) -> bool:
    """Whether a run that started then comes after the last day of the approval."""
    return bool(started[:10] > approval["until"])


def covered(approval: dict[str, Any], levels: NDArray[Any], places: Iterable[tuple[int, int]]) -> set[tuple[int, int]]:
    """Those of the places (row, column) that have the colour that was approved there."""
    colours = {(row, column): colour for column, row, *colour in approval["pixels"]}
    return {
        place
        for place in places
        if place in colours
        and all(abs(a - b) <= TOLERANCE for a, b in zip(_clamped(levels, *place), colours[place], strict=True))
    }


def fingerprint(text: str | None) -> str:
    """What tells a scene from another, its text as crossray writes it."""
    return hashlib.sha256((text or "").encode()).hexdigest()


def _is_about(approval: dict[str, Any], entry: dict[str, Any], renderer: str) -> bool:
    same = all(approval[key] == entry[key] for key in SHAPE)
    return same and approval["renderer"] == renderer and approval["text"] == fingerprint(entry["text"])


def _clamped(levels: NDArray[Any], row: int, column: int) -> list[float]:
    return [float(value) for value in np.clip(levels[row, column], 0, 255)]
