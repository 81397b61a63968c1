"""The report as one HTML file that needs no network: a pure function of the results and the pictures of a run."""

from __future__ import annotations

import base64
import hashlib
import json
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from reports.accounting import CLASSES
from reports.embedding import Embedded, embed, thumbnail
from reports.metrics import SETTINGS, THRESHOLDS, TOLERANCE
from reports.results import AMPLIFIED

WORST_FIRST = ("failed", "disagree", "not-compared", "not-installed", "unsupported", "agree")
SIGNS = {"failed": "!", "disagree": "✗", "not-compared": "?", "not-installed": "–", "unsupported": "–", "agree": "✓"}
SCRIPTS = ("pixels.js", "colours.js", "address.js", "overview.js", "stage.js", "viewer.js", "keys.js")
SHOWN_RUNS = 30  # of the history
SPARKLINE = (120, 24)  # pixels
LARGER = 400  # pixels: a term of the reference
LONGEST_TEXT = 100_000  # characters of a scene file
SHOWN = 50  # pixels that differ, in tables and on thumbnails; the viewer marks all that are listed


def page(folder: Path, results: dict[str, Any]) -> str:
    """HTML for the results of the run in `folder`, worst scene and worst comparison first."""
    environment = Environment(
        loader=PackageLoader("reports", "assets"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"number": number, "seconds": seconds, "sparkline": sparkline, "hash": content_hash}
    scenes = [{**scene, "comparisons": sorted(scene["comparisons"], key=_badness)} for scene in results["scenes"]]
    scenes.sort(key=lambda scene: min(map(_badness, _pictures(scene))))
    embedded = embed(folder, scenes)
    return environment.get_template("report.html").render(
        results=results,
        scenes=scenes,
        renderers=_renderers(scenes),
        counts=_counts(results),
        summary=_summary(results),
        history=results.get("history", [])[-SHOWN_RUNS:],
        outcome=outcome,
        signs=SIGNS,
        thumbnail=cache(lambda name: thumbnail(folder, name)),
        larger=lambda name: thumbnail(folder, name, LARGER),
        longest=LONGEST_TEXT,
        shown=SHOWN,
        left_out=sum(_is_left_out(picture, embedded) for scene in scenes for picture in _pictures(scene)),
        settings=SETTINGS,
        thresholds=[f"{level:g}" for level in THRESHOLDS],
        tolerance=TOLERANCE,
        classes=CLASSES,
        quantum=f"{embedded.quantum:g}",
        step=embedded.step,
        blocks=embedded.blocks,
        data=_script_data(_viewer_data(scenes, embedded)),
        style=_asset("report.css"),
        script="\n".join(map(_asset, SCRIPTS)),
    )


def outcome(picture: dict[str, Any]) -> str:
    """One word for one picture: its verdict, or why it has none; `agree` for a reference that was drawn."""
    if picture["status"] != "rendered":
        return str(picture["status"])
    if "verdict" not in picture:
        return "agree"
    return str(picture["verdict"] or "not-compared")


def _renderers(scenes: list[dict[str, Any]]) -> dict[str, str]:
    """The titles of all renderers that are held against a reference, by name, in the order of their names."""
    found = {picture["renderer"]: picture["title"] for scene in scenes for picture in scene["comparisons"]}
    return dict(sorted(found.items()))


def _counts(results: dict[str, Any]) -> dict[str, int]:
    """How many comparisons have each outcome, worst first; a missing reference counts, too."""
    found = [outcome(picture) for scene in results["scenes"] for picture in scene["comparisons"]]
    found += [word for scene in results["scenes"] if (word := outcome(scene["reference"])) != "agree"]
    return {word: found.count(word) for word in WORST_FIRST if word in found}


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


def _pictures(scene: dict[str, Any]) -> list[dict[str, Any]]:
    """All of a scene, the reference first."""
    return [scene["reference"], *scene["comparisons"]]


def _is_left_out(picture: dict[str, Any], embedded: Embedded) -> bool:
    return picture["image"] is not None and picture["image"] not in embedded.names


def _viewer_data(scenes: list[dict[str, Any]], embedded: Embedded) -> dict[str, Any]:
    """What the viewer knows of the pictures; their values are in blocks of their own."""
    return {
        "quantum": embedded.quantum,
        "digits": len(f"{embedded.quantum:g}".partition(".")[2]),
        "step": embedded.step,
        "amplified": AMPLIFIED,
        "tolerance": TOLERANCE,
        "classes": CLASSES,
        "scenes": [
            {
                **{key: scene[key] for key in ("scene", "path", "width", "height", "depth", "convention")},
                "offsets": embedded.offsets.get(scene["scene"]),
                "rays": _rays(scene),
                "pictures": [_viewer_picture(picture, embedded) for picture in _pictures(scene)],
            }
            for scene in scenes
        ],
    }


def _rays(scene: dict[str, Any]) -> dict[str, list[str]]:
    """The ray trees that are stored, by column and row: once, however many renderers differ there."""
    pixels = [pixel for picture in scene["comparisons"] for pixel in picture["worst"] if "raytree" in pixel]
    return {f"{pixel['column']},{pixel['row']}": pixel["raytree"] for pixel in pixels}


def _viewer_picture(picture: dict[str, Any], embedded: Embedded) -> dict[str, Any]:
    compared = picture.get("pixels") is not None
    return {
        **{key: picture[key] for key in ("renderer", "title", "reason")},
        "outcome": outcome(picture),
        "left_out": _is_left_out(picture, embedded),
        "against": picture.get("against"),
        "unexplained": picture["pixels"]["unexplained"] if compared else 0,
        "differing": picture["over"][f"{TOLERANCE:g}"] if compared else 0,
        "worst": [{key: pixel[key] for key in pixel if key != "raytree"} for pixel in picture.get("worst", [])],
        "block": embedded.names.get(picture["image"]),
        "base": embedded.bases.get(picture["image"]),
        "maps": {
            kind: embedded.names[name] for kind, name in picture.get("maps", {}).items() if name in embedded.names
        },
    }


def _script_data(data: dict[str, Any]) -> Markup:
    """JSON that no HTML parser can take for the end of its script."""
    text = json.dumps(data, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    return Markup(text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026"))


def _badness(picture: dict[str, Any]) -> tuple[int, int, float]:
    """Sorts worst first; of equal verdicts the more pixels, then the larger error."""
    unexplained = (picture.get("pixels") or {}).get("unexplained", 0)
    largest = (picture.get("metrics") or {}).get("max_error", 0)
    return WORST_FIRST.index(outcome(picture)), -unexplained, -largest


def _asset(name: str) -> str:
    return resources.files("reports").joinpath("assets", name).read_text(encoding="utf-8")


def content_hash(text: str) -> str:
    """How a content security policy names a script or style, so that a browser runs no other."""
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode("ascii")


def number(value: float | None) -> str:
    """Four significant digits (never rounded up to 1), or a dash for what is not defined."""
    if value is None:
        return "–"
    return "0.9999…" if 0.99995 <= value < 1 else f"{value:.4g}"


def seconds(value: float | None) -> str:
    """Milliseconds below one second, or a dash."""
    if value is None:
        return "–"
    return f"{value * 1000:.1f} ms" if value < 1 else f"{value:.2f} s"


def sparkline(values: list[float | None]) -> str:
    """The points of a line through the values, oldest first, from 0 to the largest, for an SVG of SPARKLINE pixels."""
    width, height = SPARKLINE
    largest = max([value for value in values if value is not None], default=0) or 1
    step = (width - 4) / max(1, len(values) - 1)
    places = [
        (2 + i * step, height - 3 - (height - 6) * value / largest)
        for i, value in enumerate(values)
        if value is not None
    ]
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in places)
