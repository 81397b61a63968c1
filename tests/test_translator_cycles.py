"""Blender Cycles: the script, what is refused, and the real thing.

The expected files are checked by hand against their scenes. After a change on purpose, write them anew with
`CROSSRAY_REFRESH=1 python -m pytest tests/test_translator_cycles.py` and read the difference before keeping it.
"""

import ast
import re
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
from helpers import EXAMPLE, EXPECTED, NUMBER, exact, expect_text, pixels_over, rendered, scene_of
from hypothesis import given
from hypothesis import strategies as st

from reference import EXACT, Plane, Scene, Sphere, render
from reference.image import Picture
from reference.text import dump, parse
from translator.contract import PYTHON, Settings, Unsupported
from translator.renderers.cycles import export

ROOT = Path(__file__).parent.parent
SETTINGS = Settings(64, 48, 3)
pytestmark = pytest.mark.filterwarnings("ignore::reference.errors.SceneWarning")

# Coloured ambient; colours over 255; kr > 1; a sphere before the screen and a twin that vanishes; a wall lit from the
# side that the eye does not see; a floor that the screen cuts; planes that hold the light or the eye or are the screen.
TRICKY = """\
10 200 90
0.3
3
300 0 40
5 5 90
8
0.5
0.25
0 255 0
0 0 300
40
1
1.5
0 0 255
0 0 300
40
0.2
0
5
200 100 50
0 0 400
0 3000 4000
0.5
0.75
60 70 80
0 -20 0
0 1 0
1
0.1
60 70 80
500 500 500
0 0 -2
1
0.1
60 170 80
0 0 0
1 1 0
1
0.1
160 70 80
7 7 100
0 0 -3
1
0
"""
SCENES = {"example1": EXAMPLE.read_text(encoding="utf-8"), "cycles": TRICKY}


def text_of(scene: Scene, settings: Settings = SETTINGS) -> str:
    return export(scene, settings).files["scene.py"]


def calls(text: str) -> dict[str, list[dict[str, Any]]]:
    """The keyword arguments of the calls at the end of a script, by function."""
    found: dict[str, list[dict[str, Any]]] = {"sphere": [], "plane": []}
    for node in ast.parse(text).body:
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Call) and isinstance(node.value.func, ast.Name):
            values = {keyword.arg or "": ast.literal_eval(keyword.value) for keyword in node.value.keywords}
            values |= {"name": ast.literal_eval(node.value.args[0])} if node.value.args else {}
            found.setdefault(node.value.func.id, []).append(values)
    return found


@pytest.mark.parametrize("name", SCENES)
def test_export_is_as_expected(name: str) -> None:
    text = text_of(parse(SCENES[name]))
    expect_text(f"{name}.py.txt", text)


@pytest.mark.parametrize("name", SCENES)
def test_the_assignments_own_text_is_in_the_comments(name: str) -> None:
    scene = parse(SCENES[name])
    comments = [line.removeprefix("#   ") for line in text_of(scene).splitlines() if re.match(r"#   -?\d", line)]
    assert "\n".join(comments) + "\n" == dump(scene)


def test_the_command_is_in_the_header() -> None:
    exported = export(parse(TRICKY), SETTINGS)
    assert exported.command == (PYTHON, "scene.py", exported.image)
    assert f"# Run: {' '.join(exported.command)}\n" in exported.files["scene.py"]


def test_the_script_builds_the_scene_and_draws_it() -> None:
    found = calls(text_of(parse(TRICKY)))
    assert list(found) == ["sphere", "plane", "studio", "render"]
    assert found["studio"] == [{"width": 64, "height": 48, "bounces": 3, "threads": 2}]
    assert [sphere["name"] for sphere in found["sphere"]] == ["sphere 1", "sphere 2"]
    assert found["sphere"][0]["centre"] == (5, 5, 90)
    assert found["sphere"][1]["reflection"] == 1.5
    assert found["sphere"][1]["emitted"] == (0, 200 * 0.3 / 256, 0, 1)
    assert found["plane"][0]["foot"] == pytest.approx((0, 192, 256))
    assert [plane.get("shadow", True) for plane in found["plane"]] == [True, True, False, True, True]
    assert [plane.get("seen", True) for plane in found["plane"]] == [True, True, True, False, False]


def test_one_view_layer_is_enough_without_mirrors() -> None:
    assert calls(text_of(scene_of(BALL, FLOOR)))["studio"][0]["bounces"] == 0
    assert calls(text_of(scene_of(BALL, FLOOR), Settings(64, 48, 10**6)))["studio"][0]["bounces"] == 0


def ball(x: float, y: float, z: float, radius: float, reflection: float = 0) -> Sphere:
    return Sphere((255, 0, 0), (x, y, z), radius, 1, reflection)


BALL, MIRROR = ball(0, 0, 300, 10), ball(0, 0, 300, 10, 0.5)
FLOOR = Plane((255, 0, 0), (0, -100, 0), (0, 1, 0), 1, 0)
INSIDE = "Cycles' spheres have no inside: rays of the camera, from the screen, start in {}"
NEGATIVE = "Cycles takes negative light for none: {} brings some"
FAINT = "Cycles leaves out what is fainter than 1e-05: {} has such a coefficient"
REFUSED = {
    "depth": (
        scene_of(MIRROR),
        Settings(64, 64, 25),
        "Cycles' single precision is too coarse for 25 bounces (at most 24)",
    ),
    "small": (scene_of(BALL), Settings(64, 3), "Blender's pictures have at least 4x4 pixels"),
    "narrow": (
        scene_of(BALL),
        Settings(1001, 5),
        "Blender's pixels are at most 200 times as wide as high, or as high as wide",
    ),
    "eye in a sphere": (scene_of(BALL, ball(0, 0, 0, 300)), SETTINGS, INSIDE.format("sphere 2")),
    "sphere across the screen": (scene_of(ball(10, 0, 100, 5)), SETTINGS, INSIDE.format("sphere 1")),
    "sphere at the screen's corner": (scene_of(ball(60, 60, 100, 15.5)), SETTINGS, INSIDE.format("sphere 1")),
    "many mirrors": (
        scene_of(*(ball(9 * place, 0, 300, 4, 0.5) for place in range(20))),
        Settings(64, 48, 6),
        "Cycles' single precision is too coarse for 6 bounces between 20 mirroring spheres (at most 5)",
    ),
    "mirrors that meet on a line through the eye": (
        scene_of(
            FLOOR, replace(FLOOR, point=(9, 0, 9)), replace(FLOOR, point=(0, 0, 0), normal=(1, 0, 0), reflection=1)
        ),
        SETTINGS,
        "Cycles decides by rounding what mirrors show on the line through the eye where plane 2 and plane 3 meet",
    ),
    "spheres too alike": (
        scene_of(BALL, ball(5, 5, 300, 10), ball(1e-4, 0, 300, 10)),
        SETTINGS,
        "Cycles' single precision is too coarse to tell sphere 1 from sphere 3",
    ),
    "planes too alike": (
        scene_of(FLOOR, Plane((9, 9, 9), (0, -100.0001, 0), (0, -3, 0), 1, 0)),
        SETTINGS,
        "Cycles' single precision is too coarse to tell plane 1 from plane 2",
    ),
    "light on a sphere": (
        scene_of(BALL, ball(500, 500, 600, 100)),
        SETTINGS,
        "Cycles decides by rounding whether sphere 2 hides the light, which lies on it",
    ),
    "far sphere": (
        scene_of(BALL, ball(0, 0, 1e6, 1)),
        SETTINGS,
        "Cycles' single precision is too coarse beyond 1e+06: sphere 2 reaches farther",
    ),
    "large sphere": (
        scene_of(ball(0, 0, 6000, 5001)),
        SETTINGS,
        "Cycles' single precision is too coarse for a radius over 5000: sphere 1 has 5001",
    ),
    "far plane": (
        scene_of(FLOOR, replace(FLOOR, point=(0, -1.1e8, 0))),
        SETTINGS,
        "Cycles sees nothing beyond 5.36871e+08, where rays along plane 2 would meet it",
    ),
    "negative colour": (scene_of(replace(BALL, colour=(9, -1, 9))), SETTINGS, NEGATIVE.format("sphere 1")),
    "negative coefficient": (scene_of(BALL, replace(FLOOR, diffuse=-0.5)), SETTINGS, NEGATIVE.format("plane 1")),
    "negative mirror": (scene_of(replace(BALL, reflection=-0.5)), SETTINGS, NEGATIVE.format("sphere 1")),
    "negative ambient": (replace(scene_of(BALL), ambient=(-1, 0, 0)), SETTINGS, NEGATIVE.format("sphere 1")),
    "faint mirror": (scene_of(MIRROR, replace(FLOOR, reflection=1e-6)), SETTINGS, FAINT.format("plane 1")),
    "faint surface": (scene_of(replace(BALL, diffuse=1e-6)), SETTINGS, FAINT.format("sphere 1")),
    "bright surface": (
        scene_of(replace(BALL, colour=(1e30, 0, 0))),
        SETTINGS,
        "single precision cannot keep apart colours and coefficients as far from 1 as 3.90625e+26",
    ),
}
CARRIED = {
    "deepest": (scene_of(MIRROR), Settings(64, 64, 24)),
    "smallest": (scene_of(BALL), Settings(4, 800)),
    "many mirrors": (scene_of(*[replace(MIRROR, radius=place + 9) for place in range(30)]), SETTINGS),
    "deep mirrors": (scene_of(*[replace(MIRROR, radius=place + 9) for place in range(19)]), Settings(64, 64, 24)),
    "sphere before the screen": (scene_of(ball(10, 0, 94, 5)), SETTINGS),
    "eye in a small sphere": (scene_of(ball(0, 0, 0, 99)), SETTINGS),
    "sphere between pixels": (scene_of(ball(0, 0, 100, 0.5)), SETTINGS),
    "sphere beside the screen": (scene_of(ball(65, 65, 100, 20)), SETTINGS),
    "light in a sphere": (scene_of(ball(500, 500, 500, 300)), SETTINGS),
    "negative twice": (replace(scene_of(replace(BALL, colour=(-9, 0, 0), diffuse=0)), ambient=(-255, 0, 0)), SETTINGS),
    "negative mirror that is not seen": (scene_of(replace(BALL, reflection=-0.5)), Settings(64, 48, 0)),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_carried_is_refused_with_the_reason(case: str) -> None:
    scene, settings, reason = REFUSED[case]
    with pytest.raises(Unsupported) as refusal:
        export(scene, settings)
    assert str(refusal.value) == reason


@pytest.mark.parametrize("case", CARRIED)
def test_what_is_just_within_the_limits_is_carried(case: str) -> None:
    export(*CARRIED[case])


def test_refusal_counts_surfaces_as_the_file_does() -> None:
    with pytest.raises(Unsupported, match="sphere 3 "):
        export(scene_of(BALL, replace(BALL, diffuse=0), ball(0, 0, 1e9, 1)), SETTINGS)


shares, numbers = st.floats(0, 1e3), st.floats(-1e5, 1e5)
triples, colours = st.tuples(numbers, numbers, numbers), st.tuples(shares, shares, shares)
spheres = st.builds(Sphere, colours, triples, st.floats(1e-9, 1e3), shares, shares)
planes = st.builds(Plane, colours, triples, triples.filter(any), shares, shares)
scenes = st.builds(
    Scene, colours, shares, st.lists(spheres, max_size=3).map(tuple), st.lists(planes, max_size=3).map(tuple)
)


@given(scene=scenes)
def test_only_numbers_of_a_scene_reach_the_file(scene: Scene) -> None:
    try:
        text = text_of(scene)
    except Unsupported:
        return
    known = (EXPECTED / "cycles.py.txt").read_text(encoding="utf-8")
    assert set(NUMBER.sub("#", text).splitlines()) <= set(NUMBER.sub("#", known).splitlines())
    assert len(calls(text)["plane"]) <= len(scene.planes)  # it can be read, and holds literals only


def drawn(scene: Scene, width: int, height: int, depth: int = 3) -> Picture:
    """The real thing, which may be missing: no Blender module comes for other Pythons than 3.11."""
    if find_spec("bpy") is None:
        pytest.skip("bpy is not installed")
    picture, outcome = rendered("cycles", scene, Settings(width, height, depth))
    assert outcome.version == "5.0.1"
    return picture


@pytest.mark.parametrize("name", SCENES)
def test_real_pictures_agree(name: str) -> None:
    scene = parse(SCENES[name])
    assert pixels_over(exact(scene, 160, 90), drawn(scene, 160, 90), 0.05) == 0


@pytest.mark.parametrize("name", ["plane_back", "eye_on_plane", "light_on_plane", "near_front"])
def test_real_pictures_agree_in_corners(name: str) -> None:
    scene = Scene.load(ROOT / "scenes" / "diagnostic" / f"{name}.txt")
    assert pixels_over(exact(scene, 80, 80), drawn(scene, 80, 80)) == 0


@pytest.mark.parametrize("depth", [0, 12])
def test_depth_counts_bounces(depth: int) -> None:
    scene = Scene.load(ROOT / "scenes" / "diagnostic" / "facing_mirrors.txt")
    truth = render(scene, EXACT, width=40, height=40, depth=depth)
    assert pixels_over(truth, drawn(scene, 40, 40, depth)) == 0
