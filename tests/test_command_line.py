"""The command line in its own process: files, exit codes, and what is said where."""

import json
import re
import shutil
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from helpers import EXAMPLE, ROOT, Finished, crossray, exact, need, pixels_over

from reference import Scene
from reference.image import read_image, write_image
from translator.contract import Limits
from translator.registry import renderer_names
from translator.renderers import mitsuba, povray

COMMANDS = ("render", "export", "check", "compare", "grade", "explain", "certify", "doctor")
SMALL = ("--size", "16x16")


def report(folder: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    return content


def statuses(folder: Path) -> dict[tuple[str, str], str]:
    return {
        (scene["scene"], comparison["renderer"]): comparison["status"]
        for scene in report(folder)["scenes"]
        for comparison in scene["comparisons"]
    }


@pytest.fixture
def fake_povray(tmp_path: Path) -> tuple[str, Path]:
    """A search path with nothing but a `povray` that runs the shell script `draw`."""
    programs = tmp_path / "programs"
    programs.mkdir()
    script = programs / "draw"
    povray = programs / "povray"
    povray.write_text(
        f"#!/bin/sh\nif [ $1 = --version ]; then echo POV-Ray 9.9; exit; fi\n. {script}\n", encoding="utf-8"
    )
    povray.chmod(0o755)
    return str(programs), script


@pytest.mark.parametrize("command", ["", *COMMANDS])
def test_help_shows_an_example(command: str) -> None:
    result = crossray(*command.split(), "--help")
    assert (result.returncode, result.stderr) == (0, "")
    assert re.search(rf"^ *crossray {command or '(render|check)'}( |$)", result.stdout, re.MULTILINE)


def test_help_lists_the_commands() -> None:
    listed = re.findall(r"^  ([a-z]+)  ", crossray("--help").stdout, re.MULTILINE)
    assert set(COMMANDS) <= set(listed)


def test_version() -> None:
    result = crossray("--version")
    assert (result.returncode, result.stderr) == (0, "")
    assert re.fullmatch(r"crossray \d+\.\d+\.\d+\S*\n", result.stdout)


@pytest.fixture(scope="module")
def checked(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[Finished]]:
    need("povray")
    out = tmp_path_factory.mktemp("checked") / "some where/out"
    words = ("check", EXAMPLE, "--size", "64x64", "--with", "povray", "mitsuba", "--out", out)
    return out, [crossray(*words), crossray(*words)]


def test_check_writes_reports_and_pictures(checked: tuple[Path, list[Finished]]) -> None:
    out, results = checked
    for result in results:
        assert result.returncode == 0, result.stderr
        assert [line.split()[:3] for line in result.stdout.splitlines()] == [
            ["example1", "povray", "agree:"],
            ["example1", "mitsuba", "agree:"],
        ]
        assert result.stderr == f"{out / 'report.html'}\n"
    content = report(out)
    assert content["version"] == 1
    (scene,) = content["scenes"]
    facts = {name: scene[name] for name in ("scene", "path", "width", "height", "depth", "convention")}
    assert list(facts.values()) == ["example1", str(EXAMPLE), 64, 64, 3, "exact"]
    assert scene["reference"]["renderer"] == "certified"
    assert scene["reference"]["limits"] == asdict(Limits()) | {"origin": [0, 0, 0]}
    limits = {comparison["renderer"]: comparison["limits"] for comparison in scene["comparisons"]}
    declared = {"povray": asdict(povray.LIMITS), "mitsuba": asdict(mitsuba.LIMITS)}
    assert limits == json.loads(json.dumps(declared))
    assert {comparison["verdict"] for comparison in scene["comparisons"]} == {"agree"}
    assert (out / "report.html").stat().st_size > 10_000
    assert ElementTree.parse(out / "junit.xml").getroot().tag == "testsuites"


def test_check_keeps_pictures_as_exr_and_png(checked: tuple[Path, list[Finished]]) -> None:
    out, _ = checked
    truth = exact(Scene.load(EXAMPLE), 64, 64)
    (scene,) = report(out)["scenes"]
    for picture in (scene["reference"], *scene["comparisons"]):
        assert pixels_over(truth, read_image(out / f"{picture['image']}.exr")) == 0
        assert pixels_over(truth, read_image(out / f"{picture['image']}.png"), 1) <= 1


def test_renderers_can_be_named_in_several_ways(tmp_path: Path) -> None:
    ways = [
        ["--to", "povray", "mitsuba"],
        ["--to", "povray,mitsuba"],
        ["--to=povray,mitsuba"],
        ["--to", "povray", "--to", "mitsuba"],
        ["--to", "native,povray", "mitsuba,povray"],
    ]
    for number, words in enumerate(ways):
        for order in ([str(EXAMPLE), *words], [*words, str(EXAMPLE)]):
            folder = tmp_path / str(number)
            result = crossray("export", *order, "-o", folder)
            assert result.returncode == 0, (words, result.stderr)
            assert {path.name for path in folder.iterdir()} - {"native"} == {"povray", "mitsuba"}


def test_check_compares_every_renderer_with_the_truth(tmp_path: Path) -> None:
    assert crossray("check", EXAMPLE, *SMALL, "--out", tmp_path / "out").returncode == 0
    assert [name for _, name in statuses(tmp_path / "out")] == renderer_names()
    (scene,) = report(tmp_path / "out")["scenes"]
    assert scene["reference"]["renderer"] == "certified"


def test_check_takes_renderers_with_commas(tmp_path: Path) -> None:
    need("povray")
    result = crossray("check", "--with", "povray,mitsuba", EXAMPLE, *SMALL, "--out", tmp_path / "out")
    assert result.returncode == 0, result.stderr
    assert set(statuses(tmp_path / "out").values()) == {"rendered"}
    assert [name for _, name in statuses(tmp_path / "out")] == ["povray", "mitsuba"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["check", EXAMPLE, "--with", "povrey"], "povrey"),
        (["check", EXAMPLE, "--with", "povray,,mitsuba"], "found ''"),
        (["check", EXAMPLE, "--with"], "--with"),
        (["export", EXAMPLE, "--to", "mitsuba", "--to", "povrey"], "povrey"),
        (["check", "missing.txt"], "missing.txt:1:1: expected "),
        (["check", EXAMPLE, "--size", "0x16"], "size"),
        (["check", EXAMPLE, "--depth", "-1"], "depth"),
        (["export", EXAMPLE, "--size", "16x0"], "size"),
        (["export", EXAMPLE, "--depth", "-1"], "depth"),
        (["compare", "missing.png", EXAMPLE], "missing.png:1:1: expected a picture"),
        (["compare", EXAMPLE, EXAMPLE], "expected a picture"),
        (["invent"], "invent"),
    ],
    ids=lambda value: " ".join(Path(word).name for word in value) if isinstance(value, list) else None,
)
def test_bad_input_ends_with_2_and_writes_nothing(words: list[str | Path], message: str, tmp_path: Path) -> None:
    result = crossray(*words, cwd=tmp_path)
    assert (result.returncode, result.stdout) == (2, ""), result.stderr
    assert message in result.stderr
    assert "Traceback" not in result.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("words", "code"), [([], 0), (["--with", "mitsuba", "povray"], 3)])
def test_renderer_that_is_not_installed(words: list[str], code: int, tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    out = tmp_path / "out"
    result = crossray("check", EXAMPLE, *SMALL, *words, "--out", out, path=str(tmp_path / "empty"))
    assert result.returncode == code, result.stderr
    assert statuses(out)["example1", "povray"] == "not-installed"
    assert statuses(out)["example1", "mitsuba"] == "rendered"
    reason = "not installed; to have it: apt-get install povray"
    assert f"example1  povray  not-installed: {reason}\n" in result.stdout
    assert reason in (out / "report.html").read_text(encoding="utf-8")
    assert reason in (out / "junit.xml").read_text(encoding="utf-8")


def test_renderer_that_is_wrong_ends_with_1(fake_povray: tuple[str, Path], tmp_path: Path) -> None:
    path, script = fake_povray
    write_image(tmp_path / "black.png", np.zeros((16, 16, 3)))
    script.write_text(f"exec {shutil.which('cp')} {tmp_path}/black.png scene.png\n", encoding="utf-8")
    result = crossray("check", EXAMPLE, *SMALL, "--out", tmp_path / "out", path=path)
    assert result.returncode == 1, result.stderr
    assert "example1  povray  disagree: 256 of 256 pixels unexplained; " in result.stdout


FAILURES = {"crash": ("echo oh dear; exit 7", "exit code 7"), "endless": ("while :; do :; done", "out of time (4 s)")}


@pytest.mark.parametrize("failure", FAILURES)
def test_renderer_that_fails_ends_with_3_and_the_rest_is_kept(
    failure: str, fake_povray: tuple[str, Path], tmp_path: Path
) -> None:
    path, script = fake_povray
    program, reason = FAILURES[failure]
    script.write_text(program, encoding="utf-8")
    words = ("--timeout", "4") if failure == "endless" else ()
    result = crossray("check", EXAMPLE, *SMALL, "--with", "povray", *words, "--out", tmp_path / "out", path=path)
    assert result.returncode == 3, result.stderr
    assert "example1  povray  failed: " in result.stdout
    assert reason in result.stdout
    assert (tmp_path / "out/images/example1/certified.exr").is_file()
    assert reason in (tmp_path / "out/report.html").read_text(encoding="utf-8")


def test_refused_scene_is_said_and_is_no_failure(tmp_path: Path) -> None:
    out = tmp_path / "out"
    result = crossray("check", EXAMPLE, *SMALL, "--depth", "17", "--with", "mitsuba", "--out", out)
    assert result.returncode == 0, result.stderr
    assert statuses(out) == {("example1", "mitsuba"): "unsupported"}
    assert "17 bounces" in result.stdout


def test_exported_lines_draw_the_scene(tmp_path: Path) -> None:
    need("povray")
    folder = tmp_path / "my exports"
    result = crossray("export", EXAMPLE, "--size", "32x32", "-o", folder, "--quiet")
    assert (result.returncode, result.stderr) == (0, "")
    lines = result.stdout.splitlines()
    names = [name for name in renderer_names() if name != "native"]
    assert len(lines) == len(names)
    truth = exact(Scene.load(EXAMPLE), 32, 32)
    for name, picture in (("povray", "scene.png"), ("mitsuba", "scene.exr")):
        (line,) = [line for line in lines if f"/{name}' " in line]
        assert not (folder / name / picture).exists()
        subprocess.run(["sh", "-c", line], cwd=tmp_path, check=True, capture_output=True, timeout=60)
        assert pixels_over(truth, read_image(folder / name / picture)) == 0


def test_export_where_no_renderer_can_carry_the_scene(tmp_path: Path) -> None:
    result = crossray("export", EXAMPLE, "--depth", "300", "--to", "povray,mitsuba", "-o", tmp_path / "export")
    assert (result.returncode, result.stdout) == (3, "")
    assert "povray: not exported: POV-Ray follows at most 255 bounces, not 300" in result.stderr


def test_compare(tmp_path: Path) -> None:
    picture = np.random.default_rng(3).integers(0, 250, (20, 30, 3)).astype(float)
    other = picture.copy()
    other[4, 9, 1] += 2
    write_image(tmp_path / "right.png", picture)
    write_image(tmp_path / "same.exr", picture)
    write_image(tmp_path / "other.png", other)
    write_image(tmp_path / "small.png", picture[:-1])
    same, wrong, small = (
        crossray("compare", "right.png", name, cwd=tmp_path) for name in ("same.exr", "other.png", "small.png")
    )
    assert (same.returncode, wrong.returncode, small.returncode) == (0, 1, 2)
    assert (same.stderr, wrong.stderr, small.stdout) == ("", "", "")
    assert re.search(r"ssim +1\n", same.stdout)
    assert "column 9, row 4" in wrong.stdout
    assert "small.png:1:1: expected a picture of 30x20 like right.png, found 30x19" in small.stderr
    reported = crossray("compare", "right.png", "other.png", "--out", "out", cwd=tmp_path)
    assert (reported.returncode, reported.stdout) == (1, wrong.stdout)
    (scene,) = report(tmp_path / "out")["scenes"]
    assert scene["comparisons"][0]["worst"] == [{"column": 9, "row": 4, "error": 2, "class": None, "evidence": None}]
    assert "right.png" in (tmp_path / "out/report.html").read_text(encoding="utf-8")


def test_compare_keeps_pictures_that_lie_where_the_report_goes(tmp_path: Path) -> None:
    pictures = [tmp_path / "out/images/example1" / name for name in ("native.png", "povray.png")]
    pictures[0].parent.mkdir(parents=True)
    for picture in pictures:
        write_image(picture, np.zeros((16, 16, 3)))
    assert crossray("compare", *pictures, "--out", tmp_path / "out").returncode == 0
    assert [picture.is_file() for picture in pictures] == [True, True]


def test_check_keeps_files_that_are_not_its_own(tmp_path: Path) -> None:
    (tmp_path / "images").mkdir()
    (tmp_path / "images/holiday.jpg").write_bytes(b"mine")
    assert crossray("check", EXAMPLE, *SMALL, "--with", "native", "--out", tmp_path).returncode == 0
    assert (tmp_path / "images/holiday.jpg").is_file()


def test_doctor_names_every_renderer() -> None:
    result = crossray("doctor")
    assert (result.returncode, result.stderr) == (0, "")
    for name in renderer_names():
        assert re.search(rf"^(works|missing) +{name}: ", result.stdout, re.MULTILINE)


def test_scene_from_standard_input(tmp_path: Path) -> None:
    text = EXAMPLE.read_text(encoding="utf-8")
    result = crossray("render", "-", "-o", "picture.exr", *SMALL, stdin=text, cwd=tmp_path)
    assert (result.returncode, result.stdout, result.stderr) == (0, "", "")
    assert pixels_over(exact(Scene.load(EXAMPLE), 16, 16), read_image(tmp_path / "picture.exr")) == 0
    result = crossray("check", "-", *SMALL, "--with", "mitsuba", stdin=text, cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    assert statuses(tmp_path / "out") == {("stdin", "mitsuba"): "rendered"}
    result = crossray("check", "-", *SMALL, stdin=text + "7\n", cwd=tmp_path)
    assert result.returncode == 2
    assert result.stderr.startswith("<stdin>:25:1: expected ")


def test_scenes_of_one_name_both_appear(tmp_path: Path) -> None:
    copies = [tmp_path / folder / "homework.txt" for folder in ("anna", "bert")]
    for copy in copies:
        copy.parent.mkdir()
        shutil.copy(EXAMPLE, copy)
    result = crossray("check", *copies, *SMALL, "--with", "mitsuba", "--out", tmp_path / "out")
    assert result.returncode == 0, result.stderr
    scenes = report(tmp_path / "out")["scenes"]
    assert [scene["scene"] for scene in scenes] == ["homework", "homework-2"]
    assert [scene["path"] for scene in scenes] == list(map(str, copies))
    page = (tmp_path / "out/report.html").read_text(encoding="utf-8")
    assert all(str(copy) in page for copy in copies)


def test_scene_with_a_name_that_is_not_utf8(tmp_path: Path) -> None:
    shutil.copy(EXAMPLE, tmp_path / "caf\udce9.txt")
    result = crossray("check", "caf\udce9.txt", *SMALL, "--with", "native", cwd=tmp_path)
    assert "Traceback" not in result.stderr
    assert result.returncode == 0


def test_results_go_to_standard_output_and_messages_to_standard_error(tmp_path: Path) -> None:
    scene = tmp_path / "loud.txt"
    scene.write_text(EXAMPLE.read_text(encoding="utf-8").replace("0.1\n", "1.5\n", 1), encoding="utf-8")
    words = ("check", scene, *SMALL, "--with", "mitsuba", "--out", tmp_path / "out")
    said, quiet, verbose = crossray(*words), crossray(*words, "--quiet"), crossray(*words, "--verbose")
    assert said.stdout == quiet.stdout == verbose.stdout
    assert re.fullmatch(r"loud  mitsuba  agree: .*\n", said.stdout)
    assert said.stderr.splitlines() == [
        f"warning: {scene}:2:1: the ambient coefficient: 1.5 is outside 0..1",
        str(tmp_path / "out/report.html"),
    ]
    assert quiet.stderr == ""
    lines = re.sub(r"[0-9.]+ s$", "0 s", verbose.stderr, flags=re.MULTILINE).splitlines()
    drawn = [f"{name}: {scene}{end}" for name in ("certified", "mitsuba") for end in ("", ": rendered in 0 s")]
    assert sorted(lines[1:-2]) == drawn
    assert lines[-2:] == ["comparing: loud: mitsuba", str(tmp_path / "out/report.html")]


def test_examples_are_checked_when_no_scene_is_named(tmp_path: Path) -> None:
    result = crossray("check", *SMALL, "--with", "native", "--out", tmp_path / "out", cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    assert [scene["scene"] for scene in report(tmp_path / "out")["scenes"]] == [f"example{i}" for i in (1, 2, 3, 4)]


def test_import_of_the_command_line_is_light() -> None:
    program = "import crossray, sys; print({'drjit', 'mitsuba', 'OpenImageIO', 'skimage'} & set(sys.modules))"
    assert (
        subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, check=True).stdout == b"set()\n"
    )


@pytest.mark.parametrize("ending", [".jpg", ".png", ".exr"])
def test_drawing_imports_only_what_it_needs(ending: str, tmp_path: Path) -> None:
    program = "import atexit, sys; atexit.register(lambda: print(*sys.modules)); import crossray; crossray.main()"
    command = [sys.executable, "-c", program, "render", str(EXAMPLE), *SMALL, "-o", str(tmp_path / f"a{ending}")]
    result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    imported = {name.partition(".")[0] for name in result.stdout.split()}
    assert {"reference", "drjit", "numpy"} <= imported
    rest = {"mitsuba", "skimage", "scipy", "matplotlib", "rich", "jinja2", "translator", "reports", "flint"}
    assert not imported & (rest | ({"OpenImageIO"} if ending == ".jpg" else {"PIL"}))


def test_large_pictures_are_never_whole_in_memory(tmp_path: Path) -> None:
    """25 million pixels: 600 MB in double precision."""
    if not Path("/proc/self/status").exists():
        pytest.skip("the peak of memory is read from Linux's /proc")
    show = "print(*[line for line in open('/proc/self/status') if line.startswith('VmHWM')])"
    program = f"import atexit; atexit.register(lambda: {show}); import crossray; crossray.main()"
    words = ["render", str(EXAMPLE), "--size", "5000x5000", "-o", str(tmp_path / "a.png")]
    result = subprocess.run([sys.executable, "-c", program, *words], cwd=ROOT, capture_output=True, check=True)
    assert int(result.stdout.split()[1]) < 550_000
    assert read_image(tmp_path / "a.png").shape == (5000, 5000, 3)
