"""Accepted differences: what they cover, what they do not, and when they end."""

import json
from datetime import UTC, date, datetime, timedelta
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from helpers import crossray
from recorded import GREY, HEIGHT, WIDTH, altered, facts

from reference.errors import InputError
from reference.image import Picture, read_image
from reports.approvals import MOST, approvals_path, approve, read_approvals
from reports.recording import Recording, find_picture, read_run
from reports.results import unexplained
from reports.writing import write_reports

TODAY = datetime.now(UTC).date()
TOMORROW, YESTERDAY = TODAY + timedelta(days=1), TODAY - timedelta(days=1)
TEXT = "not a scene: nothing is explained"
KNOWN = altered((5, 5, 200), (6, 5, 90))


def judged(
    folder: Path, picture: Picture, approvals: list[dict[str, Any]], text: str = TEXT, renderer: str = "povray"
) -> dict[str, Any]:
    run = Recording(folder, "0.1.0")
    entry = run.add_scene("s.txt", WIDTH, HEIGHT, depth=3, convention="exact", text=text, approvals=approvals)
    run.add_picture(entry, facts("native"), GREY)
    run.add_picture(entry, facts(renderer), picture)
    comparison: dict[str, Any] = write_reports(folder)["scenes"][0]["comparisons"][0]
    return comparison


@pytest.fixture
def approvals(tmp_path: Path) -> list[dict[str, Any]]:
    folder, path = tmp_path / "first", tmp_path / "s.approved.json"
    assert judged(folder, KNOWN, [])["verdict"] == "disagree"
    entry, picture = find_picture(folder, read_run(folder), TEXT, "povray")
    levels = read_image(folder / f"{picture['image']}.exr")
    places = unexplained(folder, entry, picture)
    assert places == [(5, 5), (5, 6)]
    assert approve(path, entry, "povray", levels, places, because="a <b>known</b> | limit", until=TOMORROW) == 2
    return read_approvals(path)


def test_what_is_approved_agrees_and_stays_counted(tmp_path: Path, approvals: list[dict[str, Any]]) -> None:
    found = judged(tmp_path / "run", KNOWN, approvals)
    assert (found["verdict"], found["pixels"]["unexplained"]) == ("agree", 2)
    about = {"because": "a <b>known</b> | limit", "until": TOMORROW.isoformat()}
    assert found["approval"] == about | {"expired": False, "pixels": 2}
    assert [pixel.get("approved") for pixel in found["worst"]] == [True, True]
    html = (tmp_path / "run" / "report.html").read_text(encoding="utf-8")
    assert f"approved until {TOMORROW}" in html
    case = ElementTree.parse(tmp_path / "run" / "junit.xml").find(".//testcase[@name='povray']")
    assert case is not None
    assert [child.tag for child in case] == ["properties"]
    summary = (tmp_path / "run" / "summary.md").read_text(encoding="utf-8")
    assert f"2 pixels approved until {TOMORROW}: a &#60;b&#62;known&#60;/b&#62; &#124; limit" in summary


@pytest.mark.parametrize(
    ("picture", "covered", "worst"),
    [
        (altered((5, 5, 200), (6, 5, 90), (7, 5, 101)), 2, (7, 5)),  # another pixel
        (altered((5, 5, 201), (6, 5, 90)), 1, (5, 5)),  # another colour of the same pixel
        (altered((5, 5, 0), (6, 5, 90)), 1, (5, 5)),  # the same error to the other side
    ],
)
def test_another_difference_is_not_hidden(
    tmp_path: Path, approvals: list[dict[str, Any]], picture: Picture, covered: int, worst: tuple[int, int]
) -> None:
    found = judged(tmp_path / "run", picture, approvals)
    assert (found["verdict"], found["approval"]["pixels"]) == ("disagree", covered)
    assert (found["worst"][0]["column"], found["worst"][0]["row"]) == worst
    failure = ElementTree.parse(tmp_path / "run" / "junit.xml").find(".//failure")
    assert failure is not None
    assert f"{covered} of them are approved" in failure.attrib["message"]


def test_a_smaller_difference_is_covered(tmp_path: Path, approvals: list[dict[str, Any]]) -> None:
    assert judged(tmp_path / "run", altered((5, 5, 200.25)), approvals)["verdict"] == "agree"


def test_approvals_end_after_their_last_day(tmp_path: Path, approvals: list[dict[str, Any]]) -> None:
    last = [approvals[0] | {"until": TODAY.isoformat()}]
    over = [approvals[0] | {"until": YESTERDAY.isoformat()}]
    assert judged(tmp_path / "today", KNOWN, last)["verdict"] == "agree"
    found = judged(tmp_path / "after", KNOWN, over)
    assert (found["verdict"], found["approval"]["expired"]) == ("disagree", True)
    assert f"approval expired {YESTERDAY}" in (tmp_path / "after" / "report.html").read_text(encoding="utf-8")


def test_of_another_scene_or_renderer_or_size_they_say_nothing(tmp_path: Path, approvals: list[dict[str, Any]]) -> None:
    assert "approval" not in judged(tmp_path / "a", KNOWN, approvals, text="changed")
    assert "approval" not in judged(tmp_path / "b", KNOWN, approvals, renderer="tachyon")
    assert "approval" not in judged(tmp_path / "c", KNOWN, [approvals[0] | {"width": 7}])


def test_a_new_approval_replaces_the_old_one_and_leaves_others(tmp_path: Path, approvals: list[dict[str, Any]]) -> None:
    path = tmp_path / "s.approved.json"
    entry = {"text": TEXT, "width": WIDTH, "height": HEIGHT, "depth": 3}
    approve(path, entry, "tachyon", KNOWN, [(5, 5)], because="other", until=TOMORROW)
    approve(path, entry, "povray", KNOWN, [(5, 6)], because="again", until=TOMORROW)
    assert [(found["renderer"], found["because"]) for found in read_approvals(path)] == [
        ("tachyon", "other"),
        ("povray", "again"),
    ]


@pytest.mark.parametrize(
    ("places", "because", "message"),
    [
        ([], "why", "found none"),
        ([(5, 5)], "  ", "expected a reason"),
        ([(0, 0)] * (MOST + 1), "why", f"found {MOST + 1}"),
        ([(9, 9)], "why", "not numbers"),
    ],
)
def test_what_cannot_be_approved(tmp_path: Path, places: list[tuple[int, int]], because: str, message: str) -> None:
    entry = {"text": TEXT, "width": WIDTH, "height": HEIGHT, "depth": 3}
    with pytest.raises(InputError, match=message):
        approve(tmp_path / "x.json", entry, "povray", altered((9, 9, np.nan)), places, because=because, until=date.max)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{\n  broken", ":2:3: expected JSON"),
        ("[]", ":1:1: expected"),
        ('{"version": 2, "approvals": []}', ":1:1: expected"),
        ('{"version": 1, "approvals": [{"renderer": "povray"}]}', ":1:1: expected approvals"),
        ("[" * 100000, ":1:1: expected a file of approvals"),
    ],
)
def test_damaged_files_are_refused_at_a_place(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "s.approved.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=message):
        read_approvals(path)


def test_standard_input_has_no_place_for_approvals() -> None:
    with pytest.raises(InputError, match="standard input"):
        approvals_path("-")


SCENE = "255 255 255\n0.3\n1\n255 0 0\n0 0 300\n80\n0.5\n0\n0\n"


def test_the_command_line_from_disagreement_to_approval(tmp_path: Path) -> None:
    (tmp_path / "s.txt").write_text(SCENE, encoding="utf-8")
    words = ("check", "s.txt", "--size", "24x24", "--with", "native", "--out", "out")
    assert crossray(*words, cwd=tmp_path).returncode == 0
    run = read_run(tmp_path / "out")
    image = tmp_path / "out" / f"{run['scenes'][0]['pictures'][1]['image']}.exr"
    levels = read_image(image)
    levels[12, 12] += 30
    from reference.image import write_image

    write_image(image, levels)
    write_reports(tmp_path / "out")
    refused = crossray("approve", "s.txt", "native", "--because", "x", "--until", "2020-01-01", cwd=tmp_path)
    assert (refused.returncode, (tmp_path / "s.approved.json").exists()) == (2, False)
    asked = ("--because", "an experiment", "--until", TOMORROW.isoformat())
    done = crossray("approve", "s.txt", "native", *asked, cwd=tmp_path)
    assert (done.returncode, done.stdout) == (
        0,
        f"s.approved.json: 1 pixels of native approved until {TOMORROW}\n",
    )
    comparison = json.loads((tmp_path / "out" / "report.json").read_text(encoding="utf-8"))["scenes"][0]["comparisons"][
        0
    ]
    assert (comparison["verdict"], comparison["approval"]["pixels"]) == ("agree", 1)
    assert crossray(*words, cwd=tmp_path).returncode == 0
    assert len((tmp_path / "out" / "history.jsonl").read_text(encoding="utf-8").splitlines()) == 2
    (tmp_path / "s.approved.json").write_text("{", encoding="utf-8")
    refused = crossray(*words, cwd=tmp_path)
    assert refused.returncode == 2
    assert refused.stderr.startswith("s.approved.json:1:2: expected JSON")
