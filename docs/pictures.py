"""Draw the pictures of the README: `make pictures` (the second needs Chromium and `make report` before it)."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
from playwright.sync_api import sync_playwright

from reference import Scene, render
from reference.image import write_image

ROOT = Path(__file__).parent.parent
SIDE = 400  # pixels


def draw_examples() -> None:
    """The four examples side by side."""
    scenes = [Scene.load(path) for path in sorted((ROOT / "scenes").glob("example?.txt"))]
    pictures = [render(scene, width=SIDE, height=SIDE) for scene in scenes]
    write_image(ROOT / "docs" / "examples.png", np.concatenate(pictures, axis=1))


def photograph_report() -> None:
    """The top of the report, as a browser shows it."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1440, "height": 1150})
        page.goto((ROOT / "out" / "report.html").as_uri())
        page.screenshot(path=ROOT / "docs" / "report.png")
        browser.close()


if __name__ == "__main__":
    draw_examples()
    photograph_report()
