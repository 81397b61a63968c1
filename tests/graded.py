"""A class as grading records it, with nothing graded: records, and the pictures that belong to them."""

from pathlib import Path
from typing import Any

import numpy as np

from reports.collection import Entry
from reports.gradebook import empty_record
from reports.gradeimages import SMALL, THUMB, Album

SIDE = 40
EVIL = '<b>Eve</b> & "co" \''
CAUSES = {
    "S8": ("reflections have no shadows", "shadows"),
    "C4": ("rays go through the corners of pixels", "geometry"),
}


def cause(id_: str, *, named: bool = True, share: float = 0.9) -> dict[str, Any]:
    parts = [{"id": part, "title": CAUSES[part][0]} for part in id_.split("+")]
    return {
        "id": id_,
        "title": " and ".join(part["title"] for part in parts),
        "share": share,
        "hint": "Do it <right>.",
        "looks": "wrong",
        "evidence": f"explains {share:.0%} of the difference",
        "features": [CAUSES[part["id"]][1] for part in parts],
        "named": named,
        "parts": parts,
    }


def record(
    student: str, scene: str, verdict: str | None, *causes: dict[str, Any], features: tuple[str, ...] = ()
) -> dict[str, Any]:
    """A graded picture; one that is wrong differs in a square."""
    status = {None: "failed", "unreadable": "refused"}.get(verdict, "graded")
    reason = {"right": "Every pixel is right.", "wrong": "9 pixels are wrong."}.get(str(verdict), "It is <no> picture.")
    made = empty_record(Entry(student, scene, Path(f"{student}/{scene}.png")), status, reason)
    made |= {"verdict": verdict, "causes": list(causes), "seconds": 0.5}
    if verdict == "wrong":
        named = [feature for found in causes if found["named"] for feature in found["features"]]
        made |= {"outside": 9, "features": named or list(features), "advice": "Look at the <worst> pixel."}
        made["blobs"] = [{"pixels": 9, "box": [10, 20, 12, 22], "objects": ["plane 1, lines 9-13"]}]
        made["blob_count"] = 3
        made["worst"] = {
            "column": 11,
            "row": 21,
            "found": [255.0, 0.0, 0.0],
            "expected": [1, 2, 3],
            "text": "The worst pixel, column 11, row 21: yours is (255, 0, 0), right is (1, 2, 3).",
            "rays": [
                {
                    "ray": "camera",
                    "hit": "plane 1, lines 9-13, t = 2.0000",
                    "ambient": "1.0 2.0 3.0",
                    "diffuse": "0.0 0.0 0.0",
                    "why": "in the shadow of sphere 1",
                    "share": "1",
                    "adds": "1.0 2.0 3.0",
                },
                {"ray": "reflection 1", "hit": "nothing", "adds": ""},
            ],
            "sum": "1 2 3",
            "ray_tree": ["column 11, row 21", "clamped  (1, 2, 3)"],
            "zoom": {"width": 21, "height": 21, "column": 10, "row": 10},
        }
    return made


def draw(folder: Path, made: dict[str, Any], name: str) -> dict[str, Any]:
    """Write the pictures of a record."""
    if made["status"] != "graded":
        return made
    right = np.full((SIDE, SIDE, 3), 30.0)
    right[:, :, 1] = np.arange(SIDE) * 4
    yours = right.copy()
    album, images = Album(folder, 1000, exact=True), made["images"]
    made |= {"width": SIDE, "height": SIDE, "format": "PNG"}
    if made["verdict"] == "wrong":
        yours[20:23, 10:13] = (255, 0, 0)
        images |= {
            "small": album.save(f"{name}-small", yours, SMALL),
            "difference": album.save_difference(f"{name}-difference", np.abs(yours - right)),
            "small_difference": album.save_difference(f"{name}-small-difference", np.abs(yours - right), SMALL),
            "right": album.save(f"{made['scene']}-right", right),
            "right_small": album.save(f"{made['scene']}-right-small", right, SMALL),
            "zoom": album.save_zoom(f"{name}-zoom", yours, 11, 21),
            "right_zoom": album.save_zoom(f"{name}-right-zoom", right, 11, 21),
        }
    images |= {"thumb": album.save(f"{name}-thumb", yours, THUMB), "yours": album.save(f"{name}-yours", yours)}
    return made


def class_records() -> list[dict[str, Any]]:
    """Five students and two scenes: all right, one mistake, a pair, unknown, and files that could not be graded."""
    return [
        record("anna", "one", "right"),
        record("anna", "two", "right"),
        record("ben", "one", "right"),
        record("ben", "two", "wrong", cause("S8"), cause("C4", named=False, share=0.2)),
        record("carl", "one", "wrong", cause("S8+C4")),
        record("carl", "two", "wrong", cause("C4")),
        record("dora", "one", "wrong"),
        record("dora", "two", "wrong", features=("shadows",)),
        record(EVIL, "one", "unreadable"),
        record(EVIL, "two", None),
    ]
