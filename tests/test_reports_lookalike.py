"""A wrong picture of which each pixel might be right is told by the mistake that draws it; no right one is."""

import sys
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path

import numpy as np
import pytest
from helpers import ROOT

sys.path.insert(0, str(ROOT / "tests" / "benchmarks"))

from prove import harmless, jpeg, png, scenes

from reference import DOCUMENT
from reference.image import quantise
from reference.mistakes import MISTAKES
from reference.slips import draw
from reference.world import View
from reports.diagnosis import diagnose
from reports.envelope import Envelope, envelope
from reports.lookalike import look_again
from reports.submission import Submission, read_submission
from reports.suspects import Suspects
from reports.verdict import Verdict, judge

VIEW = View(250, 250, 3)
Verdicts = tuple[Verdict, Verdict]


photo = partial(jpeg, quality=85, subsampling="4:2:0")


@cache
def bounds(name: str) -> Envelope:
    return envelope(scenes()[name], VIEW.width, VIEW.height)


@cache
def suspects(name: str) -> Suspects:
    return Suspects(scenes()[name], VIEW)


def verdicts(name: str, picture: Submission) -> Verdicts:
    """By the envelope alone, and after another look."""
    first = judge(bounds(name), picture)
    return first, look_again(first, lambda: suspects(name), picture)


@pytest.mark.parametrize(
    ("name", "key", "file"),
    [
        ("tangent", "C5", png),
        ("eye_inside", "C4", png),
        ("example4", "R7", photo),
        ("near_front", "Q2", photo),
        ("bright_ambient", "C5", photo),
    ],
)
def test_hidden_mistakes_are_told(name: str, key: str, file: Callable[[object], Submission]) -> None:
    first, second = verdicts(name, file(quantise(MISTAKES[key].draw(scenes()[name], VIEW))))
    assert first.right
    assert not second.right
    assert second.reasons == ("lookalike",)


@pytest.mark.parametrize("name", ["example4", "tangent", "eye_inside"])
def test_right_pictures_stay_right(name: str) -> None:
    for kind, picture in harmless(scenes()[name], VIEW, few=True):
        assert verdicts(name, picture)[1].right, kind


def test_a_third_of_a_hidden_mistake_is_not_that_mistake() -> None:
    """What a mistake's picture explains in part only is no proof."""
    right = quantise(draw(scenes()["tangent"], DOCUMENT, VIEW))
    wrong = quantise(MISTAKES["C5"].draw(scenes()["tangent"], VIEW))
    third = np.where(np.random.default_rng(1).random(right.shape[:2])[..., None] < 2 / 3, right, wrong)
    assert verdicts("tangent", png(third))[1].right


def test_what_is_right_beyond_doubt_is_not_looked_at_again() -> None:
    def never() -> Suspects:
        raise AssertionError

    picture = png(quantise(draw(scenes()["tangent"], DOCUMENT, VIEW)))
    first = judge(bounds("tangent"), picture)
    assert look_again(first, never, picture) is first


@pytest.mark.parametrize("path", sorted((ROOT / "tests" / "encoded").glob("*.jpg")), ids=lambda path: path.stem)
def test_other_encoders(path: Path) -> None:
    """Go's image/jpeg and stb_image_write round otherwise than the library that Pillow uses; 500 pixels, quality 75."""
    name, truth, _ = path.stem.split("-")
    picture = read_submission(path)
    view = View(500, 500, 3)
    scene = Suspects(scenes()[name], view)
    verdict = look_again(judge(envelope(scenes()[name], 500, 500), picture), lambda: scene, picture)
    assert verdict.right == (truth == "right"), verdict.reasons
    if not verdict.right:
        first = diagnose(scene, picture.levels, picture.facts)[0]
        assert (first.id, first.named) == (truth, True)
