"""Paths whose errors mirrors magnify: three balls that nearly touch, and a floor."""

from dataclasses import asdict

import numpy as np
import pytest

import reports.accounting
from reference import Plane, Scene, Sphere
from reference.proof import Prover
from reference.rules import Rules
from reference.scene import Triple
from reference.witness import _Search, find_error
from reports.accounting import PRECISION, account, explain_pixel
from translator.contract import Limits

FLOOR = Plane((200, 180, 160), (0, -100, 0), (0, 1, 0), 1, 0.5)
RED, GREEN = Sphere((250, 30, 20), (-10.5, 0, 300), 10, 0.5, 1), Sphere((20, 220, 60), (10.5, 0, 300), 10, 0.5, 1)
BLUE = Sphere((30, 60, 240), (0, 0, 318.5), 10, 0.5, 1)
SCENE = Scene((255, 255, 255), 0.2, (RED, GREEN, BLUE), (FLOOR,))
PIXEL, DEPTH = (492, 530), 5
SINGLE = Rules(precision=2.0**-20)


@pytest.fixture(scope="module")
def prover() -> Prover:
    return Prover(SCENE, depth=DEPTH)


def colour_of(prover: Prover, size: float) -> Triple:
    """What a path brings back whose errors are up to that."""
    errors = np.random.default_rng(7).uniform(-1, 1, (2 * DEPTH + 2, 3))
    with prover.tables(128) as tables:
        red, green, blue = -_Search(prover, tables, PIXEL, Rules(precision=size), np.zeros(3)).miss(errors)
    return (red, green, blue)


def truth(prover: Prover) -> Triple:
    (colour,) = prover.admissible(*PIXEL).colours
    return colour.value


def test_a_path_without_errors_is_the_proven_one(prover: Prover) -> None:
    assert colour_of(prover, 0) == pytest.approx(truth(prover), abs=1e-9)
    assert find_error(prover, *PIXEL, truth(prover), SINGLE) == 0


def test_balls_hold_nothing_there(prover: Prover) -> None:
    assert not prover.admissible(*PIXEL, SINGLE).complete


@pytest.mark.parametrize("size", [2.0**-21, 2.0**-22, 2.0**-24])
def test_a_colour_that_errors_make_is_found_with_no_larger_ones(prover: Prover, size: float) -> None:
    colour = colour_of(prover, size)
    found = find_error(prover, *PIXEL, colour, SINGLE)
    assert found
    assert found <= size
    assert found == find_error(prover, *PIXEL, colour, SINGLE)
    assert find_error(prover, *PIXEL, colour, Rules(precision=found / 8)) is None


def test_the_pixel_is_explained_by_that_precision_only(prover: Prover) -> None:
    value = colour_of(prover, 2.0**-21)
    assert max(abs(a - b) for a, b in zip(value, truth(prover), strict=True)) > 0.5
    reason = explain_pixel(prover, asdict(Limits(SINGLE.precision)), *PIXEL, value)
    assert reason
    assert reason.kind == PRECISION
    assert reason.evidence.startswith("a path with errors of up to 2^-2")
    assert explain_pixel(prover, asdict(Limits(2.0**-30)), *PIXEL, value) is None
    assert explain_pixel(prover, {}, *PIXEL, value) is None


@pytest.mark.parametrize("wrong", [(0.6, -0.6, 0.6), (-2, 2, 2), (0, 30, 0), (-30, -30, 30)])
def test_a_colour_that_no_small_errors_make_is_unexplained(prover: Prover, wrong: Triple) -> None:
    red, green, blue = (a + b for a, b in zip(truth(prover), wrong, strict=True))
    assert explain_pixel(prover, asdict(Limits(SINGLE.precision)), *PIXEL, (red, green, blue)) is None


def test_what_agrees_and_what_balls_exclude_is_not_searched(monkeypatch: pytest.MonkeyPatch, prover: Prover) -> None:
    monkeypatch.setattr(reports.accounting, "find_error", lambda *_: pytest.fail("searched"))
    red, green, blue = truth(prover)
    assert explain_pixel(prover, asdict(Limits(SINGLE.precision)), *PIXEL, (red + 0.4, green, blue)) is None
    floor = (300, 900)
    (seen,) = prover.admissible(*floor).colours
    red, green, blue = seen.value
    assert explain_pixel(prover, asdict(Limits(SINGLE.precision)), *floor, (red + 0.6, green, blue)) is None


def test_searches_in_vain_come_to_an_end(monkeypatch: pytest.MonkeyPatch, prover: Prover) -> None:
    searched = []
    monkeypatch.setattr(reports.accounting, "find_error", lambda *_: searched.append(1))
    column, row = PIXEL
    wrong = np.full((row + 1, column + 1, 3), np.array(truth(prover)) + 2)
    reasons = account(prover, asdict(Limits(SINGLE.precision)), wrong, np.array([(row, column)] * 60))
    assert reasons == [None] * 60
    assert len(searched) == 400 // (DEPTH + 1) ** 2
