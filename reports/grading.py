"""One picture graded: the verdict, the causes, the worst pixel with its rays, and the pictures that show it."""

from __future__ import annotations

import re
from collections import Counter
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
from reports.gradeimages import SMALL, THUMB, Album, surroundings, worst_channel
from reports.location import locate
from reports.lookalike import look_again
from reports.rays import pixel_sentence, ray_rows
from reports.raytree import ray_tree
from reports.recording import slug
from reports.resemblance import unlike
from reports.submission import Facts, Submission, read_submission
from reports.suspects import Suspects
from reports.verdict import OUTSIDE, Blob, Verdict, judge

SHARED = "pictures/_right"  # which is no student's
LISTED = 20  # blobs
RIGHT = "Every pixel is one that a right tracer could have made."
ROUNDED = "Right, with levels rounded that the document truncates: no pixel is off by more than one level."
TOGETHER = {  # why pixels are wrong of which each might be right
    "displaced": "all of them displaced alike",
    "lookalike": "all of them as a known mistake draws them",
}
KEPT = 2  # scenes and sizes of which a worker keeps what is dear
MOSTLY = 0.9  # of the wrong pixels are on the objects that are named
STRANGE = 0.5  # of the picture wrong without a known mistake: it may be one of something else
BLANK = 2.0  # levels that one colour may differ by in a JPEG
SIDE = 100  # pixels at which other scenes are tried


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
    record["format"] = f"{width} x {height}, {_format(submission.facts)}"
    album = Album(task.folder, task.side, task.exact)
    record["images"] = {
        "thumb": album.save(f"{task.name}-thumb", submission.levels, THUMB),
        "yours": album.save(task.name, submission.levels),
    }
    if verdict.right:
        record |= {"verdict": "right", "reason": ROUNDED if verdict.rounding else RIGHT, "outside": 0}
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


def _format(facts: Facts) -> str:
    sampling = f", {facts.subsampling}" if facts.subsampling else ""
    return f"{facts.format}, {facts.bits} bit {facts.channels}{sampling}"


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
    where = _where(bounds, excess)
    advice = _what_else(task, submission.levels) or unlike(bounds, submission) or ""
    found = [] if advice else diagnose(_suspects(task.scene, view), submission.levels, submission.facts)
    causes = [_cause(cause, where) for cause in found]
    features: list[str] = next((cause["features"] for cause in causes if cause["named"]), [])
    if not features and not advice:
        features = list(locate(task.scene, view, excess))
    share = f"{outside / (view.width * view.height):.2%}".replace(".00%", "%").replace("%", " %")
    all_together = next((TOGETHER[reason] for reason in verdict.reasons if reason in TOGETHER), "")
    what = "cannot be right" if verdict.count or not all_together else f"are off, {all_together}"
    return {
        "verdict": "wrong",
        "reason": f"{outside} of {view.width * view.height} pixels ({share}) {what}, {where}.",
        "outside": outside,
        "advice": advice or _advice(outside / (view.width * view.height), features),
        "features": features,
        "causes": causes,
        "blobs": [_blob(blob) for blob in verdict.blobs[:LISTED]],
        "blob_count": verdict.blob_count,
        "worst": _worst(task, view, submission, excess),
    }


def _where(bounds: Envelope, excess: NDArray[Any]) -> str:
    """The objects that nearly all wrong pixels are on."""
    seen = Counter(bounds.objects[(worst_channel(excess) > 0)].tolist())
    names, told = [], 0
    for number, count in seen.most_common():
        names.append(bounds.names[number])
        told += count
        if told >= MOSTLY * seen.total():
            break
    if len(names) > 4:
        return "everywhere"
    if names == ["background"]:
        return "where nothing is seen"
    return "on " + " and ".join(filter(None, [", ".join(names[:-1]), names[-1]]))


def _cause(cause: Cause, where: str) -> dict[str, Any]:
    mistakes = "this mistake" if len(cause.parts) == 1 else "both mistakes"
    return {
        "id": cause.id,
        "title": cause.title,
        "share": cause.share,
        "hint": cause.hint,
        "looks": cause.looks,
        "evidence": f"The scene drawn with {mistakes} explains {100 * cause.share:.0f} % of the difference, {where}.",
        "where": where,
        "features": list(cause.features),
        "named": cause.named,
        "parts": [{"id": id_, "title": title} for id_, title in cause.parts],
        "value": cause.value,
    }


def _what_else(task: Task, levels: NDArray[Any]) -> str:
    """What a picture is that nobody drew of the scene, and what to do; empty for one that somebody may have."""
    if max(float(np.ptp(levels[..., channel])) for channel in range(3)) <= BLANK:
        return "The whole picture has one colour: did the program write what it has drawn?"
    if other := _other_scene(task, levels):
        return f"This is a picture of {other}: is it the right file?"
    return ""


def _advice(share: float, features: list[str]) -> str:
    """What to do about a picture that shows none of the known mistakes."""
    if features:
        return f"The difference lies in the {' and '.join(features)}. Follow the rays of the worst pixel."
    if share > STRANGE:
        return "Most of it is unlike the scene: is it a picture of this scene at all, with the assignment's camera?"
    return "Follow the rays of the worst pixel and compare each number with your program's."


def _other_scene(task: Task, levels: NDArray[Any]) -> str | None:
    """The name of another scene of the class that the picture is closer to than to its own, by far."""
    small = _small(levels)
    errors = {
        name: float(np.abs(_small_right(scene, task.depth) - small).mean()) for name, scene in task.others.items()
    }
    best = min(errors, key=errors.__getitem__)
    own = errors.get(task.entry.scene, np.inf)
    return best if best != task.entry.scene and errors[best] < min(4.0, own / 3) else None


@lru_cache(16)
def _small_right(scene: Scene, depth: int) -> NDArray[np.float64]:
    from reference.tracer import render

    return _small(np.asarray(render(scene, DOCUMENT, width=SIDE, height=SIDE, depth=depth)))


def _small(levels: NDArray[Any]) -> NDArray[np.float64]:
    from PIL import Image

    from reference.image import quantise

    image = Image.fromarray(quantise(np.asarray(levels, float))).resize((SIDE // 2, SIDE // 2), Image.Resampling.BOX)
    return np.asarray(image, np.float64)


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
