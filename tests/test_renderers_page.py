"""docs/renderers.md: what can be told without a renderer is what would be written now."""

import re
import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers import ROOT

from translator.registry import TRUTH, adapter, own_renderers

REFRESH = "docs/renderers.md is not what would be written now: `make docs` writes it"
DIAGNOSTIC = sorted(path.stem for path in (ROOT / "scenes" / "diagnostic").glob("*.txt"))


@pytest.fixture(scope="module")
def documentation() -> dict[str, Any]:
    return runpy.run_path(str(ROOT / "docs" / "renderers.py"))


@pytest.fixture(scope="module")
def written() -> str:
    return (ROOT / "docs" / "renderers.md").read_text(encoding="utf-8")


def rows(text: str, heading: str) -> list[list[str]]:
    """The table under a heading, its head first."""
    section = text.partition(f"\n# {heading}\n" if heading == "The renderers" else f"\n## {heading}\n")[2]
    lines = re.findall(r"^\| (.*) \|$", section.partition("\n## ")[0], re.MULTILINE)
    return [line.split(" | ") for number, line in enumerate(lines) if number != 1]


def test_every_renderer_is_there_as_it_says_of_itself(documentation: dict[str, Any], written: str) -> None:
    _, *found = rows("\n" + written, "The renderers")
    assert [row[1] for row in found] == [f"`{name}`" for name in documentation["names"]()], REFRESH
    assert {row[1].strip("`") for row in found} == own_renderers().keys() - {TRUTH}
    for title, name, install, licence, version, *sizes in found:
        said = adapter(name.strip("`"))
        assert [title, install, licence] == [said.TITLE, f"`{said.INSTALL}`", said.LICENCE], REFRESH
        assert version
        assert all(re.fullmatch(r"[0-9.]+ MB|–", size) for size in sizes)


def test_limits_are_those_that_are_declared(documentation: dict[str, Any], written: str) -> None:
    assert rows(written, "What their arithmetic cannot do better")[1:] == documentation["limits"](), REFRESH


def test_refusals_are_those_that_a_user_reads(documentation: dict[str, Any], written: str) -> None:
    assert written.endswith(f"## What is refused, and why\n\n{documentation['refusals']()}"), REFRESH


def test_every_diagnostic_scene_is_there(documentation: dict[str, Any], written: str) -> None:
    head, *found = rows(written, "What each can carry")
    names = documentation["names"]()
    assert head == ["scene", *(adapter(name).TITLE for name in names)], REFRESH
    assert [row[0] for row in found] == [f"[{name}](../scenes/diagnostic/{name}.txt)" for name in DIAGNOSTIC], REFRESH
    for scene, row in zip(DIAGNOSTIC, found, strict=True):
        refused = [isinstance(documentation["exported"](name, scene), str) for name in names]
        assert [cell == "refused" for cell in row[1:]] == refused, REFRESH


def test_nothing_is_unexplained(written: str) -> None:
    _, *examples = rows(written, "How they agree on the document's examples")
    _, *carried = rows(written, "What each can carry")
    cells = [cell for row in examples for cell in row[1:5]] + [cell for row in carried for cell in row[1:]]
    assert len(examples) * 4 + len(DIAGNOSTIC) * len(examples) == len(cells)
    for cell in cells:
        assert re.fullmatch(r"0|refused|not installed here|\d+ [a-z]+-[a-z]+(, \d+ [a-z]+-[a-z]+)*", cell)


def test_sizes_are_those_on_disk() -> None:
    installed_size = runpy.run_path(str(ROOT / "docs" / "sizes.py"))["installed_size"]
    numpy = installed_size("pip install numpy>=1")
    folder = Path(np.__file__).parent
    on_disk = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file() and path.suffix != ".pyc")
    assert on_disk < numpy.alone < 3 * on_disk
    assert numpy.whole == numpy.alone
    assert installed_size("pip install numpy", ["jinja2"]).whole > numpy.alone
    assert installed_size("pip install 'crossray[dev]' (for Python 3.11)").alone > 1e6
    for line in (
        "pip install 'crossray[no-such-extra]'",
        "pip install no-such-thing",
        "apt-get install no-such-thing",
        "see their site",
    ):
        assert installed_size(line) is None
