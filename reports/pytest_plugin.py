"""The pytest plugin: the fixture `assert_matches`, which files the report of each test where it can be found.

Nothing of crossray is imported before a test uses it. `-p no:crossray` leaves the plugin out.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest


def pytest_addoption(parser: pytest.Parser) -> None:
    """The folder for reports."""
    group = parser.getgroup("crossray", "pictures of the ray tracing assignment")
    group.addoption(
        "--crossray-out", default="crossray-report", metavar="DIR", help="where crossray's reports go (crossray-report)"
    )


@pytest.fixture
def assert_matches(request: pytest.FixtureRequest) -> Callable[..., None]:
    """`crossray.assert_matches`, with paths beside the test's own file and a report folder named after the test."""
    folder = Path(request.config.getoption("--crossray-out"))
    beside = request.path.parent
    name = re.sub(r"[^A-Za-z0-9._-]+", "_", request.node.name).strip("._")[:80] or "test"

    def check(scene: str | Path, picture: str | Path, **options: Any) -> None:
        __tracebackhide__ = True
        from reports.assertion import check_picture

        options.setdefault("out", request.config.rootpath / folder / name)
        check_picture(_near(beside, scene), _near(beside, picture), **options)

    return check


def _near(folder: Path, path: str | Path) -> Path:
    """The path as it is, or where there is nothing, beside the test."""
    here = Path(path)
    return folder / here if not here.exists() and (folder / here).exists() else here
