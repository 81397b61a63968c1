"""Draw the README's picture of a grade: `python docs/grade_pictures.py` (needs Chromium)."""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from playwright.sync_api import sync_playwright

from reference import Scene
from reference.image import quantise
from reference.mistakes import MISTAKES
from reference.world import View

ROOT = Path(__file__).parent.parent
SCENE, MISTAKE = ROOT / "scenes" / "example1.txt", "S8"
SIDE = 1000  # pixels


def photograph_grade() -> None:
    """The top of the page for one wrong picture, as a browser shows it."""
    from PIL import Image

    mistake = MISTAKES[MISTAKE]
    with tempfile.TemporaryDirectory() as name, sync_playwright() as playwright:
        pixels = quantise(mistake.draw(Scene.load(SCENE), View(SIDE, SIDE, 3)))
        Image.fromarray(pixels).save(Path(name) / "scene.jpg", quality=90)
        command = [sys.executable, "-m", "crossray", "grade", str(SCENE), "scene.jpg", "--quiet"]
        subprocess.run(command, cwd=name, check=False)
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1280, "height": 1180})
        page.goto((Path(name) / "out" / "grade.html").as_uri())
        page.screenshot(path=ROOT / "docs" / "grade.png")
        browser.close()


if __name__ == "__main__":
    photograph_grade()
