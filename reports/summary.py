"""A run in short, as Markdown for a pull request: the verdict, then what is not well, worst first."""

from __future__ import annotations

import re
from typing import Any

from reports.page import WORST_FIRST, outcome

ROWS = 40  # comparisons listed
LONGEST = 160  # letters of a reason


def summary(results: dict[str, Any]) -> str:
    """Markdown text; names and reasons cannot be taken for markup."""
    pictures = [(scene["scene"], picture) for scene in results["scenes"] for picture in _told(scene)]
    pictures.sort(key=lambda pair: (WORST_FIRST.index(outcome(pair[1])), -_unexplained(pair[1])))
    compared = [picture for _, picture in pictures if picture.get("verdict")]
    agreeing = sum(picture["verdict"] == "agree" for picture in compared)
    lines = [f"**crossray {_plain(results['crossray'])}**: {agreeing} of {len(compared)} comparisons agree.", ""]
    rows = [pair for pair in pictures if outcome(pair[1]) != "agree" or pair[1].get("approval")]
    if rows:
        lines += ["| scene | renderer | verdict | unexplained | largest error | |", "|---|---|---|--:|--:|---|"]
        lines += [_row(scene, picture) for scene, picture in rows[:ROWS]]
    if len(rows) > ROWS:
        lines += ["", f"And {len(rows) - ROWS} more."]
    if rows:
        lines.append("")
    lines.append("The whole report is `report.html` in the same folder.")
    return "\n".join(lines) + "\n"


def _told(scene: dict[str, Any]) -> list[dict[str, Any]]:
    """The comparisons, and the reference where it is missing."""
    lost = [scene["reference"]] if scene["reference"]["status"] != "rendered" else []
    return [*lost, *scene["comparisons"]]


def _row(scene: str, picture: dict[str, Any]) -> str:
    known = picture.get("pixels")
    numbers = [str(_unexplained(picture)), f"{picture['metrics']['max_error']:.3g}"] if known else ["", ""]
    why = picture["reason"] or ""
    if approval := picture.get("approval"):
        word = "approval expired" if approval["expired"] else "approved until"
        why = f"{approval['pixels']} pixels {word} {approval['until']}: {approval['because']}"
    elif known and picture["worst"]:
        why = f"worst at column {picture['worst'][0]['column']}, row {picture['worst'][0]['row']}"
    words = [_plain(scene), _plain(picture["title"]), outcome(picture), *numbers, _plain(why)]
    return f"| {' | '.join(words)} |"


def _unexplained(picture: dict[str, Any]) -> int:
    return int((picture.get("pixels") or {}).get("unexplained", 0))


def _plain(text: str) -> str:
    """One short line in which every sign that Markdown or HTML could read stands for itself."""
    line = "".join(letter if letter.isprintable() else " " for letter in text)
    short = line if len(line) <= LONGEST else line[:LONGEST] + "…"
    return re.sub(r"[^\w\s.,;:…/=()%+-]", lambda sign: f"&#{ord(sign[0])};", short).replace("_", "&#95;")
