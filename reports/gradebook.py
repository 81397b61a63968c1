"""A class graded: all pictures in parallel, then one record, one page, and results for each student."""

from __future__ import annotations

import json
import os
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import count
from pathlib import Path
from time import perf_counter
from typing import Any

from reference.files import make_folder, write_text
from reference.scene import Scene
from reports.collection import Collection, Entry
from reports.credit import mark, named
from reports.gradepage import page
from reports.gradescope import gradescope
from reports.recording import slug
from reports.workers import Failed, run_jobs

PICTURES, STUDENTS = "pictures", "students"
FEW = 4  # pictures that are kept pixel by pixel
LARGE, MEDIUM = 1000, 480  # pixels a side of the largest pictures kept, of few and of many
TIMEOUT = 300.0  # seconds for one picture


@dataclass(frozen=True)
class Task:
    """One picture to grade, and where its pictures go."""

    entry: Entry
    scene: Scene
    depth: int
    folder: Path
    name: str  # of the pictures, in the folder
    side: int
    exact: bool
    others: Mapping[str, Scene]  # what it may be a picture of instead


@dataclass(frozen=True)
class Assignment:
    """The scenes by name, with the path of each as it was given, and the depth limit."""

    scenes: Mapping[str, Scene]
    paths: Mapping[str, str]
    depth: int


def grade(
    assignment: Assignment,
    collection: Collection,
    out: Path,
    version: str,
    *,
    jobs: int | None = None,
    timeout: float = TIMEOUT,
    progress: Callable[[str], None] = lambda text: None,
) -> dict[str, Any]:
    """Grade everything and write grade.json, grade.html and results.json into `out`; returns what grade.json holds.

    Each of several students has results.json and a page in `out`/students. A picture that crashes or outlasts its
    process, or takes more than `timeout` seconds, is recorded as failed. Raises OutputError.
    """
    started, start = datetime.now(UTC), perf_counter()
    make_folder(out)
    entries = collection.entries
    records: list[dict[str, Any]] = [{}] * len(entries)
    there = [place for place, entry in enumerate(entries) if entry.path is not None]
    few = len(entries) <= FEW
    names = _picture_names(entries)
    tasks = [
        Task(
            entries[place],
            assignment.scenes[entries[place].scene],
            assignment.depth,
            out,
            f"{PICTURES}/{names[place]}",
            LARGE if few else MEDIUM,
            few,
            assignment.scenes,
        )
        for place in there
    ]
    for place, entry in enumerate(entries):
        records[place] = empty_record(entry, "refused", f"there is no picture of {entry.scene}")
        if entry.path is None:
            progress(f"{entry.student}: {entry.scene}")
    cores = usable_cores()
    workers = max(1, min(jobs or cores, len(tasks)))
    threads = max(1, cores // workers)
    topics = [task.entry.scene for task in tasks]
    with closing(run_jobs(tasks, topics, workers=workers, threads=threads, timeout=timeout)) as answers:
        for number, answer in answers:
            entry = tasks[number].entry
            progress(f"{entry.student}: {entry.scene}")
            record = empty_record(entry, "failed", answer.reason) if isinstance(answer, Failed) else answer["record"]
            records[there[number]] = record
    results = {
        "version": 1,
        "crossray": version,
        "started": started.isoformat(timespec="seconds"),
        "seconds": round(perf_counter() - start, 3),
        "scene": next(iter(assignment.paths.values())) if len(assignment.paths) == 1 else None,
        "scenes": [{"scene": name, "path": path} for name, path in assignment.paths.items()],
        "depth": assignment.depth,
        "pictures": records,
        "students": list(students_of(records)),
        "mistakes": mistakes(records),
        "ignored": [{"path": shown(path), "reason": reason} for path, reason in collection.ignored],
    }
    _write(out, results)
    return results


def students_of(pictures: Sequence[Mapping[str, Any]]) -> Iterator[dict[str, Any]]:
    """Every student's points, in order, and the name of the page in case that there are several."""
    places: dict[str, list[int]] = {}
    for place, picture in enumerate(pictures):
        places.setdefault(picture["student"], []).append(place)
    folders = _unique([slug(student) for student in places])
    for (student, own), folder in zip(places.items(), folders, strict=True):
        given = mark([pictures[place] for place in own])
        yield {
            "student": student,
            "points": given.points,
            "most": given.most,
            "review": given.review,
            "credits": [{**vars(credit), "reasons": list(credit.reasons)} for credit in given.credits],
            "pictures": own,
            "page": f"{STUDENTS}/{folder}/grade.html" if len(places) > 1 else None,
        }


def _write(out: Path, results: Mapping[str, Any]) -> None:
    """The record first, then what is made of it."""
    write_text(out / "grade.json", json.dumps(results, indent=1, allow_nan=False) + "\n")
    for student in results["students"]:
        pictures = [results["pictures"][place] for place in student["pictures"]]
        where = make_folder((out / student["page"]).parent) if student["page"] else out
        write_text(where / "results.json", json.dumps(gradescope(pictures, student), indent=1, allow_nan=False) + "\n")
        if student["page"]:
            own = {**results, "students": [{**student, "page": None}], "ignored": []}
            write_text(out / student["page"], page(out, own, student=student["student"]))
    write_text(out / "grade.html", page(out, results))


def mistakes(records: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """The named mistakes, those of most students first, each with who made it; of pairs, each counts."""
    students: dict[str, set[str]] = {}
    titles: dict[str, str] = {}
    pictures: Counter[str] = Counter()
    for record in records:
        if not (cause := named(record)):
            continue
        for part in cause["parts"]:
            titles[part["id"]] = part["title"]
            students.setdefault(part["id"], set()).add(record["student"])
            pictures[part["id"]] += 1
    order = sorted(students, key=lambda id_: (-len(students[id_]), -pictures[id_], id_))
    return [
        {"id": id_, "title": titles[id_], "pictures": pictures[id_], "students": sorted(students[id_])} for id_ in order
    ]


def empty_record(entry: Entry, status: str, reason: str) -> dict[str, Any]:
    """The record of a picture of which nothing is known but why."""
    return {
        "picture": shown(entry.path) if entry.path else None,
        "student": entry.student,
        "scene": entry.scene,
        "status": status,
        "verdict": None if status == "failed" else "unreadable",
        "reason": readable(reason),
        "format": None,
        "width": None,
        "height": None,
        "outside": None,
        "advice": None,
        "features": [],
        "causes": [],
        "blobs": [],
        "blob_count": 0,
        "worst": None,
        "images": {},
        "seconds": 0.0,
    }


def shown(path: Path) -> str:
    """A path that any file can hold."""
    return readable(str(path))


def readable(text: str) -> str:
    """Text that any file can hold: file names can be any bytes, and are part of messages."""
    return text.encode("utf-8", "replace").decode()


def usable_cores() -> int:
    """How many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _picture_names(entries: Sequence[Entry]) -> list[str]:
    return _unique([f"{slug(entry.student)}/{slug(entry.scene)}" for entry in entries])


def _unique(names: Sequence[str]) -> list[str]:
    """Each name once, with a number where it is taken; capitals make no difference, as some file systems see none."""
    taken: set[str] = set()
    chosen = []
    for name in names:
        free = next(each for each in _numbered(name) if each.lower() not in taken)
        taken.add(free.lower())
        chosen.append(free)
    return chosen


def _numbered(name: str) -> Iterator[str]:
    yield name
    yield from (f"{name}-{number}" for number in count(2))
