"""`crossray grade`: verdicts, causes, exit codes and files, for one picture and for a class."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import click.testing
import numpy as np
import pytest
from fakes import are_gone
from helpers import EXAMPLE, ROOT, crossray
from jsonschema import Draft202012Validator
from matplotlib import cbook
from PIL import Image

import crossray as command_line
from reference import DOCUMENT, Scene, render
from reference.image import quantise, write_image
from reference.mistakes import MISTAKES
from reference.model import pixel_direction
from reference.world import View
from reports import gradebook, workers
from reports.collection import Collection, Entry
from reports.gradebook import Assignment
from reports.workers import Failed

SIDE = 160
OTHER = ROOT / "scenes" / "example2.txt"
PICTURE = {"picture", "verdict", "reason", "causes", "blobs"}  # what others rely on


def drawn(path: Path, mistake: str = "") -> Image.Image:
    """The right picture of a scene, or one with a mistake of the bank."""
    scene, view = Scene.load(path), View(SIDE, SIDE, 3)
    if mistake:
        return Image.fromarray(quantise(MISTAKES[mistake].draw(scene, view)))
    return Image.fromarray(quantise(np.asarray(render(scene, DOCUMENT, width=SIDE, height=SIDE))))


def schema() -> dict[str, Any]:
    content: dict[str, Any] = json.loads((ROOT / "reports/assets/grade.schema.json").read_text(encoding="utf-8"))
    Draft202012Validator.check_schema(content)
    return content


def graded(folder: Path) -> dict[str, Any]:
    """What grade.json holds, which follows its schema."""
    content: dict[str, Any] = json.loads((folder / "grade.json").read_text(encoding="utf-8"))
    assert [error.message for error in Draft202012Validator(schema()).iter_errors(content)] == []
    return content


@pytest.fixture(scope="module")
def singles(tmp_path_factory: pytest.TempPathFactory) -> tuple[int, dict[str, dict[str, Any]]]:
    """Many pictures for one scene, good and bad, in one call: the exit code and each one's record."""
    folder = tmp_path_factory.mktemp("singles")
    right = drawn(EXAMPLE)
    right.save(folder / "right.png")
    right.save(folder / "right.jpg", quality=75)
    drawn(EXAMPLE, "S8").save(folder / "unshadowed.png")
    drawn(EXAMPLE, "C1").save(folder / "flipped.png")
    drawn(OTHER).save(folder / "other.png")
    photograph = Image.open(cbook._get_data_path("sample_data", "grace_hopper.jpg"))
    photograph.convert("RGB").resize((SIDE, SIDE)).save(folder / "photograph.jpg")
    Image.new("RGB", (SIDE, SIDE)).save(folder / "black.png")
    Image.new("RGB", (SIDE, SIDE), (255, 255, 255)).save(folder / "white.png")
    for name in ("right.png", "right.jpg"):
        whole = (folder / name).read_bytes()
        (folder / f"cut_{name}").write_bytes(whole[: len(whole) // 2])
    (folder / "text.png").write_text("hello\n")
    (folder / "empty.png").write_bytes(b"")
    names = [*sorted(path.name for path in folder.iterdir()), "missing.png"]
    result = crossray("grade", EXAMPLE, *names, "--out", "out", cwd=folder)
    assert "Traceback" not in result.stderr
    return result.returncode, {Path(picture["picture"]).name: picture for picture in graded(folder / "out")["pictures"]}


def test_right_pictures(singles: tuple[int, dict[str, Any]]) -> None:
    for name in ("right.png", "right.jpg"):
        assert singles[1][name]["verdict"] == "right", singles[1][name]
        assert singles[1][name]["causes"] == singles[1][name]["blobs"] == []


@pytest.mark.parametrize(("name", "mistake"), [("unshadowed.png", "S8"), ("flipped.png", "C1")])
def test_mistakes_are_named(singles: tuple[int, dict[str, Any]], name: str, mistake: str) -> None:
    picture = singles[1][name]
    assert picture["verdict"] == "wrong"
    first = picture["causes"][0]
    assert (first["id"], first["named"]) == (mistake, True)
    assert first["share"] > 0.9
    assert (first["title"], first["hint"]) == (MISTAKES[mistake].title, MISTAKES[mistake].hint)
    assert picture["features"] == [MISTAKES[mistake].feature]
    assert picture["blobs"]
    worst = picture["worst"]
    assert any(
        left <= worst["column"] <= right and top <= worst["row"] <= bottom
        for left, top, right, bottom in (blob["box"] for blob in picture["blobs"])
    )
    assert worst["ray_tree"][0] == f"column {worst['column']}, row {worst['row']}, convention document"
    assert worst["sum"] == " ".join(map(str, worst["expected"]))


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("other.png", "."),
        ("photograph.jpg", "."),
        ("black.png", "blank"),
        ("white.png", "blank"),
    ],
)
def test_what_is_no_picture_of_the_scene_has_no_false_cause(
    singles: tuple[int, dict[str, Any]], name: str, reason: str
) -> None:
    picture = singles[1][name]
    assert picture["verdict"] == "wrong"
    assert not [cause for cause in picture["causes"] if cause["named"]], picture["causes"]
    assert re.search(reason, picture["reason"] + picture["advice"])


def test_a_picture_that_lies_aside_is_told_how_far(tmp_path: Path) -> None:
    """By no known mistake: three quarters of a pixel to the right, sampled at random."""
    places = np.random.default_rng(8).random((2, SIDE, SIDE))
    shifted = replace(DOCUMENT, camera_direction=lambda column, row, *size: pixel_direction(column - 3, row, *size))
    large = np.clip(render(Scene.load(EXAMPLE), shifted, width=4 * SIDE, height=4 * SIDE), 0, 255)
    rows, columns = np.indices((SIDE, SIDE))
    down, across = (places * 4).astype(int)
    picture = large.reshape(SIDE, 4, SIDE, 4, 3)[rows, down, columns, across]
    Image.fromarray(quantise(picture)).save(tmp_path / "aside.png")
    crossray("grade", EXAMPLE, "aside.png", "--out", "out", cwd=tmp_path)
    (found,) = graded(tmp_path / "out")["pictures"]
    assert found["verdict"] == "wrong"
    assert re.search(r"0\.[78] pixels too far right: which point of the screen", found["advice"])
    assert found["features"] == ["geometry"]


@pytest.mark.parametrize("name", ["cut_right.png", "cut_right.jpg", "text.png", "empty.png", "missing.png"])
def test_what_is_no_picture_is_unreadable(singles: tuple[int, dict[str, Any]], name: str) -> None:
    picture = singles[1][name]
    assert (picture["verdict"], picture["status"]) == ("unreadable", "refused")
    assert picture["causes"] == picture["blobs"] == []
    assert name not in picture["reason"]
    assert len(picture["reason"]) < 150


def test_bad_input_is_the_exit_code(singles: tuple[int, dict[str, Any]]) -> None:
    assert singles[0] == 2


def test_one_right_picture(tmp_path: Path) -> None:
    drawn(EXAMPLE).save(tmp_path / "scene.jpg", quality=90)
    text = EXAMPLE.read_text(encoding="utf-8")
    result = crossray("grade", "-", "scene.jpg", "--quiet", cwd=tmp_path, stdin=text)
    assert (result.returncode, result.stderr) == (0, "")
    assert re.fullmatch(r"scene\.jpg: stdin: right: .+\n", result.stdout)
    content = graded(tmp_path / "out")
    assert (content["version"], content["scene"]) == (1, "-")
    assert set(content["pictures"][0]) >= PICTURE
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        "grade.html",
        "grade.json",
        "results.json",
        "pictures",
    }
    assert json.loads((tmp_path / "out" / "results.json").read_text())["score"] == 100


@pytest.mark.parametrize(
    ("key", "value"),
    [("verdict", "maybe"), ("status", "fine"), ("outside", -1), ("causes", [{"id": "S8"}]), ("features", ["magic"])],
)
def test_the_schema_refuses_what_is_wrong(tmp_path: Path, key: str, value: Any) -> None:
    drawn(EXAMPLE).save(tmp_path / "scene.png")
    assert crossray("grade", EXAMPLE, "scene.png", "--out", "out", cwd=tmp_path).returncode == 0
    content = graded(tmp_path / "out")
    content["pictures"][0][key] = value
    assert not Draft202012Validator(schema()).is_valid(content)


def test_one_wrong_picture(tmp_path: Path) -> None:
    drawn(EXAMPLE, "S8").save(tmp_path / "scene.png")
    result = crossray("grade", EXAMPLE, "scene.png", cwd=tmp_path)
    assert result.returncode == 1
    assert "most likely S8: " in result.stdout
    assert f"What to do: {MISTAKES['S8'].hint[:20]}" in result.stdout
    assert "The worst pixel, column " in result.stdout
    assert "out/grade.html" in result.stderr
    results = json.loads((tmp_path / "out" / "results.json").read_text())
    assert 80 <= results["score"] < 100


@pytest.fixture(scope="module")
def homework(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Six students, two scenes."""
    folder = tmp_path_factory.mktemp("class")
    makes = {"anna": "", "ben": "S8", "carl": "S8", "dora": "C1", "eve": ""}
    for scene in (EXAMPLE, OTHER):
        pictures = {mistake: drawn(scene, mistake) for mistake in set(makes.values())}
        for name, mistake in makes.items():
            (folder / name).mkdir(exist_ok=True)
            pictures[mistake].save(folder / name / f"{scene.stem}.png")
    (folder / "eve" / "example2.png").write_text("not yet")
    (folder / "finn").mkdir()
    return folder


def test_a_class(homework: Path, tmp_path: Path) -> None:
    words = ("grade", "--scene", EXAMPLE, "--scene", OTHER, homework, "--out", "out", "--jobs", "2")
    result = crossray(*words, cwd=tmp_path)
    assert result.returncode == 2  # eve's and finn's files
    content = graded(tmp_path / "out")
    assert content["scene"] is None
    assert [scene["scene"] for scene in content["scenes"]] == ["example1", "example2"]
    verdicts = {(picture["student"], picture["scene"]): picture["verdict"] for picture in content["pictures"]}
    assert {name: (verdicts[name, "example1"], verdicts[name, "example2"]) for name, _ in verdicts} == {
        "anna": ("right", "right"),
        "ben": ("wrong", "wrong"),
        "carl": ("wrong", "wrong"),
        "dora": ("wrong", "wrong"),
        "eve": ("right", "unreadable"),
        "finn": ("unreadable", "unreadable"),
    }
    common = {mistake["id"]: mistake["students"] for mistake in content["mistakes"]}
    assert common == {"S8": ["ben", "carl"], "C1": ["dora"]}
    scores = {}
    for student in content["students"]:
        folder = tmp_path / "out" / "students" / student["student"]
        scores[student["student"]] = json.loads((folder / "results.json").read_text())["score"]
        page = (folder / "grade.html").read_text(encoding="utf-8")
        assert len(re.findall("<article", page)) == 2
    assert scores == {student["student"]: student["points"] for student in content["students"]}
    assert (scores["anna"], scores["eve"], scores["finn"]) == (100, 50, 0)
    assert 50 < scores["ben"] < 100
    lines = result.stdout.splitlines()
    assert lines[0] == "anna: 100 of 100 points: example1 right, example2 right"
    assert lines[-2].startswith("2 students: S8 ")


def test_the_same_again_is_the_same(homework: Path, tmp_path: Path) -> None:
    """In whichever order the processes end."""
    pages = []
    for jobs in ("1", "2"):
        words = ("grade", "--scene", EXAMPLE, homework / "anna", homework / "ben", "--out", tmp_path / jobs)
        assert crossray(*words, "--pattern", "{scene}.png", "--jobs", jobs, "--quiet").returncode == 1
        content = graded(tmp_path / jobs)
        for picture in content["pictures"]:
            picture.pop("seconds")
        pages.append(content["pictures"])
    assert pages[0] == pages[1]


def test_bad_words(tmp_path: Path) -> None:
    (tmp_path / "bad.txt").write_text("1 2\n")
    for words, message in (
        (("bad.txt", "a.png"), r"bad\.txt:1:4: expected the ambient colour"),
        ((EXAMPLE,), "found no picture"),
        (("missing.txt", "a.png"), r"missing\.txt:1:1: expected a readable scene"),
        (("--scene", EXAMPLE, "--scene", EXAMPLE, "a.png"), "found example1 twice"),
        (("--scene", EXAMPLE, "--scene", OTHER, "a.png"), r"a\.png:1:1: expected a name that tells the scene"),
    ):
        result = crossray("grade", *words, cwd=tmp_path)
        assert result.returncode == 2
        assert re.search(message, result.stderr), result.stderr
    assert not (tmp_path / "out").exists()


def test_what_could_not_be_done(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("a.png", "b.png"):
        drawn(EXAMPLE).save(tmp_path / name)
    real = workers.run_jobs

    def sometimes(*jobs: Any, **options: Any) -> Any:
        for place, answer in real(*jobs, **options):
            yield place, Failed("it took more than 5 s") if place == 0 else answer

    monkeypatch.setattr(gradebook, "run_jobs", sometimes)
    words = ["grade", str(EXAMPLE), *(str(tmp_path / name) for name in ("a.png", "b.png")), "--out", str(tmp_path)]
    result = click.testing.CliRunner().invoke(command_line.app, words)
    assert result.exit_code == 3
    assert "a: 0 of 100 points: example1 not graded" in result.stdout
    assert [(picture["verdict"], picture["status"]) for picture in graded(tmp_path)["pictures"]] == [
        (None, "failed"),
        ("right", "graded"),
    ]


def test_being_stopped_leaves_no_process_and_no_report(tmp_path: Path) -> None:
    scene = Scene.load(EXAMPLE)
    write_image(tmp_path / "large.png", render(scene, width=3000, height=3000))
    for number in range(8):
        (tmp_path / "class").mkdir(exist_ok=True)
        os.link(tmp_path / "large.png", tmp_path / "class" / f"{number}.png")
    command = [sys.executable, "-m", "crossray", "grade", "--scene", str(EXAMPLE), str(tmp_path / "class")]
    with subprocess.Popen([*command, "--out", str(tmp_path / "out")], stderr=subprocess.PIPE, text=True) as process:
        children: list[int] = []
        while len(children) < 1:
            assert process.poll() is None
            time.sleep(0.05)
            listed = [path.read_text() for path in Path(f"/proc/{process.pid}/task").glob("*/children")]
            children = [int(word) for text in listed for word in text.split()]
        time.sleep(0.5)
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=30)
    assert (process.returncode, said) == (128 + signal.SIGINT, "interrupted\n")
    assert are_gone(children)
    assert not (tmp_path / "out" / "grade.json").exists()


def test_names_that_are_not_text(tmp_path: Path) -> None:
    """Names of files can be any bytes, and any words."""
    folder = tmp_path / "class"
    folder.mkdir()
    right = drawn(EXAMPLE)
    for name in (b"\xff\xfe.png", b"..png", b"-rf.png", "Zoë <b>.png".encode(), b"a\n.png"):
        with (folder / os.fsdecode(name)).open("wb") as file:
            right.save(file, "PNG")
    words = ("grade", "--scene", EXAMPLE, folder, "--out", tmp_path / "out")
    result = crossray(*words)
    assert result.returncode in (0, 2), result.stderr
    verdicts = [picture["verdict"] for picture in graded(tmp_path / "out")["pictures"]]
    assert verdicts.count("right") >= 3
    assert None not in verdicts


def test_nothing_to_grade(tmp_path: Path) -> None:
    """A student who has handed in nothing gets results all the same."""
    assignment = Assignment({"one": Scene.load(EXAMPLE)}, {"one": "one.txt"}, 3)
    results = gradebook.grade(assignment, Collection([Entry("anna", "one", None)], []), tmp_path, "0")
    assert results["pictures"][0]["reason"] == "there is no picture of one"
    assert json.loads((tmp_path / "results.json").read_text())["score"] == 0
