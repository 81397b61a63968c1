"""Running renderers: programs that misbehave in every way, then the real ones."""

import os
import shutil
import sys
from collections.abc import Callable, Iterator
from dataclasses import asdict
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from fakes import are_gone
from helpers import EXAMPLE, TRICKY, exact, need, pixels_over, rendered

import translator.process
import translator.run
from reference import Scene
from reference.image import Picture, write_image
from reference.text import parse
from translator.contract import PYTHON, Export, Limits, Settings, Unsupported
from translator.run import Outcome, installed_version, run_renderer

SETTINGS = Settings(8, 6)
EMPTY = Scene((255, 255, 255), 0.1)
ANSWERS = (PYTHON, "-c", "print('Fake 1.2')")

Draw = Callable[..., Outcome]


@pytest.fixture
def fresh_versions() -> Iterator[None]:
    installed_version.cache_clear()
    yield
    installed_version.cache_clear()


@pytest.fixture
def levels() -> Picture:
    return np.random.default_rng(1).uniform(0, 255, (6, 8, 3)).astype(np.float32)


@pytest.fixture
def draw(fresh_versions: None, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, levels: Picture) -> Draw:
    """Run a program as the renderer; in it, PICTURE is the path of a good picture, OUTSIDE a folder that stays."""
    outside = tmp_path / "outside"
    outside.mkdir()
    write_image(outside / "good.exr", levels)
    start = (
        f"import os, shutil, signal, sys, time\nPICTURE = {str(outside / 'good.exr')!r}\nOUTSIDE = {str(outside)!r}\n"
    )

    def run(
        program: str,
        version: tuple[str, ...] = ANSWERS,
        image: str = "scene.exr",
        timeout: float = 20,
        refusal: str | None = None,
        environment: dict[str, str] | None = None,
    ) -> Outcome:
        def export(scene: Scene, settings: Settings) -> Export:
            if refusal:
                raise Unsupported(refusal)
            files = {"program.py": start + program, "textures/list.txt": "é\n"}
            command = (PYTHON, "program.py", "two words")
            return Export(files, command, image, ("a note",), environment or {}, Limits(2.0**-10, 0.5))

        fake = SimpleNamespace(
            TITLE="The Fake",
            INSTALL="get fake",
            VERSION=(version, r"Fake (\S+)"),
            TIMING=r"traced in ([0-9.]+) s",
            SUMMARY=r"in short: .*",
            export=export,
        )
        monkeypatch.setattr(translator.run, "adapter", lambda name: fake)
        return run_renderer("fake", EMPTY, SETTINGS, timeout)

    return run


COPY = "shutil.copy(PICTURE, 'scene.exr')\n"


def test_rendered(draw: Draw, levels: Picture) -> None:
    outcome = draw(
        COPY + "print('traced in 0.25 s')\nassert open('textures/list.txt', encoding='utf-8').read() == 'é\\n'"
    )
    assert (outcome.renderer, outcome.title, outcome.status) == ("fake", "The Fake", "rendered"), outcome
    assert (outcome.version, outcome.reason, outcome.trace_seconds) == ("1.2", None, 0.25)
    assert outcome.seconds is not None
    assert 0 < outcome.seconds < 20
    assert outcome.command == f"{sys.executable} program.py 'two words'"
    assert outcome.log == "traced in 0.25 s\n"
    assert outcome.notes == ("a note",)
    assert outcome.limits == asdict(Limits(2.0**-10, 0.5))
    assert outcome.summary is None
    assert outcome.picture is not None
    np.testing.assert_allclose(outcome.picture, levels, rtol=1e-6)


def test_summary_is_what_the_log_says_in_short(draw: Draw) -> None:
    assert draw(COPY + "print('at length')\nprint('in short: fine')\nprint('at length')").summary == "in short: fine"


def test_unsupported(draw: Draw) -> None:
    outcome = draw("", refusal="no spheres, please: sphere 1")
    assert (outcome.status, outcome.version, outcome.reason) == ("unsupported", "1.2", "no spheres, please: sphere 1")
    assert outcome.picture is None


@pytest.mark.parametrize("version", [("no-such-renderer", "--version"), (PYTHON, "-c", "import sys; sys.exit(1)")])
def test_not_installed(draw: Draw, version: tuple[str, ...]) -> None:
    outcome = draw(COPY, version=version)
    assert (outcome.status, outcome.version, outcome.picture) == ("not-installed", None, None)
    assert outcome.reason == "not installed; to have it: get fake"


def test_version_that_cannot_be_read_is_unknown(draw: Draw) -> None:
    assert draw(COPY, version=(PYTHON, "-c", "print('hello')")).version == "unknown"


def test_version_is_asked_once(draw: Draw, tmp_path: Path) -> None:
    asked = tmp_path / "asked"
    version = (PYTHON, "-c", f"open({str(asked)!r}, 'a').write('x'); print('Fake 1.2')")
    assert [draw(COPY, version=version).version for _ in range(2)] == ["1.2", "1.2"]
    assert asked.read_text(encoding="ascii") == "x"


def test_exit_code(draw: Draw) -> None:
    outcome = draw(COPY + "print('out of luck')\nprint('bad sign', file=sys.stderr)\nsys.exit(7)")
    assert (outcome.status, outcome.reason) == ("failed", "it failed with exit code 7: out of luck")
    assert sorted(outcome.log.splitlines()) == ["bad sign", "out of luck"]
    assert (outcome.version, outcome.picture, outcome.notes) == ("1.2", None, ("a note",))
    assert outcome.seconds
    assert "program.py" in outcome.command


@pytest.mark.parametrize("number", ["signal.SIGSEGV", "signal.SIGKILL", "40"])
def test_killed_by_a_signal(draw: Draw, number: str) -> None:
    outcome = draw(f"os.kill(os.getpid(), {number})\ntime.sleep(20)")
    assert outcome.status == "failed"
    assert outcome.reason is not None
    assert outcome.reason.startswith("it was stopped by ")
    assert number.removeprefix("signal.") in outcome.reason


FORK = """
import subprocess
child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"])
open(os.path.join(OUTSIDE, "processes"), "w").write(f"{os.getpid()} {child.pid}")
"""


def test_timeout_leaves_no_process(draw: Draw, tmp_path: Path) -> None:
    outcome = draw(FORK + "print('still there', flush=True)\ntime.sleep(60)", timeout=2)
    assert (outcome.status, outcome.reason, outcome.log) == (
        "failed",
        "it ran out of time (2 s): still there",
        "still there\n",
    )
    assert outcome.seconds is not None
    assert 2 <= outcome.seconds < 8
    processes = (tmp_path / "outside/processes").read_text(encoding="ascii").split()
    assert len(processes) == 2
    assert are_gone([int(process) for process in processes])


def test_a_process_that_is_left_behind_is_ended(draw: Draw, tmp_path: Path) -> None:
    assert draw(FORK + COPY).status == "rendered"
    processes = (tmp_path / "outside/processes").read_text(encoding="ascii").split()
    assert are_gone([int(process) for process in processes])


UNUSABLE = {
    "none": ("scene.exr", ""),
    "truncated EXR": ("scene.exr", "open('scene.exr', 'wb').write(open(PICTURE, 'rb').read()[:-40])"),
    "header of an EXR": ("scene.exr", "open('scene.exr', 'wb').write(open(PICTURE, 'rb').read()[:60])"),
    "truncated PNG": ("good.png", "open('good.png', 'wb').write(open(OUTSIDE + '/good.png', 'rb').read()[:-80])"),
    "empty": ("scene.png", "open('scene.png', 'wb')"),
    "text": ("scene.png", "open('scene.png', 'w').write('not a picture ' * 100)"),
    "folder": ("scene.png", "os.mkdir('scene.png')"),
}


@pytest.mark.parametrize("case", UNUSABLE)
def test_no_usable_picture(draw: Draw, tmp_path: Path, levels: Picture, case: str) -> None:
    write_image(tmp_path / "outside/good.png", levels)
    image, program = UNUSABLE[case]
    outcome = draw("print('done')\n" + program, image=image)
    assert outcome.status == "failed", outcome
    assert outcome.reason is not None
    assert outcome.reason.startswith("it left no usable picture (")
    assert "found" in outcome.reason
    assert "/" not in outcome.reason
    assert outcome.log == "done\n"


def test_picture_of_the_wrong_size(draw: Draw, tmp_path: Path) -> None:
    write_image(tmp_path / "outside/good.png", np.zeros((8, 6, 3)))
    outcome = draw("print('done')\nshutil.copy(OUTSIDE + '/good.png', 'scene.png')", image="scene.png")
    assert (outcome.status, outcome.reason) == ("failed", "expected a picture of 8x6, found 6x8: done")
    assert (outcome.picture, outcome.log) == (None, "done\n")


def test_environment_is_cleaned(draw: Draw, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("POVINI", "RAYPATH", "SECRET", "PYTHONPATH"):
        monkeypatch.setenv(name, "/somewhere")
    program = (
        COPY + "print(os.getcwd())\nfor name in os.environ: print(name, os.environ[name])\nprint(sys.stdin.read())"
    )
    folder, *rows = draw(program, environment={"OWN": "yes"}).log.splitlines()
    found = dict(row.partition(" ")[::2] for row in rows if row)
    kept = {"PATH", "PYTHONUSERBASE", "DRJIT_LIBLLVM_PATH"}
    assert set(found) - {"LC_CTYPE"} - kept == {"LANG", "HOME", "TMPDIR", "OWN"}
    assert found["HOME"] == found["TMPDIR"] == folder
    assert (found["OWN"], found["PATH"]) == ("yes", os.environ["PATH"])


ENDINGS = {"well": COPY, "badly": "sys.exit(1)", "late": "time.sleep(60)", "without a picture": ""}


@pytest.mark.parametrize("ending", ENDINGS)
def test_private_folder_is_gone(draw: Draw, tmp_path: Path, ending: str) -> None:
    note = "open(OUTSIDE + '/folder', 'w').write(os.getcwd())\nos.makedirs('deep/er')\nos.chmod('deep', 0o500)\n"
    draw(note + ENDINGS[ending], timeout=2)
    folder = Path((tmp_path / "outside/folder").read_text(encoding="utf-8"))
    assert folder.is_absolute()
    assert not folder.exists()


def test_renderer_that_empties_its_folder_has_failed(draw: Draw) -> None:
    outcome = draw("for name in os.listdir('.'): shutil.rmtree(name) if os.path.isdir(name) else os.remove(name)")
    assert outcome.status == "failed"


def test_log_shows_lines_as_a_terminal_does(draw: Draw) -> None:
    text = "start\\r\\n 10%\\r 50%\\rdone\\nlast \\xff line"
    outcome = draw(COPY + f"sys.stdout.buffer.write(b'{text}')")
    assert outcome.log == "start\ndone\nlast \N{REPLACEMENT CHARACTER} line"


@pytest.mark.parametrize("separator", ["\\n", " ", "\\r"])
def test_huge_output_is_cut_to_its_end(draw: Draw, separator: str) -> None:
    outcome = draw(
        COPY + f"for number in range(300000): sys.stdout.write(f'line {{number}}{separator}')\nprint('the end')"
    )
    assert outcome.status == "rendered"
    assert outcome.log.endswith("the end\n")
    assert len(outcome.log) <= translator.process.KEPT_LOG
    assert "line 0" not in outcome.log.splitlines()


CREASE = 62  # at 100x100 the centres of this row see floor and wall meet, a tie that float32 cannot decide


@pytest.mark.parametrize(
    ("name", "allowed", "undecided"), [("native", 0, []), ("povray", 0, []), ("mitsuba", 1, [CREASE])]
)
def test_real_renderers_draw_the_example(name: str, allowed: int, undecided: list[int]) -> None:
    scene = Scene.load(EXAMPLE)
    picture, truth = rendered_by(name, scene, 100, 100), exact(scene, 100, 100)
    assert pixels_over(np.delete(truth, undecided, axis=0), np.delete(picture, undecided, axis=0)) <= allowed


@pytest.mark.parametrize("name", ["native", "povray", "mitsuba"])
@pytest.mark.parametrize("text", [EXAMPLE.read_text(encoding="ascii"), TRICKY], ids=["example", "tricky"])
@pytest.mark.filterwarnings("ignore::reference.errors.SceneWarning")
def test_pictures_that_are_not_square_agree(name: str, text: str) -> None:
    scene = parse(text)
    assert pixels_over(exact(scene, 160, 90), rendered_by(name, scene, 160, 90)) == 0


def rendered_by(name: str, scene: Scene, width: int, height: int) -> Picture:
    if name == "povray":
        need("povray")
    return rendered(name, scene, Settings(width, height))[0]


def test_renderer_without_its_program_is_not_installed(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    assert shutil.which("povray") is None
    installed_version.cache_clear()
    outcome = run_renderer("povray", EMPTY, SETTINGS)
    installed_version.cache_clear()
    assert (outcome.status, outcome.reason) == ("not-installed", "not installed; to have it: apt-get install povray")


def test_mitsuba_misses_a_slanting_plane_whose_own_directions_rays_have() -> None:
    """A grey plane through the eye holds a diagonal of pixels; they show the red wall, in light or in shadow."""
    grey, wall = "99 99 99\n0 0 0\n1 1 0\n1\n0\n", "190 51 83\n0 0 800\n0 0 -1\n0.7\n0\n"
    scene = parse(f"255 255 255\n0.1\n0\n2\n{grey}{wall}")
    red, green, _ = rendered_by("mitsuba", scene, 64, 64).diagonal()
    assert red == pytest.approx(green * 190 / 51, rel=1e-3)
