"""Terms that are shown alone add up to the picture, and tell which of them a renderer has wrong."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers import EXAMPLE, TRICKY, exact, need, rendered

from reference import Scene
from reference.errors import RendererError
from reference.text import dump, parse
from reports.recording import Recording
from reports.terms import LARGEST, TITLES, Terms, compare_terms, record_terms, terms, variants
from translator.contract import Settings

SHAPE: dict[str, Any] = {"width": 60, "height": 40, "depth": 3}
pytestmark = pytest.mark.filterwarnings("ignore::reference.errors.SceneWarning")


@cache
def scenes() -> dict[str, Scene]:
    return {"example1": Scene.load(EXAMPLE), "tricky": parse(TRICKY)}


@cache
def of(name: str) -> Terms:
    return terms(scenes()[name], **SHAPE)


@pytest.mark.parametrize("name", ["example1", "tricky"])
def test_terms_add_up_to_the_whole_picture(name: str) -> None:
    found = of(name)
    assert set(found) == set(TITLES)
    total = found["ambient"] + found["diffuse"] - found["shadow"] + found["reflection"]
    full = exact(scenes()[name], 60, 40)
    assert np.abs(total - full).max() < 1e-9 * max(1, full.max())
    assert np.allclose(found["light"], found["diffuse"] - found["shadow"], atol=1e-9)
    for term, levels in found.items():
        assert levels.min() > -1e-9, term
        assert levels.max() > 1, term


def test_each_term_follows_its_coefficient() -> None:
    scene, found = scenes()["example1"], of("example1")
    halved = terms(replace(scene, ambient_coefficient=scene.ambient_coefficient / 2), **SHAPE)
    assert np.allclose(halved["ambient"], found["ambient"] / 2)
    assert np.allclose(halved["diffuse"], found["diffuse"])
    assert np.allclose(halved["shadow"], found["shadow"])
    flat = terms(scene, width=60, height=40, depth=0)
    assert np.abs(flat["reflection"]).max() < 1e-9


def test_shadow_is_only_where_the_light_is_blocked() -> None:
    found = of("example1")
    dark = (found["shadow"] > 0).any(axis=-1)
    assert 0 < np.count_nonzero(dark) < dark.size
    assert not found["light"][dark].any()
    assert np.array_equal(found["light"][~dark], found["diffuse"][~dark])


@pytest.mark.parametrize("wrong", ["ambient", "light", "reflection"])
def test_the_term_that_is_wrong_is_named(wrong: str) -> None:
    right = of("example1")
    other = {name: levels.copy() for name, levels in right.items()}
    other[wrong][20, 30] += 7
    full = other["ambient"] + other["light"] + other["reflection"]
    found = compare_terms(right, full, {name: other[name] for name in ("ambient", "light")})
    assert {name for name, numbers in found.items() if numbers["over"]} == {wrong}
    assert found[wrong] == {"max_error": 7, "over": 1}


def test_what_a_renderer_clamps_is_no_error() -> None:
    right = dict(of("example1"))
    right["reflection"] = right["reflection"].copy()
    right["reflection"][20, 30] = 300  # the whole is above 255
    full = np.clip(right["ambient"] + right["light"] + right["reflection"], 0, 255)
    alone = {name: np.clip(right[name], 0, 255) for name in ("ambient", "light")}
    assert {name: numbers["over"] for name, numbers in compare_terms(right, full, dict(alone)).items()} == {
        "ambient": 0,
        "light": 0,
        "reflection": 0,
    }
    full[20, 30] = np.nan
    assert compare_terms(right, full, dict(alone))["reflection"] == {"max_error": 255, "over": 1}


def test_what_was_not_drawn_is_not_compared() -> None:
    right = of("example1")
    assert set(compare_terms(right, None, {"ambient": right["ambient"], "light": None})) == {"ambient"}
    assert compare_terms(right, None, {"ambient": None, "light": None}) == {}


def test_a_renderer_draws_the_variants() -> None:
    need("povray")
    settings = Settings(60, 40, 3, 1)
    pictures = {
        name: rendered("povray", variant, settings)[0] for name, variant in variants(scenes()["example1"]).items()
    }
    full = rendered("povray", scenes()["example1"], settings)[0]
    found = compare_terms(of("example1"), full, dict(pictures))
    assert set(found) == {"ambient", "light", "reflection"}
    for numbers in found.values():
        assert numbers["over"] <= 2, found


def test_terms_of_very_large_pictures_are_left_out(tmp_path: Path) -> None:
    run = Recording(tmp_path, "0.1.0")
    entry = run.add_scene("s.txt", LARGEST, 2, depth=3, convention="exact", text="")
    assert record_terms(run, entry, lambda words, folder: pytest.fail("drawn")) is None
    assert "terms" not in entry


def test_terms_that_cannot_be_drawn_are_left_out(tmp_path: Path) -> None:
    def crash(words: list[str], folder: Path) -> None:
        raise RendererError("python ended with signal 6")

    run = Recording(tmp_path, "0.1.0")
    entry = run.add_scene("s.txt", 8, 8, depth=3, convention="exact", text=dump(scenes()["example1"]))
    assert record_terms(run, entry, crash) is None
    assert "terms" not in entry
