"""The three reports of one run made of small pictures, its texts full of markup."""

import json
import shutil
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from typing import Any, NoReturn
from xml.etree import ElementTree

import numpy as np
import pytest
from helpers import need
from playwright.sync_api import Browser, Dialog, Page, Request, sync_playwright

from reference.image import Picture, read_image
from reports.recording import Recording
from reports.writing import write_reports

WIDTH, HEIGHT = 120, 80
NAME = """<img src=x onerror=alert(1)>&"'"""
HOSTILE = (
    "</pre></script><script>alert(2)</script>\0\x1b[31m\x07\x85\ufffe ]]> &amp; {{ 7 * 7 }} "
    "<img src=x onerror=alert(3)>"
)
REPORTS = ("report.html", "report.json", "junit.xml")
GREY = np.full((HEIGHT, WIDTH, 3), 100.0)


def altered(*pixels: tuple[int, int, float]) -> Picture:
    picture = GREY.copy()
    for column, row, level in pixels:
        picture[row, column] = level
    return picture


def facts(renderer: str, status: str = "rendered", reason: str | None = None, log: str = "") -> dict[str, Any]:
    ran = status in ("rendered", "failed")
    return {
        "renderer": renderer,
        "title": renderer.title(),
        "status": status,
        "version": None if status == "not-installed" else "1.2 <b>",
        "reason": reason,
        "seconds": 1.25 if ran else None,
        "trace_seconds": 0.01 if status == "rendered" else None,
        "command": f"{renderer} '<b>' && true" if ran else "",
        "log": log,
        "notes": ["a <b>note</b>"] if ran else [],
    }


def record(folder: Path, scenes: dict[str, list[tuple[dict[str, Any], Picture | None]]]) -> Path:
    run = Recording(folder, "0.1.0")
    for path, pictures in scenes.items():
        entry = run.add_scene(path, WIDTH, HEIGHT, depth=3, convention="exact", text=f"255 255 255\n{HOSTILE}\n")
        for about, levels in pictures:
            run.add_picture(entry, about, levels)
    write_reports(folder)
    return folder


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    native = (facts("native"), GREY)
    return record(
        tmp_path_factory.mktemp("run"),
        {
            "scenes/fine.txt": [native, (facts("povray", log="all well"), altered((1, 1, 100.5)))],
            "scenes/slight.txt": [native, (facts("povray"), altered((5, 5, 101)))],
            "scenes/off.txt": [native, (facts("povray"), altered((5, 5, 101), (6, 5, 101)))],
            f"scenes/{NAME}.txt": [
                native,
                (facts("cycles"), GREY),
                (facts("radiance", "unsupported", HOSTILE), None),
                (facts("tachyon", "not-installed", "not installed; to have it: <b>"), None),
                (facts("povray"), altered((110, 60, 200), (3, 2, 150))),
                (facts("mitsuba-stock"), altered((7, 70, 255))),
                (facts("mitsuba", "failed", f"it failed {HOSTILE}", HOSTILE), None),
            ],
            "scenes/lost.txt": [
                (facts("native", "failed", "it was stopped by SIGSEGV"), None),
                (facts("povray"), GREY),
            ],
        },
    )


@pytest.fixture(scope="module")
def report(folder: Path) -> dict[str, Any]:
    def refuse(word: str) -> NoReturn:
        pytest.fail(f"{word} is not JSON")

    content: dict[str, Any] = json.loads((folder / "report.json").read_text(encoding="utf-8"), parse_constant=refuse)
    return content


def test_report_has_the_names_of_the_contract(report: dict[str, Any]) -> None:
    assert report["version"] == 1
    assert {"crossray", "started", "environment", "scenes"} <= set(report)
    assert [scene["scene"] for scene in report["scenes"]] == ["fine", "slight", "off", NAME, "lost"]
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
        {"column": 110, "row": 60, "error": 100},
        {"column": 3, "row": 2, "error": 50},
    ]


def test_junit(folder: Path) -> None:
    suites = {suite.get("name"): suite for suite in ElementTree.parse(folder / "junit.xml").getroot()}
    assert list(suites) == ["fine", "slight", "off", NAME, "lost"]
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
        assert (attributes.get("src") or "data:image/png;base64,").startswith("data:image/png;base64,")
        assert (attributes.get("href") or "#").startswith("#")
    assert [tag for tag, _ in elements.found].count("script") == 1
    assert "url(" not in text
    assert "@import" not in text
    assert "{{ 7 * 7 }}" in text


def test_pictures_that_are_no_numbers_show_in_the_difference(tmp_path: Path) -> None:
    broken = altered((30, 20, np.nan))
    record(tmp_path, {"nan.txt": [(facts("native"), GREY), (facts("povray"), broken)]})
    comparison = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))["scenes"][0]["comparisons"][0]
    assert comparison["worst"] == [{"column": 30, "row": 20, "error": 255}]
    assert read_image(tmp_path / f"{comparison['difference']}.png")[20, 30].min() == 255


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


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    program = need("chromium")
    options = ["--no-sandbox", "--disable-gpu", "--disable-background-networking"]
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=program, args=options)
        yield chromium
        chromium.close()


def opened(browser: Browser, folder: Path, width: int, trouble: list[str]) -> Page:
    """The report in a window; what it says, opens or asks for beyond itself is added to `trouble`."""

    def dismiss(dialog: Dialog) -> None:
        trouble.append(dialog.message)
        dialog.dismiss()

    def requested(request: Request) -> None:
        if not request.url.startswith("data:") and request.url.partition("#")[0] != address:
            trouble.append(request.url)

    address = (folder / "report.html").as_uri()
    page = browser.new_page(viewport={"width": width, "height": 720})
    page.on("console", lambda message: trouble.append(message.text))
    page.on("pageerror", lambda error: trouble.append(str(error)))
    page.on("dialog", dismiss)
    page.on("request", requested)
    page.goto(address)
    return page


@pytest.fixture
def page(browser: Browser, folder: Path) -> Iterator[Page]:
    trouble: list[str] = []
    page = opened(browser, folder, 1280, trouble)
    yield page
    page.close()
    assert trouble == []


def test_every_picture_has_loaded(page: Page) -> None:
    sizes = page.eval_on_selector_all(
        "img.picture", "images => images.map(i => [i.complete, i.naturalWidth, i.naturalHeight])"
    )
    assert sizes == [[True, WIDTH, HEIGHT]] * 17
    assert page.locator("script").count() == 1
    assert page.locator("img[src=x], pre *, b").count() == 0


def test_overview_is_worst_first(page: Page) -> None:
    rows = page.locator("section[aria-labelledby=overview] tbody tr").all()
    cells = [[cell.strip() for cell in row.locator("th, td").all_inner_texts()[:3]] for row in rows]
    assert cells.pop(8)[0:2] == ["", "Povray 1.2 <b>"]
    assert cells == [
        [NAME, "Native 1.2 <b>", "reference"],
        ["", "Mitsuba 1.2 <b>", "failed"],
        ["", "Povray 1.2 <b>", "disagree"],
        ["", "Mitsuba-Stock 1.2 <b>", "disagree"],
        ["", "Tachyon", "not installed"],
        ["", "Radiance 1.2 <b>", "unsupported"],
        ["", "Cycles 1.2 <b>", "agree"],
        ["lost", "Native 1.2 <b>", "failed"],
        ["off", "Native 1.2 <b>", "reference"],
        ["", "Povray 1.2 <b>", "disagree"],
        ["slight", "Native 1.2 <b>", "reference"],
        ["", "Povray 1.2 <b>", "disagree"],
        ["fine", "Native 1.2 <b>", "reference"],
        ["", "Povray 1.2 <b>", "agree"],
    ]
    headings = page.locator("section.scene h2").all_inner_texts()
    assert headings == [NAME, "lost", "off", "slight", "fine"]


def test_what_was_not_compared_is_not_said_to_agree(page: Page) -> None:
    badges = page.locator("#scene-2 .badge, tbody:has(a[href='#scene-2']) .badge").all_inner_texts()
    assert badges.count("failed") == 2
    assert "agree" not in badges


def test_texts_are_shown_as_they_are(page: Page) -> None:
    shown = page.locator("section.scene").first.text_content() or ""
    for part in ("</pre></script><script>alert(2)</script>", "{{ 7 * 7 }}", "a <b>note</b>", "povray '<b>' && true"):
        assert part in shown


def test_what_was_not_drawn_leaves_a_gap_with_its_reason(page: Page) -> None:
    gap = page.locator("section.scene", has=page.get_by_role("heading", name="lost")).locator(".gap")
    assert gap.count() == 1
    assert gap.locator(".badge").inner_text() == "failed"
    assert gap.locator("p").inner_text() == "it was stopped by SIGSEGV"
    assert page.locator("section.scene").first.locator(".gap").count() == 3


ALTS = [
    f"{NAME} by Native",
    f"{NAME} by Povray",
    f"Difference of {NAME} by Povray to Native, × 32",
    f"{NAME} by Mitsuba-Stock",
    f"Difference of {NAME} by Mitsuba-Stock to Native, × 32",
    f"{NAME} by Cycles",
    f"Difference of {NAME} by Cycles to Native, × 32",
]


def caption(page: Page) -> str:
    return page.locator("dialog .caption").inner_text()


def width(page: Page) -> float:
    box = page.locator("dialog .stage img").bounding_box()
    assert box
    return box["width"]


def test_pictures_take_each_others_place(page: Page) -> None:
    dialog = page.locator("dialog")
    assert not dialog.is_visible()
    page.locator("img.picture").nth(1).click()
    assert dialog.is_visible()
    assert caption(page) == f"{ALTS[1]} · 2 of 7 · × 1"
    for alt in [*ALTS[2:], *ALTS[:2]]:
        page.keyboard.press("ArrowRight")
        assert caption(page).startswith(alt + " · ")
        assert page.locator("dialog .stage img").get_attribute("alt") == alt
    for alt in (ALTS[0], ALTS[6], ALTS[5]):
        page.keyboard.press("ArrowLeft")
        assert caption(page).startswith(alt + " · ")
    page.get_by_role("button", name="next picture").click()
    assert caption(page).startswith(ALTS[6] + " · ")


def test_size_changes(page: Page) -> None:
    page.locator("img.picture").first.click()
    sizes = []
    for key in ("+", "=", "-", "-", "-"):
        page.keyboard.press(key)
        sizes.append(width(page) / WIDTH)
    assert sizes == [2, 4, 2, 1, 0.5]
    assert caption(page).endswith("× 0.5")
    for _ in range(8):
        page.keyboard.press("+")
    assert width(page) == 32 * WIDTH
    page.get_by_role("button", name="− smaller").click()
    assert width(page) == 16 * WIDTH


SEEN = """([column, row]) => {
  const stage = document.querySelector("dialog .stage"), image = stage.querySelector("img");
  const box = image.getBoundingClientRect(), scale = box.width / image.naturalWidth;
  const x = box.left + (column + 0.5) * scale, y = box.top + (row + 0.5) * scale;
  return document.elementFromPoint(x, y) === image;
}"""


def test_differing_pixels_are_visited(page: Page) -> None:
    page.locator("img.picture").first.click()
    places = [(3, 2), (110, 60), (7, 70)]
    for column, row in [*places, places[0]]:
        page.keyboard.press("n")
        assert caption(page) == f"{ALTS[0]} · 1 of 7 · × 16 · column {column}, row {row}"
        assert page.evaluate(SEEN, [column, row])
    page.keyboard.press("p")
    assert "column 7, row 70" in caption(page)
    page.keyboard.press("ArrowRight")
    assert caption(page) == f"{ALTS[1]} · 2 of 7 · × 16 · column 7, row 70"
    assert page.evaluate(SEEN, places[2])


def test_nothing_to_visit_is_no_error(page: Page) -> None:
    page.locator("section.scene").last.locator("img.picture").first.click()
    page.keyboard.press("n")
    assert caption(page) == "fine by Native · 1 of 3 · × 1"


def test_dialog_opens_and_closes_by_keyboard_and_by_pointer(page: Page) -> None:
    picture, dialog = page.locator("img.picture").nth(2), page.locator("dialog")
    for key in ("Enter", " "):
        picture.focus()
        page.keyboard.press(key)
        assert dialog.is_visible()
        assert caption(page).startswith(ALTS[2])
        page.keyboard.press("Escape")
        assert not dialog.is_visible()
        assert picture.evaluate("image => image === document.activeElement")
    picture.click()
    page.get_by_role("button", name="close").click()
    assert not dialog.is_visible()


@pytest.mark.parametrize("width", [420, 900])
def test_page_fits_its_window(browser: Browser, folder: Path, width: int) -> None:
    page = opened(browser, folder, width, [])
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    page.close()


def test_long_words_fit_a_small_window(browser: Browser, tmp_path: Path) -> None:
    word = "x" * 150
    about = facts("povray", "failed", f"cannot open /{word}", word)
    record(tmp_path, {f"scenes/{word}.txt": [(facts("native"), GREY), (about, None)]})
    page = opened(browser, tmp_path, 420, [])
    assert page.evaluate("document.documentElement.scrollWidth") <= 420
    page.close()
