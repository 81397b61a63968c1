"""All reports of a run, from its folder alone."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from reference.files import write_text
from reports.junit import junit
from reports.page import page
from reports.results import judge
from reports.summary import summary


def write_reports(folder: Path, progress: Callable[[str], None] = lambda text: None) -> dict[str, Any]:
    """Write report.json, junit.xml, summary.md and report.html into a run's folder; returns the content of the first.

    Raises InputError where the folder holds no run and OutputError where it cannot be written.
    """
    results = judge(folder, progress)
    write_text(folder / "report.json", json.dumps(results, indent=1, allow_nan=False) + "\n")
    write_text(folder / "junit.xml", junit(results))
    write_text(folder / "summary.md", summary(results))
    write_text(folder / "report.html", page(folder, results))
    return results
