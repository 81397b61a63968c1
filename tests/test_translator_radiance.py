"""The Radiance adapter: the files that it writes, what it refuses, and the real program.

The expected files are checked by hand against their scenes. After a change on purpose, write them anew with
`CROSSRAY_REFRESH=1 python -m pytest tests/test_translator_radiance.py` and read the difference before keeping it.
"""

import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers import (
    EXAMPLE,
    NUMBER,
    ROOT,
    TRICKY,
    exact,
    expect_text,
    need_module,
    pixels_over,
    rendered,
    scene_of,
)
from hypothesis import given
from hypothesis import strategies as st

from reference import Plane, Scene, Sphere
from reference.image import Picture, read_image
from reference.scene import LIGHT, Triple
from reference.text import parse
from translator.contract import Export, Limits, Settings, Unsupported
from translator.renderers import radiance
from translator.renderers.radiance import faces, limits
from translator.run import run_renderer, write_export

SCENES = {"example1": EXAMPLE.read_text(encoding="utf-8"), "tricky": TRICKY}
FILES = ("scene.rad", "light.rad", "ambient.rad", "scene.vf", "scene.opt")
SETTINGS = Settings(64, 48, 3)
LONGEST_COMMENT = 2047  # characters: what follows on the same line, Radiance reads as scene
DIAGNOSTIC = ROOT / "scenes" / "diagnostic"
pytestmark = pytest.mark.filterwarnings("ignore::reference.errors.SceneWarning")


def ball(x: float, y: float, z: float, radius: float) -> Sphere:
    return Sphere((255, 0, 0), (x, y, z), radius, 1, 0)


def plane(point: Triple, normal: Triple) -> Plane:
    return Plane((255, 0, 0), point, normal, 1, 0)


NEAR, FLOOR = ball(0, 0, 300, 10), plane((0, -100, 0), (0, 1, 0))


def export(*surfaces: Sphere | Plane, depth: int = 3) -> Export:
    return radiance.export(scene_of(*surfaces), Settings(64, 48, depth))


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("file", FILES)
def test_export_is_as_expected(file: str, scene: str) -> None:
    text = radiance.export(parse(SCENES[scene]), SETTINGS).files[file]
    expect_text(f"{scene}-{file}", text)


def test_export_brings_the_program_that_the_header_runs() -> None:
    exported = export(NEAR)
    assert set(exported.files) == {*FILES, "render.py"}
    compile(exported.files["render.py"], "render.py", "exec")
    assert f"# Run: {' '.join(exported.command)}\n" in exported.files["scene.rad"]


def objects(*surfaces: Sphere | Plane) -> list[str]:
    """Material and kind of each object, in order."""
    return re.findall(r"^([a-z0-9-]+ (?:sphere|bubble|ring)) \S+$", export(*surfaces).files["scene.rad"], re.MULTILINE)


SEEN: dict[str, tuple[Sphere | Plane, list[str]]] = {
    "floor": (FLOOR, ["front-of-plane-1 ring"]),
    "floor from its back": (plane((0, -100, 0), (0, -3, 0)), ["back-of-plane-1 ring"]),
    "floor at the edge of the screen": (plane((7, -50, 7), (0, 1, 0)), ["front-of-plane-1 ring"]),
    "floor that the screen cuts": (plane((0, -20, 0), (0, 1, 0)), ["front-of-plane-1 ring", "back-of-plane-1 ring"]),
    "through the eye": (plane((0, 0, 0), (1, 1, 0)), ["front-of-plane-1 ring", "back-of-plane-1 ring"]),
    "before the screen": (plane((0, 0, 50), (0, 0, 1)), ["front-of-plane-1 ring"]),
    "the screen": (plane((9, 9, 100), (0, 0, 2)), ["front-of-plane-1 ring"]),
    "the screen from its back": (plane((9, 9, 100), (0, 0, -2)), ["back-of-plane-1 ring"]),
    "ball": (NEAR, ["surface-of-sphere-1 sphere"]),
    "ball that the screen cuts": (ball(0, 0, 100, 10), ["surface-of-sphere-1 sphere"]),
    "ball around the screen": (ball(0, 0, 100, 71), ["inside-of-sphere-1 bubble"]),
    "ball around all but the corners": (ball(0, 0, 100, 70), ["surface-of-sphere-1 sphere"]),
    "world": (ball(0, -2e5, 0, 1.9e5), ["outside-of-sphere-1 sphere"]),
    "world that the screen cuts": (
        ball(0, -2e5, 100, 2e5),
        ["outside-of-sphere-1 sphere", "inside-of-sphere-1 bubble"],
    ),
}


@pytest.mark.parametrize("case", SEEN)
def test_only_the_sides_that_can_be_seen_are_there(case: str) -> None:
    surface, expected = SEEN[case]
    assert objects(surface) == expected


def test_of_a_plane_with_two_sides_each_lies_before_the_other() -> None:
    rings = re.findall(r"^8 (.*)$", export(plane((0, -20, 0), (0, 1, 0))).files["scene.rad"], re.MULTILINE)
    front, back = (list(map(float, ring.split())) for ring in rings)
    assert front[1] - back[1] == pytest.approx(faces.THICKNESS)
    assert (front[3:6], back[3:6]) == ([0, 1, 0], [0, -1, 0])


def material(text: str, name: str) -> list[str]:
    """The lines of the arguments of a material."""
    return [line.strip() for line in text.partition(f"BRTDfunc {name}\n")[2].splitlines()[:7]]


def test_the_light_shines_through_to_the_side_that_does_not_face_it() -> None:
    """A ceiling below the light that is seen from below: the given normal faces the light, not the viewer."""
    files = export(plane((0, 200, 0), (0, 1, 0)), plane((0, 600, 0), (0, 1, 0))).files
    assert material(files["light.rad"], "back-of-plane-1")[4:] == ["9 0 0 0", "0 0 0", "1.0 0.0 0.0"]
    assert material(files["light.rad"], "back-of-plane-2")[4:] == ["9 0 0 0", "0 0 0", "0.0 0.0 0.0"]
    assert material(files["ambient.rad"], "back-of-plane-1")[5:] == ["0 0 0", "0 0 0"]


def test_negative_colours_are_a_picture_of_their_own() -> None:
    dark = replace(NEAR, colour=(-51, 102, 0), diffuse=0.5)
    files = export(FLOOR, dark).files
    assert set(files) == {*FILES, "render.py", "light-negative.rad", "ambient-negative.rad"}
    assert material(files["light.rad"], "surface-of-sphere-1")[4] == "9 0.0 0.2 0.0"
    assert material(files["light-negative.rad"], "surface-of-sphere-1")[4] == "9 0.1 0.0 0.0"
    assert material(files["light-negative.rad"], "front-of-plane-1")[4] == "9 0.0 0.0 0.0"
    assert set(export(replace(dark, diffuse=-1.0, colour=(9, 9, 9))).files) - {*FILES} == {
        "render.py",
        "light-negative.rad",
    }


def test_nothing_mirrors_at_depth_0() -> None:
    mirror = replace(NEAR, reflection=0.5)
    assert "0.5" in export(mirror).files["light.rad"]
    assert "0.5" not in export(mirror, depth=0).files["light.rad"]


def test_far_planes_make_the_unit_small() -> None:
    near, far = export(FLOOR), export(FLOOR, plane((0, 0, 3e7), (0, 0, -1)))
    assert near.limits == Limits(precision=1e-8, gap=1e-6, far=1e8)
    assert far.limits.gap == pytest.approx(1e-3)
    assert (export(NEAR).limits.far, export(plane((0, 0, 3e7), (0, 0, 1))).limits.far) == pytest.approx((1e10, 1e13))
    assert export(plane((0, 0.5, 0), (0, 1, 0))).limits.far == 1e6
    assert "z negated" in near.files["scene.rad"]
    assert "times 0.001, z negated" in far.files["scene.rad"]


def test_the_lamp_keeps_clear_of_surfaces() -> None:
    def radius(*surfaces: Sphere | Plane) -> float:
        found = re.search(
            r"^light sphere lamp\n0\n0\n4 \S+ \S+ \S+  (\S+)$", export(*surfaces).files["light.rad"], re.M
        )
        assert found
        return float(found[1])

    assert radius() == radius(FLOOR) == limits.LAMP
    assert radius(plane((0, 499, 0), (0, 1, 0))) == 0.5
    assert radius(ball(*LIGHT, 3)) == 1.5
    assert radius(plane((0, 500, 0), (0, 1, 0))) == limits.LAMP
    assert radius(ball(500, 500, 600, 100)) == limits.SMALLEST_LAMP


COARSE = "Radiance's double precision is too coarse beyond 1e+08"
REFUSED = {
    "depth": (scene_of(NEAR), 1001, "Radiance follows at most 1000 bounces, not 1001"),
    "negative mirror": (
        scene_of(NEAR, replace(FLOOR, reflection=-0.5)),
        3,
        "Radiance follows no ray of negative weight: plane 1 reflects -0.5",
    ),
    "sphere too far": (scene_of(NEAR, ball(0, 0, 1e8, 1)), 3, f"{COARSE}: sphere 2 reaches farther"),
    "plane too far": (
        scene_of(FLOOR, plane((0, -1.1e8, 0), (0, 2, 0))),
        3,
        f"{COARSE}: plane 2 reaches farther",
    ),
    "radius": (scene_of(NEAR, ball(0, 0, 300, 1e-6)), 3, "Radiance knows no radius up to 1e-06: sphere 2 has 1e-06"),
    "radius beside a far plane": (
        scene_of(ball(0, 0, 300, 1e-4), plane((0, 0, 3e7), (0, 0, 1))),
        3,
        "Radiance knows no radius up to 0.001: sphere 1 has 0.0001",
    ),
    "sphere at the light": (
        scene_of(NEAR, ball(500, 500, 600, 99.99)),
        3,
        "Radiance finds no lamp smaller than 0.01: sphere 2 leaves room for 0.005",
    ),
    "plane at the light": (
        scene_of(FLOOR, plane((0, 500.0078125, 0), (0, 3, 0))),
        3,
        "Radiance finds no lamp smaller than 0.01: plane 2 leaves room for 0.00390625",
    ),
    "sphere at the light beside a far plane": (
        scene_of(ball(500, 500, 600, 50), plane((0, 0, 6e7), (0, 0, 1))),
        3,
        "Radiance finds no lamp smaller than 60: sphere 1 leaves room for 25",
    ),
    "dark": (
        scene_of(Sphere((1e-4, 0, 0), (0, 0, 300), 10, 1, 1000.0)),
        3,
        "Radiance leaves out what is as dark as sphere 1, which mirrors would brighten",
    ),
    "colour": (
        scene_of(Sphere((1e30, 0, 0), (0, 0, 300), 10, 1, 0)),
        3,
        "single precision cannot keep apart colours and coefficients as far from 1 as 3.92157e+27",
    ),
    "counted as in the file": (
        scene_of(NEAR, NEAR, ball(0, 0, 1e9, 1)),
        3,
        f"{COARSE}: sphere 3 reaches farther",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_carried_is_refused_with_the_reason(case: str) -> None:
    scene, depth, reason = REFUSED[case]
    with pytest.raises(Unsupported) as refusal:
        radiance.export(scene, Settings(64, 48, depth))
    assert str(refusal.value) == reason


def test_what_is_just_within_the_limits_is_carried() -> None:
    far = (ball(0, 0, 9.9e7, 1), plane((0, -9.9e7, 0), (0, 1, 0)))
    export(*far, depth=1000)
    export(ball(0, 0, 300, 1.1e-6), ball(500, 500, 600, 99.97), plane((0, 500.03125, 0), (0, 3, 0)))
    export(Sphere((1e-4, 0, 0), (0, 0, 300), 10, 1, 2.0))


numbers = st.floats(-1e5, 1e5)
triples = st.tuples(numbers, numbers, numbers)
spheres = st.builds(Sphere, triples, triples, st.floats(1e-5, 1e5), numbers, st.floats(0, 1e5))
planes = st.builds(Plane, triples, triples, triples.filter(any), numbers, st.floats(0, 1e5))
scenes = st.builds(
    Scene, triples, numbers, st.lists(spheres, max_size=3).map(tuple), st.lists(planes, max_size=3).map(tuple)
)
FACES = {
    *("front-of-plane-# ring plane-#", "back-of-plane-# ring plane-#", "surface-of-sphere-# sphere sphere-#"),
    *("outside-of-sphere-# sphere sphere-#", "inside-of-sphere-# bubble sphere-#"),
}
LINES = {
    *FACES,
    *(f"void BRTDfunc {face.partition(' ')[0]}" for face in FACES),
    *("", "#", "# .", "# if(Rdot,#,#) if(Rdot,#,#) if(Rdot,#,#)", "if(Rdot,#,#) if(Rdot,#,#) if(Rdot,#,#)"),
    *("void brightfunc nofall", "# (Ts+#)*(Ts+#) .", "nofall illum light", "# void", "light sphere lamp"),
    "rvu -vtv -vp # -vd # -vu # -vh # -vv # -vo #",
    *("-ab #", "-dj # -ds # -dt # -dc # -dr #", "-ss # -st #", "-lr # -lw #"),
}


@given(scene=scenes)
def test_only_numbers_of_a_scene_reach_the_files(scene: Scene) -> None:
    try:
        files = radiance.export(scene, SETTINGS).files
    except Unsupported:
        return
    lines = [line for name in files if name != "render.py" for line in files[name].split("\n")]
    shapes = {re.sub(r"#( #)+", "#", " ".join(NUMBER.sub("#", line).split())) for line in lines if line[:1] != "#"}
    assert shapes <= LINES


@given(scene=scenes)
def test_comments_end_before_radiance_reads_on(scene: Scene) -> None:
    try:
        files = radiance.export(scene, SETTINGS).files
    except Unsupported:
        return
    lines = [line for name in files if name.endswith(".rad") for line in files[name].split("\n")]
    assert max(map(len, lines)) < LONGEST_COMMENT
    assert not [line for line in lines if line.lstrip().startswith("!")]


HOSTILE = "1 2 3\n!touch owned\r!touch owned\r\n\n  !touch owned\x0b!touch owned\x0c!touch owned\u2028!touch owned"


def test_the_embedded_scene_is_inert_whatever_it_says(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    need_module("pyradiance")
    monkeypatch.setattr("translator.contract.dump", lambda scene: HOSTILE)
    exported = export(NEAR)
    comments = exported.files["scene.rad"].partition("assignment writes it:")[2]
    assert comments.count("\n#   ") == len(HOSTILE.splitlines())
    result = run_by_hand(exported, tmp_path)
    assert result.returncode == 0, result.stderr
    assert not (tmp_path / "owned").exists()


def run_by_hand(exported: Export, folder: Path) -> subprocess.CompletedProcess[str]:
    """What the header says, where the user's settings lead to a library and programs that must not be used."""
    write_export(exported, folder)
    trap = folder / "trap"
    trap.mkdir()
    for program in ("rtrace", "oconv", "vwrays", "sh"):
        Path(trap, program).write_text("#!/bin/sh\ntouch owned\n")
        Path(trap, program).chmod(0o755)
    for file in (trap / "rayinit.cal", trap / ".rtrace", folder / "rayinit.cal"):
        file.write_text("} nonsense")
    misled = {name: str(trap) for name in ("RAYPATH", "PATH", "HOME", "TMPDIR")}
    command = [sys.executable, *exported.command[1:]]
    return subprocess.run(
        command, cwd=folder, env=os.environ | misled, capture_output=True, text=True, timeout=60, check=False
    )


def test_it_runs_by_hand_whatever_the_user_has_set(tmp_path: Path) -> None:
    need_module("pyradiance")
    scene = parse(TRICKY)
    result = run_by_hand(radiance.export(scene, SETTINGS), tmp_path)
    assert (result.returncode, result.stderr) == (0, "")
    assert pixels_over(exact(scene, 64, 48), read_image(tmp_path / "scene.exr")) == 0
    assert not [*tmp_path.rglob("owned")]


def test_radiance_itself_runs_what_the_header_says(tmp_path: Path) -> None:
    """Its pictures have 8 bits and an exponent."""
    need_module("pyradiance")
    from pyradiance import BINPATH

    scene = parse(TRICKY.replace("200 100 50", "200 100 -50"))
    exported = radiance.export(scene, SETTINGS)
    write_export(exported, tmp_path)
    steps = re.findall(r"^#   ([a-z]+ .*)$", exported.files["scene.rad"], re.MULTILINE)
    assert [step.partition(" ")[0] for step in steps] == ["oconv", "rpict"] * 4 + ["pcomb"]
    programs = {"PATH": str(BINPATH), "RAYPATH": str(BINPATH.parent / "lib")}
    subprocess.run(["/bin/sh", "-ec", "\n".join(steps)], cwd=tmp_path, env=programs, capture_output=True, check=True)
    assert pixels_over(exact(scene, 64, 48), read_image(tmp_path / "scene.hdr"), level=4) == 0


def broken(before: str, after: str) -> Export:
    """An export with an error in the materials under the lamp."""
    exported = export(NEAR)
    text = exported.files["light.rad"]
    assert before in text
    return replace(exported, files={**exported.files, "light.rad": text.replace(before, after, 1)})


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        ("void BRTDfunc", "void nonsense", "oconv: fatal - (light.rad): unknown type"),
        ("\n10 0", "\n10 nonsense", "rtrace: "),
    ],
)
def test_a_failure_of_radiance_fails_the_run_with_what_it_says(
    before: str, after: str, message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    need_module("pyradiance")
    exported = broken(before, after)
    monkeypatch.setattr(radiance, "export", lambda scene, settings: exported)
    outcome = run_renderer("radiance", scene_of(NEAR), SETTINGS, 60)
    assert (outcome.status, outcome.picture) == ("failed", None)
    assert message in (outcome.reason or "")


@pytest.mark.parametrize(("end", "said"), [("exit 3", 3), ("kill -SEGV $$", "rtrace was stopped by signal 11")])
def test_a_program_that_stops_ends_the_drawing(
    end: str, said: int | str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    need_module("pyradiance")
    from translator.renderers.radiance import render

    Path(tmp_path, "rtrace").write_text(f"#!/bin/sh\n{end}\n")
    Path(tmp_path, "rtrace").chmod(0o755)
    monkeypatch.setattr(render, "BINPATH", tmp_path)
    with pytest.raises(SystemExit) as stopped:
        render.trace("light", b"")
    assert stopped.value.code == said


@pytest.mark.parametrize("threads", [1, 3])
def test_no_more_processes_run_than_threads_are_given(
    threads: int, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    need_module("pyradiance")
    from translator.renderers.radiance import render

    running, most = [], []
    original = render.run

    def counted(*command: str, given: bytes | memoryview = b"") -> bytes:
        running.append(command)
        most.append(len(running))
        assert "-n" not in command
        result = original(*command, given=given)
        running.remove(command)
        return result

    exported = radiance.export(parse(TRICKY), replace(SETTINGS, threads=threads))
    write_export(exported, tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [*exported.command[1:]])
    monkeypatch.setattr(render, "run", counted)
    render.main()
    assert len(most) == 2 + 1 + 2 * threads
    assert max(most) <= threads
    assert read_image(tmp_path / "scene.exr").shape == (48, 64, 3)


def drawn(scene: Scene, settings: Settings) -> Picture:
    need_module("pyradiance")
    picture, outcome = rendered("radiance", scene, settings)
    assert re.fullmatch(r"\S+ of pyradiance [0-9.]+", outcome.version or "")
    assert 0 < (outcome.trace_seconds or 0) < (outcome.seconds or 0)
    return picture


REAL = {
    "example": (EXAMPLE.read_text(encoding="utf-8"), Settings(100, 100)),
    "tricky": (TRICKY, Settings(160, 90)),
    "depth 0": (EXAMPLE.read_text(encoding="utf-8"), Settings(60, 60, 0)),
    "one thread": (EXAMPLE.read_text(encoding="utf-8"), Settings(60, 60, threads=1)),
    "eight threads": (TRICKY, Settings(60, 60, threads=8)),
    "nothing": ("1 1 1\n1\n0\n0\n", Settings(4, 4)),
}


@pytest.mark.parametrize("case", REAL)
def test_the_real_one_agrees(case: str) -> None:
    text, settings = REAL[case]
    scene = parse(text)
    truth = exact(scene, settings.width, settings.height, settings.depth)
    assert pixels_over(truth, drawn(scene, settings)) == 0


def test_mirrors_and_negative_colours_in_the_real_one() -> None:
    """Colours whose luminance is negative, which Radiance would drop, seen in a mirror that brightens."""
    dark = Sphere((-300, 40, 20), (-60, 0, 300), 50, 0.8, 0.2)
    bright = Sphere((900, -20, 20), (60, 0, 300), 50, 0.8, 1.5)
    scene = Scene((255, -128, 400), 0.4, (dark, bright), (replace(FLOOR, colour=(90, -90, 255), reflection=0.3),))
    truth, picture = exact(scene, 100, 100), drawn(scene, Settings(100, 100))
    assert np.abs(truth - picture).max() < 0.01
    assert truth.min() < -10


@pytest.mark.parametrize(
    "name", ["eye_inside", "eye_on_plane", "far_plane", "horizon", "light_inside", "light_on_sphere", "near_cross"]
)
def test_diagnostic_scenes_agree(name: str) -> None:
    scene = Scene.load(DIAGNOSTIC / f"{name}.txt")
    assert pixels_over(exact(scene, 100, 100), drawn(scene, Settings(100, 100))) == 0
