"""The ray tree behind a pixel against the picture, and what it says."""

import json
import random
from pathlib import Path

import numpy as np
import pytest
from helpers import EXAMPLE, ROOT, crossray

from reference.errors import InputError
from reference.explanation import explain
from reference.model import CONVENTIONS, DOCUMENT, PUBLISHED
from reference.scene import Scene
from reference.text import parse
from reference.tracer import render
from reports.raytree import parting, ray_tree

SCENES = sorted((ROOT / "scenes").glob("*.txt")) + sorted((ROOT / "scenes" / "diagnostic").glob("*.txt"))

pytestmark = pytest.mark.filterwarnings("ignore::reference.errors.SceneWarning")


@pytest.mark.parametrize("convention", CONVENTIONS)
@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_the_terms_sum_to_the_pixel(path: Path, convention: str) -> None:
    scene, model = Scene.load(path), CONVENTIONS[convention]
    picture = render(scene, model, width=200, height=100, dtype=float)
    pick = random.Random(path.stem)
    for _ in range(40):
        column, row = pick.randrange(200), pick.randrange(100)
        told = explain(scene, model, column=column, row=row, width=200, height=100)
        assert told.colour == pytest.approx(picture[row, column], abs=1e-9)
        shares = [bounce.contribution for bounce in told.bounces if bounce.contribution]
        assert np.sum(shares, axis=0) == pytest.approx(told.colour if shares else 0.0)
        assert told.bytes == tuple(int(value) for value in np.clip(told.colour, 0, 255))


def test_a_tree_names_surfaces_by_their_place_in_the_file() -> None:
    told = explain(Scene.load(EXAMPLE), column=300, row=900)
    assert [bounce.hit for bounce in told.bounces] == [
        "plane 1, lines 15-19",
        "sphere 2, lines 9-13",
        "plane 1, lines 15-19",
        "sphere 2, lines 9-13",
    ]
    assert [bounce.weight for bounce in told.bounces] == pytest.approx([1, 1, 0.2, 0.2])
    assert [blocker.surface for blocker in told.bounces[2].blockers] == ["sphere 2, lines 9-13"]
    assert told.bounces[0].crossings[0].distances == ()


def test_numbers_are_those_of_the_file_where_twins_are_merged() -> None:
    ball = "9 9 9\n0 0 300\n50\n1\n0\n"
    scene = parse(f"255 255 255\n0.1\n3\n{ball}{ball}9 9 9\n0 0 200\n20\n1\n0\n0\n")
    told = explain(scene, column=5, row=5, width=10, height=10)
    assert told.bounces[0].hit == "sphere 3, lines 14-18"
    assert len(told.bounces[0].crossings) == 2


def test_depth_and_misses_end_the_tree() -> None:
    mirrors = Scene.load(ROOT / "scenes" / "diagnostic" / "facing_mirrors.txt")
    assert len(explain(mirrors, column=10, row=10, depth=7).bounces) == 8
    nothing = explain(parse("0 0 0\n0\n0\n0\n"), column=0, row=0)
    assert (len(nothing.bounces), nothing.bounces[0].hit, nothing.bytes) == (1, None, (0, 0, 0))


@pytest.mark.parametrize("place", [(-1, 0), (0, -1), (10, 0), (0, 8)])
def test_pixels_outside_the_picture(place: tuple[int, int]) -> None:
    with pytest.raises(InputError, match="expected a pixel within 10x8"):
        explain(Scene.load(EXAMPLE), column=place[0], row=place[1], width=10, height=8)


def test_text_for_people() -> None:
    text = "\n".join(ray_tree(explain(Scene.load(EXAMPLE), column=300, row=900)))
    assert "shadow   of sphere 2, lines 9-13 at t = 0.0122" in text
    assert "bounce 2, of which 0.2 reaches the eye" in text
    assert text.endswith("8 bit    116 61 50\nproof    this colour is proven")
    miss = "\n".join(ray_tree(explain(parse("0 0 0\n0\n0\n0\n"), column=0, row=0)))
    assert "hits     nothing: black" in miss


def test_where_conventions_part() -> None:
    document, published = (explain(Scene.load(EXAMPLE), model, column=300, row=900) for model in (DOCUMENT, PUBLISHED))
    assert parting(document, published) == "document and published part at ray 2: 0.2 and 0.1 of it reach the eye"
    assert "follow the same rays; their sums differ by 0 levels" in parting(document, document)


def test_command_line() -> None:
    result = crossray("explain", EXAMPLE, "300", "900", "--convention", "document", "--convention", "published")
    assert result.returncode == 0
    assert result.stdout.strip().endswith("part at ray 2: 0.2 and 0.1 of it reach the eye")
    result = crossray("explain", EXAMPLE, "30", "90", "--size", "100x100", "--json")
    (told,) = json.loads(result.stdout)["conventions"]
    assert (told["column"], told["row"], len(told["bounces"])) == (30, 90, 4)
    assert told["bounces"][0]["hit"] == "plane 1, lines 15-19"
    result = crossray("explain", EXAMPLE, "300", "1900")
    assert (result.returncode, result.stdout) == (2, "")
    assert "expected a pixel within 1000x1000" in result.stderr
