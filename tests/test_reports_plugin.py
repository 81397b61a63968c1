"""The pytest plugin and `crossray.assert_matches` in a student's own repository."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from helpers import EXAMPLE

from reference import PUBLISHED, Scene, render
from reference.image import write_image

SIDE = 120
TESTS = """\
import crossray

def test_right():
    crossray.assert_matches("scene.txt", "right.png")

def test_wrong():
    crossray.assert_matches("scene.txt", "wrong.png", out="report")

def test_fixture(assert_matches):
    assert_matches("scene.txt", "wrong.png")

def test_missing():
    crossray.assert_matches("scene.txt", "missing.png")
"""


@pytest.fixture(scope="module")
def repository(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("homework")
    shutil.copy(EXAMPLE, folder / "scene.txt")
    scene = Scene.load(EXAMPLE)
    write_image(folder / "right.png", render(scene, width=SIDE, height=SIDE))
    write_image(folder / "wrong.png", render(scene, PUBLISHED, width=SIDE, height=SIDE))
    (folder / "test_picture.py").write_text(TESTS, encoding="utf-8")
    (folder / "reports").mkdir()  # as students have; ours must still be found
    return folder


def run_pytest(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *words]
    environment = {name: value for name, value in os.environ.items() if name != "PYTEST_ADDOPTS"}
    return subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, timeout=120, check=False
    )


def test_in_a_students_repository(repository: Path) -> None:
    result = run_pytest(repository, "--crossray-out", "found")
    assert "3 failed, 1 passed" in result.stdout, result.stdout + result.stderr
    wrong, fixture, missing = result.stdout.split("def test_")[1:]
    for told, report in ((wrong, "report"), (fixture, "found/test_fixture")):
        assert "AssertionError: wrong.png: scene: wrong: " in told or "AssertionError: " in told
        assert "most likely R7: " in told
        assert "What to do: " in told
        assert f"The report: {repository / report / 'grade.html'}" in told
        assert (repository / report / "grade.html").stat().st_size > 10_000
        assert "reports/assertion.py" not in told
    assert "no such file" in missing


def test_without_the_plugin(repository: Path) -> None:
    result = run_pytest(repository, "-p", "no:crossray", "-k", "right or fixture")
    assert "1 passed, 2 deselected, 1 error" in result.stdout
    assert "fixture 'assert_matches' not found" in result.stdout


def test_pytest_starts_light() -> None:
    """The plugin alone loads nothing of crossray's, and no library."""
    program = "import sys, reports.pytest_plugin; print(*sorted(sys.modules))"
    result = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    loaded = set(result.stdout.split())
    assert "reports.pytest_plugin" in loaded
    assert not loaded & {"reference", "crossray", "numpy", "drjit", "PIL", "jinja2", "OpenImageIO"}
    assert not [name for name in loaded if name.startswith("reports.") and name != "reports.pytest_plugin"]
