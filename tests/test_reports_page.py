"""The three reports of one run."""

import copy
import json
import shutil
from html.parser import HTMLParser
from pathlib import Path
from typing import Any, NoReturn
from xml.etree import ElementTree

import numpy as np
import pytest
from markupsafe import escape
from recorded import EDGE, GREY, HEIGHT, NAME, NEAR, WIDTH, altered, facts, record, record_everything

import reports.embedding
import reports.page
from reference.image import read_image
from reports.accounting import CLASSES
from reports.page import page, sparkline
from reports.terminal import summary_lines
from reports.writing import write_reports

REPORTS = ("report.html", "report.json", "junit.xml")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record_everything(tmp_path_factory.mktemp("run"))


@pytest.fixture(scope="module")
def report(folder: Path) -> dict[str, Any]:
    def refuse(word: str) -> NoReturn:
        pytest.fail(f"{word} is not JSON")

    content: dict[str, Any] = json.loads((folder / "report.json").read_text(encoding="utf-8"), parse_constant=refuse)
    return content


def test_report_has_the_names_of_the_contract(report: dict[str, Any]) -> None:
    assert report["version"] == 1
    assert {"crossray", "started", "environment", "scenes"} <= set(report)
    assert [scene["scene"] for scene in report["scenes"]] == ["fine", "slight", "off", NAME, "lost", "edges"]
    for scene in report["scenes"]:
        assert {"scene", "path", "width", "height", "depth", "convention", "seconds", "comparisons"} <= set(scene)
        for comparison in scene["comparisons"]:
            names = {"renderer", "version", "status", "reason", "seconds", "verdict", "metrics", "pixels"}
            assert names <= set(comparison)
            if comparison["verdict"]:
                assert set(comparison["metrics"]) == {"ssim", "ssim_min", "psnr", "rmse", "flip", "max_error"}
                assert set(comparison["pixels"]) == {"total", "agree", "explained", "unexplained"}


def test_verdicts_and_pixels(report: dict[str, Any]) -> None:
    found = {
        (scene["scene"], comparison["renderer"]): (comparison["status"], comparison["verdict"], comparison["pixels"])
        for scene in report["scenes"]
        for comparison in scene["comparisons"]
    }
    rendered = {pair: (verdict, pixels) for pair, (status, verdict, pixels) in found.items() if pixels}
    wrong = {pair: pixels["unexplained"] for pair, (_, pixels) in rendered.items()}
    assert wrong == {
        ("fine", "povray"): 0,
        ("slight", "povray"): 1,
        ("off", "povray"): 2,
        (NAME, "cycles"): 0,
        (NAME, "povray"): 2,
        (NAME, "mitsuba-stock"): 1,
        ("edges", "mitsuba"): 1,
        ("edges", "povray"): 0,
    }
    for verdict, pixels in rendered.values():
        assert verdict == ("disagree" if pixels["unexplained"] else "agree")
        assert pixels["total"] == WIDTH * HEIGHT
        assert pixels["agree"] + sum(pixels["explained"].values()) + pixels["unexplained"] == pixels["total"]
    assert found[(NAME, "radiance")] == ("unsupported", None, None)
    assert found[(NAME, "tachyon")] == ("not-installed", None, None)
    assert found[(NAME, "mitsuba")] == ("failed", None, None)
    assert found[("lost", "povray")] == ("rendered", None, None)


def test_pixels_that_differ_are_listed_largest_error_first(report: dict[str, Any]) -> None:
    comparison = next(c for c in report["scenes"][3]["comparisons"] if c["renderer"] == "povray")
    assert comparison["worst"] == [
        {"column": 110, "row": 60, "error": 100, "class": None, "evidence": None},
        {"column": 3, "row": 2, "error": 50, "class": None, "evidence": None},
    ]


EXPLAINED = {"knife-edge": 3, "document-window": 1}


def compared(report: dict[str, Any], renderer: str) -> dict[str, Any]:
    """That renderer's comparison on the scene with explained pixels."""
    (scene,) = [scene for scene in report["scenes"] if scene["scene"] == "edges"]
    (comparison,) = [comparison for comparison in scene["comparisons"] if comparison["renderer"] == renderer]
    found: dict[str, Any] = comparison
    return found


def test_explained_pixels_agree_and_are_counted_by_class(report: dict[str, Any]) -> None:
    agreeing, wrong = compared(report, "povray"), compared(report, "mitsuba")
    agree = WIDTH * HEIGHT - 4
    assert agreeing["pixels"] == {"total": WIDTH * HEIGHT, "agree": agree, "explained": EXPLAINED, "unexplained": 0}
    assert wrong["pixels"] == {"total": WIDTH * HEIGHT, "agree": agree - 1, "explained": EXPLAINED, "unexplained": 1}
    assert (agreeing["verdict"], wrong["verdict"]) == ("agree", "disagree")
    assert (agreeing["over"]["0.5"], wrong["over"]["0.5"]) == (4, 5)


def test_explained_pixels_are_listed_with_their_evidence_after_the_others(report: dict[str, Any]) -> None:
    found = [
        (pixel["column"], pixel["row"], pixel["class"], pixel["evidence"])
        for pixel in compared(report, "mitsuba")["worst"]
    ]
    assert found == [
        (90, 30, None, None),
        (*NEAR, "document-window", "the colour by the document's text"),
        *((column, EDGE, "knife-edge", "one of 2 admissible colours") for column in (3, 20, 50)),
    ]


def test_the_worst_pixels_have_their_rays_told_once_for_all(report: dict[str, Any]) -> None:
    wrong, agreeing = (compared(report, renderer)["worst"] for renderer in ("mitsuba", "povray"))
    for pixel in [*wrong, *agreeing]:
        assert pixel["raytree"][0] == f"column {pixel['column']}, row {pixel['row']}, convention exact"
        assert pixel["raytree"][-1].startswith("proof    ")
    assert "knife edge" in wrong[-1]["raytree"][-1]
    assert wrong[1]["raytree"] == agreeing[0]["raytree"]


def test_terminal_lines_count_explained_pixels(report: dict[str, Any]) -> None:
    lines = [line for line in summary_lines(report) if line.startswith("edges")]
    explained = "3 knife-edge, 1 document-window; largest error 93.6 levels"
    assert lines == [
        f"edges  mitsuba  disagree: 1 of 9600 pixels unexplained, {explained}",
        f"edges  povray  agree: 0 of 9600 pixels unexplained, {explained}",
    ]
    assert "off  povray  disagree: 2 of 9600 pixels unexplained; largest error 1 levels" in summary_lines(report)


def test_junit(folder: Path) -> None:
    suites = {suite.get("name"): suite for suite in ElementTree.parse(folder / "junit.xml").getroot()}
    assert list(suites) == ["fine", "slight", "off", NAME, "lost", "edges"]
    for suite in suites.values():
        cases = suite.findall("testcase")
        assert suite.get("tests") == str(len(cases))
        for kind, attribute in (("failure", "failures"), ("error", "errors"), ("skipped", "skipped")):
            assert suite.get(attribute) == str(len(suite.findall(f"testcase/{kind}")))
    kinds = {case.get("name"): [child.tag for child in case] for case in suites[NAME]}
    assert kinds == {
        "native": [],
        "cycles": [],
        "radiance": ["skipped"],
        "tachyon": ["skipped"],
        "povray": ["failure"],
        "mitsuba-stock": ["failure"],
        "mitsuba": ["error"],
    }
    kinds = {case.get("name"): [child.tag for child in case] for case in suites["edges"]}
    assert kinds == {"native": [], "mitsuba": ["properties", "failure"], "povray": ["properties"]}


def test_junit_counts_explained_pixels(folder: Path) -> None:
    root = ElementTree.parse(folder / "junit.xml").getroot()
    for renderer in ("mitsuba", "povray"):
        properties = root.findall(f"testsuite[@name='edges']/testcase[@name='{renderer}']/properties/property")
        counts = {item.get("name"): item.get("value") for item in properties}
        assert counts == {"knife-edge": "3", "document-window": "1"}
    assert len(root.findall(".//properties")) == 2
    (failure,) = root.findall("testsuite[@name='edges']/testcase/failure")
    assert failure.get("message") == "1 of 9600 pixels differ and are not explained"


def test_what_was_not_compared_has_not_passed(folder: Path) -> None:
    case = ElementTree.parse(folder / "junit.xml").find("testsuite[@name='lost']/testcase[@name='povray']")
    assert case is not None
    assert [child.tag for child in case] == ["skipped"]


def test_reports_are_redrawn_to_the_byte_anywhere(folder: Path, tmp_path: Path) -> None:
    before = {name: (folder / name).read_bytes() for name in REPORTS}
    copy = shutil.copytree(folder, tmp_path / "copy", ignore=shutil.ignore_patterns(*REPORTS))
    write_reports(copy)
    assert {name: (copy / name).read_bytes() for name in REPORTS} == before
    write_reports(copy)
    assert {name: (copy / name).read_bytes() for name in REPORTS} == before


class Elements(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.found: list[tuple[str, dict[str, str | None]]] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found.append((tag, dict(attrs)))


def test_page_needs_nothing_else_and_nothing_is_injected(folder: Path) -> None:
    text = (folder / "report.html").read_text(encoding="utf-8")
    elements = Elements()
    elements.feed(text)
    for tag, attributes in elements.found:
        assert tag not in ("link", "iframe", "object", "embed", "base", "b"), tag
        assert not [name for name in attributes if name.startswith("on")]
        assert (attributes.get("src") or "data:image/jpeg;base64,").startswith("data:image/jpeg;base64,")
        assert (attributes.get("href") or "#").startswith("#")
    scripts = [attributes.get("type") for tag, attributes in elements.found if tag == "script"]
    assert scripts.count(None) == scripts.count("application/json") == 1
    assert set(scripts) == {None, "application/json", "application/octet-stream"}
    assert "url(" not in text
    assert "@import" not in text
    assert "{{ 7 * 7 }}" in text


def test_page_records_how_each_picture_was_drawn(folder: Path) -> None:
    html = (folder / "report.html").read_text(encoding="utf-8")
    assert (
        '<pre tabindex="0">povray &#39;&lt;b&gt;&#39; &amp;&amp; true</pre><p>Povray 1.2 &lt;b&gt;, on 2 cores.</p>'
        in html
    )
    assert "Tachyon of unknown" not in html


def test_page_says_what_each_class_is_and_how_many_pixels_it_has(folder: Path) -> None:
    text = (folder / "report.html").read_text(encoding="utf-8")
    for kind, meaning in CLASSES.items():
        assert f"<dt>{kind}</dt><dd>{escape(meaning)}</dd>" in text
    assert "3 of 8 comparisons agree; of 76,800 pixels 8 differ for a reason that is proven, 7 for none." in text


def test_pictures_that_are_no_numbers_show_in_the_difference(tmp_path: Path) -> None:
    broken = altered((30, 20, np.nan))
    record(tmp_path, {"nan.txt": [(facts("native"), GREY), (facts("povray"), broken)]})
    comparison = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))["scenes"][0]["comparisons"][0]
    assert comparison["worst"] == [{"column": 30, "row": 20, "error": 255, "class": None, "evidence": None}]
    assert read_image(tmp_path / f"{comparison['difference']}.png")[20, 30].min() == 255


def test_many_pixels_are_listed_and_some_of_them_shown(tmp_path: Path) -> None:
    places = [(column, row) for row in range(4, 10) for column in range(100)]
    off = altered(*((column, row, 110 + column) for column, row in places))
    record(tmp_path, {"many.txt": [(facts("native"), GREY), (facts("povray"), off)]})
    comparison = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))["scenes"][0]["comparisons"][0]
    assert comparison["pixels"]["unexplained"] == len(places) == 600
    assert len(comparison["worst"]) == 500
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "the 50 worst of 600 pixels that differ" in text
    assert text.count("data-pixel=") == 50


@pytest.mark.parametrize(
    "paths",
    [
        ["a/same.txt", "b/same.txt", "c/same.txt", "same-2.txt"],
        ["a b.txt", "a_b.txt"],
        ["a/" + "x" * 100 + ".txt", "b/" + "x" * 100 + ".txt"],
        ["日本.txt", "中文.txt", "scene.txt"],
        ["../..", "...", "-"],
    ],
)
def test_every_scene_has_a_name_and_a_folder_of_its_own(tmp_path: Path, paths: list[str]) -> None:
    record(tmp_path, {path: [(facts("native"), GREY)] for path in paths})
    scenes = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))["scenes"]
    images = [Path(scene["reference"]["image"]) for scene in scenes]
    assert len({scene["scene"] for scene in scenes}) == len(paths)
    assert len({image.parent for image in images}) == len(paths)
    assert all(image.parent.parent == Path("images") for image in images)
    assert all((tmp_path / f"{image}.exr").is_file() for image in images)


def test_file_name_that_is_not_utf8(tmp_path: Path) -> None:
    record(tmp_path, {"caf\udce9.txt": [(facts("native"), GREY)]})
    assert (tmp_path / "report.html").read_text(encoding="utf-8")
    assert (tmp_path / "junit.xml").read_text(encoding="utf-8")


def test_what_a_run_need_not_have_is_shown_where_it_does(folder: Path, report: dict[str, Any]) -> None:
    """History, approvals, terms and ray trees."""
    results = copy.deepcopy(report)
    results["history"] = [{"unexplained": number, "seconds": 2.0 * number} for number in (3, 0, 6)]
    (scene,) = [scene for scene in results["scenes"] if scene["scene"] == "edges"]
    wrong, other = scene["comparisons"]
    wrong["approval"] = {"because": "a known <b>limit</b>", "until": "2026-11-01", "expired": True}
    other["approval"] = {"because": "seen by all", "until": "2027-11-01", "expired": False}
    wrong["worst"][0]["raytree"] = ["camera ray", "  hits </script><b>plane 1</b>"]
    compared = [{"title": "Povray", "over": 3, "max_error": 20.0}, {"title": "Mitsuba", "over": 0, "max_error": 0.25}]
    scene["terms"] = [{"title": "ambient", "image": scene["reference"]["image"], "comparisons": compared}]
    html = page(folder, results)
    assert html.count('points="2.0,12.0 60.0,21.0 118.0,3.0"') == 2
    assert "Unexplained pixels of the last 3 runs: 3, 0, 6" in html
    assert (
        '<span class="approval expired" title="a known &lt;b&gt;limit&lt;/b&gt;">approval expired 2026-11-01</span>'
        in html
    )
    assert "approved until 2027-11-01</span>, because seen by all" in html
    assert '"90,30":["camera ray","  hits \\u003c/script\\u003e\\u003cb\\u003eplane 1\\u003c/b\\u003e"]' in html
    assert 'Povray: <span class="wrong">3 pixels over 0.5</span>, at most 20' in html
    assert "Mitsuba: agrees, at most 0.25" in html
    assert page(folder, results) == html
    for absent in ("Unexplained pixels of the last", "term by term", 'class="approval'):
        assert absent in html
        assert absent not in page(folder, report)


@pytest.mark.parametrize(("values", "points"), [([], ""), ([0], "2.0,21.0"), ([1, None, 2], "2.0,12.0 118.0,3.0")])
def test_sparklines(values: list[float | None], points: str) -> None:
    assert sparkline(values) == points


def test_what_is_too_large_for_a_page_is_said(
    folder: Path, report: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(reports.embedding, "LADDER", ((0.1, 16, 1.0),))
    monkeypatch.setattr(reports.embedding, "BUDGET", 400)
    monkeypatch.setattr(reports.page, "LONGEST_TEXT", 20)
    html = page(folder, report)
    left_out = html.count('"left_out":true')
    assert 1 < left_out < 14
    assert f"{left_out} pictures are left out; the run" in " ".join(html.split())
    assert 'its first 20 characters</summary><pre tabindex="0">255 255 255\n0.3\n0\n3\n</pre>' in html
