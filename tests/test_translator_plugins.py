"""Renderers of other distributions: the example one, installed for real, and those that are at fault."""

import json
import os
import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest
from helpers import EXAMPLE, ROOT, Finished, crossray

from reference import Scene
from reference.errors import RendererError
from translator.contract import Export, Limits, Settings
from translator.registry import TRUTH, adapter, ignored_offers, own_renderers, renderer_names
from translator.run import export_scene, run_renderer

EXAMPLE_RENDERER = ROOT / "tests" / "example_renderer"
DIAGNOSTIC = ROOT / "scenes" / "diagnostic"
EMPTY = Scene((255, 255, 255), 0.1)
SMALL = ("--size", "64x64")

Run = Callable[..., Finished]


def reported(folder: Path) -> dict[tuple[str, str], dict[str, Any]]:
    content = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    return {
        (scene["scene"], picture["renderer"]): picture
        for scene in content["scenes"]
        for picture in scene["comparisons"]
    }


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """crossray's command line in an environment of its own, beside which the example renderer is installed."""
    folder = tmp_path_factory.mktemp("environment")
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", folder], check=True)
    (site,) = (folder / "lib").glob("python*/site-packages")
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index", "--no-build-isolation"]
    subprocess.run([*pip, "--target", site, EXAMPLE_RENDERER], check=True)
    outside = [str(ROOT), *(path for path in sys.path if path.endswith("site-packages"))]
    (site / "outside.pth").write_text("\n".join(outside), encoding="utf-8")
    python = str(folder / "bin" / "python")

    def run(*words: str | Path) -> Finished:
        command = [python, "-m", "crossray", *map(str, words)]
        return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=120, check=False)

    return run


def test_the_example_is_as_small_as_promised() -> None:
    text = (EXAMPLE_RENDERER / "my_tracer_adapter.py").read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 70
    assert "crossray" not in re.sub(
        r"#.*|\"\"\".*?\"\"\"", "", (EXAMPLE_RENDERER / "my_tracer.py").read_text(), flags=re.S
    )


def test_doctor_lists_it(run: Run) -> None:
    result = run("doctor")
    assert result.returncode == 0, result.stdout + result.stderr
    assert "works   my-tracer: My tracer 1.0\n" in result.stdout


def test_its_export_runs_by_the_line_that_is_printed(run: Run, tmp_path: Path) -> None:
    result = run("export", EXAMPLE, "--to", "my-tracer", *SMALL, "-o", tmp_path, "--verbose")
    assert result.returncode == 0, result.stderr
    assert "my-tracer: My tracer computes in double precision" in result.stderr
    assert [path.name for path in (tmp_path / "my-tracer").iterdir()] == ["scene.txt"]
    subprocess.run(["sh", "-c", result.stdout], check=True, capture_output=True)
    native = run("render", EXAMPLE, *SMALL, "--convention", "exact", "-o", tmp_path / "native.exr")
    assert native.returncode == 0, native.stderr
    compared = run("compare", tmp_path / "native.exr", tmp_path / "my-tracer/picture.exr")
    assert compared.returncode == 0, compared.stdout


def test_it_agrees_with_the_truth_and_refuses_what_it_cannot_do(run: Run, tmp_path: Path) -> None:
    names = ("near_cross", "inside_mirror", "light_on_sphere")
    scenes = [EXAMPLE.with_name("example4.txt"), *(DIAGNOSTIC / f"{name}.txt" for name in names)]
    result = run("check", *scenes, "--with", "my-tracer", *SMALL, "--out", tmp_path)
    assert result.returncode == 0, result.stdout + result.stderr
    *drawn, refused = reported(tmp_path).values()
    assert [picture["pixels"]["unexplained"] for picture in drawn] == [0] * 3
    for picture in drawn:
        assert picture["limits"] == asdict(Limits(2.0**-44)) | {"origin": [0, 0, 0]}
        assert 0 < picture["trace_seconds"] < picture["seconds"]
    reason = "my tracer decides by rounding whether sphere 1 hides the light, which lies on it"
    assert (refused["status"], refused["reason"]) == ("unsupported", reason)


def test_without_its_installation_the_name_is_unknown() -> None:
    result = crossray("check", EXAMPLE, "--with", "my-tracer")
    assert result.returncode == 2
    assert "found 'my-tracer'" in result.stderr


SOUND = """
from pathlib import Path
from translator.contract import Export, Limits

TITLE, LICENCE, INSTALL = "Somebody's", "MIT", "pip install somebody"
VERSION = (("echo", "Somebody 1.2"), r"Somebody (\\S+)")
TIMING = r"in (\\S+) s"


def export(scene, settings):
    return Export({"scene.txt": "text"}, ("echo", "in inf s"), "scene.exr")
"""
WHOLE = 'Export({"scene.txt": "text"}, ("echo", "in inf s"), "scene.exr")'
# What is replaced in the sound adapter, by what, and the reason that is given.
FAULTS = {
    "raises": ("TITLE", "1 / 0\nTITLE", "does not load: ZeroDivisionError: "),
    "exits": ("TITLE", "import sys; sys.exit(0)\nTITLE", "does not load: SystemExit: 0"),
    "breaks-off": ("TITLE", "def TITLE", "does not load: SyntaxError: "),
    "is-gone": (SOUND, "from nowhere import export", "does not load: ModuleNotFoundError: No module named 'nowhere'"),
    "has-no-title": ("TITLE, LICENCE", "NAME, LICENCE", "does not load: TypeError: it has no text TITLE"),
    "has-no-export": ("def export", "def draw", "does not load: TypeError: it has no function export"),
    "asks-no-version": ("VERSION", "VERSION = 3\nOTHER", "does not load: TypeError: its VERSION is not a command and"),
    "finds-nothing": (r"in (\S+) s", r"in \S+ s", "does not load: TypeError: its pattern TIMING has no group"),
    "cannot-search": (r"in (\S+) s", r"in (\S+ s", "does not load: "),
    "divides": (WHOLE, "settings.width / 0", "failed: ZeroDivisionError: "),
    "stops": (WHOLE, "exit(0)", "failed: SystemExit: 0"),
    "gives-a-dict": (WHOLE, '{"scene.txt": "text"}', "failed: TypeError: expected an Export, found {"),
    "gives-nothing": (WHOLE, "None", "failed: TypeError: expected an Export, found None"),
    "climbs": ('{"scene.txt"', '{"../climbed"', "failed: ValueError: expected a name inside the folder of the export"),
    "climbs-later": ('{"scene.txt"', '{"a/../../climbed"', "failed: ValueError: expected a name inside"),
    "leaves": ('{"scene.txt"', "{str(Path.cwd() / 'climbed')", "failed: ValueError: expected a name inside"),
    "looks-outside": ('"scene.exr"', '"../scene.exr"', "failed: ValueError: expected a name inside"),
    "gives-bytes": ('"text"', 'b"text"', "failed: TypeError: expected text in an export, found b'text'"),
    "says-nothing": ('("echo", "in inf s")', "()", "failed: ValueError: expected a command"),
    "sees-forever": ('"scene.exr")', '"scene.exr", limits=Limits(far=1e999))', "failed: ValueError: expected finite"),
}  # fmt: skip
LOADED = [name for name in FAULTS if "does not load" not in FAULTS[name][2]]
DRAWS_NOTHING = "draws-nothing"  # which an adapter cannot know


@pytest.fixture(scope="module")
def offers(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with modules and what is left of their installation."""
    folder = tmp_path_factory.mktemp("offers")
    points = {}
    for name, (old, new, _) in {**FAULTS, DRAWS_NOTHING: ("", "", "")}.items():
        points[name] = "offered_" + name.replace("-", "_")
        assert old in SOUND
        (folder / f"{points[name]}.py").write_text(SOUND.replace(old, new, 1) if old else SOUND, encoding="utf-8")
    points |= dict.fromkeys(("native", "povray", TRUTH, "Bad/Name", "../climbed", "A"), points[DRAWS_NOTHING])
    offer(folder, "somebody", points)
    offer(folder, "zoe", {DRAWS_NOTHING: points["raises"]})
    return folder


def offer(folder: Path, distribution: str, points: dict[str, str]) -> None:
    information = folder / f"{distribution}-1.0.dist-info"
    information.mkdir()
    (information / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {distribution}\nVersion: 1.0\n")
    lines = ["[crossray.renderers]", *(f"{name} = {module}" for name, module in points.items())]
    (information / "entry_points.txt").write_text("\n".join(lines) + "\n")


@pytest.fixture
def offered(offers: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(offers))


@pytest.mark.usefixtures("offered")
@pytest.mark.parametrize("name", FAULTS)
def test_a_faulty_adapter_costs_its_own_picture(name: str) -> None:
    outcome = run_renderer(name, EMPTY, Settings(8, 8), 20)
    assert outcome.status == "failed"
    assert str(outcome.reason).startswith(f"its adapter {FAULTS[name][2]}"), outcome.reason
    assert "Traceback" in outcome.log
    with pytest.raises(RendererError):
        export_scene(name, EMPTY, Settings())


@pytest.mark.usefixtures("offered")
def test_a_renderer_that_draws_nothing_has_failed() -> None:
    outcome = run_renderer(DRAWS_NOTHING, EMPTY, Settings(8, 8), 20)
    assert (outcome.status, outcome.version, outcome.trace_seconds) == ("failed", "1.2", None)
    assert str(outcome.reason).startswith("it left no usable picture")


@pytest.mark.usefixtures("offered")
def test_names_that_are_taken_or_unfit_are_ignored() -> None:
    assert set(renderer_names()) == ({*own_renderers(), *FAULTS, DRAWS_NOTHING} - {TRUTH})
    assert [adapter(name).TITLE for name in ("native", "povray", TRUTH)] == ["crossray", "POV-Ray", "Certified truth"]
    assert adapter(DRAWS_NOTHING).TITLE == "Somebody's"
    unfit = [f"'{name}' of somebody: expected a name of a-z, 0-9 and -" for name in ("Bad/Name", "../climbed", "A")]
    taken = [f"'{name}' of somebody: crossray has a renderer of that name" for name in ("native", "povray", TRUTH)]
    assert sorted(ignored_offers()) == sorted([f"'{DRAWS_NOTHING}' of zoe: somebody offers it, too", *unfit, *taken])


@pytest.fixture
def run_beside(offers: Path, tmp_path: Path) -> Run:
    """crossray's command line beside the offers, in a folder of its own that also holds its temporary ones."""

    def run(*words: str | Path) -> Finished:
        (tmp_path / "temporary").mkdir(exist_ok=True)
        found = os.pathsep.join(filter(None, [str(offers), str(ROOT), os.environ.get("PYTHONPATH")]))
        environment = os.environ | {"PYTHONPATH": found, "TMPDIR": str(tmp_path / "temporary")}
        command = [sys.executable, "-m", "crossray", *map(str, words)]
        return subprocess.run(
            command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=120, check=False
        )

    return run


def test_doctor_says_what_is_broken(run_beside: Run) -> None:
    result = run_beside("doctor")
    assert (result.returncode, result.stderr) == (0, "")
    broken = dict(re.findall(r"^BROKEN  (\S+): its adapter (.*)", result.stdout, re.MULTILINE))
    assert set(broken) == set(FAULTS)
    assert all(text.startswith(FAULTS[name][2]) for name, text in broken.items())
    assert f"works   {DRAWS_NOTHING}: Somebody's 1.2\n" in result.stdout
    assert "ignored 'Bad/Name' of somebody: expected a name of a-z, 0-9 and -\n" in result.stdout


def test_the_other_renderers_still_draw(run_beside: Run, tmp_path: Path) -> None:
    words = ("check", EXAMPLE, *SMALL, "--with", "native", *FAULTS, DRAWS_NOTHING)
    result = run_beside(*words)
    assert result.returncode == 3, result.stderr
    found = {name: picture for (_, name), picture in reported(tmp_path / "out").items()}
    assert found.pop("native")["verdict"] == "agree"
    assert {picture["status"] for picture in found.values()} == {"failed"}
    assert set(found) == {*FAULTS, DRAWS_NOTHING}
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out", "temporary"]
    assert not list((tmp_path / "temporary").iterdir())


def test_nothing_is_written_outside_of_the_folder(run_beside: Run, tmp_path: Path) -> None:
    result = run_beside("export", EXAMPLE, "--to", *LOADED, "-o", "a/b")
    assert result.returncode == 3
    assert result.stderr.count("not exported: its adapter failed: ") == len(LOADED)
    assert [path.name for path in tmp_path.iterdir()] == ["temporary"]


@pytest.mark.parametrize("name", ["", ".", "..", "/", "/x", "../x", "a/../../x", "a/..", "x\0"])
def test_an_export_stays_in_its_folder(name: str) -> None:
    for files, image in (({name: "text"}, "scene.exr"), ({}, name)):
        with pytest.raises(ValueError, match="inside the folder"):
            Export(files, ("draw",), image)


@pytest.mark.parametrize("value", [-1.0, float("inf"), float("nan")])
@pytest.mark.parametrize("name", ["precision", "gap", "far", "ahead", "short"])
def test_limits_are_finite(name: str, value: float) -> None:
    with pytest.raises(ValueError, match="finite limits"):
        Limits(**{name: value})  # type: ignore[arg-type]
