"""The scene reader and writer: all that a real file may look like, what is warned about, and what a scene keeps."""

import io
import math
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from reference import Scene
from reference.errors import SceneWarning
from reference.scene import Plane, Sphere, Triple, merge_coincident
from reference.text import dump, load, parse

SCENES = Path(__file__).parents[1] / "scenes"
PLAIN = "255 250 245\n0.1\n1\n250 200 0\n50 -70 300\n30\n1\n0.2\n1\n10 20 30\n0 -100 0\n0 1 0\n0.5\n1\n"
LINES = PLAIN.splitlines()
SCENE = Scene(
    (255.0, 250.0, 245.0),
    0.1,
    (Sphere((250.0, 200.0, 0.0), (50.0, -70.0, 300.0), 30.0, 1.0, 0.2),),
    (Plane((10.0, 20.0, 30.0), (0.0, -100.0, 0.0), (0.0, 1.0, 0.0), 0.5, 1.0),),
)
SPELLINGS = {
    "plain": PLAIN,
    "crlf": PLAIN.replace("\n", "\r\n"),
    "lone-cr": PLAIN.replace("\n", "\r"),
    "mixed-line-ends": PLAIN.replace("\n", "\r\n", 5).replace("\n1\n", "\r1\r"),
    "bom": "\ufeff" + PLAIN,
    "bom-and-crlf": "\ufeff" + PLAIN.replace("\n", "\r\n"),
    "bom-and-blank-line": "\ufeff\n" + PLAIN,
    "tabs": PLAIN.replace(" ", "\t"),
    "many-blanks": PLAIN.replace(" ", " \t  "),
    "leading-blanks": "".join(f" \t{line}\n" for line in LINES),
    "trailing-blanks": "".join(f"{line} \t \n" for line in LINES),
    "blank-lines": "\n \n\t\n" + PLAIN.replace("\n", "\n\n \t\n"),
    "no-final-newline": PLAIN.rstrip(),
    "no-final-newline-but-blanks": PLAIN.rstrip() + "  \t",
    "floats": PLAIN.replace("30\n1\n", "30.0\n1.0\n").replace("50 -70 300", "50.0 -70.000 3.00e2"),
    "counts-as-floats": PLAIN.replace("0.1\n1\n", "0.1\n1.0\n").replace("0.2\n1\n", "0.2\n10e-1\n"),
}

finite = st.floats(allow_nan=False, allow_infinity=False)
triples = st.tuples(finite, finite, finite)
spheres = st.builds(Sphere, triples, triples, finite.map(abs).filter(bool), finite, finite)
planes = st.builds(Plane, triples, triples, triples.filter(any), finite, finite)
scenes = st.builds(
    Scene, triples, finite, st.lists(spheres, max_size=4).map(tuple), st.lists(planes, max_size=4).map(tuple)
)


def with_line(number: int, text: str) -> str:
    return "\n".join([*LINES[: number - 1], text, *LINES[number:]])


@pytest.mark.parametrize("text", SPELLINGS.values(), ids=SPELLINGS)
def test_every_spelling_is_read(text: str, tmp_path: Path) -> None:
    file = tmp_path / "scene.txt"
    file.write_bytes(text.encode())
    assert load(file) == load(str(file)) == Scene.load(file) == parse(text.encode()) == SCENE


def test_text_without_a_byte_order_mark_may_be_a_string() -> None:
    assert parse(PLAIN) == SCENE


def test_standard_input_is_read(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(PLAIN.encode())))
    assert load("-") == SCENE


@pytest.mark.parametrize(
    ("spelling", "value"),
    [
        (".5", 0.5),
        ("5.", 5.0),
        ("-.5", -0.5),
        ("+1", 1.0),
        ("1e2", 100.0),
        ("1E2", 100.0),
        ("1.e+2", 100.0),
        ("1e-2", 0.01),
        ("007", 7.0),
        ("4.9e-324", 5e-324),
        ("1e-999", 0.0),
        ("1.7976931348623157e308", sys.float_info.max),
        ("0." + "0" * 400 + "1e401", 1.0),
    ],
)
def test_every_number_is_read(spelling: str, value: float) -> None:
    assert parse(with_line(5, f"0 {spelling} 0")).spheres[0].centre == (0.0, value, 0.0)


def test_negative_zero_is_kept() -> None:
    scene = parse(with_line(5, "-0 0 -0.0"))
    assert [math.copysign(1, value) for value in scene.spheres[0].centre] == [-1, 1, -1]
    assert "\n-0.0 0 -0.0\n" in dump(scene)


@pytest.mark.parametrize("counts", [("0", "0"), ("0.0", "-0"), ("0e5", "+0")])
def test_an_empty_scene_is_read(counts: tuple[str, str]) -> None:
    assert parse("0 0 0\n1\n{}\n{}".format(*counts)) == Scene((0.0, 0.0, 0.0), 1.0)


@given(scenes)
@example(Scene((-0.0, 5e-324, sys.float_info.max), -0.0))
def test_a_dumped_scene_reads_back_equal(scene: Scene) -> None:
    text = dump(scene)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SceneWarning)
        again = parse(text)
    assert again == scene
    assert repr(again.ambient) == repr(scene.ambient)
    assert dump(again) == text


@pytest.mark.parametrize("number", [1, 4, 10])
@pytest.mark.parametrize(("text", "columns"), [("-1 0 255", [1]), ("0 255.5 1", [3]), ("\t-1\t256  1e9", [2, 5, 10])])
def test_unusual_colours_warn(number: int, text: str, columns: list[int]) -> None:
    with pytest.warns(SceneWarning) as caught:
        parse(with_line(number, text), "some scene.txt")
    messages = [str(warning.message) for warning in caught]
    assert [message[: message.index(": ")] for message in messages] == [
        f"some scene.txt:{number}:{column}" for column in columns
    ]
    assert all(message.endswith(" is outside 0..255") for message in messages)


@pytest.mark.parametrize("number", [2, 7, 8, 13, 14])
@pytest.mark.parametrize(("text", "column"), [("-0.001", 1), ("  1.0001", 3)])
def test_unusual_coefficients_warn(number: int, text: str, column: int) -> None:
    with pytest.warns(SceneWarning) as caught:
        parse(with_line(number, text), "some scene.txt")
    (message,) = [str(warning.message) for warning in caught]
    assert message.startswith(f"some scene.txt:{number}:{column}: ")
    assert message.endswith(f"{float(text)} is outside 0..1")


def test_a_warning_counts_blank_lines_and_all_line_ends() -> None:
    with pytest.warns(SceneWarning, match=r"^<text>:5:3: "):
        parse("\ufeff\r\r\n0 0 0\n\r  2\r0\r\n0".encode())


@pytest.mark.parametrize("name", ["example1", "example2", "example3", "example4", "diagnostic/near_cross"])
def test_ordinary_scenes_do_not_warn(name: str) -> None:
    load(SCENES / f"{name}.txt")


def test_the_limits_do_not_warn() -> None:
    parse("0 255 255.0\n1\n0\n1\n0 0 255\n0 0 0\n0 0 1\n0\n1.0")


def test_surfaces_know_their_lines() -> None:
    twice = parse("0 0 0\r\n0\n\n2\n" + "\n".join(LINES[3:8] * 2) + "\r\r2\n" + "\n".join([*LINES[9:], "", *LINES[9:]]))
    assert [sphere.lines for sphere in twice.spheres] == [(5, 9), (10, 14)]
    assert [plane.lines for plane in twice.planes] == [(17, 21), (23, 27)]


@pytest.mark.parametrize("size", [5e-324, 1e-308, 1e-200, 1.0, 3.0, 1e200, 1.7e308])
@pytest.mark.parametrize("direction", [(1, 0, 0), (0, 0, -1), (1, -1, 0), (1, 1, -1)])
def test_normals_of_any_length_become_unit(direction: Triple, size: float) -> None:
    length = math.hypot(*direction)
    normal = (direction[0] * size, direction[1] * size, direction[2] * size)
    assert Plane(SCENE.ambient, SCENE.ambient, normal, 1, 0).unit_normal == pytest.approx(
        [value / length for value in direction], abs=0, rel=1e-15
    )


def test_a_normal_may_span_all_magnitudes() -> None:
    assert Plane(SCENE.ambient, SCENE.ambient, (5e-324, -1e308, 0.0), 1, 0).unit_normal == (0.0, -1.0, 0.0)


@pytest.mark.parametrize("normal", [(0.0, 0.0, 3.0), (1.0, -2.0, 3.0), (1e-300, 1e-300, -2e-300), (1.0, 1e-9, 0.0)])
def test_tangents_and_normal_are_a_right_handed_basis(normal: tuple[float, float, float]) -> None:
    plane = Plane(SCENE.ambient, SCENE.ambient, normal, 1, 0)
    basis = np.array([*plane.tangents, plane.unit_normal])
    assert basis @ basis.T == pytest.approx(np.eye(3), abs=1e-15)
    assert np.linalg.det(basis) == pytest.approx(1)


def test_of_twin_spheres_the_first_stays() -> None:
    first, other = Sphere((1, 2, 3), (0, 0.1, 300), 5, 1, 0), Sphere((9, 9, 9), (-0.0, 0.1, 3e2), 5.0, 0, 1)
    larger, moved = Sphere((1, 2, 3), (0, 0.1, 300), 6, 1, 0), Sphere((1, 2, 3), (0, 0.2, 300), 5, 1, 0)
    merged = merge_coincident(Scene((0, 0, 0), 0, (first, larger, other, moved, first)))
    assert merged == Scene((0, 0, 0), 0, (first, larger, moved))


@pytest.mark.parametrize(
    ("points", "normals", "kept"),
    [
        pytest.param([(0, 1, -1), (7, -5, 5)], [(0, 1, 1), (0, 3, 3)], 1, id="other-length-and-point"),
        pytest.param([(0, -100, 0), (3, -100, 8)], [(0, 1, 0), (0, -1, 0)], 1, id="opposite"),
        pytest.param([(0, 0, 0), (0, 0, 0)], [(0.1, 0.2, 0.3), (1, 2, 3)], 1, id="decimal-normals"),
        pytest.param([(0.1, 0.2, 0), (0.3, 0, 0)], [(1, 1, 0), (1, 1, 0)], 1, id="decimal-sum"),
        pytest.param([(0.1 + 0.2, 0, 0), (0.3, 0, 0)], [(1, 1, 0), (1, 1, 0)], 2, id="float-sum"),
        pytest.param([(1, 1e-17, 0), (1, 0, 0)], [(1, 1, 0), (1, 1, 0)], 2, id="apart-by-less-than-rounding"),
        pytest.param([(0, 0, 0), (0, 0, 0)], [(1, 1e-300, 0), (1, 0, 0)], 2, id="tilted-by-less-than-rounding"),
        pytest.param([(0, 1, 0), (0, -1, 0)], [(0, 1, 0), (0, -1, 0)], 2, id="parallel"),
    ],
)
def test_planes_merge_when_exactly_coincident(points: list[Triple], normals: list[Triple], kept: int) -> None:
    listed = tuple(Plane((i, i, i), point, normals[i], 1, 0) for i, point in enumerate(points))
    assert merge_coincident(Scene((0, 0, 0), 0, (), listed)).planes == listed[:kept]
