"""What programs read: report.json against its schema, the Markdown summary, baselines, and notebooks."""

import copy
import json
from html.parser import HTMLParser
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers import EXAMPLE, crossray
from jsonschema import Draft202012Validator
from recorded import GREY, HOSTILE, NAME, altered, facts, record, record_everything

from reference.errors import InputError
from reference.image import read_image, write_image
from reports.baseline import read_baseline
from reports.metrics import SETTINGS
from reports.notebook import compare
from reports.summary import ROWS, summary

SMALL = ("--size", "20x16", "--with", "native")


@pytest.fixture(scope="module")
def validator() -> Draft202012Validator:
    text = resources.files("reports").joinpath("assets", "report.schema.json").read_text(encoding="utf-8")
    schema = json.loads(text)
    Draft202012Validator.check_schema(schema)
    return Draft202012Validator(schema)


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    return load(record_everything(tmp_path_factory.mktemp("run")))


@pytest.fixture(scope="module")
def checked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of the real command line, with terms."""
    folder = tmp_path_factory.mktemp("checked") / "out"
    done = crossray("check", EXAMPLE, *SMALL, "--terms", "--out", folder)
    assert done.returncode == 0, done.stderr
    return folder


def load(folder: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    return content


def test_reports_follow_the_schema(
    validator: Draft202012Validator, report: dict[str, Any], checked: Path, tmp_path: Path
) -> None:
    for content in (report, load(checked)):
        assert [error.message for error in validator.iter_errors(content)] == []
    for name in ("a.png", "b.png"):
        write_image(tmp_path / name, GREY)
    assert crossray("compare", tmp_path / "a.png", tmp_path / "b.png", "--out", tmp_path / "o").returncode == 0
    assert [error.message for error in validator.iter_errors(load(tmp_path / "o"))] == []


@pytest.mark.parametrize(
    ("where", "value"),
    [
        (("version",), 2),
        (("scenes", 1, "comparisons", 0, "status"), "fine"),
        (("scenes", 1, "comparisons", 0, "verdict"), "maybe"),
        (("scenes", 1, "comparisons", 0, "pixels", "unexplained"), -1),
        (("scenes", 1, "comparisons", 0, "pixels", "explained"), {"magic": 1}),
        (("scenes", 1, "comparisons", 0, "metrics"), {"ssim": 1}),
        (("scenes", 1, "comparisons", 0, "worst", 0, "class"), "magic"),
        (("scenes", 1, "comparisons", 0, "approval"), {"because": "x"}),
        (("history",), []),
        (("history", 0, "failed"), None),
    ],
)
def test_the_schema_refuses_what_is_wrong(
    validator: Draft202012Validator, report: dict[str, Any], where: tuple[Any, ...], value: Any
) -> None:
    wrong = copy.deepcopy(report)
    place: Any = wrong
    for key in where[:-1]:
        place = place[key]
    place[where[-1]] = value
    assert not validator.is_valid(wrong)


def test_metrics_come_with_their_settings(report: dict[str, Any]) -> None:
    assert report["settings"] == SETTINGS
    assert set(SETTINGS) == {"ssim", "ssim_min", "psnr", "rmse", "flip", "max_error"}


def test_summary_is_worst_first_and_free_of_markup(report: dict[str, Any]) -> None:
    text = summary(report)
    rows = [line for line in text.splitlines() if line.startswith("| ")][1:]
    verdicts = [row.split(" | ")[2] for row in rows]
    assert verdicts == ["failed"] * 2 + ["disagree"] * 5 + ["not-compared", "not-installed", "unsupported"]
    assert [int(row.split(" | ")[3]) for row in rows[2:7]] == [2, 2, 1, 1, 1]
    assert "3 of 8 comparisons agree" in text
    assert not set("<>`*[]!\0\x1b") & set(text.replace("**crossray 0.1.0**", "").replace("`report.html`", ""))
    assert all(row.count("|") == 7 for row in rows)
    assert HOSTILE not in text
    assert NAME not in text


def test_summary_is_short(report: dict[str, Any]) -> None:
    many = copy.deepcopy(report)
    many["scenes"] = many["scenes"] * 50
    text = summary(many)
    assert text.count("\n| ") == ROWS + 1
    assert "And 460 more." in text


def test_terms_are_in_the_report_of_a_check(checked: Path) -> None:
    (scene,) = load(checked)["scenes"]
    assert [term["name"] for term in scene["terms"]] == ["ambient", "diffuse", "shadow", "light", "reflection"]
    by_name = {term["name"]: term for term in scene["terms"]}
    for name in ("ambient", "light", "reflection"):
        (compared,) = by_name[name]["comparisons"]
        assert (compared["renderer"], compared["over"]) == ("native", 0)
        assert compared["max_error"] < 0.01
    levels = {name: read_image(checked / f"{term['image']}.exr") for name, term in by_name.items()}
    total = levels["ambient"] + levels["diffuse"] - levels["shadow"] + levels["reflection"]
    assert np.abs(total - read_image(checked / f"{scene['reference']['image']}.exr")).max() < 0.001


def test_a_baseline_that_is_the_same_agrees_and_a_changed_one_does_not(checked: Path, tmp_path: Path) -> None:
    before = tmp_path / "before"
    import shutil

    shutil.copytree(checked, before)
    done = crossray("check", EXAMPLE, *SMALL, "--baseline", before, "--out", before)  # into the same folder
    assert done.returncode == 0, done.stderr
    found = load(before)["scenes"][0]["comparisons"]
    assert [(picture["renderer"], picture["verdict"]) for picture in found] == [
        ("native", "agree"),
        ("baseline", "agree"),
    ]
    image = checked_image(before)
    levels = read_image(image)
    levels[3, 4] += 50
    write_image(image, levels)
    after = tmp_path / "after"
    assert crossray("check", EXAMPLE, *SMALL, "--baseline", before, "--out", after).returncode == 1
    baseline = load(after)["scenes"][0]["comparisons"][1]
    assert (baseline["verdict"], baseline["pixels"]["unexplained"], baseline["against"]) == ("disagree", 1, "native")
    assert (baseline["worst"][0]["column"], baseline["worst"][0]["row"]) == (4, 3)


def checked_image(folder: Path) -> Path:
    pictures = json.loads((folder / "run.json").read_text(encoding="utf-8"))["scenes"][0]["pictures"]
    image = next(picture["image"] for picture in pictures if picture["renderer"] == "native")
    return folder / f"{image}.exr"


def test_baselines_that_do_not_fit(checked: Path, tmp_path: Path) -> None:
    text = load(checked)["scenes"][0]["text"]
    (fitting,) = read_baseline(checked, [("elsewhere/other.txt", text)], 20, 16, 3)
    assert (fitting[0]["status"], fitting[0]["against"]) == ("rendered", "native")
    (changed, new) = read_baseline(checked, [("example1.txt", "changed"), ("new.txt", "new")], 20, 16, 3)
    assert [facts["reason"] for facts, _ in (changed, new)] == [
        "the scene has changed since the baseline",
        "the baseline has no such scene",
    ]
    assert [(facts["status"], levels) for facts, levels in (changed, new)] == [("unsupported", None)] * 2
    with pytest.raises(InputError, match=r"run\.json:1:1: expected pictures of 21x16, depth 3, found 20x16, depth 3"):
        read_baseline(checked, [("example1.txt", text)], 21, 16, 3)
    with pytest.raises(InputError, match=r"run\.json:1:1: expected the record of a run"):
        read_baseline(tmp_path, [], 20, 16, 3)
    for wrong in ("[]", '{"scenes": [{}]}', '{"scenes": [1]}'):
        (tmp_path / "run.json").write_text(wrong, encoding="utf-8")
        with pytest.raises(InputError, match=r"run\.json:1:1: expected the record of a run"):
            read_baseline(tmp_path, [("s.txt", text)], 20, 16, 3)


def test_a_run_without_the_newer_keys_and_one_that_was_interrupted_draw(tmp_path: Path) -> None:
    record(tmp_path, {"s.txt": [(facts("native"), GREY), (facts("povray"), GREY)], "t.txt": []})
    content = load(tmp_path)
    assert [scene["scene"] for scene in content["scenes"]] == ["s"]
    assert "terms" not in content["scenes"][0]


class Sources(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.sources: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.sources += [value or "" for name, value in attrs if name == "src"]
        assert not [name for name, _ in attrs if name.startswith("on")]


def test_a_comparison_shows_itself(tmp_path: Path) -> None:
    import base64
    import io

    from PIL import Image

    path = tmp_path / f"{NAME}.png"
    write_image(path, altered((3, 2, 150)))
    shown = compare(GREY, path)
    assert not shown.agrees
    html = Sources()
    html.feed(shown._repr_html_())
    assert html.tags.count("img") == 3
    assert set(html.tags) == {"div", "figure", "img", "figcaption", "p", "strong", "pre"}
    pictures = [Image.open(io.BytesIO(base64.b64decode(source.partition(",")[2]))) for source in html.sources]
    difference = np.asarray(pictures[2])
    assert difference[2, 3].tolist() == [255, 255, 255]
    assert np.count_nonzero(difference.any(axis=-1)) == 1
    assert "worst at  column 3, row 2" in str(shown)
    assert compare(GREY, GREY).agrees


def test_a_comparison_of_unequal_sizes_is_refused() -> None:
    with pytest.raises(InputError, match="found 120x80 and 119x80"):
        compare(GREY, GREY[:, 1:])
    with pytest.raises(InputError, match="height x width x 3"):
        compare(GREY[..., 0], GREY)
