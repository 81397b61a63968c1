"""The native pictures of an earlier run, with which those of a new one are compared."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from reference.errors import InputError
from reference.image import Picture, read_image
from reports.recording import RUN, read_run, unrendered

BASELINE, NATIVE = "baseline", "native"


def read_baseline(
    folder: Path, scenes: Sequence[tuple[str, str]], width: int, height: int, depth: int
) -> list[tuple[dict[str, Any], Picture | None]]:
    """For each scene (path, text) the facts to record and the picture; None, with the reason, where it has none.

    Raises InputError where the folder holds no run, and for pictures of another size or depth.
    """
    run = read_run(folder)
    try:
        found = []
        for path, text in scenes:
            entry, reason = _find(run, path, text)
            levels = None
            if entry:
                shape = f"{entry['width']}x{entry['height']}, depth {entry['depth']}"
                if shape != (asked := f"{width}x{height}, depth {depth}"):
                    raise InputError(f"{folder / RUN}:1:1: expected pictures of {asked}, found {shape}")
                images = {picture["renderer"]: picture["image"] for picture in entry["pictures"]}
                if image := images.get(NATIVE):
                    levels = read_image(folder / f"{image}.exr")
                else:
                    reason = "the baseline has no native picture of this scene"
            facts = unrendered(BASELINE, f"Baseline {run['crossray']}") | {"against": NATIVE}
            facts["version"] = str(run["crossray"])
            found.append((facts if levels is not None else facts | {"status": "unsupported", "reason": reason}, levels))
    except (AttributeError, KeyError, TypeError) as error:
        raise InputError(f"{folder / RUN}:1:1: expected the record of a run, found something else") from error
    return found


def _find(run: dict[str, Any], path: str, text: str) -> tuple[dict[str, Any] | None, str | None]:
    """The entry of the same scene, or why there is none."""
    for entry in run["scenes"]:
        if entry["text"] == text:
            return entry, None
    if any(Path(entry["path"]).name == Path(path).name for entry in run["scenes"]):
        return None, "the scene has changed since the baseline"
    return None, "the baseline has no such scene"
