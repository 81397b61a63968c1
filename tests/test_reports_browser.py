"""The report in a real browser."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from helpers import need
from playwright.sync_api import Browser, Dialog, Page, Request, sync_playwright
from recorded import GREY, HEIGHT, NAME, WIDTH, facts, record, record_everything

from reports.accounting import CLASSES


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record_everything(tmp_path_factory.mktemp("run"))


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
    assert sizes == [[True, WIDTH, HEIGHT]] * 22
    assert page.locator("script").count() == 1
    assert page.locator("img[src=x], pre *, b").count() == 0


def test_overview_is_worst_first(page: Page) -> None:
    rows = page.locator("section[aria-labelledby=overview] tbody tr").all()
    cells = [[cell.strip() for cell in row.locator("th, td").all_inner_texts()[:3]] for row in rows]
    assert cells.pop(8)[0:2] == ["", "Povray"]
    assert cells == [
        [NAME, "Native", "reference"],
        ["", "Mitsuba", "failed"],
        ["", "Povray", "disagree"],
        ["", "Mitsuba-Stock", "disagree"],
        ["", "Tachyon", "not installed"],
        ["", "Radiance", "unsupported"],
        ["", "Cycles", "agree"],
        ["lost", "Native", "failed"],
        ["off", "Native", "reference"],
        ["", "Povray", "disagree"],
        ["edges", "Native", "reference"],
        ["", "Mitsuba", "disagree"],
        ["", "Povray", "agree"],
        ["slight", "Native", "reference"],
        ["", "Povray", "disagree"],
        ["fine", "Native", "reference"],
        ["", "Povray", "agree"],
    ]
    headings = page.locator("section.scene h2").all_inner_texts()
    assert headings == [NAME, "lost", "off", "edges", "slight", "fine"]


def test_explained_pixels_have_columns_of_their_own(page: Page) -> None:
    table = page.locator("section[aria-labelledby=overview] table")
    headings = table.locator("thead tr").first.locator("th").all_inner_texts()
    assert headings[3:5] == ["Unexplained", "Explained"]
    rows = table.locator("tbody:has(a:text-is('edges')) tr").all()
    cells = [[cell.strip() for cell in row.locator("th, td").all_inner_texts()[3:8]] for row in rows[1:]]
    assert cells == [
        ["1", "3 knife-edge, 1 document-window", "5", "5", "5"],
        ["0", "3 knife-edge, 1 document-window", "4", "4", "4"],
    ]
    assert rows[0].locator("td.why").inner_text() == "native <b>in short</b>"
    widths = {sum(cell.evaluate("cell => cell.colSpan") for cell in row.locator("th, td").all()) for row in rows}
    assert len(widths) == 1
    meaning = rows[1].locator(".class").first.get_attribute("title")
    assert meaning == CLASSES["knife-edge"]


def test_every_differing_pixel_is_listed_with_why(page: Page) -> None:
    scene = page.locator("section.scene", has=page.get_by_role("heading", name="edges"))
    listed = scene.locator("details", has_text="Mitsuba: pixels that differ")
    listed.locator("summary").click()
    assert listed.locator("thead th").all_inner_texts() == ["Column", "Row", "Error in levels", "Why"]
    rows = [row.locator("td").all_inner_texts() for row in listed.locator("tbody tr").all()]
    assert rows == [
        ["90", "30", "20", "unexplained"],
        ["72", "76", "93.56", "document-window: the colour by the document's text"],
        *([str(column), "72", "35.86", "knife-edge: one of 2 admissible colours"] for column in (3, 20, 50)),
    ]
    for picture, (unexplained, explained) in enumerate([(1, 4), (0, 4)]):
        circles = scene.locator("svg").nth(picture).locator("circle")
        assert (circles.count(), circles.locator("xpath=self::*[@class='explained']").count()) == (
            unexplained + explained,
            explained,
        )
        caption = scene.locator("figcaption", has_text="Difference").nth(picture).inner_text()
        assert f"red: {unexplained} unexplained, amber: explained" in caption


def test_versions_are_under_the_pictures(page: Page) -> None:
    captions = page.locator("section.scene").first.locator("figcaption:has(strong)").all_inner_texts()
    assert captions == [
        "Native 1.2 <b> · reference",
        "Mitsuba 1.2 <b> · failed",
        "Povray 1.2 <b> · disagree",
        "Mitsuba-Stock 1.2 <b> · disagree",
        "Tachyon not installed",
        "Radiance 1.2 <b> · unsupported",
        "Cycles 1.2 <b> · agree",
    ]


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
