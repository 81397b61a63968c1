"""One picture graded: the verdict, the causes, the worst pixel with its rays, and the pictures that show it."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import lru_cache
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference.errors import InputError
from reference.explanation import explain
from reference.model import DOCUMENT
from reference.scene import Scene
from reference.world import View
from reports.diagnosis import Cause, diagnose
from reports.envelope import Envelope, envelope
from reports.gradebook import Task, empty_record
from reports.gradeimages import SMALL, THUMB, Album, surroundings
from reports.location import locate
from reports.lookalike import look_again
from reports.otherscene import other_scene
from reports.rays import pixel_sentence, ray_rows
from reports.raytree import ray_tree
from reports.recording import slug
from reports.resemblance import blank, unlike
from reports.sentences import advise, blame, form, point_aside, praise, where
from reports.submission import Submission, read_submission
from reports.suspects import Suspects
from reports.verdict import OUTSIDE, Blob, Verdict, judge, worst_channel

SHARED = "pictures/_right"  # which is no student's
LISTED = 20  # blobs
KEPT = 2  # scenes and sizes of which a worker keeps what is dear


def grade_picture(task: Task) -> dict[str, Any]:
    """The record of one picture, as in grade.json; its pictures are written into the task's folder."""
    start = perf_counter()
    path = task.entry.path
    assert path
    try:
        submission = read_submission(path)
    except InputError as error:
        return empty_record(task.entry, "refused", re.sub(rf"^{re.escape(str(path))}(:1:1)?: ", "", str(error)))
    height, width = submission.levels.shape[:2]
    view = View(width, height, task.depth)
    bounds = _bounds(task.scene, view)
    verdict = look_again(judge(bounds, submission), lambda: _suspects(task.scene, view), submission)
    record = empty_record(task.entry, "graded", "") | {"width": width, "height": height}
    record["format"] = f"{width} x {height}, {form(submission.facts)}"
    album = Album(task.folder, task.side, task.exact)
    record["images"] = {
        "thumb": album.save(f"{task.name}-thumb", submission.levels, THUMB),
        "yours": album.save(task.name, submission.levels),
    }
    if verdict.right:
        record |= {"verdict": "right", "reason": praise(verdict), "outside": 0}
    else:
        excess = _excess(verdict, submission, bounds)
        record |= _wrong(task, view, submission, bounds, verdict, excess)
        record["images"] |= _pictures(task, album, submission, bounds, excess, record["worst"])
    return record | {"seconds": round(perf_counter() - start, 3)}


@lru_cache(KEPT)
def _bounds(scene: Scene, view: View) -> Envelope:
    return envelope(scene, view.width, view.height, view.depth)


@lru_cache(KEPT)
def _suspects(scene: Scene, view: View) -> Suspects:
    return Suspects(scene, view)


def _excess(verdict: Verdict, submission: Submission, bounds: Envelope) -> NDArray[np.float32]:
    """How far each channel is off, in levels, where that counts: H x W x 3, 0 elsewhere; never 0 everywhere."""
    error = np.abs(submission.levels - bounds.centre)
    wrong = worst_channel(verdict.outside) > OUTSIDE
    if "offset" in verdict.reasons:
        wrong = wrong | verdict.offset_area
    if wrong.any():
        return np.where(wrong[..., None], np.maximum(verdict.outside, error * verdict.offset_area[..., None]), 0)
    far = np.where((worst_channel(error) > OUTSIDE)[..., None], error, 0)
    return far if far.any() else error


def _wrong(
    task: Task, view: View, submission: Submission, bounds: Envelope, verdict: Verdict, excess: NDArray[np.float32]
) -> dict[str, Any]:
    """What a wrong picture's record says beyond any."""
    outside = int((worst_channel(excess) > 0).sum())
    place = where(bounds, excess)
    advice = blank(bounds, submission) or _other(task, submission) or unlike(bounds, submission) or ""
    found = [] if advice else diagnose(_suspects(task.scene, view), submission.levels, submission.facts)
    causes = [_cause(cause, place) for cause in found]
    features: list[str] = next((cause["features"] for cause in causes if cause["named"]), [])
    if not features and not advice and "displaced" in verdict.reasons:
        features, advice = ["geometry"], point_aside(verdict.displacement)
    elif not features and not advice:
        features = list(locate(task.scene, view, excess))
    return {
        "verdict": "wrong",
        "reason": blame(verdict, outside, view.width * view.height, place),
        "outside": outside,
        "advice": advice or advise(outside / (view.width * view.height), features),
        "features": features,
        "causes": causes,
        "blobs": [_blob(blob) for blob in verdict.blobs[:LISTED]],
        "blob_count": verdict.blob_count,
        "worst": _worst(task, view, submission, excess),
    }


def _cause(cause: Cause, place: str) -> dict[str, Any]:
    mistakes = "this mistake" if len(cause.parts) == 1 else "both mistakes"
    return {
        "id": cause.id,
        "title": cause.title,
        "share": cause.share,
        "hint": cause.hint,
        "looks": cause.looks,
        "evidence": f"The scene drawn with {mistakes} explains {100 * cause.share:.0f} % of the difference, {place}.",
        "where": place,
        "features": list(cause.features),
        "named": cause.named,
        "parts": [{"id": id_, "title": title} for id_, title in cause.parts],
        "value": cause.value,
    }


def _other(task: Task, submission: Submission) -> str | None:
    name = other_scene(task.entry.scene, task.others, task.depth, submission.levels)
    return f"This is a picture of {name}: is it the right file?" if name else None


def _blob(blob: Blob) -> dict[str, Any]:
    worst = {"column": blob.worst[0], "row": blob.worst[1], "excess": round(blob.excess, 2)}
    return {"pixels": blob.size, "box": list(blob.box), "objects": list(blob.objects), "worst": worst}


def _worst(task: Task, view: View, submission: Submission, excess: NDArray[Any]) -> dict[str, Any]:
    """The pixel that is farthest off, what is right there, and how that comes about."""
    row, column = divmod(int(np.argmax(worst_channel(excess))), view.width)
    pixel: Mapping[str, int] = {"column": column, "row": row}
    explanation = explain(task.scene, DOCUMENT, **pixel, width=view.width, height=view.height, depth=view.depth)
    found = [round(float(level), 2) for level in submission.levels[row, column]]
    left, top, across, down = surroundings(submission.levels.shape, column, row)
    return {
        **pixel,
        "found": found,
        "expected": list(explanation.bytes),
        "text": pixel_sentence(explanation, found),
        "rays": ray_rows(explanation),
        "sum": " ".join(map(str, explanation.bytes)),
        "ray_tree": list(ray_tree(explanation)),
        "zoom": {"width": across, "height": down, "column": column - left, "row": row - top},
    }


def _pictures(
    task: Task, album: Album, submission: Submission, bounds: Envelope, excess: NDArray[Any], worst: Mapping[str, Any]
) -> dict[str, str]:
    levels, pixel = submission.levels, (worst["column"], worst["row"])
    shared = f"{SHARED}/{slug(task.entry.scene)}-{bounds.width}x{bounds.height}"
    return {
        "small": album.save(f"{task.name}-small", levels, SMALL),
        "difference": album.save_difference(f"{task.name}-difference", excess),
        "small_difference": album.save_difference(f"{task.name}-small-difference", excess, SMALL),
        "right": album.save(shared, bounds.centre),
        "right_small": album.save(f"{shared}-small", bounds.centre, SMALL),
        "zoom": album.save_zoom(f"{task.name}-zoom", levels, *pixel),
        "right_zoom": album.save_zoom(f"{task.name}-right-zoom", bounds.centre, *pixel),
    }
