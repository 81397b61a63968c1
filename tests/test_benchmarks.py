"""The benchmarks run from end to end, their page tells all that was measured, and the plain C++ tracer is right."""

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers import ROOT

from reference import Scene, render
from translator.registry import adapter
from translator.run import installed_version

FOLDER = ROOT / "tests" / "benchmarks"
sys.path.insert(0, str(FOLDER))

from bench import read_results  # noqa: E402
from objects import growth, too_long  # noqa: E402
from page import page  # noqa: E402
from peers import PRECISIONS, Task, missing  # noqa: E402
from spheres import sphere_scene  # noqa: E402
from tables import spread, time, times_faster  # noqa: E402
from turns import QUICK, Pace, Run, in_turn, pixels_off, ratio  # noqa: E402

from reference.errors import RendererError  # noqa: E402

PARTS = ("examples", "objects", "sizes", "process", "roofline")
PEERS = ("povray", "tachyon", "mitsuba", "radiance")


@pytest.fixture(scope="module")
def trial(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("bench")
    command = [sys.executable, str(FOLDER / "bench.py"), "--quick", "--out", str(folder), "--docs", str(folder)]
    subprocess.run(command, cwd=folder, check=True, capture_output=True, timeout=300)
    return folder


def section(text: str, heading: str) -> str:
    return text.partition(f"\n## {heading}\n")[2].partition("\n## ")[0]


def first_cells(text: str) -> list[str]:
    return re.findall(r"^\| (.*?) \|", text, re.MULTILINE)


def test_every_part_leaves_its_numbers(trial: Path) -> None:
    results = read_results(trial)
    assert tuple(results) == PARTS
    for part in results.values():
        assert part["quick"] is True
        assert part["machine"]["cores"] >= 1
        assert part["machine"]["ours"] == PRECISIONS[0]


def test_everyone_was_measured(trial: Path) -> None:
    results = read_results(trial)
    present = [name for name in PEERS if installed_version(name)]
    row = results["examples"]["rows"]["example1"]
    scalar = ["c++ double", "c++ float"] if shutil.which("g++") else []
    assert row.keys() == {*present, *scalar, *PRECISIONS, "certify"}
    for name, entry in row.items():
        assert all(seconds > 0 for seconds in entry["seconds"]), name
        assert entry.get("off", 0) <= 64, name
    assert row.get("c++ double", {"off": 0})["off"] == 0
    for number in ("10", "100"):
        contenders = results["objects"]["rows"][number]["contenders"]
        assert {*PRECISIONS, *present} - {"radiance"} <= contenders.keys()
        assert all("reason" not in entry for entry in contenders.values())
    for row in results["sizes"]["rows"].values():
        assert 30 * 2**20 < row["memory"] < 2**31


def test_the_page_tells_it_all(trial: Path) -> None:
    text = (trial / "benchmarks.md").read_text(encoding="utf-8")
    assert "A quick trial" in text
    ours = {"auto": "crossray auto", "double": "crossray double", "single": "crossray single"}
    titles = [adapter(name).TITLE for name in PEERS if installed_version(name)] + [ours[name] for name in PRECISIONS]
    examples = first_cells(section(text, "The document's examples"))
    assert {"example1", *titles} <= set(examples)
    assert {title for title in titles if title != "Radiance"} <= set(
        first_cells(section(text, "The number of spheres"))
    )
    assert "| 10 | 100 |" in section(text, "The number of spheres")
    assert "peak memory" in section(text, "The size of the picture")
    assert "example1" in first_cells(section(text, "The whole process"))
    assert text.count("**missed**") + text.count("| met |") == 6
    for name in re.findall(r"!\[.*?\]\((.*?)\)", text):
        assert (trial / name).read_text(encoding="utf-8").startswith("<?xml")
    assert str(ROOT) not in text


def test_the_page_is_made_of_the_numbers_alone(trial: Path, tmp_path: Path) -> None:
    for part in PARTS:
        shutil.copy(trial / f"{part}.json", tmp_path)
    assert page(read_results(tmp_path)) == (trial / "benchmarks.md").read_text(encoding="utf-8")
    command = [sys.executable, str(FOLDER / "bench.py"), "page", "--out", str(tmp_path), "--docs", str(tmp_path)]
    subprocess.run(command, check=True, capture_output=True, timeout=100)
    for name in ("benchmarks.md", "benchmarks-examples.svg", "benchmarks-objects.svg", "benchmarks-sizes.svg"):
        assert (tmp_path / name).read_bytes() == (trial / name).read_bytes()


def test_a_part_alone_makes_a_page(trial: Path) -> None:
    results = read_results(trial)
    for part in PARTS:
        assert page({part: results[part]}).count("\n## ") == 1
    assert "Nothing" in page({})


@pytest.mark.skipif(shutil.which("g++") is None, reason="g++ is not installed")
@pytest.mark.parametrize("name", ["example1", "example2", "example3", "example4", "diagnostic/near_cross", 30])
def test_the_plain_tracer_draws_the_same_picture(name: str | int) -> None:
    scene = sphere_scene(name) if isinstance(name, int) else Scene.load(ROOT / "scenes" / f"{name}.txt")
    task = Task(scene, 200, QUICK)
    expected = render(scene, width=200, height=200, dtype=float)
    allowed = {"c++ double": 0 if isinstance(name, str) else 2, "c++ float": 100}
    for contender, most in allowed.items():
        picture = task.scalar(contender).picture
        assert picture is not None
        assert np.ptp(picture) > 50
        assert pixels_off(picture, expected) <= most


@pytest.mark.skipif(shutil.which("g++") is None, reason="g++ is not installed")
def test_operations_are_counted() -> None:
    scene = Scene.load(ROOT / "scenes" / "example1.txt")
    empty = Task(Scene((0, 0, 0), 0), 10, QUICK).counts()
    sums, products, comparisons, quotients, roots = (count / 100 for count in empty)
    # Of a ray that meets nothing: two coordinates, the square of its length, and one over that.
    assert (sums, products, comparisons, quotients, roots) == (2 + 2, 2 + 3, 0, 1, 0)
    assert all(few < many for few, many in zip(empty[:2], Task(scene, 10, QUICK).counts()[:2], strict=True))


def test_scenes_of_spheres_are_the_same_every_time_and_in_view() -> None:
    scene = sphere_scene(1000)
    assert scene == sphere_scene(1000)
    assert len(scene.spheres) == 1000
    assert len({sphere.colour for sphere in scene.spheres}) > 990
    for sphere in scene.spheres:
        _, y, z = sphere.centre
        assert y - sphere.radius >= -150 - 1e-3
        assert z - sphere.radius > 100
        assert z + sphere.radius <= 1300 + 1e-3
    assert np.ptp(render(scene, width=50, height=50)) > 100


def test_contenders_take_turns() -> None:
    order: list[str] = []

    def contender(name: str, seconds: float) -> Any:
        def run() -> Run:
            order.append(name)
            return Run(seconds, None, np.full((2, 2, 3), 0.6 * len(name)))

        return run

    def failing() -> Run:
        raise RendererError("it broke")

    entries = in_turn({"a": contender("a", 1), "bad": failing, "bb": contender("bb", 2)}, Pace(rounds=2, budget=100))
    assert order == ["a", "bb"] * 3
    assert entries["bad"] == {"reason": "it broke"}
    assert entries["bb"]["seconds"] == [2, 2]
    assert entries["bb"]["off"] == 4
    assert times_faster(entries["bb"], entries["a"]) == 2
    assert times_faster(entries["bad"], entries["a"]) is None
    assert spread(entries["bad"]) == "it broke"
    breaking = iter([Run(1.0)])

    def break_later() -> Run:
        if run := next(breaking, None):
            return run
        raise RendererError("it broke later")

    (broken,) = in_turn({"a": break_later}, Pace(rounds=2, budget=100)).values()
    assert broken == {"reason": "it broke later"}
    (slow,) = in_turn({"a": contender("a", 3)}, Pace(budget=0)).values()
    assert slow["cold"]
    assert slow["seconds"] == [3]


def test_numbers_are_told_plainly() -> None:
    assert [time(value) for value in (0.00123, 0.0456, 0.789, 1.5, 123.4)] == [
        "1.23 ms",
        "45.6 ms",
        "789 ms",
        "1.50 s",
        "123 s",
    ]
    assert ratio([2, 4, 9], [1, 1]) == 3
    assert spread({"seconds": [1.0, 2.0, 4.0]}) == "2.00 s (1.00 s to 4.00 s, 3 rounds)"
    assert spread({"seconds": [1.0]}) == "1.00 s (once)"


def test_growth_is_fitted_and_what_takes_too_long_is_left_out() -> None:
    rows = {str(10**k): {"contenders": {"x": {"seconds": [10 ** (k / 4)]}}} for k in range(1, 7)}
    assert growth(rows, "x", lambda entry: float(entry["seconds"][0])) == pytest.approx(0.25)
    assert growth(rows, "y", lambda entry: 1.0) is None
    assert too_long("x", 100, None) is None
    assert too_long("x", 100, {"number": 10, "whole": 1.0, "seconds": [1.0]}) is None
    assert too_long("x", 100, {"number": 10, "whole": 13.0, "seconds": [1.0]}) == (
        "not tried: a whole run took 13 s with 10"
    )
    assert too_long("c++ double", 100, {"number": 10, "whole": 1.0, "seconds": [3.0]}) == (
        "not tried: tracing took 3 s with 10"
    )
    assert too_long("x", 100, {"number": 10, "reason": "it broke"}) == "not tried after 10"


def test_what_is_missing_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    assert missing(["c++ double"]) == {"c++ double": "apt-get install g++"}


def test_results_are_json(trial: Path) -> None:
    for part in PARTS:
        json.loads((trial / f"{part}.json").read_text(), parse_constant=pytest.fail)
