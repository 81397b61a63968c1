"""Nothing that a scene, a name or the environment says makes a renderer read, write or run anything of somebody else's.

Traps lie in the working directory, in the home, beside the output and behind every variable. All of them either leave a
mark in the folder `outside` or spoil the picture; a snapshot of all folders shows that nothing else was touched either.
"""

import json
import os
import re
import shutil
import stat
import subprocess
import sys
import warnings
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from fakes import offer
from helpers import EXAMPLE, exact, pixels_over
from hypothesis import given, settings
from hypothesis import strategies as st

from reference import Plane, Scene, Sphere
from reference.errors import InputError, SceneWarning
from reference.image import read_image
from reference.text import dump, parse
from translator.contract import Settings, Unsupported
from translator.registry import adapter, renderer_names
from translator.run import command_line, installed_version, write_export

ALWAYS = ("mitsuba", "native", "povray", "tachyon")  # in continuous integration
SIZE = 16
NUMBER = re.compile(r"-?[0-9]+(\.[0-9]+)?(e[+-]?[0-9]+)?")
CROSSRAY = [sys.executable, "-P", "-m", "crossray"]
ESCAPE = "\x1b]0;mine\x07"
NAMES = {
    "space and dash": "-o my home work",
    "quotes and lines": "it's \"mine\"\n'two\nlines\r",
    "commands": "$(touch x);touch y&`touch z`|touch w>v\\",
    "option": "--with",
    "patterns": f"*?[a]~{{b,c}}%s%n$HOME#;{ESCAPE}\U0001f600",
    "bytes": "caf\udce9",
    "dots": "....",
}
POVRAY_TRAP = """\
Width=4
Height=3
Output_File_Name={outside}/written.png
Create_Ini={outside}/written.ini
Antialias=On
Antialias_Threshold=0.0
Quality=1
Final_Frame=2
Pre_Scene_Command=touch {outside}/ran
Library_Path={outside}
"""

LOOK = """\
from reference import Scene
from translator.contract import Settings
from translator.run import run_renderer
print(run_renderer("looks", Scene((1, 1, 1), 0.1), Settings(4, 4), 30).log)
"""


def installed() -> list[str]:
    """The renderers that there are here."""
    names = [name for name in renderer_names() if installed_version(name)]
    if os.environ.get("CI") == "true":
        assert set(ALWAYS) <= set(names), names
    return names


def snapshot(folder: Path) -> dict[str, tuple[int, int, bytes]]:
    """Everything in a folder: its kind, its time and its content."""
    found = {}
    for path in [folder, *folder.rglob("*")]:
        state = path.lstat()
        content = path.read_bytes() if stat.S_ISREG(state.st_mode) else b""
        found[str(path.relative_to(folder))] = (state.st_mode, state.st_mtime_ns, content)
    return found


def without(found: dict[str, Any], *folders: str) -> dict[str, Any]:
    """A snapshot without what is in these folders of it; they themselves, and where they were made, may change."""
    inside = tuple(f"{folder}/" for folder in folders)
    changed = {*folders, *(str(Path(folder).parent) for folder in folders)}
    return {name: state for name, state in found.items() if not name.startswith(inside) and name not in changed}


def plain_environment() -> dict[str, str]:
    kept = ("PATH", "PYTHONPATH", "DRJIT_LIBLLVM_PATH", "CI", "HOME")
    return {name: os.environ[name] for name in kept if name in os.environ}


def hostile_environment(world: Path) -> dict[str, str]:
    """A home, a working directory and variables full of traps. `crossray` itself still starts."""
    outside, home, work = (world / name for name in ("outside", "home", "work"))
    for folder in (
        outside,
        home / ".povray/3.7",
        home / ".drjit",
        work,
        world / "tmp",
        world / "python",
        world / "relative",
    ):
        folder.mkdir(parents=True)
    (home / ".drjit/sweep.stamp").touch()  # Dr.Jit notes there, once a day or so, that it has looked after its kernels
    trap = POVRAY_TRAP.format(outside=outside)
    permitted = f"[File I/O Security]\nnone\n[Shellout Security]\nallowed\n[Permitted Paths]\nread+write* = {outside}\n"
    for place in (work / "povray.ini", home / ".povray/3.7/povray.ini", home / ".povrayrc", outside / "povray.ini"):
        place.write_text(trap, encoding="utf-8")
    (home / ".povray/3.7/povray.conf").write_text(permitted, encoding="utf-8")
    (work / "scene.pov").write_text('#error "the wrong scene"\n', encoding="utf-8")
    (work / "rayinit.cal").write_text("{ wrong }\n", encoding="utf-8")
    program = f"open({str(outside / 'ran')!r}, 'w')\nraise SystemExit('the wrong program')\n"
    names = ("mitsuba", "drjit", "numpy", "whitted", "draw", "reference", "translator", "OpenImageIO", "crossray")
    for name in (*names, "argparse", "sitecustomize", "usercustomize", "bpy", "pyradiance"):
        (work / f"{name}.py").write_text(program, encoding="utf-8")
    (world / "python/startup.py").write_text(program, encoding="utf-8")
    for name in ("povray", "tachyon", "radiance", "rtrace", "oconv", "python", "sh"):
        place = work / name
        place.write_text(f"#!/bin/sh\ntouch {outside}/ran\n", encoding="utf-8")
        place.chmod(0o755)
        shutil.copy(place, world / "relative" / name)
    shutil.copy(work / "rayinit.cal", outside)
    return plain_environment() | {
        "HOME": str(home),
        "PATH": os.pathsep.join([".", "../relative", "", os.environ["PATH"]]),
        "POVINI": str(outside / "povray.ini"),
        "POVINC": str(outside),
        "RAYPATH": f".:{outside}",
        "TMPDIR": str(world / "tmp"),
        "PYTHONSTARTUP": str(world / "python/startup.py"),
        "PYTHONINSPECT": "",
        "PYTHONHASHSEED": "7",
        "PYTHONWARNINGS": "default",
        "LD_PRELOAD": "/nonexistent/library.so",
        "LD_LIBRARY_PATH": str(work),
        "DRJIT_CACHE_PATH": str(outside),
        "DRJIT_LIBOPTIX_PATH": "/nonexistent",
        "MI_DEFAULT_VARIANT": "scalar_spectral",
        "MITSUBA_DIR": str(outside),
        "OMP_NUM_THREADS": "nonsense",
        "OPENIMAGEIO_PLUGIN_PATH": str(outside),
        "OCIO": str(outside / "config.ocio"),
        "CYCLES_SHADER_PATH": str(outside),
        "XDG_CONFIG_HOME": str(home),
        "XDG_CACHE_HOME": str(home),
        "IFS": "/",
        "CDPATH": str(outside),
        "ENV": str(world / "python/startup.py"),
        "BASH_ENV": str(world / "python/startup.py"),
        "DISPLAY": ":77",
        "LANG": "tr_TR.UTF-8",
        "LC_ALL": "de_DE.UTF-8",
        "TZ": "Nowhere/At_All",
    }


def run(words: list[str], environment: dict[str, str], folder: Path) -> subprocess.CompletedProcess[str]:
    done = subprocess.run(words, env=environment, cwd=folder, capture_output=True, timeout=120, check=False)
    said = (text.decode("utf-8", "surrogateescape") for text in (done.stdout, done.stderr))  # line ends as they are
    return subprocess.CompletedProcess(done.args, done.returncode, *said)


def check(words: list[str], environment: dict[str, str], folder: Path) -> dict[str, Any]:
    """The report of a check with everything that there is."""
    size = f"{SIZE}x{SIZE}"
    command = [*CROSSRAY, "check", "--size", size, "--with", ",".join(installed()), "--out", "out", "--", *words]
    result = run(command, environment, folder)
    assert result.returncode == 0, result
    assert "Traceback" not in result.stderr
    content: dict[str, Any] = json.loads((folder / "out/report.json").read_text(encoding="utf-8"))
    return content


def pictures(folder: Path, results: dict[str, Any]) -> dict[str, Any]:
    """The pictures of the one scene of a run."""
    (scene,) = results["scenes"]
    drawn = [scene["reference"], *scene["comparisons"]]
    assert {picture["status"] for picture in drawn} == {"rendered"}, drawn
    return {picture["renderer"]: read_image(folder / f"{picture['image']}.exr") for picture in drawn}


@pytest.fixture(scope="module")
def peaceful(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """The pictures of a run in which nothing is wrong."""
    folder = tmp_path_factory.mktemp("peaceful")
    return pictures(folder / "out", check([str(EXAMPLE)], plain_environment(), folder))


def test_a_hostile_world_changes_no_picture_and_is_not_touched(tmp_path: Path, peaceful: dict[str, Any]) -> None:
    environment = hostile_environment(tmp_path)
    before = snapshot(tmp_path)
    results = check([str(EXAMPLE)], environment, tmp_path / "work")
    after = snapshot(tmp_path)
    changed = "work/out"
    assert without(after, changed, "tmp/x") == without(before, changed, "tmp/x")
    assert not list((tmp_path / "tmp").iterdir())
    drawn = pictures(tmp_path / "work/out", results)
    assert drawn.keys() == peaceful.keys()
    for name, picture in drawn.items():
        np.testing.assert_array_equal(picture, peaceful[name], err_msg=name)
    told = json.dumps(results)
    assert not re.search("nonexistent|the wrong (program|scene)", told)


def test_exported_lines_work_in_a_hostile_world(tmp_path: Path, peaceful: dict[str, Any]) -> None:
    """The lines are for a shell of the user, with all that is set there; what stands in CDPATH and POVINI too."""
    environment = hostile_environment(tmp_path)
    names = [name for name in installed() if name != "native"]
    for name in names:
        (tmp_path / "outside/export" / name).mkdir(parents=True)
    before = snapshot(tmp_path)
    words = [*CROSSRAY, "export", str(EXAMPLE), "--size", f"{SIZE}x{SIZE}", "--to", ",".join(names)]
    result = run(words, environment, tmp_path / "work")
    assert result.returncode == 0, result
    safe = environment | {"PATH": os.environ["PATH"]}
    for name, line in zip(names, result.stdout.splitlines(), strict=True):
        done = run(["sh", "-c", line], safe, tmp_path / "work")
        assert done.returncode == 0, (line, done)
        image = adapter(name).export(Scene.load(EXAMPLE), Settings(SIZE, SIZE)).image
        picture = read_image(tmp_path / "work/export" / name / image)
        np.testing.assert_allclose(picture, peaceful[name], atol=1e-4, err_msg=name)
    after = snapshot(tmp_path)
    # In the user's home Dr.Jit keeps compiled kernels and Blender makes folders for thumbnails.
    changed = ("work/export", "home/.drjit", "home/thumbnails", "tmp")
    assert without(after, *changed) == without(before, *changed)
    assert not list((tmp_path / "tmp").iterdir())
    assert not any(path.is_file() for path in (tmp_path / "home/thumbnails").rglob("*"))


@pytest.mark.parametrize("case", NAMES)
def test_names_of_scenes_and_folders_are_only_names(case: str, tmp_path: Path) -> None:
    """`export` and the line it prints, run by a shell, for a scene and a folder that are called so."""
    name = NAMES[case]
    work = tmp_path / "work"
    work.mkdir()
    shutil.copy(EXAMPLE, work / name)
    names = [renderer for renderer in ("povray",) if renderer in installed()]
    before = snapshot(tmp_path)
    target = f"out {name}"
    words = ["export", "--size", "8x6", "--to", ",".join(names), f"--output={target}/{name}", "--", name]
    result = run([*CROSSRAY, *words], os.environ | {"PYTHONIOENCODING": "utf-8:strict"}, work)
    assert (result.returncode, result.stderr) == (0, ""), result
    for renderer, line in zip(names, split_lines(result.stdout, len(names)), strict=True):
        done = run(["sh", "-c", line], dict(os.environ), work)
        assert done.returncode == 0, (line, done)
        exported = adapter(renderer).export(Scene.load(EXAMPLE), Settings(8, 6))
        folder = work / target / name / renderer
        assert {path.name for path in folder.iterdir()} == {*exported.files, exported.image}
        shutil.copy(folder / exported.image, tmp_path / exported.image)
        assert read_image(tmp_path / exported.image).shape == (6, 8, 3)
        (tmp_path / exported.image).unlink()
    after = snapshot(tmp_path)
    before["."] = after["."]
    assert without(after, f"work/{target}") == without(before, f"work/{target}")
    assert {path.name for path in work.iterdir()} == {name, target}


def split_lines(text: str, count: int) -> list[str]:
    """The commands that were printed: a name in them may hold line ends."""
    lines = re.findall(r"\(cd -- .*?\)\n(?=\(cd -- |\Z)", text, re.DOTALL)
    assert len(lines) == count, text
    return lines


def test_a_check_of_many_names(tmp_path: Path) -> None:
    """All of them at once: reports name them, folders are called something safe, and nothing else is made."""
    work = tmp_path / "work"
    work.mkdir()
    for name in NAMES.values():
        shutil.copy(EXAMPLE, work / name)
    environment = offer(tmp_path / "fakes", {"fails": "exit 1"})
    before = snapshot(tmp_path)
    words = ["check", "--size", "4x4", "--with", "fails", "--timeout", "1", "--out", "out", "--", *NAMES.values()]
    result = run([*CROSSRAY, *words], environment, work)
    assert result.returncode == 3, result
    assert len(result.stdout.splitlines()) == len(NAMES)
    assert all(line.isprintable() for line in (result.stdout + result.stderr).splitlines())
    assert without(snapshot(tmp_path), "work/out", "fakes") == without(before, "work/out", "fakes")
    folders = [path.name for path in (work / "out/images").iterdir()]
    assert len(folders) == len(NAMES)
    assert all(re.fullmatch(r"[A-Za-z0-9_-][A-Za-z0-9._-]*", folder) for folder in folders), folders
    scenes = json.loads((work / "out/report.json").read_text(encoding="utf-8"))["scenes"]
    assert [scene["path"] for scene in scenes] == [name.encode("utf-8", "replace").decode() for name in NAMES.values()]
    suites = ElementTree.parse(work / "out/junit.xml").getroot().findall("testsuite")
    assert len(suites) == len(NAMES)


def test_complaints_do_not_command_the_terminal(tmp_path: Path) -> None:
    (tmp_path / ESCAPE).write_text("hello", encoding="utf-8")
    for words in (["render", ESCAPE], ["render", f"missing{ESCAPE}"]):
        result = run([*CROSSRAY, *words], dict(os.environ), tmp_path)
        assert result.returncode == 2
        assert re.search(r":1:1: expected ", result.stderr), result.stderr
        assert result.stderr.rstrip("\n").isprintable()


def test_pictures_cannot_be_called_what_their_library_cannot_open(tmp_path: Path) -> None:
    for words in (["render", str(EXAMPLE), "-o", "caf\udce9.png"], ["render", str(EXAMPLE), "-o", "caf\udce9/a.png"]):
        result = run([*CROSSRAY, *words, "--size", "8x8"], dict(os.environ), tmp_path)
        assert result.returncode == 2, result
        assert "expected a path in UTF-8 for a picture" in result.stderr
        assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("mask", [0o000, 0o022, 0o077])
def test_the_private_folder_is_private(mask: int, tmp_path: Path) -> None:
    """Whatever the umask, others can neither enter it nor put anything there."""
    (tmp_path / "tmp").mkdir()
    environment = offer(tmp_path / "fakes", {"looks": "stat -c '%a %u %h' . draw.sh; umask; exit 1"})
    code = "import os, sys; os.umask(int(sys.argv[1])); os.execv(sys.argv[2], sys.argv[2:])"
    script = (
        "from translator.run import *; from reference.text import *; from translator.contract import *; import sys\n"
    )
    script += "print(run_renderer('looks', parse('1 1 1\\n.1\\n0\\n0\\n'), Settings(4, 4), 30).log)"
    words = [sys.executable, "-c", code, str(mask), sys.executable, "-P", "-c", LOOK]
    result = run(words, environment | {"TMPDIR": str(tmp_path / "tmp")}, tmp_path)
    assert result.returncode == 0, result
    folder, file, umask = result.stdout.split("\n")[:3]
    assert folder == f"700 {os.geteuid()} 2"
    assert file == f"{0o666 & ~mask:o} {os.geteuid()} 1"
    assert int(umask, 8) == mask


@pytest.mark.parametrize("place", [".", "relative/../relative"])
def test_a_relative_folder_for_temporary_files(place: str, tmp_path: Path) -> None:
    """What is said of it to renderers is absolute, as they run elsewhere."""
    (tmp_path / "relative").mkdir()
    environment = offer(tmp_path / "fakes", {"looks": 'echo "$HOME|$TMPDIR|$PWD"; exit 1'}) | {"TMPDIR": place}
    result = run([sys.executable, "-P", "-c", LOOK], environment, tmp_path)
    home, temporary, here = (Path(word) for word in result.stdout.strip().split("|"))
    assert home == temporary
    assert home.resolve() == here.resolve()
    assert tmp_path in here.parents
    assert {path.name for path in tmp_path.iterdir()} == {"relative", "fakes"}
    assert not list((tmp_path / "relative").iterdir())


def test_links_that_lie_where_an_export_goes_lead_nowhere_new(tmp_path: Path) -> None:
    """A link is followed as by any program, its target replaced whole; a link to nowhere is no way around a folder."""
    mine = tmp_path / "mine"
    mine.mkdir()
    (tmp_path / "export").mkdir()
    (tmp_path / "export/povray").symlink_to(tmp_path / "nowhere")
    result = run([*CROSSRAY, "export", str(EXAMPLE), "--to", "povray"], dict(os.environ), tmp_path)
    assert result.returncode == 3, result
    assert "export/povray: cannot be made a folder" in result.stderr
    assert not (tmp_path / "nowhere").exists()


any_float = st.floats(allow_nan=False, allow_infinity=False)
coordinates = st.one_of(
    st.floats(-1e3, 1e3), any_float, st.sampled_from([5e-324, -5e-324, 1e-310, 1.7976931348623157e308, -1e308, -0.0])
)
triples = st.tuples(coordinates, coordinates, coordinates)
positive = st.one_of(st.floats(1e-9, 1e3), st.floats(min_value=0, exclude_min=True, allow_infinity=False))
some_spheres = st.lists(st.builds(Sphere, triples, triples, positive, coordinates, coordinates), max_size=2)
some_planes = st.lists(st.builds(Plane, triples, triples, triples.filter(any), coordinates, coordinates), max_size=2)


@pytest.mark.parametrize("name", renderer_names())
@settings(max_examples=40, deadline=None)
@given(ambient=triples, coefficient=coordinates, spheres=some_spheres, planes=some_planes)
def test_exports_hold_nothing_of_a_scene_but_numbers(
    name: str, ambient: Any, coefficient: float, spheres: list[Sphere], planes: list[Plane]
) -> None:
    """Nor can numbers end a comment, name a file or spell a word: huge and tiny ones are refused or written out."""
    try:
        scene = Scene(ambient, coefficient, tuple(spheres), tuple(planes))
        exported = adapter(name).export(scene, Settings(64, 48, 3))
    except (Unsupported, InputError):
        return
    simple = adapter(name).export(Scene((1, 2, 3), 0.5), Settings(64, 48, 3))
    assert all(re.fullmatch(r"[a-z0-9][a-z0-9_.-]*", file) for file in [*exported.files, exported.image])
    assert exported.environment == simple.environment
    assert [NUMBER.sub("#", word) for word in exported.command] == [NUMBER.sub("#", word) for word in simple.command]
    text = dump(scene)
    assert re.fullmatch(r"[0-9eE+\-. \n]*", text)
    assert "--" not in text
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SceneWarning)
        assert parse(text) == scene
    for content in exported.files.values():
        assert content.isascii()
        assert not re.search(r"[\x00-\x09\x0b-\x1f\x7f]", content)
        if content.lstrip().startswith("<"):
            comments = re.findall(r"<!--(.*?)-->", content, re.DOTALL)
            assert all("--" not in comment for comment in comments)
            ElementTree.fromstring(content)


@pytest.mark.parametrize("number", ["5e-324", "1e-310", "1.7976931348623157e308", "0x10", "1_0", "١", "1e400", "1d3"])
def test_strange_numbers_are_refused_or_carried(number: str) -> None:
    """As text: what Python, C and renderers read differently never reaches them."""
    text = EXAMPLE.read_text(encoding="utf-8").replace("50 -70 300", f"{number} -70 300", 1)
    try:
        scene = parse(text)
    except InputError:
        return
    for name in renderer_names():
        try:
            exported = adapter(name).export(scene, Settings(8, 8))
        except Unsupported:
            continue
        assert all(number not in content or number.isascii() for content in exported.files.values())


def test_a_line_that_is_recorded_can_be_typed(tmp_path: Path) -> None:
    """With the settings that the renderer ran with: pasted into a shell in the folder of the export, it draws."""
    for name in set(installed()) & {"povray", "tachyon"}:
        exported = adapter(name).export(Scene.load(EXAMPLE), Settings(SIZE, SIZE))
        write_export(exported, tmp_path / name)
        line = command_line(exported)
        assert all(f"{setting}={value} " in line for setting, value in exported.environment.items())
        assert run(["sh", "-c", line], dict(os.environ), tmp_path / name).returncode == 0
        picture = read_image(tmp_path / name / exported.image)
        assert pixels_over(exact(Scene.load(EXAMPLE), SIZE, SIZE), picture) == 0
