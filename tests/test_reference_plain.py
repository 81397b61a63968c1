"""The quick reader of plain scene files: it reads what the careful reader reads, or gives up."""

import gc
import warnings
from itertools import product

import pytest
from random_scenes import random_scene

from reference import Scene
from reference.errors import SceneError, SceneWarning
from reference.plain import parse_plain
from reference.text import dump, parse, parse_carefully

TEXT = "255 250 245\n0.1\n1\n250 200 0\n50 -70 300\n30\n1\n0.2\n1\n10 20 30\n0 -100 0\n0 1 0\n0.5\n1\n"


def attributes(scene: Scene) -> tuple[object, ...]:
    """All that a scene says, line numbers and the signs of zeros included."""
    return (repr(scene), [sphere.lines for sphere in scene.spheres], [plane.lines for plane in scene.planes])


def read_in_both_ways(text: str) -> tuple[Scene | None, Scene | None]:
    """By the quick reader, and line by line where there is nothing to refuse or to warn about."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            return parse_plain(text), parse_carefully(text, "scene.txt")
        except (SceneError, SceneWarning):
            return parse_plain(text), None


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_the_quick_reader_reads_what_the_careful_one_reads(seed: int, end: str) -> None:
    scene = random_scene(seed)
    text = dump(scene).replace("\n", end)
    for variant in (text, text.removesuffix(end), text.replace(" 0 ", " -0.0 ")):
        plain, careful = read_in_both_ways(variant)
        assert plain is not None
        assert careful is not None
        assert attributes(plain) == attributes(careful)


def test_the_quick_reader_gives_up_where_the_careful_one_would_speak() -> None:
    """One change anywhere in a file: a scene is the same scene, and what is refused or warned about is None."""
    text = dump(random_scene(3))
    same = 0
    for place, piece in product(range(len(text)), ["", " ", "\n", "\r", "-", "e", "9", ".", "_", "\x1c", "\u0663"]):
        for changed in (text[:place] + piece + text[place + 1 :], text[:place] + piece + text[place:]):
            plain, careful = read_in_both_ways(changed)
            if plain is not None:
                assert careful is not None, changed
                assert attributes(plain) == attributes(careful), changed
                same += 1
    assert same > len(text)


@pytest.mark.parametrize(
    "change",
    [
        ("0.1\n1\n", "0.1\n1.0\n"),
        ("30", "0"),
        ("30", "-1"),
        ("30", "1e999"),
        ("30", "nan"),
        ("0 1 0", "0 -0 0"),
        ("250", "256"),
    ],
)
def test_the_quick_reader_gives_up(change: tuple[str, str]) -> None:
    assert parse_plain(TEXT) == parse(TEXT)
    assert parse_plain(TEXT.replace(*change)) is None
    assert parse_plain("") is None


def test_the_quick_reader_leaves_garbage_collection_as_it_was() -> None:
    assert gc.isenabled()
    parse_plain("1 2 3")
    assert gc.isenabled()
