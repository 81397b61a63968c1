"""The report as one HTML file that needs no network: a pure function of the results and the pictures of a run."""

from __future__ import annotations

import base64
import json
from importlib import resources
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from reports.accounting import CLASSES
from reports.metrics import SETTINGS, THRESHOLDS, TOLERANCE
from reports.results import AMPLIFIED

WORST_FIRST = ("failed", "disagree", "not-compared", "not-installed", "unsupported", "agree")


def page(folder: Path, results: dict[str, Any]) -> str:
    """HTML for the results of the run in `folder`, worst scene and worst comparison first."""
    environment = Environment(
        loader=PackageLoader("reports", "assets"), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    environment.filters |= {"number": _number, "seconds": _seconds}
    scenes = [{**scene, "comparisons": sorted(scene["comparisons"], key=_badness)} for scene in results["scenes"]]
    scenes.sort(key=lambda scene: min(map(_badness, [scene["reference"], *scene["comparisons"]])))
    return environment.get_template("report.html").render(
        results=results,
        scenes=scenes,
        summary=_summary(results),
        outcome=outcome,
        marks=_marks,
        embed=lambda name: _embed(folder, name),
        settings=SETTINGS,
        thresholds=[f"{level:g}" for level in THRESHOLDS],
        tolerance=TOLERANCE,
        classes=CLASSES,
        amplified=AMPLIFIED,
        style=_asset("report.css"),
        script=_asset("report.js"),
    )


def outcome(picture: dict[str, Any]) -> str:
    """One word for one picture: its verdict, or why it has none; `agree` for a reference that was drawn."""
    if picture["status"] != "rendered":
        return str(picture["status"])
    if "verdict" not in picture:
        return "agree"
    return str(picture["verdict"] or "not-compared")


def _summary(results: dict[str, Any]) -> str:
    """One sentence on the whole run."""
    compared = [picture for scene in results["scenes"] for picture in scene["comparisons"] if picture["pixels"]]
    agreeing = sum(picture["verdict"] == "agree" for picture in compared)
    open_, total = (sum(picture["pixels"][key] for picture in compared) for key in ("unexplained", "total"))
    explained = sum(sum(picture["pixels"]["explained"].values()) for picture in compared)
    return (
        f"{agreeing} of {len(compared)} comparisons agree; of {total:,} pixels "
        f"{explained:,} differ for a reason that is proven, {open_:,} for none."
    )


def _marks(scene: dict[str, Any]) -> str:
    """The differing pixels of all comparisons of a scene, as JSON."""
    places = {(pixel["column"], pixel["row"]) for picture in scene["comparisons"] for pixel in picture["worst"]}
    return json.dumps([{"column": column, "row": row} for column, row in sorted(places, key=lambda place: place[::-1])])


def _badness(picture: dict[str, Any]) -> tuple[int, int, float]:
    """Sorts worst first; of equal verdicts the more pixels, then the larger error."""
    unexplained = (picture.get("pixels") or {}).get("unexplained", 0)
    largest = (picture.get("metrics") or {}).get("max_error", 0)
    return WORST_FIRST.index(outcome(picture)), -unexplained, -largest


def _embed(folder: Path, name: str) -> str:
    return "data:image/png;base64," + base64.b64encode((folder / f"{name}.png").read_bytes()).decode("ascii")


def _asset(name: str) -> str:
    return resources.files("reports").joinpath("assets", name).read_text(encoding="utf-8")


def _number(value: float | None) -> str:
    """Four significant digits (never rounded up to 1), or a dash for what is not defined."""
    if value is None:
        return "–"
    return "0.9999…" if 0.99995 <= value < 1 else f"{value:.4g}"


def _seconds(value: float | None) -> str:
    if value is None:
        return "–"
    return f"{value * 1000:.1f} ms" if value < 1 else f"{value:.2f} s"
