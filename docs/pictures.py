"""Draw the pictures of the README: `make pictures` (all but the first need Chromium and `make report` before it)."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from playwright.sync_api import Browser, sync_playwright

from reference import EXACT, Scene, render
from reference.certification import certify
from reference.image import write_image
from reference.text import dump
from reports.recording import Recording
from reports.writing import write_reports

ROOT = Path(__file__).parent.parent
DOCS = ROOT / "docs"
SIDE = 400  # pixels
READY = "() => !document.querySelector('.viewer').open || document.querySelector('.wait').textContent === ''"


def draw_examples() -> None:
    """The four examples side by side."""
    scenes = [Scene.load(path) for path in sorted((ROOT / "scenes").glob("example?.txt"))]
    pictures = [render(scene, width=SIDE, height=SIDE) for scene in scenes]
    write_image(DOCS / "examples.png", np.concatenate(pictures, axis=1))


def record_mistake(folder: Path) -> None:
    """A run of the first example with a picture whose mirrors are 1 % too strong."""
    scene = Scene.load(ROOT / "scenes" / "example1.txt")
    wrong = replace(EXACT, reflected_weight=lambda weight, kr, depth: EXACT.reflected_weight(weight, 1.01 * kr, depth))
    run = Recording(folder, "docs")
    entry = run.add_scene("scenes/example1.txt", SIDE, SIDE, depth=3, convention="exact", text=dump(scene))
    truth = certify(scene, width=SIDE, height=SIDE).picture
    run.add_picture(entry, run.picture_file("certified", Path("Certified truth")), truth)
    run.add_picture(
        entry, run.picture_file("homework", Path("homework.exr")), render(scene, wrong, width=SIDE, height=SIDE)
    )
    write_reports(folder)


def photograph(browser: Browser, folder: Path, name: str, address: str = "", keys: str = "") -> None:
    """The report in `folder` at that address, after those keys, as a browser shows it."""
    page = browser.new_page(viewport={"width": 1440, "height": 900})
    page.goto((folder / "report.html").as_uri() + address)
    page.wait_for_function(READY)
    for key in keys:
        page.keyboard.press(key)
    page.wait_for_function(READY)
    page.wait_for_timeout(1000)  # milliseconds, until every renderer's values are there
    page.screenshot(path=DOCS / f"{name}.png")
    page.close()


def photograph_reports() -> None:
    """Overview and viewer of `make report`, and a pixel that is wrong."""
    with sync_playwright() as playwright, TemporaryDirectory() as folder:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        photograph(browser, ROOT / "out", "report")
        photograph(browser, ROOT / "out", "viewer", "#view=example2&b=mitsuba-stock&exposure=1&pixel=511,640")
        record_mistake(Path(folder))
        photograph(browser, Path(folder), "pixel", "#view=example1&b=homework&mode=side&zoom=24", "n")
        browser.close()


if __name__ == "__main__":
    draw_examples()
    photograph_reports()
