"""Tachyon: the scene file, what is refused, and the real thing.

The expected files are checked by hand against their scenes. After a change on purpose, write them anew with
`CROSSRAY_REFRESH=1 python -m pytest tests/test_translator_tachyon.py` and read the difference before keeping it.
"""

import re
import subprocess
import sys
from ctypes import sizeof
from dataclasses import replace
from pathlib import Path

import pytest
from helpers import EXAMPLE, EXPECTED, NUMBER, exact, expect_text, need, pixels_over, rendered, scene_of
from hypothesis import given
from hypothesis import strategies as st

from reference import Plane, Scene, Sphere
from reference.image import Picture, read_image
from reference.text import dump, parse
from translator.contract import PYTHON, Settings, Unsupported
from translator.renderers.tachyon import export
from translator.renderers.tachyon.draw import Colour, Texture, Vector, statements

SETTINGS = Settings(64, 48, 3)
pytestmark = pytest.mark.filterwarnings("ignore::reference.errors.SceneWarning")

# Ambient light without green; colours out of range; kr > 1; coefficients that are negative or under 1/512; a twin that
# vanishes; the light between two walls, of which one is seen from the back, and exactly on a third; a slanting mirror.
TRICKY = """\
10 0 90
0.3
4
300 0 -20
-30 20 300
40
0.5
1.5
0 255 0
-30 20 300
40
0.2
0
-200 -250 -100
45 -30 320
35
-0.8
0
250 250 100
20 60 400
30
0.001
0.5
3
200 100 250
0 0 450
0 3000 4000
0.5
0.75
60 70 80
500 500 500
0 0 -2
1
0.1
60 170 80
-250 -200 0
1 3 0
1
0.4
"""
SCENES = {"example1": EXAMPLE.read_text(encoding="utf-8"), "tachyon": TRICKY}


def text_of(scene: Scene, settings: Settings = SETTINGS) -> str:
    return export(scene, settings).files["scene.dat"]


def shapes_of(scene: Scene) -> list[str]:
    """The first words of the surfaces in a scene file, first listed first."""
    return [kind for kind, fields in statements(text_of(scene)) if "TEXTURE" in fields][::-1]


@pytest.mark.parametrize("name", SCENES)
def test_export_is_as_expected(name: str) -> None:
    text = text_of(parse(SCENES[name]))
    expect_text(f"{name}.dat", text)


@pytest.mark.parametrize("name", SCENES)
def test_the_assignments_own_text_is_in_the_comments(name: str) -> None:
    scene = parse(SCENES[name])
    comments = [line.removeprefix("#   ") for line in text_of(scene).splitlines() if re.match(r"#   -?\d", line)]
    assert "\n".join(comments) + "\n" == dump(scene)


def test_the_command_is_in_the_header() -> None:
    exported = export(parse(TRICKY), SETTINGS)
    assert exported.command[:4] == (PYTHON, "draw.py", "scene.dat", exported.image)
    assert f"# Run: {' '.join(exported.command)}\n" in exported.files["scene.dat"]


def test_the_drawing_program_reads_what_was_written() -> None:
    read = list(statements(text_of(parse(TRICKY))))
    assert [kind for kind, _ in read] == [
        *("BEGIN_SCENE", "RESOLUTION", "SHADER_MODE", "CAMERA", "END_CAMERA", "BACKGROUND", "LIGHT"),
        *("SPHERE", "SPHERE", "SPHERE", "RING", "RING", "PLANE", "STRI", "RING", "END_SCENE"),
    ]
    found = dict(read)
    assert found["RESOLUTION"]["RESOLUTION"] == [64, 48]
    assert found["CAMERA"]["RAYDEPTH"] == [4]
    assert found["CAMERA"]["FRUSTUM"] == [-0.5078125, 0.4921875, -0.5 - 0.5 / 48, 0.5 - 0.5 / 48]
    assert found["SPHERE"]["CENTER"] == [-30, 20, 300]
    assert found["SPHERE"]["SPECULAR"] == [1.5]


def ball(x: float, y: float, z: float, radius: float, reflection: float = 0) -> Sphere:
    return Sphere((255, 0, 0), (x, y, z), radius, 1, reflection)


def wall(
    x: float, y: float, z: float, *normal: float, diffuse: float = 1, reflection: float = 0, side: float = 1
) -> Plane:
    """The plane through a point; without a normal, that from the eye to the point or, with `side` -1, back."""
    a, b, c = normal or (side * x, side * y, side * z)
    return Plane((255, 0, 0), (x, y, z), (a, b, c), diffuse, reflection)


FLOOR, BALL, MIRROR = wall(0, -100, 0, 0, 1, 0), ball(0, 0, 300, 10), ball(0, 0, 300, 10, 0.5)
BEFORE = "Tachyon's camera sees what is before the screen: {} comes into its view there"
WITHIN = "Tachyon darkens spheres seen from within: {}"
GAP = "Tachyon decides by rounding whether {} hides the light, which is {} from it"
REFUSED = {
    "depth": (scene_of(), 4097, "Tachyon follows at most 4096 bounces, not 4097"),
    "sphere before the screen": (scene_of(BALL, ball(10, 0, 60, 5)), 3, BEFORE.format("sphere 2")),
    "sphere on the screen": (scene_of(ball(0, 0, 108, 10)), 3, BEFORE.format("sphere 1")),
    "sphere at the side of the view": (scene_of(ball(50, 0, 80, 9)), 3, BEFORE.format("sphere 1")),
    "sphere at the edge of the view": (scene_of(ball(-50, 50, 80, 11.6)), 3, BEFORE.format("sphere 1")),
    "sphere around the eye only": (scene_of(ball(0, 0, 0, 90)), 3, BEFORE.format("sphere 1")),
    "plane before the screen": (scene_of(FLOOR, wall(0, 0, 60, side=-1)), 3, BEFORE.format("plane 2")),
    "plane that cuts the screen": (scene_of(wall(0, -40, 0, 0, 3, 0)), 3, BEFORE.format("plane 1")),
    "plane on the screen": (scene_of(wall(7, 7, 100, 0, 0, 2)), 3, BEFORE.format("plane 1")),
    "eye in a sphere": (scene_of(ball(0, 0, 0, 200)), 3, WITHIN.format("sphere 1 holds the eye and not the light")),
    "edge toward the eye": (
        scene_of(ball(-50, 0, 300, 60, 0.5), BALL, ball(0, -50, 300, 60)),
        3,
        WITHIN.format("rays may get in at the edge of sphere 1 and sphere 3, which cut each other"),
    ),
    "plane through the eye": (
        scene_of(MIRROR, FLOOR, wall(9, 0, 9, 0, 1, 0)),
        3,
        "Tachyon darkens planes seen from their back: mirrors may show both sides of plane 2",
    ),
    "slanting mirrors face to face": (
        scene_of(wall(300, 0, 300, side=-1, reflection=0.5), wall(-300, 0, -300)),
        3,
        "Tachyon's slanting mirrors end far away: plane 1 shows plane 2 even there",
    ),
    "faint mirror": (
        scene_of(BALL, replace(FLOOR, reflection=0.001)),
        3,
        "Tachyon leaves out reflections under 1/512: plane 1 has 0.001",
    ),
    "negative mirror": (
        scene_of(BALL, ball(0, 0, 400, 10, -0.5)),
        3,
        "Tachyon leaves out reflections under 1/512: sphere 2 has -0.5",
    ),
    "sphere at the light": (scene_of(BALL, ball(500, 500, 600, 100)), 3, GAP.format("sphere 2", "0")),
    "sphere near the light": (scene_of(ball(500, 500, 600, 100.000001)), 3, GAP.format("sphere 1", "1e-06")),
    "plane near the light": (scene_of(wall(0, 500.000001, 0, 0, 1, 0)), 3, GAP.format("plane 1", "1e-06")),
    "sphere too far": (
        scene_of(BALL, ball(0, 0, 1e7, 1)),
        3,
        "Tachyon's rays stray beyond 1e+07: sphere 2 reaches farther",
    ),
    "plane too far": (
        scene_of(FLOOR, wall(0, 0, 1.1e8)),
        3,
        "Tachyon's rays stray beyond 1e+08: plane 2 reaches farther",
    ),
    "colour": (
        scene_of(Sphere((0, 1e-40, 0), (0, 0, 300), 10, 1, 0)),
        3,
        "single precision cannot keep apart colours and coefficients as far from 1 as 3.92157e-43",
    ),
}
CARRIED = {
    "depth": (scene_of(MIRROR), 4096),
    "sphere beside the view": (scene_of(ball(50, 0, 80, 8.9), ball(-50, 50, 80, 11.5), ball(0, 0, 110, 9.9)), 3),
    "sphere behind the eye": (scene_of(ball(0, 0, -50, 49.9), FLOOR), 3),
    "eye in a sphere with the light": (scene_of(ball(0, 0, 0, 900), MIRROR), 3),
    "eye in a matte black sphere": (scene_of(replace(ball(0, 0, 0, 200), diffuse=0), MIRROR), 3),
    "eye in a sphere behind a wall": (scene_of(ball(0, 0, 0, 200), wall(0, 400, 0)), 3),
    "plane beside the view": (scene_of(wall(0, -50.1, 0, 0, 1, 0)), 3),
    "plane through the eye without mirrors": (scene_of(BALL, wall(9, 0, 9, 0, 1, 0)), 3),
    "plane through the eye that is never lit": (scene_of(MIRROR, wall(9, 0, 9, 0, -1, 0)), 3),
    "faint mirror that is not seen": (scene_of(replace(FLOOR, reflection=1e-9)), 0),
    "edge beside the eye": (scene_of(ball(-50, 0, 300, 60, 0.5), ball(50, 0, 300, 60.001)), 3),
    "matte edge toward the eye": (scene_of(ball(-50, 0, 300, 60), ball(50, 0, 300, 60), FLOOR, MIRROR), 3),
    "light on a plane": (scene_of(wall(0, 0, 500, 0, 0, -1)), 3),
    "far away": (scene_of(ball(0, 0, 9e6, 1e5), wall(0, 0, 9.9e7, side=-1)), 3),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_carried_is_refused_with_the_reason(case: str) -> None:
    scene, depth, reason = REFUSED[case]
    with pytest.raises(Unsupported) as refusal:
        export(scene, Settings(64, 64, depth))
    assert str(refusal.value) == reason


@pytest.mark.parametrize("case", CARRIED)
def test_what_is_just_within_the_limits_is_carried(case: str) -> None:
    scene, depth = CARRIED[case]
    export(scene, Settings(64, 64, depth))


def test_a_picture_whose_channels_tachyon_cannot_count_is_refused() -> None:
    with pytest.raises(Unsupported, match=r"^Tachyon draws at most 715827882 pixels, not 715827883$"):
        export(scene_of(BALL), Settings(715827883, 1))
    export(scene_of(BALL), Settings(2 * 3 * 7, 715827882 // 42))


def test_refusal_counts_surfaces_as_the_file_does() -> None:
    with pytest.raises(Unsupported, match="sphere 3 "):
        export(scene_of(BALL, replace(BALL, diffuse=0), ball(0, 0, 60, 5)), SETTINGS)


def test_a_plane_is_a_triangle_where_its_back_is_lit_and_ends_where_it_slants() -> None:
    ceiling = wall(0, 200, 0)
    assert shapes_of(scene_of(FLOOR, ceiling)) == ["PLANE", "STRI"]
    assert shapes_of(scene_of(wall(0, 200, 0, side=-1))) == ["PLANE"]
    assert shapes_of(scene_of(ceiling, wall(200, 0, 0))) == ["PLANE", "PLANE"]  # either is in the other's shadow
    assert shapes_of(scene_of(wall(0, 200, 90))) == ["RING", "STRI"]
    assert shapes_of(scene_of(wall(0, -200, 90, reflection=0.5))) == ["RING", "RING"]
    assert shapes_of(scene_of(wall(0, -200, 90))) == ["PLANE"]


numbers = st.floats(-1e5, 1e5)
triples = st.tuples(numbers, numbers, numbers)
spheres = st.builds(Sphere, triples, triples, st.floats(1e-9, 1e3), numbers, numbers)
planes = st.builds(Plane, triples, triples, triples.filter(any), numbers, numbers)
scenes = st.builds(
    Scene, triples, numbers, st.lists(spheres, max_size=3).map(tuple), st.lists(planes, max_size=3).map(tuple)
)


@given(scene=scenes)
def test_only_numbers_of_a_scene_reach_the_file(scene: Scene) -> None:
    try:
        text = text_of(scene)
    except Unsupported:
        return
    known = "".join((EXPECTED / f"{name}.dat").read_text(encoding="utf-8") for name in SCENES)
    known += "# sphere #, far away\n# plane #\nPLANE CENTER # # # NORMAL # # #\n"
    assert set(NUMBER.sub("#", text).splitlines()) <= set(NUMBER.sub("#", known).splitlines())


def drawn(scene: Scene, width: int, height: int) -> Picture:
    need("tachyon")
    picture, outcome = rendered("tachyon", scene, Settings(width, height))
    assert outcome.version == "0.99"
    return picture


@pytest.mark.parametrize("name", SCENES)
def test_real_pictures_agree(name: str) -> None:
    scene = parse(SCENES[name])
    assert pixels_over(exact(scene, 160, 90), drawn(scene, 160, 90), 0.05) == 0


def test_mirrored_rays_pass_through_the_light() -> None:
    """The mirror shows the light exactly in a pixel, and behind it a wall."""
    scene = scene_of(wall(0, 0, 20250, 0, 0, -1, reflection=0.9), wall(0, 0, -700, 0, 0, 1))
    picture = drawn(scene, 200, 200)
    assert picture[97, 102] == pytest.approx(exact(scene, 200, 200)[97, 102], abs=0.01)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (("libtachyon.so.0", "libtachyon.so.9"), "libtachyon.so.9 is missing; on Debian: apt-get install tachyon-bin-"),
        (("LIBTACHYON_0.9.9", "LIBTACHYON_1.0.0"), "libtachyon.so.0 is not Debian's Tachyon 0.99: it has no rt_initia"),
    ],
)
def test_without_the_right_library_nothing_is_drawn(change: tuple[str, str], reason: str, tmp_path: Path) -> None:
    need("tachyon")
    files = export(parse(TRICKY), SETTINGS).files
    (tmp_path / "draw.py").write_text(files["draw.py"].replace(*change), encoding="utf-8")
    (tmp_path / "scene.dat").write_text(files["scene.dat"], encoding="ascii")
    command = [sys.executable, "draw.py", "scene.dat", "scene.exr"]
    run = subprocess.run(command, cwd=tmp_path, check=False, capture_output=True, text=True)
    assert run.returncode == 1
    assert run.stderr.startswith(reason)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["draw.py", "scene.dat"]


def test_the_structures_are_those_of_the_header() -> None:
    """Sizes and offsets in bytes, as a C compiler gives them for tachyon.h 0.99."""
    assert (sizeof(Vector), sizeof(Colour), sizeof(Texture)) == (24, 12, 296)
    assert [getattr(Texture, field[0]).offset for field in Texture._fields_] == [0, 4, 16, 24, 32, 40, 48, 56, 200]


def test_the_program_draws_nearly_the_same(tmp_path: Path) -> None:
    need("tachyon")
    scene = parse(SCENES["example1"])
    (tmp_path / "scene.dat").write_text(text_of(scene, Settings(160, 90)), encoding="ascii")
    command = ["tachyon", "scene.dat", "-format", "PPM48", "-o", "scene.ppm"]
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
    assert pixels_over(exact(scene, 160, 90), read_image(tmp_path / "scene.ppm"), 0.5) <= 2
