"""A student's results.json, in the format that Gradescope documents for autograders."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from reports.credit import MEANING
from reports.gradelines import picture_lines

VISIBLE = "visible"


def gradescope(pictures: Sequence[Mapping[str, Any]], student: Mapping[str, Any]) -> dict[str, Any]:
    """One test a feature with its points and, where some are missing, why; all given as in grade.json."""
    tests = [
        {
            "name": f"{credit['feature']}: {MEANING[credit['feature']]}",
            "number": str(number),
            "score": credit["points"],
            "max_score": credit["most"],
            "status": "failed" if credit["reasons"] else "passed",
            "output": "\n".join(credit["reasons"]) or "Nothing is wrong here.",
            "output_format": "text",
            "tags": [credit["feature"]],
            "visibility": VISIBLE,
        }
        for number, credit in enumerate(student["credits"], 1)
    ]
    return {
        "score": student["points"],
        "execution_time": round(sum(picture["seconds"] for picture in pictures), 2),
        "output": "\n".join(_lines(pictures, student)),
        "output_format": "text",
        "test_output_format": "text",
        "visibility": VISIBLE,
        "stdout_visibility": "hidden",
        "tests": tests,
        "extra_data": {"crossray": [_brief(picture) for picture in pictures], "review": student["review"] or None},
    }


def _lines(pictures: Sequence[Mapping[str, Any]], student: Mapping[str, Any]) -> Iterator[str]:
    for picture in pictures:
        yield from picture_lines(picture)
        yield ""
    if student["review"]:
        yield f"A person should look at this: {student['review']}."


def _brief(picture: Mapping[str, Any]) -> dict[str, Any]:
    causes = [cause["id"] for cause in picture["causes"]]
    return {"scene": picture["scene"], "verdict": picture["verdict"], "causes": causes}
