"""A recorded run becomes numbers and verdicts: the content of report.json."""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference.errors import SceneError, SceneWarning
from reference.explanation import explain
from reference.image import read_image, write_image
from reference.model import CONVENTIONS
from reference.proof import Prover
from reference.scene import Scene
from reference.text import parse
from reports.accounting import CLASSES, Reason, account
from reports.approvals import covered, find_approval, is_expired
from reports.history import history
from reports.metrics import SETTINGS, TOLERANCE, Measurement, error_map, measure
from reports.raytree import ray_tree
from reports.recording import read_run

AMPLIFIED = 32  # the difference picture: 8 levels of error are white
WORST = 500  # pixels listed for each comparison
TREES = 12  # of them have their rays told
MANY = 200  # surfaces, from which on no rays are told: each tree would name them all


def judge(folder: Path, progress: Callable[[str], None] = lambda text: None) -> dict[str, Any]:
    """Compare every picture of the run in `folder` with its scene's reference; writes the difference pictures there.

    Returns the content of report.json. Raises InputError where the folder holds no run.
    """
    run = read_run(folder)
    scenes = [_judge_scene(folder, run["started"], entry, progress) for entry in run["scenes"] if entry["pictures"]]
    results = {**run, "settings": SETTINGS, "scenes": scenes}
    return {**results, "history": history(folder, results)}


def unexplained(folder: Path, entry: dict[str, Any], picture: dict[str, Any]) -> list[tuple[int, int]]:
    """Row and column of every pixel of a recorded picture that nothing explains, largest error first."""
    truth, scene = _truth(folder, entry, picture), _scene(entry)
    if truth is None or picture["image"] is None:
        return []
    shape = {key: entry[key] for key in ("width", "height", "depth")}
    levels = read_levels(folder, picture)
    places = _differing(error_map(truth, levels))
    reasons: list[Reason | None] = [None] * len(places)
    if scene:
        reasons = account(Prover(scene, **shape), picture.get("limits") or {}, levels, places)
    return [(row, column) for (row, column), reason in zip(places.tolist(), reasons, strict=True) if reason is None]


def read_levels(folder: Path, picture: dict[str, Any]) -> NDArray[Any]:
    """A recorded picture, in levels. Raises InputError where it is missing."""
    return read_image(folder / f"{picture['image']}.exr")


def _truth(folder: Path, entry: dict[str, Any], picture: dict[str, Any]) -> NDArray[Any] | None:
    """What a picture is compared with: the first of its scene, or, where it says `against`, that one."""
    name = picture.get("against") or entry["pictures"][0]["renderer"]
    found = next((other["image"] for other in entry["pictures"] if other["renderer"] == name), None)
    return read_image(folder / f"{found}.exr") if found else None


def _judge_scene(folder: Path, started: str, entry: dict[str, Any], progress: Callable[[str], None]) -> dict[str, Any]:
    reference, *others = entry["pictures"]
    truth = _truth(folder, entry, reference)
    scene = _scene(entry)
    shape = {"width": entry["width"], "height": entry["height"], "depth": entry["depth"]}
    prover = Prover(scene, **shape) if scene else None
    trees: dict[tuple[int, int], list[str]] = {}
    comparisons = []
    for picture in others:
        progress(f"{entry['scene']}: {picture['renderer']}")
        right = _truth(folder, entry, picture) if picture.get("against") else truth
        comparison = _compare(folder, right, picture, prover, find_approval(entry, picture["renderer"]), started)
        if scene and prover and prover.surfaces <= MANY:
            _tell_rays(scene, entry, comparison["worst"][:TREES], trees)
        comparisons.append(comparison)
    facts = {key: value for key, value in entry.items() if key not in ("pictures", "approvals")}
    seconds = reference["seconds"] if reference["trace_seconds"] is None else reference["trace_seconds"]
    return {**facts, "seconds": seconds, "reference": reference, "comparisons": comparisons}


def _scene(entry: dict[str, Any]) -> Scene | None:
    """The scene of the pictures, where it is known, so that differences can be explained."""
    if entry["text"] is None:
        return None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SceneWarning)
            return parse(entry["text"])
    except SceneError:
        return None


def _tell_rays(
    scene: Scene, entry: dict[str, Any], worst: list[dict[str, Any]], trees: dict[tuple[int, int], list[str]]
) -> None:
    """Put the reference's ray tree beside each of these pixels; `trees` keeps those of the whole scene."""
    shape = {key: entry[key] for key in ("width", "height", "depth")}
    for pixel in worst:
        place = pixel["column"], pixel["row"]
        if place not in trees:
            told = explain(scene, CONVENTIONS[entry["convention"]], column=place[0], row=place[1], **shape)
            trees[place] = list(ray_tree(told))
        pixel["raytree"] = trees[place]


def _compare(
    folder: Path,
    truth: NDArray[Any] | None,
    picture: dict[str, Any],
    prover: Prover | None,
    approval: dict[str, Any] | None,
    started: str,
) -> dict[str, Any]:
    result: dict[str, Any] = {
        **picture,
        "verdict": None,
        "metrics": None,
        "pixels": None,
        "over": None,
        "worst": [],
        "difference": None,
        "maps": {},
    }
    if truth is None and picture["image"]:
        return {**result, "reason": "not compared: the reference is missing"}
    if truth is None or picture["image"] is None:
        return result
    levels = read_levels(folder, picture)
    measured = measure(truth, levels)
    error = error_map(truth, levels)
    difference = f"{picture['image']}-difference"
    shown = np.nan_to_num(np.abs(np.clip(truth, 0, 255) - np.clip(levels, 0, 255)), nan=255)
    write_image(folder / f"{difference}.png", shown * AMPLIFIED)
    maps = {name: _write_map(folder, f"{picture['image']}-{name}", values) for name, values in measured.maps.items()}
    places = _differing(error)
    limits = picture.get("limits") or {}
    reasons: list[Reason | None] = [None] * len(places)
    if prover:
        reasons = account(prover, limits, levels, places)
    pixels = _count(measured, reasons)
    approved: set[tuple[int, int]] = set()
    if approval:
        left = [(row, column) for (row, column), why in zip(places.tolist(), reasons, strict=True) if why is None]
        approved, expired = covered(approval, levels, left), is_expired(approval, started)
        facts = {"because": approval["because"], "until": approval["until"]}
        result["approval"] = {**facts, "expired": expired, "pixels": len(approved)}
        approved = set() if expired else approved
    return {
        **result,
        "verdict": "disagree" if pixels["unexplained"] > len(approved) else "agree",
        "metrics": measured.metrics(),
        "places": {"ssim_min": measured.ssim_min_at, "max_error": measured.max_error_at},
        "pixels": pixels,
        "over": measured.over,
        "worst": _worst(error, places, reasons, approved),
        "difference": difference,
        "maps": maps,
    }


def _write_map(folder: Path, name: str, values: NDArray[np.float64]) -> str:
    """A grey 8 bit picture of values 0..1 (larger ones are white), rounded; returns its name."""
    write_image(folder / f"{name}.png", np.rint(np.clip(values, 0, 1) * 255)[..., None].repeat(3, axis=-1))
    return name


def _differing(error: NDArray[np.float64]) -> NDArray[np.intp]:
    """Row and column of the pixels that do not agree, largest error first; of equal ones the topmost, then leftmost."""
    rows, columns = np.nonzero(~(error <= TOLERANCE))
    order = np.lexsort((columns, rows, -error[rows, columns]))
    return np.stack([rows[order], columns[order]], axis=-1)


def _count(measured: Measurement, reasons: list[Reason | None]) -> dict[str, Any]:
    """Every pixel in one class."""
    kinds = Counter(reason.kind for reason in reasons if reason)
    explained = {kind: kinds[kind] for kind in CLASSES if kinds[kind]}
    agree = measured.total - len(reasons)
    return {"total": measured.total, "agree": agree, "explained": explained, "unexplained": reasons.count(None)}


def _worst(
    error: NDArray[np.float64],
    places: NDArray[np.intp],
    reasons: list[Reason | None],
    approved: set[tuple[int, int]],
) -> list[dict[str, Any]]:
    """The pixels that do not agree, those without a reason first, and of them those first that nobody approved."""
    accepted = [(row, column) in approved for row, column in places.tolist()]
    order = sorted(range(len(reasons)), key=lambda i: (reasons[i] is not None, accepted[i]))[:WORST]
    return [
        {
            "column": int(places[i][1]),
            "row": int(places[i][0]),
            "error": round(float(error[tuple(places[i])]), 3),
            "class": reason.kind if (reason := reasons[i]) else None,
            "evidence": reason.evidence if reason else None,
            **({"approved": True} if accepted[i] else {}),
        }
        for i in order
    ]
