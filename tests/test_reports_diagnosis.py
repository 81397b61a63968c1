"""Diagnosis: what was planted is named, through JPEG and other sizes, and nothing is where nothing is known."""

import sys
from functools import cache
from typing import Any

import numpy as np
import pytest
from helpers import ROOT

sys.path.insert(0, str(ROOT / "tests" / "benchmarks"))

from planted import plant
from prove import jpeg, page, png, prove

from reference.image import quantise
from reference.mistakes import FAMILIES, MISTAKES, combine, light_at
from reference.scene import Scene
from reference.world import View
from reports.diagnosis import NAMED, Cause, diagnose
from reports.suspects import Suspects, blocks

SIDE = 200


@cache
def suspects(name: str = "example1") -> Suspects:
    return Suspects(Scene.load(ROOT / "scenes" / f"{name}.txt"), View(SIDE, SIDE, 3))


def causes(levels: Any, name: str = "example1") -> list[Cause]:
    picture = png(quantise(levels))
    return diagnose(suspects(name), picture.levels, picture.facts)


@pytest.mark.parametrize("quality", [60, 75, 90])
@pytest.mark.parametrize("key", ["C4", "C5", "I2", "S8", "L4", "A3", "R3", "R7", "R9"])
def test_through_jpeg(key: str, quality: int) -> None:
    levels = MISTAKES[key].draw(suspects().scene, View(SIDE, SIDE, 3))
    picture = jpeg(quantise(levels), quality, "4:2:0")
    first = diagnose(suspects(), picture.levels, picture.facts)[0]
    assert first.id == key
    assert first.named
    assert first.hint == MISTAKES[key].hint


def test_other_sizes_and_antialiasing() -> None:
    large = MISTAKES["R8"].draw(suspects().scene, View(4 * SIDE, 4 * SIDE, 3))
    for levels in (large, blocks(large, 2), blocks(large, 4), MISTAKES["R8"].draw(suspects().scene, View(150, 150, 3))):
        assert causes(levels)[0].id == "R8"


@pytest.mark.parametrize(
    ("id_", "value"), [("C7", 70.0), ("C7", 55.0), ("A4", 0.2), ("A4", 0.12), ("A4", 0.08), ("Q4", 1.8)]
)
def test_numbers_are_found(id_: str, value: float) -> None:
    found = causes(FAMILIES[id_].of(value).draw(suspects().scene, View(SIDE, SIDE, 3)))[0]
    assert found.id == id_
    assert found.value == pytest.approx(value, rel=0.03)
    assert "not" in found.title


@pytest.mark.parametrize(
    "key", ["C1", "C7", "I1", "I3", "P1", "P3", "S3", "S6", "S8", "L6", "L10", "A2", "R1", "R8", "R9"]
)
def test_what_another_tracer_draws(key: str) -> None:
    """Pictures of a plain NumPy tracer that makes the mistake."""
    text = (ROOT / "scenes" / "example1.txt").read_text(encoding="utf-8-sig")
    first = causes(np.nan_to_num(plant(text, SIDE, key)))[0]
    assert first.id == key
    assert first.named


def test_the_light_is_found() -> None:
    first = causes(light_at((-500.0, 500.0, 300.0)).draw(suspects().scene, View(SIDE, SIDE, 3)))[0]
    assert first.id == "LP"
    assert first.named


@pytest.mark.parametrize("quality", [None, 75, 95])
def test_speckles_are_known(quality: int | None) -> None:
    """Those that double precision makes in another tracer, without a least distance for shadows."""
    text = (ROOT / "scenes" / "example1.txt").read_text(encoding="utf-8-sig")
    pixels = quantise(plant(text, SIDE, "S1"))
    picture = png(pixels) if quality is None else jpeg(pixels, quality, "4:2:0")
    first = diagnose(suspects(), picture.levels, picture.facts)[0]
    assert first.id == "S1"
    assert first.named


def test_areas_are_no_speckles() -> None:
    """What S1 darkens, dark in the left half."""
    scene, view = suspects().scene, View(SIDE, SIDE, 3)
    marred = MISTAKES["S1"].draw(scene, view)
    half = np.where(np.arange(SIDE)[None, :, None] < SIDE // 2, marred, suspects().right_whole)
    assert "S1" not in [cause.id for cause in causes(half)]


@pytest.mark.parametrize(
    ("one", "other"), [("L9", "S8"), ("C4", "A3"), ("S4", "L7"), ("R12/0", "Q6"), ("P3", "Q4"), ("R7", "S9")]
)
@pytest.mark.parametrize("form", ["PNG", "JPEG"])
def test_two_at_once(one: str, other: str, form: str) -> None:
    both = combine(MISTAKES[one], MISTAKES[other])
    assert both is not None
    pixels = quantise(both.draw(suspects().scene, View(SIDE, SIDE, 3)))
    picture = png(pixels) if form == "PNG" else jpeg(pixels, 85, "4:2:0")
    first = diagnose(suspects(), picture.levels, picture.facts)[0]
    assert set(first.id.split("+")) == {one.partition("/")[0], other}
    assert [part[0] for part in first.parts] == first.id.split("+")
    assert len(first.features) == 2


def test_what_nobody_knows_has_no_name() -> None:
    """A hole in a sphere, and noise."""
    scene, view = suspects().scene, View(SIDE, SIDE, 3)
    right = MISTAKES["C8"].draw(scene, view).copy()
    right[120:150, 60:90] = (0, 255, 0)
    assert not [cause for cause in causes(right) if cause.named]
    noise = np.random.default_rng(2).uniform(0, 255, (SIDE, SIDE, 3))
    assert not [cause for cause in causes(noise) if cause.share >= NAMED]


def test_the_gate_is_proven_on_a_part() -> None:
    tallies = prove(["example3"], 120, 2, sides=(160,))
    harmless, mistakes = tallies["harmless"], tallies["mistakes"]
    assert harmless.passed == harmless.pictures > 40
    assert tallies["sizes"].passed == tallies["sizes"].pictures > 10
    assert mistakes.pictures > 40
    assert mistakes.passed == 0
    assert mistakes.first >= 0.9 * mistakes.pictures
    assert mistakes.three >= 0.95 * mistakes.pictures
    text = page(tallies, ["example3"], 120, (160,))
    assert f"{harmless.passed} of {harmless.pictures} (100.0 %)" in text
