"""The runs of a folder: what is remembered, and what a damaged file does to it."""

import json
import shutil
from pathlib import Path
from typing import Any

import pytest
from recorded import GREY, altered, facts, record

from reports.history import HISTORY, KEPT, SHOWN, as_line, history, remember
from reports.writing import write_reports


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return record(tmp_path, {"s.txt": [(facts("native"), GREY), (facts("povray"), altered((5, 5, 200), (6, 5, 90)))]})


def load(folder: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    return content


def earlier(folder: Path, *days: int) -> list[dict[str, Any]]:
    line = as_line(load(folder))
    return [line | {"started": f"2020-01-{day:02}T00:00:00+00:00", "unexplained": day} for day in days]


def test_a_run_is_one_line_with_its_comparisons(folder: Path) -> None:
    (line,) = load(folder)["history"]
    assert (line["verdict"], line["failed"], line["unexplained"], line["seconds"]) == ("disagree", 0, 2, 2.5)
    assert line["comparisons"] == [
        {
            "scene": "s",
            "renderer": "povray",
            "status": "rendered",
            "verdict": "disagree",
            "unexplained": 2,
            "seconds": 1.25,
        }
    ]


def test_remembering_twice_and_redrawing_add_nothing(folder: Path) -> None:
    (folder / HISTORY).write_text("".join(json.dumps(run) + "\n" for run in earlier(folder, 1, 2)), encoding="utf-8")
    results = write_reports(folder)
    remember(folder, results)
    remember(folder, results)
    assert [run["unexplained"] for run in results["history"]] == [1, 2, 2]
    lines = (folder / HISTORY).read_text(encoding="utf-8").splitlines()
    assert [json.loads(line) for line in lines] == results["history"]
    before = {name: (folder / name).read_bytes() for name in ("report.html", "report.json", "summary.md")}
    copy = shutil.copytree(folder, folder / "copy")
    write_reports(copy)
    assert {name: (copy / name).read_bytes() for name in before} == before
    assert (copy / HISTORY).read_bytes() == (folder / HISTORY).read_bytes()


def test_an_earlier_run_does_not_know_later_ones(folder: Path) -> None:
    results = load(folder)
    runs = [*earlier(folder, 1), as_line(results), *earlier(folder, 3)]
    (folder / HISTORY).write_text("".join(json.dumps(run) + "\n" for run in runs), encoding="utf-8")
    assert history(folder, results) == runs[:2]


def test_damaged_lines_are_passed_over(folder: Path) -> None:
    good = json.dumps(earlier(folder, 4)[0]).encode()
    broken = [good[:-9], b"", b"[1]", b"null", b"\xff\xfe", b"[" * 5000, good.replace(b'"failed": 0', b'"failed": NaN')]
    broken.append(good.replace(b'"unexplained": 4', b'"unexplained": -1', 1))
    broken.append(good.replace(b'"seconds": 2.5', b'"seconds": 1e999', 1))
    (folder / HISTORY).write_bytes(b"\n".join([*broken, good, good[:40]]))
    results = write_reports(folder)
    assert [run["started"][:10] for run in results["history"][:-1]] == ["2020-01-04"]
    remember(folder, results)
    assert len((folder / HISTORY).read_bytes().splitlines()) == 2


def test_what_is_kept_and_shown_is_bounded(folder: Path) -> None:
    line = as_line(load(folder))
    runs = [line | {"started": f"2020-01-01T00:00:00+{number}"} for number in range(KEPT + 7)]
    (folder / HISTORY).write_text("".join(json.dumps(run) + "\n" for run in runs), encoding="utf-8")
    results = load(folder)
    assert len(history(folder, results)) == SHOWN
    remember(folder, results)
    kept = (folder / HISTORY).read_text(encoding="utf-8").splitlines()
    assert len(kept) == KEPT
    assert json.loads(kept[-1])["started"] == results["started"]
