"""The page of a grade, and in a real browser."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from graded import EVIL, class_records, draw
from helpers import need
from playwright.sync_api import Browser, Page, sync_playwright

from reports.gradebook import mistakes, students_of
from reports.gradeimages import SMALL, THUMB, Album, surroundings, tiled
from reports.gradepage import page as grade_page


def results_of(folder: Path, records: list[dict[str, Any]]) -> dict[str, Any]:
    pictures = [draw(folder, made, f"picture-{place}") for place, made in enumerate(records)]
    names = list(dict.fromkeys(picture["scene"] for picture in pictures))
    return {
        "version": 1,
        "crossray": "0",
        "started": "now",
        "seconds": 1.0,
        "scene": None,
        "scenes": [{"scene": name, "path": f"scenes/{name}.txt"} for name in names],
        "depth": 3,
        "pictures": pictures,
        "students": list(students_of(pictures)),
        "mistakes": mistakes(pictures),
        "ignored": [{"path": EVIL, "reason": "it is a link"}],
    }


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    program = need("chromium")
    options = ["--no-sandbox", "--disable-gpu", "--disable-background-networking"]
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=program, args=options)
        yield chromium
        chromium.close()


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("class")
    results = results_of(folder, class_records())
    (folder / "grade.html").write_text(grade_page(folder, results), encoding="utf-8")
    (folder / "ben.html").write_text(grade_page(folder, results, student="ben"), encoding="utf-8")
    return folder


def opened(browser: Browser, path: Path, width: int = 1280, fragment: str = "") -> Iterator[Page]:
    trouble: list[str] = []
    page = browser.new_page(viewport={"width": width, "height": 720})
    page.on("console", lambda message: trouble.append(message.text))
    page.on("pageerror", lambda error: trouble.append(str(error)))
    page.on("request", lambda request: trouble.append(request.url) if request.url.startswith("http") else None)
    page.goto(path.as_uri() + fragment)
    yield page
    page.close()
    assert trouble == []


@pytest.fixture
def page(browser: Browser, folder: Path) -> Iterator[Page]:
    yield from opened(browser, folder / "grade.html")


@pytest.fixture
def own_page(browser: Browser, folder: Path) -> Iterator[Page]:
    yield from opened(browser, folder / "ben.html")


def names(page: Page) -> list[str]:
    return page.locator("table.class tbody tr:visible th a").all_inner_texts()


def test_the_class_is_worst_first_and_sorts(page: Page) -> None:
    assert names(page) == [EVIL, "dora", "carl", "ben", "anna"]
    points = page.locator("table.class thead button", has_text="Points")
    points.click()
    points.click()
    assert names(page)[0] == "anna"
    assert page.locator("table.class th[aria-sort=descending]").inner_text().strip().startswith("Points")
    page.locator("table.class thead button", has_text="Student").click()
    assert names(page) == [EVIL, "anna", "ben", "carl", "dora"]
    page.locator("table.class thead button", has_text="two").click()
    assert names(page)[0] == EVIL  # not graded, then unreadable, wrong, right
    assert names(page)[-1] == "anna"


def test_filters(page: Page) -> None:
    page.locator("input[name=name]").fill("A")
    assert names(page) == ["dora", "carl", "anna"]
    assert page.locator("form output").inner_text() == "3 of 5 students"
    page.locator("form.filters button[type=reset]").click()
    page.wait_for_function("document.querySelectorAll('table.class tbody tr[hidden]').length === 0")
    shown = {}
    for value in ("right", "wrong", "unreadable", "failed", "review"):
        page.locator("select[name=verdict]").select_option(value)
        shown[value] = names(page)
    assert shown == {
        "right": ["anna"],
        "wrong": ["dora", "carl", "ben"],
        "unreadable": [EVIL],
        "failed": [EVIL],
        "review": [EVIL, "dora"],
    }
    assert page.url.endswith("#?verdict=review")


def test_who_made_a_mistake(page: Page) -> None:
    rows = [row.locator("th, td.number").all_inner_texts() for row in page.locator(".mistakes tbody tr").all()]
    assert rows == [
        ["S8 reflections have no shadows", "2", "2"],
        ["C4 rays go through the corners of pixels", "1", "2"],
    ]
    page.locator("button[data-mistake=S8]").click()
    assert names(page) == ["carl", "ben"]
    assert page.locator("section.student:visible h2").all_text_contents() == [
        "carl 67.5 of 100 points",
        "ben 92.5 of 100 points",
    ]


def test_filters_are_kept_in_the_address(browser: Browser, folder: Path) -> None:
    for page in opened(browser, folder / "grade.html", fragment="#?mistake=C4"):
        assert names(page) == ["carl"]


def test_a_student_opens(page: Page) -> None:
    section = page.locator("section.student", has_text="ben")
    page.locator("table.class a", has_text="ben").click()
    callout = section.locator(".callout:visible")
    callout.wait_for()
    assert "Most likely" in callout.inner_text()
    assert "What to do. Do it <right>." in callout.inner_text()
    ratios = section.locator("img:visible").evaluate_all("images => images.map(i => i.naturalWidth)")
    assert len(ratios) == 4
    assert min(ratios) > 0
    assert section.locator(".copy").evaluate("e => getComputedStyle(e).backgroundImage").startswith('url("data:image')


def test_names_are_no_markup(page: Page) -> None:
    assert page.locator("b, script:not(:last-of-type)").count() == 0
    assert "(255, 0, 0)" not in page.title()
    assert page.locator("table.class", has_text=EVIL).count() == 1


def test_a_students_own_page(own_page: Page) -> None:
    assert own_page.title() == "crossray grade: ben: 1 of 2 not right"
    assert own_page.locator("h3 .badge").all_inner_texts() == ["right", "wrong"]
    assert own_page.locator("figcaption").all_inner_texts()[1] == "yours; where it is wrong is marked"
    wrong = own_page.locator("article").nth(1)
    rays = [row.locator("th, td").all_inner_texts() for row in wrong.locator(".rays tbody tr").all()]
    assert rays[0][:3] == ["camera", "plane 1, lines 9-13, t = 2.0000", "1.0 2.0 3.0"]
    assert rays[1] == ["reflection 1", "nothing", "nothing"]
    assert wrong.locator(".rays tfoot td").inner_text() == "1 2 3"
    box = wrong.locator(".pictures .marked rect").first.bounding_box()
    image = wrong.locator("img.picture").first.bounding_box()
    assert box
    assert image
    pixel = image["width"] / 40
    assert box["x"] + box["width"] / 2 - image["x"] == pytest.approx(11.5 * pixel, abs=2)
    assert box["y"] + box["height"] / 2 - image["y"] == pytest.approx(21.5 * pixel, abs=2)


def test_pictures_take_each_others_place(own_page: Page) -> None:
    own_page.locator("article").nth(1).locator("img.picture").first.focus()
    own_page.keyboard.press("Enter")
    caption = own_page.locator("dialog .caption")
    assert caption.inner_text() == "yours · 1 of 3 · × 1"
    own_page.keyboard.press("ArrowRight")
    own_page.keyboard.press("+")
    assert caption.inner_text() == "right · 2 of 3 · × 2"
    own_page.keyboard.press("Escape")
    assert not own_page.locator("dialog").is_visible()


@pytest.mark.parametrize("name", ["grade.html", "ben.html"])
def test_nothing_is_wider_than_a_small_window(browser: Browser, folder: Path, name: str) -> None:
    for page in opened(browser, folder / name, width=360):
        for closed in page.locator("details.one > summary").all():
            closed.click()
        assert page.evaluate("document.documentElement.scrollWidth") <= 360


def test_text_stands_out_from_its_ground(browser: Browser, folder: Path) -> None:
    """WCAG AA for every colour of text, in both schemes."""
    style = re.findall(r"--(\w+): (#\w{6})", (folder / "grade.html").read_text(encoding="utf-8"))
    half = len(style) // 2
    for scheme in (dict(style[:half]), dict(style[half:])):
        grounds = [luminance(scheme[name]) for name in ("ground", "raised", "callout")]
        for name in ("text", "quiet", "good", "bad", "warn", "accent"):
            for ground in grounds if name in ("text", "quiet") else grounds[:2]:
                low, high = sorted((luminance(scheme[name]), ground))
                assert (high + 0.05) / (low + 0.05) >= 4.5, (name, scheme)


def luminance(colour: str) -> float:
    """Relative, as WCAG 2 defines it."""
    channels = [int(colour[place : place + 2], 16) / 255 for place in (1, 3, 5)]
    red, green, blue = (c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in channels)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def test_a_class_makes_a_small_page(tmp_path: Path) -> None:
    """200 students, 4 scenes, all wrong, in noise, which compresses worst."""
    noise = np.random.default_rng(1).uniform(0, 255, (224, 224, 3))
    album = Album(tmp_path, 480, exact=False)
    thumb, small = ((tmp_path / album.save(f"{side}", noise, side)).stat().st_size for side in (THUMB, SMALL))
    zoom = (tmp_path / album.save_zoom("zoom", noise, 100, 100)).stat().st_size
    assert 800 * (thumb + 2 * small + 2 * zoom) * 4 / 3 < 40e6


def test_one_wrong_pixel_survives_scaling_down() -> None:
    error = np.zeros((997, 1003, 3))
    error[996, 1002] = (0, 7, 3)
    small = tiled(error, 5)
    assert small.shape == (200, 201, 3)
    assert small[199, 200].tolist() == [0, 7, 3]
    assert small.sum() == 10
    assert tiled(error, 1) is error


@pytest.mark.parametrize(
    ("pixel", "expected"),
    [((50, 50), (40, 40, 21, 21)), ((0, 99), (0, 79, 21, 21)), ((99, 0), (79, 0, 21, 21))],
)
def test_surroundings_stay_inside(pixel: tuple[int, int], expected: tuple[int, int, int, int]) -> None:
    assert surroundings((100, 100, 3), *pixel) == expected
    assert surroundings((5, 4, 3), 2, 2) == (0, 0, 4, 5)
