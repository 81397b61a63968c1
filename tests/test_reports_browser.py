"""The report in a real browser: every mode, key, filter and address, and the values that it shows."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from axe_playwright_python.sync_playwright import Axe
from helpers import need
from playwright.sync_api import Browser, Dialog, Page, Request, sync_playwright
from recorded import (
    EDGES,
    EDGES_PATH,
    GREY,
    HEIGHT,
    NAME,
    NEAR,
    WIDTH,
    altered,
    edges,
    facts,
    record,
    record_everything,
)

import reports.embedding
from reference import EXACT
from reference.explanation import explain
from reference.files import make_folder
from reference.image import Picture, read_image, write_image
from reference.text import parse
from reports.accounting import CLASSES
from reports.page import page as drawn
from reports.raytree import ray_tree


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


def opened(browser: Browser, folder: Path, trouble: list[str], address: str = "", **window: Any) -> Page:
    """The report in a window; what it says, opens or asks for beyond itself is added to `trouble`."""

    def dismiss(dialog: Dialog) -> None:
        trouble.append(dialog.message)
        dialog.dismiss()

    def requested(request: Request) -> None:
        if not request.url.startswith(("data:", "blob:")) and request.url.partition("#")[0] != file:
            trouble.append(request.url)

    file = (folder / "report.html").as_uri()
    page = browser.new_page(**{"viewport": {"width": 1280, "height": 720}} | window)
    page.on("console", lambda message: trouble.append(message.text))
    page.on("pageerror", lambda error: trouble.append(str(error)))
    page.on("dialog", dismiss)
    page.on("request", requested)
    page.goto(file + address)
    return page


@pytest.fixture
def page(browser: Browser, folder: Path) -> Iterator[Page]:
    trouble: list[str] = []
    page = opened(browser, folder, trouble)
    yield page
    page.close()
    assert trouble == []


def look(page: Page, address: str) -> None:
    """Open the viewer by an address of this page and wait for the picture."""
    page.evaluate("address => { location.hash = address; }", address)
    page.wait_for_function(
        "() => document.querySelector('.viewer').open && document.querySelector('.wait').textContent === ''"
    )


def entries(page: Page) -> dict[str, str]:
    """What the address says."""
    found: dict[str, str] = page.evaluate("() => Object.fromEntries(new URLSearchParams(location.hash.slice(1)))")
    return found


# --- the overview


def test_every_thumbnail_has_loaded(page: Page) -> None:
    page.evaluate("() => document.querySelectorAll('img').forEach((image) => { image.loading = 'eager'; })")
    page.wait_for_function("() => [...document.images].every((image) => image.complete)")
    sizes = page.eval_on_selector_all("img", "images => images.map(i => [i.naturalWidth, i.naturalHeight])")
    assert sizes == [[WIDTH, HEIGHT]] * 28
    assert page.locator("img[src=x], pre *, b").count() == 0


def test_verdicts_at_a_glance(page: Page) -> None:
    rows = [row.locator("th, td").all_text_contents() for row in page.locator(".matrix tr").all()]
    shown = [[" ".join(cell.split()) for cell in row] for row in rows]
    assert shown == [
        ["Scene", "Cycles", "Mitsuba", "Mitsuba-Stock", "Povray", "Radiance", "Tachyon"],
        [
            NAME,
            "✓ agree",
            "! failed",
            "✗ 1 pixels unexplained",
            "✗ 2 pixels unexplained",
            "– unsupported",
            "– not installed",
        ],
        ["lost", "", "", "", "? not compared", "", ""],
        ["off", "", "", "", "✗ 2 pixels unexplained", "", ""],
        ["edges", "", "✗ 1 pixels unexplained", "", "✓ agree4 proven", "", ""],
        ["slight", "", "", "", "✗ 1 pixels unexplained", "", ""],
        ["fine", "", "", "", "✓ agree", "", ""],
    ]
    tally = [" ".join(item.split()) for item in page.locator(".tally li").all_text_contents()]
    assert tally == [
        "2 ! failed",
        "5 ✗ disagree",
        "1 ? not compared",
        "1 – not installed",
        "1 – unsupported",
        "3 ✓ agree",
    ]


def rows_shown(page: Page) -> list[tuple[str, str, str]]:
    """Scene, renderer and verdict of the rows that are seen."""
    return [
        (scene, row.locator("td").nth(1).inner_text(), row.locator("td").nth(2).inner_text().lstrip("!✗?–✓ "))
        for body in page.locator(".comparisons tbody").all()
        for scene in [body.get_attribute("data-scene") or ""]
        for row in body.locator("tr").all()
        if row.is_visible()
    ]


def test_overview_is_worst_first(page: Page) -> None:
    assert rows_shown(page) == [
        (NAME, "Native", "reference"),
        (NAME, "Mitsuba", "failed"),
        (NAME, "Povray", "disagree"),
        (NAME, "Mitsuba-Stock", "disagree"),
        (NAME, "Tachyon", "not installed"),
        (NAME, "Radiance", "unsupported"),
        (NAME, "Cycles", "agree"),
        ("lost", "Native", "failed"),
        ("lost", "Povray", "not compared"),
        ("off", "Native", "reference"),
        ("off", "Povray", "disagree"),
        ("edges", "Native", "reference"),
        ("edges", "Mitsuba", "disagree"),
        ("edges", "Povray", "agree"),
        ("slight", "Native", "reference"),
        ("slight", "Povray", "disagree"),
        ("fine", "Native", "reference"),
        ("fine", "Povray", "agree"),
    ]
    assert page.locator("section.scene h2").all_inner_texts() == [NAME, "lost", "off", "edges", "slight", "fine"]


FILTERS = [
    (
        "failed=1",
        [
            (NAME, "Mitsuba"),
            (NAME, "Povray"),
            (NAME, "Mitsuba-Stock"),
            ("off", "Povray"),
            ("edges", "Mitsuba"),
            ("slight", "Povray"),
        ],
    ),
    ("renderer=mitsuba", [(NAME, "Mitsuba"), ("edges", "Mitsuba")]),
    ("scene=edges", [("edges", "Mitsuba"), ("edges", "Povray")]),
    ("class=knife-edge", [("edges", "Mitsuba"), ("edges", "Povray")]),
    (
        "class=unexplained",
        [(NAME, "Povray"), (NAME, "Mitsuba-Stock"), ("off", "Povray"), ("edges", "Mitsuba"), ("slight", "Povray")],
    ),
    ("search=ALL+well", [("fine", "Povray")]),
    ("search=sigsegv", []),
    ("failed=1&renderer=povray&class=unexplained&search=slight", [("slight", "Povray")]),
    ("renderer=radiance&class=knife-edge", []),
]


def compared_rows(page: Page) -> list[tuple[str, str]]:
    return [(scene, renderer) for scene, renderer, _ in rows_shown(page) if renderer != "Native"]


@pytest.mark.parametrize(("address", "left"), FILTERS, ids=[address for address, _ in FILTERS])
def test_filters_by_form_and_by_address(
    page: Page, browser: Browser, folder: Path, address: str, left: list[tuple[str, str]]
) -> None:
    for name, value in (part.split("=") for part in address.split("&")):
        field, text = page.locator(f".filters [name={name}]"), value.replace("+", " ")
        if name == "failed":
            field.check()
        elif name == "search":
            field.fill(text)
        else:
            field.select_option(text)
    assert compared_rows(page) == left
    assert page.evaluate("location.hash") == f"#{address}"
    assert page.locator(".filters output").inner_text() == f"{len(left)} of 12 comparisons"
    shown = [section.get_attribute("data-scene") for section in page.locator("section.scene:visible").all()]
    assert set(shown) >= {scene for scene, _ in left}
    other = opened(browser, folder, [], f"#{address}")
    assert compared_rows(other) == left
    assert other.locator(".nothing").is_visible() == (not shown)
    other.get_by_role("button", name="Show all").click()
    other.wait_for_function("location.hash === ''")
    assert len(compared_rows(other)) == 12
    other.close()


def test_explained_pixels_have_columns_of_their_own(page: Page) -> None:
    rows = page.locator(".comparisons tbody[data-scene=edges] tr").all()
    cells = [[cell.strip() for cell in row.locator("th, td").all_inner_texts()[4:9]] for row in rows[1:]]
    assert cells == [
        ["1", "3 knife-edge, 1 document-window", "5", "5", "5"],
        ["0", "3 knife-edge, 1 document-window", "4", "4", "4"],
    ]
    assert rows[0].locator("td.why").inner_text() == "native <b>in short</b>"
    widths = {sum(cell.evaluate("cell => cell.colSpan") for cell in row.locator("th, td").all()) for row in rows}
    assert len(widths) == 1
    assert rows[1].locator(".class").first.get_attribute("title") == CLASSES["knife-edge"]


def test_every_differing_pixel_is_listed_with_why(page: Page) -> None:
    scene = page.locator("section.scene[data-scene=edges]")
    listed = scene.locator("details", has_text="Mitsuba: 5 pixels that differ")
    listed.locator("summary").click()
    rows = [row.locator("td").all_inner_texts()[:4] for row in listed.locator("tbody tr").all()]
    assert rows == [
        ["90", "30", "20", "unexplained"],
        ["72", "76", "93.56", "document-window: the colour by the document's text"],
        *([str(column), "72", "35.86", "knife-edge: one of 2 admissible colours"] for column in (3, 20, 50)),
    ]
    for picture, (unexplained, explained) in enumerate([(1, 4), (0, 4)]):
        thumbnail = scene.locator(".thumb").nth(picture + 1)
        assert thumbnail.locator("circle.unexplained").count() == unexplained
        assert thumbnail.locator("circle.explained").count() == explained
    listed.get_by_role("link").nth(1).click()
    assert {key: entries(page).get(key) for key in ("view", "b", "pixel")} == {
        "view": "edges",
        "b": "mitsuba",
        "pixel": f"{NEAR[0]},{NEAR[1]}",
    }


def test_texts_are_shown_as_they_are(page: Page) -> None:
    shown = page.locator("section.scene").first.text_content() or ""
    for part in ("</pre></script><script>alert(2)</script>", "{{ 7 * 7 }}", "a <b>note</b>", "povray '<b>' && true"):
        assert part in shown


def test_what_was_not_drawn_leaves_a_gap_with_its_reason(page: Page) -> None:
    gap = page.locator("section.scene[data-scene=lost] .gap")
    assert gap.count() == 1
    assert gap.locator(".badge").inner_text() == "! failed"
    assert gap.locator("p").inner_text() == "it was stopped by SIGSEGV"
    assert page.locator("section.scene").first.locator(".gap").count() == 3


# --- the viewer: what it draws is computed here again, and read back from its canvas


def arrays(folder: Path, scene: str, *renderers: str) -> list[Picture]:
    """Levels of pictures as the EXR files hold them."""
    (entry,) = [one for one in json.loads((folder / "report.json").read_text())["scenes"] if one["scene"] == scene]
    images = {picture["renderer"]: picture["image"] for picture in [entry["reference"], *entry["comparisons"]]}
    return [read_image(folder / f"{images[renderer]}.exr") for renderer in renderers]


CANVAS = """([column, row, pane]) => {
  const [left, top] = toPane(panes()[pane], column + 0.5, row + 0.5), ratio = window.devicePixelRatio;
  const copy = new OffscreenCanvas(1, 1).getContext("2d", { willReadFrequently: true });
  copy.drawImage(canvas, -Math.floor(left * ratio), -Math.floor(top * ratio));
  return [...copy.getImageData(0, 0, 1, 1).data].slice(0, 3);
}"""
PLACES = [(10, 10), (45, 70), (90, 30), (110, 5), (100, 60), NEAR]


def seen(page: Page, column: int, row: int, pane: int = 0) -> list[int]:
    """The colour on the canvas in the middle of a pixel."""
    found: list[int] = page.evaluate(CANVAS, [column, row, pane])
    return found


def truncated(value: Any) -> list[int]:
    return [int(channel) for channel in np.clip(np.round(value, 3) + 1e-9, 0, 255)]


FIRST_PICTURE = """async () => {
  const start = performance.now();
  document.querySelector(".cell").click();
  while (document.querySelector(".wait").textContent) await new Promise((done) => setTimeout(done, 5));
  return performance.now() - start;
}"""
MARKERS = "unexplained,knife-edge,document-window,renderer-precision,declared-limit,approved"
LOOK = f"view=edges&a=native&b=mitsuba&hide={MARKERS}"


def test_slider_shows_a_on_the_left_and_b_on_the_right(page: Page, folder: Path) -> None:
    a, b = arrays(folder, "edges", "native", "mitsuba")
    for split in (0, 40, 100):
        look(page, f"{LOOK}&split={split}")
        for column, row in PLACES:
            right = page.evaluate("([x]) => toPane(panes()[0], x, 0)[0] / stage.clientWidth * 100", [column + 0.5])
            if abs(right - split) > 3:
                assert seen(page, column, row) == truncated((a if right < split else b)[row, column])


def test_divider_is_dragged_and_moved_by_keys(page: Page) -> None:
    look(page, LOOK)
    box = page.locator(".stage").bounding_box()
    assert box
    middle = box["y"] + box["height"] / 2
    page.mouse.move(box["x"] + box["width"] / 2, middle)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] * 0.25, middle, steps=3)
    page.mouse.up()
    assert float(entries(page)["split"]) == pytest.approx(25, abs=0.2)
    page.keyboard.press(".")
    assert float(entries(page)["split"]) == pytest.approx(30, abs=0.2)
    page.keyboard.press(",")
    page.keyboard.press(",")
    assert float(entries(page)["split"]) == pytest.approx(20, abs=0.2)


def test_flip_shows_one_then_the_other(page: Page, folder: Path) -> None:
    pictures = arrays(folder, "edges", "native", "mitsuba")
    look(page, f"{LOOK}&mode=blink")
    for shown, title in ((0, "A Native"), (1, "B Mitsuba"), (0, "A Native")):
        assert page.locator(".label-a").inner_text() == title
        assert [seen(page, *place) for place in PLACES] == [truncated(pictures[shown][y, x]) for x, y in PLACES]
        page.keyboard.press(" ")
    page.keyboard.press("b")
    found = {page.locator(".label-a").inner_text()}
    page.wait_for_timeout(700)
    found.add(page.locator(".label-a").inner_text())
    assert found == {"A Native", "B Mitsuba"}
    page.keyboard.press("b")
    still = page.locator(".label-a").inner_text()
    page.wait_for_timeout(700)
    assert page.locator(".label-a").inner_text() == still


def test_side_by_side_is_synced(page: Page, folder: Path) -> None:
    pictures = arrays(folder, "edges", "native", "mitsuba")
    look(page, f"{LOOK}&mode=side")
    for _ in range(2):
        for pane, picture in enumerate(pictures):
            for column, row in ((90, 30), (88, 31)):
                assert seen(page, column, row, pane) == truncated(picture[row, column])
        page.locator(".stage").focus()
        look(page, f"{LOOK}&mode=side&pixel=92,32&zoom=40")


COLOURS = "(signed) => [...(signed ? SIGNED : LINEAR)]"


@pytest.mark.parametrize("gain", [0, 3, 10])
@pytest.mark.parametrize("mode", ["difference", "signed"])
def test_heat_maps_tell_the_error(page: Page, folder: Path, mode: str, gain: int) -> None:
    a, b = (np.clip(np.round(picture, 3), 0, 255) for picture in arrays(folder, "edges", "native", "mitsuba"))
    look(page, f"{LOOK}&mode={mode}&gain={gain}")
    table = np.reshape(page.evaluate(COLOURS, mode == "signed"), (256, 3))
    for column, row in PLACES:
        difference = b[row, column] - a[row, column]
        largest = difference[np.abs(difference).argmax()] * 2**gain
        value = 127.5 + largest / 2 if mode == "signed" else abs(largest)
        entry = int(np.clip(np.floor(value + 0.5), 0, 255))
        assert seen(page, column, row) in table[max(0, entry - 1) : entry + 2].tolist()
    end = f"{255 / 2**gain:.3g}"
    shown = [page.locator(f".legend .{part}").inner_text() for part in ("low", "high")]
    assert shown == ([f"−{end}", f"+{end}"] if mode == "signed" else ["0", end])
    assert page.locator(".legend canvas").is_visible()
    bar = page.evaluate(
        "[...document.querySelector('.legend canvas').getContext('2d').getImageData(200, 0, 1, 1).data]"
    )
    assert bar[:3] == table[200].tolist()


@pytest.mark.parametrize("mode", ["ssim", "flip"])
def test_maps_of_ssim_and_flip(page: Page, folder: Path, mode: str) -> None:
    (entry,) = [one for one in json.loads((folder / "report.json").read_text())["scenes"] if one["scene"] == "edges"]
    name = entry["comparisons"][0]["maps"][mode]
    values = np.rint(read_image(folder / f"{name}.png")[..., 0])
    assert values.max() > 20
    look(page, f"{LOOK}&mode={mode}&gain=1")
    table = page.evaluate(COLOURS, False)
    for column, row in PLACES:
        entry_at = 3 * int(min(255, values[row, column] * 2))
        assert seen(page, column, row) == table[entry_at : entry_at + 3]
    assert page.locator(".legend .high").inner_text() == "0.5"
    look(page, f"{LOOK}&mode={mode}&pixel=90,30")
    unit = {"ssim": "1 − SSIM", "flip": "FLIP error"}[mode]
    assert page.locator(".legend .unit").inner_text() == f"{unit} {values[30, 90] / 255:.3f} here"
    assert page.locator(".label-a").inner_text().endswith(": Mitsuba against Native")


def test_reference_has_no_map_against_itself(page: Page) -> None:
    page.evaluate("location.hash = 'view=edges&a=native&b=native&mode=ssim'")
    page.wait_for_function("() => document.querySelector('.wait').textContent.startsWith('There is no such map')")


def test_exposure_brightens_the_numbers_not_the_bytes(page: Page, folder: Path) -> None:
    (picture,) = arrays(folder, "edges", "mitsuba")
    for stops in (-2, 1.5, 6):
        look(page, f"{LOOK}&split=0&exposure={stops}")
        assert [seen(page, *place) for place in PLACES] == [
            truncated(np.round(picture[y, x], 3) * 2**stops) for x, y in PLACES
        ]


def readings(page: Page) -> dict[str, list[str]]:
    return {
        row.get_attribute("data-renderer") or "": row.locator("td").all_inner_texts()
        for row in page.locator(".values tbody tr").all()
    }


def test_read_out_is_what_the_files_hold(page: Page, folder: Path) -> None:
    """At 50 random pixels under the pointer, for every renderer."""
    random = np.random.default_rng(50)
    names = ("native", "mitsuba", "povray")
    pictures = arrays(folder, "edges", *names)
    right = np.clip(pictures[0], 0, 255)
    look(page, f"{LOOK}&mode=difference")
    page.wait_for_function("() => store.ready.size >= 3")
    box = page.locator(".stage").bounding_box()
    assert box
    for _ in range(50):
        column, row = int(random.integers(WIDTH)), int(random.integers(HEIGHT))
        left, top = page.evaluate("([x, y]) => toPane(panes()[0], x, y)", [column + 0.5, row + 0.5])
        page.mouse.move(box["x"] + left, box["y"] + top)
        assert page.locator("h2.pixel").inner_text() == f"Column {column}, row {row}"
        found = readings(page)
        for name, picture in zip(names, pictures, strict=True):
            assert found[name][:3] == [f"{value:.3f}" for value in picture[row, column]]
            if name != "native":
                error = np.abs(np.clip(picture, 0, 255) - right)[row, column].max()
                assert float(found[name][3]) == pytest.approx(error, abs=0.0011)


def test_values_that_are_no_numbers(browser: Browser, tmp_path: Path) -> None:
    broken = altered((30, 20, np.nan), (31, 20, np.inf), (32, 20, -1e30), (33, 20, 1000), (34, 20, -3))
    record(tmp_path, {"nan.txt": [(facts("native"), GREY), (facts("povray"), broken)]})
    trouble: list[str] = []
    page = opened(browser, tmp_path, trouble)
    found = []
    for column in range(30, 35):
        look(page, f"view=nan&split=0&pixel={column},20&zoom=64")
        found.append(readings(page)["povray"])
    assert [values[0] for values in found] == ["not a number", "∞", "-2147483.646", "1000.000", "-3.000"]
    assert [values[3] for values in found] == ["255.000", "155.000", "100.000", "155.000", "100.000"]
    page.close()
    assert trouble == []


def test_missing_renderers_say_why(page: Page) -> None:
    page.evaluate("scene => { writeAddress({ view: scene, pixel: '3,2' }); showAddress(); }", NAME)
    page.wait_for_function("() => store.ready.size >= 4")
    rows = readings(page)
    assert rows["tachyon"] == ["not installed"]
    assert rows["mitsuba"] == ["failed"]
    assert rows["povray"][0] == "150.000"
    assert page.locator("[data-state=view] option").all_inner_texts() == [
        NAME,
        "lost",
        "off",
        "edges",
        "slight",
        "fine",
    ]


def test_marked_pixels_are_visited_worst_first_and_say_why(page: Page) -> None:
    look(page, "view=edges&b=mitsuba")
    expected = [((90, 30), "unexplained"), (NEAR, "document-window"), *(((x, 72), "knife-edge") for x in (3, 20, 50))]
    for number, ((column, row), kind) in enumerate([*expected, expected[0]]):
        page.keyboard.press("n")
        assert page.locator("h2.pixel").inner_text() == f"Column {column}, row {row}"
        assert page.locator(".place").inner_text() == f"{number % 5 + 1} of 5 marked"
        assert (
            f"Mitsuba: {'○□◇'[('unexplained', 'document-window', 'knife-edge').index(kind)]} {kind}"
            in page.locator("aside .why").inner_text()
        )
        assert entries(page)["pixel"] == f"{column},{row}"
        assert page.evaluate("camera.zoom") >= 16
    page.keyboard.press("p")
    assert page.locator(".place").inner_text() == "5 of 5 marked"
    page.get_by_role("button", name="Next marked pixel").click()
    assert page.locator(".place").inner_text() == "1 of 5 marked"
    spoken = page.locator(".spoken").text_content() or ""
    assert spoken.startswith("Column 90, row 30. ")
    assert "somebody is wrong" in spoken
    command = page.locator("aside .why code").inner_text()
    assert command == f"crossray explain {EDGES_PATH} 90 30 --size 120x80 --depth 3 --convention exact"


SPOT = """([x, y]) => {
  const [left, top] = toPane(panes()[0], x + 0.5, y + 0.5), r = Math.ceil(Math.max(7, camera.zoom * 0.5 + 6)) + 3;
  const copy = new OffscreenCanvas(2 * r, 2 * r).getContext("2d", { willReadFrequently: true });
  copy.drawImage(canvas, r - left, r - top);
  const found = copy.getImageData(0, 0, 2 * r, 2 * r).data;
  return found.filter((value, i) => i % 4 !== 3 && value > 90).length;
}"""


def test_rays_are_told_at_marked_pixels(page: Page) -> None:
    scene = parse(EDGES)
    for column, row in ((90, 30), NEAR):
        look(page, f"view=edges&b=mitsuba&pixel={column},{row}&zoom=16")
        shape = {"width": WIDTH, "height": HEIGHT, "depth": 3}
        told = list(ray_tree(explain(scene, EXACT, column=column, row=row, **shape)))
        assert page.locator("aside .why pre").text_content() == "\n".join(told)
        assert told[0] == f"column {column}, row {row}, convention exact"
    look(page, "view=edges&b=mitsuba&pixel=1,1")
    assert page.locator("aside .why pre").count() == 0


def test_approved_pixels_and_pictures_against_others_than_the_reference(
    browser: Browser, folder: Path, tmp_path: Path
) -> None:
    results = json.loads((folder / "report.json").read_text())
    (scene,) = [scene for scene in results["scenes"] if scene["scene"] == "edges"]
    wrong, other = scene["comparisons"]
    wrong["worst"][0]["approved"] = True
    wrong |= {"verdict": "agree", "against": "povray"}
    wrong["approval"] = {"because": "known", "until": "2027-11-01", "expired": False, "pixels": 1}
    (tmp_path / "report.html").write_text(drawn(folder, results), encoding="utf-8")
    trouble: list[str] = []
    page = opened(browser, tmp_path, trouble)
    cell = page.locator(".matrix tr", has_text="edges").locator(".cell").first
    assert cell.inner_text() == "✓ 1 approved"
    row = page.locator(".comparisons tbody[data-scene=edges] tr[data-renderer=mitsuba]")
    assert row.locator("td").nth(2).inner_text() == "✓ agree against Povray approved until 2027-11-01"
    cell.click()
    assert {key: entries(page)[key] for key in ("a", "b")} == {"a": "povray", "b": "mitsuba"}
    page.wait_for_function("() => store.ready.size >= 3")
    page.keyboard.press("n")
    assert page.locator(".marks label").first.inner_text().split() == ["◎", "approved", "1"]
    assert "◎ approved. Nothing explains it, and somebody has approved it." in page.locator("aside .why").inner_text()
    page.keyboard.press("6")
    page.wait_for_function("() => document.querySelector('.label-a').textContent.endsWith('against Povray')")
    assert other["verdict"] == "agree"
    page.close()
    assert trouble == []


def test_each_class_has_a_marker_that_can_be_hidden(page: Page) -> None:
    look(page, "view=edges&b=mitsuba&mode=difference")
    spot = SPOT
    labels = [" ".join(label.split()) for label in page.locator(".marks label").all_inner_texts()]
    assert labels == ["○ unexplained 1", "□ document-window 1", "◇ knife-edge 3"]
    for kind, place in (("unexplained", (90, 30)), ("document-window", NEAR), ("knife-edge", (20, 72))):
        before = page.evaluate(spot, list(place))
        page.locator(f".marks input[value={kind}]").uncheck()
        assert kind in entries(page)["hide"]
        assert page.evaluate(spot, list(place)) < before - 10
    page.keyboard.press("n")
    assert "pixel" not in entries(page)
    page.locator(".stage").focus()
    page.keyboard.press("m")
    assert "hide" not in entries(page)


def test_nothing_to_visit_is_no_error(page: Page) -> None:
    look(page, "view=fine")
    page.keyboard.press("n")
    assert page.locator(".place").inner_text() == "none marked"


def test_every_key_does_what_the_help_says(page: Page) -> None:
    look(page, "view=edges&b=mitsuba&pixel=60,40")
    press = page.keyboard.press

    def value(name: str) -> str | None:
        return entries(page).get(name)

    modes = ["slider", "blink", "side", "difference", "signed", "ssim", "flip"]
    for number, mode in reversed(list(enumerate(modes, 1))):
        press(str(number))
        assert page.locator(".modes [aria-checked=true]").get_attribute("value") == mode
        assert (value("mode") or "slider") == mode
    for key, name, expected in (
        ("x", "a", "mitsuba"),
        ("x", "a", "native"),
        ("]", "b", "povray"),
        ("]", "b", "native"),
        ("[", "b", "povray"),
    ):
        press(key)
        assert value(name) == expected
    for key, expected in (
        ("ArrowRight", "61,40"),
        ("ArrowUp", "61,39"),
        ("Shift+ArrowLeft", "51,39"),
        ("Shift+ArrowDown", "51,49"),
    ):
        press(key)
        assert value("pixel") == expected
    fitting = page.evaluate("camera.zoom")
    zooms = []
    for key in ("+", "=", "-", "-"):
        press(key)
        zooms.append(page.evaluate("camera.zoom"))
    assert fitting < zooms[0] == zooms[1] / 2 == zooms[2] == 2 * zooms[3]
    press("0")
    assert page.evaluate("camera.zoom") == fitting
    changes: tuple[tuple[str, str, str | None], ...] = (
        ("e", "exposure", "0.5"),
        ("E", "exposure", None),
        ("E", "exposure", "-0.5"),
        ("g", "gain", "6"),
        ("G", "gain", None),
        ("G", "gain", "4"),
        (".", "split", "55"),
        ("r", "split", None),
        ("m", "hide", MARKERS),
        ("m", "hide", None),
        ("}", "view", "slight"),
        ("{", "view", "edges"),
    )
    for key, name, setting in changes:
        press(key)
        assert value(name) == setting, key
    press("?")
    assert page.locator("dialog.help").is_visible()
    listed = page.locator("dialog.help kbd").all_inner_texts()
    names = {" ": "Space", "-": "−"} | {
        f"Arrow{name}": sign for name, sign in zip(("Left", "Right", "Up", "Down"), "←→↑↓", strict=True)
    }
    assert listed == [names.get(key, key) for key in page.evaluate("[...actions.keys()]")]
    press("Escape")
    assert not page.locator("dialog.help").is_visible()
    assert page.locator("dialog.viewer").is_visible()
    press("q")
    assert not page.locator("dialog.viewer").is_visible()
    assert entries(page) == {}


def test_buttons_and_fields_do_what_keys_do(page: Page) -> None:
    look(page, "view=edges&b=mitsuba")
    for name, mode in (("Side by side", "side"), ("FLIP map", "flip"), ("Slider", "slider")):
        page.get_by_role("radio", name=name).click()
        assert entries(page).get("mode", "slider") == mode
    page.get_by_label("Exposure").fill("2")
    page.get_by_label("Amplification").fill("7")
    page.get_by_label("Divider").fill("10")
    assert {key: entries(page)[key] for key in ("exposure", "gain", "split")} == {
        "exposure": "2",
        "gain": "7",
        "split": "10",
    }
    page.get_by_label("Exposure").focus()
    page.keyboard.press("ArrowRight")
    assert entries(page)["exposure"] == "2.5"
    page.locator("[data-state=a]").select_option("povray")
    page.locator("[data-state=view]").select_option("slight")
    assert {key: entries(page)[key] for key in ("view", "a", "b")} == {"view": "slight", "a": "povray", "b": "native"}
    page.get_by_role("button", name="Zoom in").click()
    assert "zoom" in entries(page)
    page.get_by_role("button", name="Fit").click()
    assert "zoom" not in entries(page)
    page.get_by_role("button", name="Keys").click()
    page.get_by_role("button", name="Close").last.click()
    page.get_by_role("button", name="Close").first.click()
    assert not page.locator("dialog.viewer").is_visible()


def test_pointer_pans_zooms_and_chooses(page: Page) -> None:
    look(page, "view=edges&b=mitsuba&mode=blink")
    box = page.locator(".stage").bounding_box()
    assert box
    x, y = box["x"] + 300, box["y"] + 300
    page.mouse.move(x, y)
    under = page.locator("h2.pixel").inner_text()
    page.mouse.wheel(0, -1200)
    assert page.locator("h2.pixel").inner_text() == under
    assert page.evaluate("camera.zoom") > 30
    page.mouse.click(x, y)
    assert under == "Column {}, row {}".format(*entries(page)["pixel"].split(","))
    before = page.evaluate("[camera.x, camera.y, camera.zoom]")
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 80, y - 40, steps=4)
    page.mouse.up()
    after = page.evaluate("[camera.x, camera.y, camera.zoom]")
    assert after == pytest.approx([before[0] - 80 / before[2], before[1] + 40 / before[2], before[2]])
    page.mouse.move(x + 80, y - 40)
    assert page.locator("h2.pixel").inner_text() == under


def test_touch(browser: Browser, folder: Path) -> None:
    trouble: list[str] = []
    page = opened(
        browser,
        folder,
        trouble,
        "#view=edges&b=mitsuba&mode=blink",
        has_touch=True,
        viewport={"width": 400, "height": 800},
    )
    page.wait_for_function("() => document.querySelector('.wait').textContent === ''")
    box = page.locator(".stage").bounding_box()
    assert box
    left, top = page.evaluate("toPane(panes()[0], 90.5, 30.5)")
    page.touchscreen.tap(box["x"] + left, box["y"] + top)
    assert entries(page)["pixel"] == "90,30"
    zoom = page.evaluate("camera.zoom")
    session = page.context.new_cdp_session(page)
    middle = [box["x"] + left, box["y"] + top]

    def touch(kind: str, *offsets: float) -> None:
        points = [{"x": middle[0] + offset, "y": middle[1], "id": i} for i, offset in enumerate(offsets)]
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    touch("touchStart", -20)
    touch("touchStart", -20, 20)
    for spread in (30, 40, 60):
        touch("touchMove", -spread, spread)
    touch("touchEnd")
    assert page.evaluate("camera.zoom") == pytest.approx(3 * zoom, rel=0.05)
    assert page.evaluate("([l, t]) => toPicture(l, t)", [left, top]) == pytest.approx([90.5, 30.5], abs=0.6)
    page.close()
    assert trouble == []


def test_address_leads_back_to_what_was_seen(page: Page, browser: Browser, folder: Path) -> None:
    page.locator(".filters [name=failed]").check()
    page.locator("section.scene[data-scene=edges] button.picture").nth(1).click()
    page.keyboard.press("n")
    page.keyboard.press("5")
    page.keyboard.press("e")
    page.keyboard.press("g")
    address = page.evaluate("location.hash")
    assert entries(page) == {
        "failed": "1",
        "view": "edges",
        "a": "native",
        "b": "mitsuba",
        "mode": "signed",
        "pixel": "90,30",
        "zoom": "16",
        "exposure": "0.5",
        "gain": "6",
    }
    other = opened(browser, folder, [], address)
    other.wait_for_function("() => document.querySelector('.wait').textContent === '' && store.ready.size >= 3")
    for watched in (".label-a", "h2.pixel", "aside .why", ".values", "output.exposure", "output.gain", "output.zoom"):
        assert other.locator(watched).inner_text() == page.locator(watched).inner_text()
    assert other.evaluate("[camera.x, camera.y]") == page.evaluate("[camera.x, camera.y]")
    other.keyboard.press("Escape")
    assert other.evaluate("location.hash") == "#failed=1"
    other.close()
    page.go_back()
    page.wait_for_function("() => !document.querySelector('.viewer').open")
    assert len(compared_rows(page)) == 6
    page.go_forward()
    page.wait_for_function("() => document.querySelector('.viewer').open")


@pytest.mark.parametrize(
    "address", ["#view=none", "#view=edges&a=x&b=y&mode=z&pixel=-1,9&zoom=q&gain=1e9&split=NaN", "#%%%", "#pixel=1,1"]
)
def test_odd_addresses_do_no_harm(browser: Browser, folder: Path, address: str) -> None:
    trouble: list[str] = []
    page = opened(browser, folder, trouble, address)
    page.wait_for_timeout(200)
    assert page.locator("dialog.viewer").is_visible() == ("view=edges" in address)
    page.close()
    assert trouble == []


def test_sampled_pictures_name_the_pixel_they_show(
    browser: Browser, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(reports.embedding, "LADDER", ((0.1, 4, 1e9),))
    truth, other = edges()
    other[33, 91] += 20
    record(tmp_path, {EDGES_PATH: [(facts("native"), truth), (facts("povray"), other)]})
    trouble: list[str] = []
    page = opened(browser, tmp_path, trouble)
    assert "of each 4 × 4" in " ".join((page.locator("section[aria-labelledby=settings]").text_content() or "").split())
    look(page, "view=edges&pixel=88,35")
    page.wait_for_function("() => store.ready.size >= 3")
    assert page.locator("h2.pixel").inner_text() == "Column 91, row 33"
    assert readings(page)["povray"][:3] == [f"{value:.1f}" for value in other[33, 91]]
    assert "unexplained" in page.locator("aside .why").inner_text()
    page.close()
    assert trouble == []


# --- for everybody


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("address", ["", "#view=edges&b=mitsuba&pixel=90,30&mode=signed", "help"])
def test_axe_finds_nothing(browser: Browser, folder: Path, scheme: str, address: str) -> None:
    page = opened(browser, folder, [], "#view=edges" if address == "help" else address, color_scheme=scheme)
    if address:
        page.wait_for_function("() => document.querySelector('.wait').textContent === ''")
    if address == "help":
        page.keyboard.press("?")
    for details in page.locator("details").all() if not address else []:
        details.evaluate("details => { details.open = true; }")
    found = Axe().run(page).response["violations"]
    page.close()
    assert [(rule["id"], rule["impact"], [node["html"][:120] for node in rule["nodes"]]) for rule in found] == []


def test_the_viewer_is_used_by_keyboard_alone(page: Page) -> None:
    cell = page.locator(".cell.disagree").first
    cell.focus()
    page.keyboard.press("Enter")
    assert page.locator("dialog.viewer").is_visible()
    assert page.evaluate("document.activeElement.className") == "stage"
    page.keyboard.press("n")
    assert page.locator("h2.pixel").inner_text() == "Column 7, row 70"
    for _ in range(3):
        page.keyboard.press("Shift+Tab")
    assert page.evaluate("document.activeElement.role || document.activeElement.getAttribute('role')") == "radio"
    page.keyboard.press("ArrowRight")
    assert entries(page)["mode"] == "blink"
    page.keyboard.press("Escape")
    assert cell.evaluate("cell => cell === document.activeElement")


@pytest.mark.parametrize("width", [360, 420, 900])
@pytest.mark.parametrize("address", ["", "#view=edges&b=mitsuba&pixel=90,30"])
def test_page_fits_its_window(browser: Browser, folder: Path, width: int, address: str) -> None:
    page = opened(browser, folder, [], address, viewport={"width": width, "height": 720})
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    if address:
        box = page.locator(".stage").bounding_box()
        assert box
        assert box["width"] >= width / 2
        assert box["height"] >= 240
        assert page.evaluate("document.querySelector('aside').scrollWidth") <= width
    page.close()


def test_long_words_fit_a_small_window(browser: Browser, tmp_path: Path) -> None:
    word = "x" * 150
    about = facts("povray", "failed", f"cannot open /{word}", word)
    record(tmp_path, {f"scenes/{word}.txt": [(facts("native"), GREY), (about, None)]})
    page = opened(browser, tmp_path, [], viewport={"width": 420, "height": 720})
    assert page.evaluate("document.documentElement.scrollWidth") <= 420
    page.close()


def test_nothing_leaves_the_file(browser: Browser, folder: Path) -> None:
    """With every scene and mode looked at, the page has asked for nothing, and could not."""
    trouble: list[str] = []
    page = opened(browser, folder, trouble)
    for scene in page.evaluate("data.scenes.map((scene) => scene.scene)"):
        for mode in page.evaluate("Object.keys(MODES)"):
            page.evaluate("known => { location.hash = new URLSearchParams(known); }", {"view": scene, "mode": mode})
            page.wait_for_function("mode => document.querySelector('.viewer').dataset.mode === mode", arg=mode)
    assert trouble == []
    policy = page.locator("meta[http-equiv=Content-Security-Policy]").get_attribute("content") or ""
    assert re.match(r"default-src 'none'; img-src data:;", policy)
    assert "unsafe" not in policy
    injected = """() => {
      const script = document.createElement("script");
      script.textContent = "window.injected = true";
      document.body.append(script);
      return window.injected ?? false;
    }"""
    assert page.evaluate(injected) is False
    refused = page.evaluate("fetch('https://example.org/').then(() => 'sent', () => 'refused')")
    assert refused == "refused"
    page.close()


def test_large_pictures_are_there_at_once(browser: Browser, tmp_path: Path) -> None:
    """First paint of the page, and two pictures of 1000 x 1000 drawn from their values: each well within a second."""
    rows, columns = np.mgrid[:1000, :1000]
    truth = np.stack([rows * 0.2, columns * 0.2, (rows + columns) * 0.1], axis=-1)
    truth[(rows - 500) ** 2 + (columns - 400) ** 2 < 300**2] += 20.123
    image = "images/large/{}"
    make_folder(tmp_path / "images" / "large")
    for name, picture in (("native", truth), ("povray", truth + 0.002 * (rows % 3)[..., None])):
        for ending in (".exr", ".png"):
            write_image(tmp_path / (image.format(name) + ending), picture)
    blank = record(tmp_path / "blank", {"large.txt": [(facts("native"), GREY), (facts("povray"), GREY)]})
    results = json.loads((blank / "report.json").read_text())
    (scene,) = results["scenes"]
    scene |= {"width": 1000, "height": 1000}
    for picture in (scene["reference"], *scene["comparisons"]):
        picture |= {"image": image.format(picture["renderer"]), "maps": {}}
    (tmp_path / "report.html").write_text(drawn(tmp_path, results), encoding="utf-8")
    trouble: list[str] = []
    page = opened(browser, tmp_path, trouble)
    page.wait_for_function("() => performance.getEntriesByName('first-contentful-paint').length")
    paint = page.evaluate("performance.getEntriesByName('first-contentful-paint')[0].startTime")
    viewed = page.evaluate(FIRST_PICTURE)
    assert seen(page, 30, 900) == truncated(truth[900, 30])
    page.close()
    assert trouble == []
    assert (paint < 2000, viewed < 4000) == (True, True), (paint, viewed)  # milliseconds, on a machine at work
