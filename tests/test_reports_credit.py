"""Points by feature, Gradescope's results, and where a difference of unknown cause lies."""

from dataclasses import replace

import numpy as np
import pytest
from graded import EVIL, cause, class_records, record
from helpers import ROOT, scene_of
from numpy.typing import NDArray

from reference import DOCUMENT, Model, Scene, Sphere, render
from reference.world import View
from reports.credit import POINTS, mark
from reports.gradebook import students_of
from reports.gradescope import gradescope
from reports.location import UNSHADOWED, locate

SIDE = 100
SCENE = Scene.load(ROOT / "scenes" / "example1.txt")


def lost(*pictures: dict[str, object]) -> dict[str, float]:
    return {credit.feature: credit.most - credit.points for credit in mark(pictures).credits if credit.reasons}


def test_points_add_up_to_a_hundred() -> None:
    assert sum(POINTS.values()) == 100
    assert (mark([record("a", "one", "right")]).points, mark([record("a", "one", "right")]).most) == (100, 100)


def test_one_mistake_costs_its_feature_only() -> None:
    right, wrong = record("a", "one", "right"), record("a", "two", "wrong", cause("S8"))
    assert lost(wrong) == {"shadows": 15}
    assert lost(right, wrong) == {"shadows": 7.5}
    assert not mark([right, wrong]).review
    (shadows,) = [credit for credit in mark([right, wrong]).credits if credit.reasons]
    assert shadows.reasons == ("two: reflections have no shadows (S8). Do it <right>.",)


def test_a_pair_costs_both_features() -> None:
    assert lost(record("a", "one", "wrong", cause("S8+C4"))) == {"shadows": 15, "geometry": 25}


def test_a_guess_costs_nothing_by_itself() -> None:
    picture = record("a", "one", "wrong", cause("S8", named=False), features=("reflections",))
    assert lost(picture) == {"reflections": 20}


def test_what_cannot_be_told_has_no_points_and_is_for_a_person() -> None:
    unknown = mark([record("a", "one", "wrong")])
    assert unknown.points == 0
    assert unknown.review == "one: what is wrong could not be told, so that no feature has points for it"
    failed = mark([record("a", "one", None), record("a", "two", "right")])
    assert (failed.points, failed.review) == (50, "one was not graded")
    assert (mark([record("a", "one", "unreadable")]).points, mark([record("a", "one", "unreadable")]).review) == (0, "")


# As in the documented format: https://gradescope-autograders.readthedocs.io/en/latest/specs/
TOP = {"score", "execution_time", "output", "output_format", "test_output_format", "visibility", "stdout_visibility"}
TEST = {"score", "max_score", "status", "name", "number", "output", "output_format", "tags", "visibility"}


def test_gradescope_results() -> None:
    records = class_records()
    for student in students_of(records):
        results = gradescope([records[place] for place in student["pictures"]], student)
        assert set(results) == TOP | {"tests", "extra_data"}
        assert [set(test) for test in results["tests"]] == [TEST] * len(POINTS)
        assert sum(test["score"] for test in results["tests"]) == pytest.approx(results["score"])
        assert sum(test["max_score"] for test in results["tests"]) == 100
        assert {test["visibility"] for test in results["tests"]} == {"visible"}
        assert all((test["status"] == "passed") == (test["score"] == test["max_score"]) for test in results["tests"])
        told = "\n".join(test["output"] for test in results["tests"] if test["status"] == "failed")
        if student["student"] == "ben":
            assert results["score"] == 92.5
            assert told == "two: reflections have no shadows (S8). Do it <right>."
            assert "most likely S8" in results["output"]
            assert "yours is (255, 0, 0), right is (1, 2, 3)" in results["output"]
        if student["student"] == "dora":
            assert "none of the known mistakes, but the difference lies in its shadows" in told
            assert results["extra_data"]["review"] == student["review"]
        if student["student"] == EVIL:
            assert results["score"] == 0
            assert "It is <no> picture." in told


def excess(other: NDArray[np.float64], scene: Scene = SCENE) -> NDArray[np.float64]:
    right = np.asarray(render(scene, width=SIDE, height=SIDE, dtype=np.float64))
    error = np.abs(np.clip(right, 0, 255) - np.clip(other, 0, 255))
    return np.where(error > 0.5, error, 0)


def drawn(scene: Scene = SCENE, model: Model = DOCUMENT, depth: int = 3) -> NDArray[np.float64]:
    return np.asarray(render(scene, model, width=SIDE, height=SIDE, depth=depth, dtype=np.float64))


def test_where_a_difference_lies() -> None:
    view = View(SIDE, SIDE, 3)
    moved = replace(DOCUMENT, camera_direction=lambda i, j, a, d: DOCUMENT.camera_direction(i - 0.5, j, a, d))
    assert locate(SCENE, view, excess(drawn(depth=0))) == ("reflections",)
    assert locate(SCENE, view, excess(drawn(depth=0, model=UNSHADOWED)) * 0) == ()
    unshadowed = np.where(excess(drawn(depth=0)) > 0, 0, excess(drawn(model=UNSHADOWED)))
    assert locate(SCENE, view, unshadowed) == ("shadows",)
    ball = scene_of(Sphere((200, 100, 50), (10, 20, 300), 60, 1, 0))
    edges = excess(drawn(scene=ball, model=moved), ball)
    assert locate(ball, view, np.where(edges > 8, edges, 0)) == ("geometry",)
    assert locate(SCENE, view, np.full((SIDE, SIDE, 3), 1.0)) == ("quantisation",)
    assert locate(SCENE, view, np.full((SIDE, SIDE, 3), 9.0)) == ()
