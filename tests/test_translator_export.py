"""The files that the adapters write, with no renderer run.

The expected files are checked by hand against their scenes. After a change on purpose, write them anew with
`CROSSRAY_REFRESH=1 python -m pytest tests/test_translator_export.py` and read the difference before keeping it.
"""

import json
import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import pytest
from helpers import EXAMPLE, EXPECTED, NUMBER, TRICKY, expect_text, scene_of
from hypothesis import given
from hypothesis import strategies as st

from reference import Plane, Scene, Sphere
from reference.text import dump, parse
from translator.contract import PYTHON, Settings, Unsupported
from translator.registry import adapter, renderer_names

SCENES = {"example1": EXAMPLE.read_text(encoding="utf-8"), "tricky": TRICKY}
WRITTEN = {"povray": ("scene.pov", ".pov"), "mitsuba": ("scene.xml", ".xml")}
SETTINGS = Settings(64, 48, 3)
pytestmark = pytest.mark.filterwarnings("ignore::reference.errors.SceneWarning")
PURE = """
import json, os, sys
from dataclasses import asdict
from reference.text import parse
from translator.contract import Settings, Unsupported
from translator.registry import adapter, renderer_names

touched = []

def exported(renderer):
    try:
        return asdict(renderer.export(scene, Settings(64, 48, 3)))
    except Unsupported as refusal:
        return str(refusal)

def watch(event, arguments):
    if event == "open":
        name, mode, flags = arguments
        if flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT):
            touched.append(name)
    elif event.partition(".")[0] in ("subprocess", "shutil", "tempfile", "socket") or event in (
        "os.mkdir", "os.remove", "os.rename", "os.system", "os.exec", "os.fork", "os.posix_spawn"
    ):
        touched.append(event)

scene = parse(sys.stdin.read())
adapters = {name: adapter(name) for name in renderer_names()}
sys.addaudithook(watch)
exports = {name: exported(renderer) for name, renderer in adapters.items()}
again = {name: exported(renderer) for name, renderer in adapters.items()}
assert not touched, touched
assert exports == again
assert not {"mitsuba", "drjit"} & set(sys.modules)
print(json.dumps(exports))
"""


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("renderer", WRITTEN)
def test_export_is_as_expected(renderer: str, scene: str) -> None:
    name, ending = WRITTEN[renderer]
    text = adapter(renderer).export(parse(SCENES[scene]), SETTINGS).files[name]
    expect_text(scene + ending, text)


@pytest.mark.parametrize("name", renderer_names())
def test_command_and_picture_belong_to_the_export(name: str) -> None:
    exported = adapter(name).export(parse(SCENES["example1"]), Settings(64, 64, 3))
    assert exported.command[0] in (PYTHON, name)
    assert all(Path(file).parts == (file,) and text.endswith("\n") for file, text in exported.files.items())
    assert exported.image not in exported.files
    assert any(Path(exported.image).stem in word for word in exported.command)


def test_native_export_reads_back_as_the_same_scene() -> None:
    scene = parse(TRICKY)
    assert parse(adapter("native").export(scene, SETTINGS).files["scene.txt"]) == scene


def test_mitsuba_export_brings_its_integrator() -> None:
    program = adapter("mitsuba").export(parse(TRICKY), SETTINGS).files["whitted.py"]
    compile(program, "whitted.py", "exec")
    assert "class Whitted(mi.SamplingIntegrator)" in program


@pytest.mark.parametrize("scene", SCENES.values(), ids=SCENES)
def test_exports_are_pure_and_deterministic(scene: str, tmp_path: Path) -> None:
    outputs = []
    for seed in ("0", "1"):
        result = subprocess.run(
            [sys.executable, "-B", "-c", PURE],
            input=scene,
            env={"PATH": "/nonexistent", "PYTHONHASHSEED": seed, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=False,
        )
        assert result.returncode == 0, result.stderr
        outputs.append(result.stdout)
    assert outputs[0] == outputs[1]
    assert set(json.loads(outputs[0])) == set(renderer_names())
    assert not list(tmp_path.iterdir())


def ball(x: float, y: float, z: float, radius: float) -> Sphere:
    return Sphere((255, 0, 0), (x, y, z), radius, 1, 0)


def wall(height: float, y: float = 1.0) -> Plane:
    return Plane((255, 0, 0), (0, height, 0), (0, y, 0), 1, 0)


def mirror(x: float) -> Sphere:
    return replace(ball(x, 0, 300, 10), reflection=0.5)


NEAR, FLOOR = ball(0, 0, 300, 10), wall(-100)
REFUSED = {
    "povray depth": ("povray", scene_of(), 256, "POV-Ray follows at most 255 bounces, not 256"),
    "povray sphere": (
        "povray",
        scene_of(NEAR, ball(0, 0, 1e8, 1)),
        3,
        "POV-Ray sees nothing beyond 1e+08: sphere 2 reaches farther",
    ),
    "povray plane": (
        "povray",
        scene_of(FLOOR, wall(-1.1e5, -2)),
        3,
        "POV-Ray sees nothing beyond 1e+08, where rays along plane 2 would meet it",
    ),
    "mitsuba depth": (
        "mitsuba",
        scene_of(),
        17,
        "Mitsuba's single precision is too coarse for 17 bounces (at most 16)",
    ),
    "mitsuba many mirrors": (
        "mitsuba",
        scene_of(*(mirror(30 * place) for place in range(20))),
        6,
        "Mitsuba's single precision is too coarse for 6 bounces between 20 mirroring spheres (at most 5)",
    ),
    "mitsuba sphere too far": (
        "mitsuba",
        scene_of(NEAR, ball(0, -1e6, 0, 1)),
        3,
        "Mitsuba's single precision is too coarse beyond 1e+06: sphere 2 reaches farther",
    ),
    "mitsuba plane too far": (
        "mitsuba",
        scene_of(FLOOR, wall(-2e4, -0.5)),
        3,
        "Mitsuba's single precision is too coarse beyond 10000: plane 2 is 20000 from the eye",
    ),
    "mitsuba radius": (
        "mitsuba",
        scene_of(NEAR, ball(0, 0, 3000, 2001)),
        3,
        "Mitsuba's single precision is too coarse for a radius over 2000: sphere 2 has 2001",
    ),
    "mitsuba sphere at the light": (
        "mitsuba",
        scene_of(NEAR, ball(500, 500, 600, 100.25)),
        3,
        "Mitsuba's single precision is too coarse within 25 of the light: sphere 2 passes at 0.25",
    ),
    "mitsuba plane at the light": (
        "mitsuba",
        scene_of(FLOOR, wall(499.75, 7)),
        3,
        "Mitsuba's single precision is too coarse within 1 of the light: plane 2 passes at 0.25",
    ),
    "mitsuba plane on the screen": (
        "mitsuba",
        scene_of(FLOOR, Plane((9, 9, 9), (7, 7, 100), (0, 0, -2), 1, 0)),
        3,
        "Mitsuba's single precision is too coarse to tell plane 2 from the screen",
    ),
    "mitsuba spheres too alike": (
        "mitsuba",
        scene_of(NEAR, ball(5, 5, 300, 10), ball(1e-4, 0, 300, 10)),
        3,
        "Mitsuba's single precision is too coarse to tell sphere 1 from sphere 3",
    ),
    "mitsuba planes too alike": (
        "mitsuba",
        scene_of(FLOOR, wall(-100.0001, -3)),
        3,
        "Mitsuba's single precision is too coarse to tell plane 1 from plane 2",
    ),
    "mitsuba colour": (
        "mitsuba",
        scene_of(Sphere((1e30, 0, 0), (0, 0, 300), 10, 1, 0)),
        3,
        "single precision cannot keep apart colours and coefficients as far from 1 as 3.28965e+34",
    ),
    "povray negative coefficient": (
        "povray",
        scene_of(NEAR, Sphere((9, 9, 9), (0, 0, 400), 10, 1, -0.5)),
        3,
        "POV-Ray ignores negative coefficients: sphere 2 has one",
    ),
    "povray sphere at the light": (
        "povray",
        scene_of(NEAR, ball(500, 500, 600, 100)),
        3,
        "POV-Ray decides by rounding whether sphere 2 hides the light, which lies on it",
    ),
    "povray colour": (
        "povray",
        scene_of(Sphere((0, 1e-40, 0), (0, 0, 300), 10, 1, 0)),
        3,
        "single precision cannot keep apart colours and coefficients as far from 1 as 1e-40",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_carried_is_refused_with_the_reason(case: str) -> None:
    renderer, scene, depth, reason = REFUSED[case]
    with pytest.raises(Unsupported) as refusal:
        adapter(renderer).export(scene, Settings(64, 48, depth))
    assert str(refusal.value) == reason


@pytest.mark.parametrize(
    ("renderer", "scene", "depth"),
    [
        ("povray", scene_of(ball(0, 0, 9.9e7, 1), wall(-9.9e4)), 255),
        (
            "mitsuba",
            scene_of(ball(0, 0, 3000, 2000), ball(500, 500, 600, 70), mirror(0), mirror(50), wall(-1e4), wall(499)),
            16,
        ),
    ],
)
def test_what_is_just_within_the_limits_is_carried(renderer: str, scene: Scene, depth: int) -> None:
    adapter(renderer).export(scene, Settings(64, 48, depth))


@pytest.mark.parametrize("renderer", WRITTEN)
def test_refusal_counts_surfaces_as_the_file_does(renderer: str) -> None:
    twin = ball(0, 0, 300, 10)
    with pytest.raises(Unsupported, match="sphere 3 "):
        adapter(renderer).export(scene_of(NEAR, twin, ball(0, 0, 1e9, 1)), SETTINGS)


numbers = st.floats(-1e5, 1e5)
triples = st.tuples(numbers, numbers, numbers)
spheres = st.builds(Sphere, triples, triples, st.floats(1e-9, 1e3), numbers, numbers)
planes = st.builds(Plane, triples, triples, triples.filter(any), numbers, numbers)
scenes = st.builds(
    Scene, triples, numbers, st.lists(spheres, max_size=3).map(tuple), st.lists(planes, max_size=3).map(tuple)
)


@pytest.mark.parametrize("renderer", WRITTEN)
@given(scene=scenes)
def test_only_numbers_of_a_scene_reach_the_file(renderer: str, scene: Scene) -> None:
    name, ending = WRITTEN[renderer]
    try:
        text = adapter(renderer).export(scene, SETTINGS).files[name]
    except Unsupported:
        return
    known = (EXPECTED / f"tricky{ending}").read_text(encoding="utf-8")
    assert set(NUMBER.sub("#", text).splitlines()) <= set(NUMBER.sub("#", known).splitlines())
    if renderer == "mitsuba":
        shapes = ElementTree.fromstring(text).findall("shape")
        assert len({shape.get("id") for shape in shapes}) == len(shapes)


@given(scene=scenes)
def test_native_export_holds_nothing_but_numbers(scene: Scene) -> None:
    text = adapter("native").export(scene, SETTINGS).files["scene.txt"]
    assert text == dump(scene)
    assert re.fullmatch(r"[0-9eE+\-. \n]+", text)


@pytest.mark.parametrize("renderer", WRITTEN)
def test_numbers_that_overflow_do_not_become_words(renderer: str) -> None:
    huge = Scene((1e308, 0, 0), 1e10, (Sphere((1e308, 0, 0), (0, 0, 300), 40, 1e10, 1e308),))
    try:
        text = adapter(renderer).export(huge, SETTINGS).files[WRITTEN[renderer][0]]
    except Unsupported:
        return
    assert re.findall(r".*\b(?:inf|nan)\b.*", text) == []
