"""Mitsuba with its own plugins alone: the scene files, what is refused, and the real thing.

The expected files are checked by hand against their scenes. After a change on purpose, write them anew with
`CROSSRAY_REFRESH=1 python -m pytest tests/test_translator_mitsuba_stock.py` and read the difference before keeping it.
"""

import re
import subprocess
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path
from xml.etree import ElementTree

import helpers
import pytest
from helpers import EXAMPLE, EXPECTED, NUMBER, TRICKY, exact, expect_text, need_module, pixels_over, rendered
from hypothesis import given
from hypothesis import strategies as st

from reference import Plane, Scene, Sphere
from reference.text import dump, parse
from translator.contract import PYTHON, Settings, Unsupported
from translator.renderers.mitsuba_stock import export

SETTINGS = Settings(64, 64, 3)
XML = ("ambient.xml", "light.xml", "scene.xml")
pytestmark = pytest.mark.filterwarnings("ignore::reference.errors.SceneWarning")
scene_of = partial(helpers.scene_of, ambient=(255, 128, 0))


def ball(x: float, y: float, z: float, radius: float, reflection: float = 0, diffuse: float = 1) -> Sphere:
    return Sphere((255, 90, 0), (x, y, z), radius, diffuse, reflection)


def wall(x: float, y: float, z: float, *normal: float, diffuse: float = 1, reflection: float = 0) -> Plane:
    a, b, c = normal
    return Plane((80, 255, 90), (x, y, z), (a, b, c), diffuse, reflection)


FLOOR, BALL = wall(0, -100, 0, 0, 1, 0, reflection=0.5), ball(0, 0, 300, 40, 0.5)
# The tricky scene with its wall unlit, which is seen from the back, and its floor below the screen.
CARRIED = TRICKY.replace("0.5\n0.75\n", "0\n0.75\n").replace("0 -20 0\n0 1 0\n", "0 -100 0\n0 3 0\n")
SCENES = {"example1": EXAMPLE.read_text(encoding="utf-8"), "tricky": CARRIED}


def files_of(scene: Scene) -> dict[str, str]:
    return dict(export(scene, SETTINGS).files)


@pytest.mark.parametrize("file", XML)
@pytest.mark.parametrize("name", SCENES)
def test_export_is_as_expected(name: str, file: str) -> None:
    text = files_of(parse(SCENES[name]))[file]
    expect_text(f"{name}-stock-{file}", text)


@pytest.mark.parametrize("file", XML[:2])
def test_the_assignments_own_text_is_in_the_comments(file: str) -> None:
    text = files_of(parse(CARRIED))[file]
    assert dump(parse(CARRIED)).splitlines() == re.findall(r"(?m)^     (-?\d[-\d. e+]*)$", text)
    assert f"Run: mitsuba -m scalar_rgb {' '.join(XML)}\n" in text


def test_the_command_runs_the_program_that_comes_along() -> None:
    exported = export(parse(CARRIED), Settings(64, 64, 3, threads=5))
    assert exported.command == (PYTHON, "draw.py", *XML, "--threads", "5")
    compile(exported.files["draw.py"], "draw.py", "exec")


@pytest.mark.parametrize(("file", "depth"), [(XML[0], "4"), (XML[1], "5"), (XML[2], "2")])
def test_bounces(file: str, depth: str) -> None:
    limit = ElementTree.fromstring(files_of(parse(CARRIED))[file]).find("integrator/integer[@name='max_depth']")
    assert limit is not None
    assert limit.get("value") == depth


BOTH = "Mitsuba's emitters have one side: {} meets the screen, so that both its sides are seen"
BACK = "Mitsuba's materials have one side: {} is seen from its back and lit in front"
SHORT = "Mitsuba's shadow rays end short of the light: {} passes it at {}"
COARSE = "Mitsuba's single precision is too coarse {}"
REFUSED = {
    "plane that cuts the screen": (scene_of(BALL, wall(0, -40, 0, 0, 1, 0)), BOTH.format("plane 1")),
    "plane on the screen": (scene_of(FLOOR, wall(7, 7, 100, 0, 0, 2)), BOTH.format("plane 2")),
    "sphere that cuts the screen": (scene_of(BALL, ball(50, 0, 100, 9)), BOTH.format("sphere 2")),
    "sphere around a corner": (scene_of(ball(-60, 60, 100, 15)), BOTH.format("sphere 1")),
    "plane lit in front": (scene_of(FLOOR, wall(0, 200, 0, 0, 1, 0)), BACK.format("plane 2")),
    "sphere around the eye": (scene_of(ball(0, 0, 0, 200)), BACK.format("sphere 1")),
    "sphere on the light": (scene_of(ball(500, 500, 600, 100)), SHORT.format("sphere 1", "0")),
    "plane near the light": (scene_of(wall(0, 0, 509, 0, 0, -1)), SHORT.format("plane 1", "9")),
    "sphere too far": (scene_of(BALL, ball(0, 0, 1e6, 9)), COARSE.format("beyond 1e+06: sphere 2 reaches farther")),
    "sphere too large": (scene_of(ball(0, 0, 9e3, 2001)), COARSE.format("for a radius over 2000: sphere 1 has 2001")),
    "colour": (
        scene_of(replace(BALL, colour=(1e30, 0, 0))),
        "single precision cannot keep apart colours and coefficients as far from 1 as 3.90625e+26",
    ),
}
KEPT = {
    "light on a plane": scene_of(BALL, wall(0, 0, 500, 0, 0, -1)),
    "sphere beside the screen": scene_of(ball(-60, 60, 100, 14)),
    "eye and light in a sphere": scene_of(BALL, ball(0, 0, 0, 1500)),
    "eye in a matte black sphere": scene_of(ball(0, 0, 0, 200, diffuse=0)),
    "nothing": scene_of(),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_carried_is_refused_with_the_reason(case: str) -> None:
    scene, reason = REFUSED[case]
    with pytest.raises(Unsupported) as refusal:
        export(scene, SETTINGS)
    assert str(refusal.value) == reason


def test_bounces_between_mirroring_spheres() -> None:
    for count, deepest in ((2, 8), (19, 8), (20, 5)):
        balls = scene_of(*(ball(90 * place, 0, 300, 40, 0.5) for place in range(count)))
        reason = f"too coarse for {deepest + 1} bounces between {count} mirroring spheres .at most {deepest}."
        with pytest.raises(Unsupported, match=reason):
            export(balls, replace(SETTINGS, depth=deepest + 1))
        export(balls, replace(SETTINGS, depth=deepest))
    export(scene_of(BALL, FLOOR), replace(SETTINGS, depth=50))


def test_pixels_are_square() -> None:
    with pytest.raises(Unsupported, match="a square screen needs a square picture"):
        export(scene_of(), Settings(64, 48))


@pytest.mark.parametrize("case", KEPT)
def test_what_is_just_within_the_limits_is_carried(case: str) -> None:
    export(KEPT[case], SETTINGS)


numbers = st.floats(-1e5, 1e5)
triples = st.tuples(numbers, numbers, numbers)
# Most of them behind the screen and below it, so that few are refused.
centres = st.tuples(numbers, numbers, st.floats(1200, 1e5))
points = st.tuples(numbers, st.floats(-1e5, -200), numbers)
normals = st.tuples(st.floats(-1e-4, 1e-4), st.floats(1e-3, 1e5), st.floats(-1e-4, 1e-4))
spheres = st.builds(Sphere, triples, centres, st.floats(1e-9, 1e3), numbers, numbers)
planes = st.builds(
    Plane, triples, st.one_of(points, triples), st.one_of(normals, triples.filter(any)), numbers, numbers
)
scenes = st.builds(
    Scene, triples, numbers, st.lists(spheres, max_size=3).map(tuple), st.lists(planes, max_size=3).map(tuple)
)


@given(scene=scenes)
def test_only_numbers_of_a_scene_reach_the_files(scene: Scene) -> None:
    try:
        files = files_of(scene)
    except Unsupported:
        return
    for file in XML:
        known = "".join((EXPECTED / f"{name}-stock-{file}").read_text(encoding="utf-8") for name in SCENES)
        lines = NUMBER.sub("#", files[file]).replace('value="true"', 'value="false"').splitlines()
        expected = NUMBER.sub("#", known).replace('value="true"', 'value="false"').splitlines()
        assert {line.strip() for line in lines} <= {line.strip() for line in expected}
        shapes = [shape.get("id") for shape in ElementTree.fromstring(files[file]).findall("shape") if shape.get("id")]
        assert len(set(shapes)) == len(shapes)


@pytest.mark.parametrize("case", [*SCENES, *KEPT])
def test_real_pictures_agree(case: str) -> None:
    need_module("mitsuba")
    scene = parse(SCENES[case]) if case in SCENES else KEPT[case]
    picture, outcome = rendered("mitsuba-stock", scene, Settings(90, 90, 3, threads=1))
    assert outcome.version is not None
    assert outcome.version[0] in "3456789"
    assert pixels_over(exact(scene, 90, 90), picture, 0.5) <= 3


def test_a_failure_of_the_command_is_the_programs(tmp_path: Path) -> None:
    need_module("mitsuba")
    program = files_of(parse(CARRIED))["draw.py"]
    command = [sys.executable, "-c", program, "missing.xml", "--threads", "1"]
    ended = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False)
    assert ended.returncode != 0
    assert "missing.xml" in ended.stdout
    assert "traced in" not in ended.stdout
