"""The runs of a folder, one line each in `history.jsonl`, oldest first."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from reference.files import write_text

HISTORY = "history.jsonl"
KEPT = 500  # runs in the file
SHOWN = 30  # runs in a report, this one included


def history(folder: Path, results: dict[str, Any]) -> list[dict[str, Any]]:
    """The last runs up to that of `results`, which comes last, whether it is in the file yet or not."""
    earlier = _read(folder)
    place = next((i for i, run in enumerate(earlier) if run["started"] == results["started"]), len(earlier))
    return [*earlier[:place][-(SHOWN - 1) :], as_line(results)]


def remember(folder: Path, results: dict[str, Any]) -> None:
    """Put the run at the end of the file, once; lines that are damaged go. Raises OutputError."""
    runs = [run for run in _read(folder) if run["started"] != results["started"]]
    lines = [json.dumps(run, allow_nan=False) + "\n" for run in [*runs, as_line(results)][-KEPT:]]
    write_text(folder / HISTORY, "".join(lines))


def as_line(results: dict[str, Any]) -> dict[str, Any]:
    """What is remembered of a run. `seconds` are those of all pictures together."""
    compared = [(scene["scene"], picture) for scene in results["scenes"] for picture in scene["comparisons"]]
    pictures = [scene["reference"] for scene in results["scenes"]] + [picture for _, picture in compared]
    verdicts = {picture["verdict"] for _, picture in compared}
    return {
        "started": results["started"],
        "crossray": results["crossray"],
        "verdict": next((verdict for verdict in ("disagree", "agree") if verdict in verdicts), None),
        "failed": sum(picture["status"] == "failed" for picture in pictures),
        "unexplained": sum(picture["pixels"]["unexplained"] for _, picture in compared if picture["pixels"]),
        "seconds": round(sum(picture["seconds"] or 0 for picture in pictures), 3),
        "comparisons": [
            {
                "scene": scene,
                "renderer": picture["renderer"],
                "status": picture["status"],
                "verdict": picture["verdict"],
                "unexplained": picture["pixels"]["unexplained"] if picture["pixels"] else None,
                "seconds": picture["seconds"],
            }
            for scene, picture in compared
        ],
    }


def _read(folder: Path) -> list[dict[str, Any]]:
    """The lines that are sound."""
    try:
        text = (folder / HISTORY).read_text(encoding="utf-8", errors="replace")
    except OSError:
        return []
    return [run for line in text.splitlines() if (run := _parse(line))]


def _parse(line: str) -> dict[str, Any] | None:
    try:
        run = json.loads(line, parse_constant=_refuse)
    except (ValueError, RecursionError):
        return None
    match run:
        case {
            "started": str(),
            "crossray": str(),
            "verdict": str() | None,
            "failed": int(),
            "unexplained": int(unexplained),
            "seconds": int() | float() as seconds,
            "comparisons": list(),
        } if 0 <= unexplained < 1 << 53 and math.isfinite(seconds):
            return dict(run)
    return None


def _refuse(word: str) -> None:
    raise ValueError(f"{word} is not JSON")
