"""A picture's verdict as an assertion, for the tests of a student's own tracer."""

from __future__ import annotations

from importlib import metadata
from pathlib import Path

from reference.errors import FailureError
from reference.scene import Scene
from reports.collection import Collection, Entry
from reports.gradebook import TIMEOUT, Assignment, grade
from reports.gradelines import picture_lines
from reports.recording import slug

FOLDER = "crossray-report"


def check_picture(
    scene: str | Path, picture: str | Path, *, depth: int = 3, out: str | Path | None = None, timeout: float = TIMEOUT
) -> None:
    """Raise AssertionError unless `picture` is right for `scene`, naming the likely cause, what to do, and the report.

    The report goes to the folder `out`, by default to one of the picture's name in `crossray-report`. The picture is
    graded in a process of its own, so that neither threads nor a crash reach the tests.

    Raises SceneError for a scene that cannot be read and FailureError where the picture could not be graded.
    """
    __tracebackhide__ = True
    name, path = Path(scene).stem or "scene", Path(picture)
    folder = Path(out) if out is not None else Path(FOLDER) / slug(path.stem)
    assignment = Assignment({name: Scene.load(scene)}, {name: str(scene)}, depth)
    collection = Collection([Entry(slug(path.stem), name, path)], [])
    results = grade(assignment, collection, folder, metadata.version("crossray"), jobs=1, timeout=timeout)
    (record,) = results["pictures"]
    if record["status"] == "failed":
        raise FailureError(f"{picture}: {record['reason']}")
    if record["verdict"] != "right":
        told = "\n".join(picture_lines(record))
        raise AssertionError(f"{told}\n   The report: {(folder / 'grade.html').resolve()}")
