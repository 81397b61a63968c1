"""A run on disk: `run.json` and the pictures. Renderings write it, reports read it, and neither knows the other."""

from __future__ import annotations

import json
import os
import platform
import re
from collections.abc import Mapping
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference.errors import InputError
from reference.files import make_folder, write_text
from reference.image import write_image

RUN, IMAGES = "run.json", "images"
PACKAGES = ("drjit", "mitsuba", "numpy", "scikit-image", "OpenImageIO", "flip-evaluator")


class Recording:
    """Writes a run as it happens: after every picture the folder holds all that is finished.

    The first picture of a scene is the one that the others are compared with.
    """

    def __init__(self, folder: Path, version: str) -> None:
        self.folder = make_folder(folder)
        self.data: dict[str, Any] = {
            "version": 1,
            "crossray": version,
            "started": datetime.now(UTC).isoformat(timespec="seconds"),
            "environment": environment(),
            "scenes": [],
        }
        self._save()

    def add_scene(self, path: str, width: int, height: int, **facts: Any) -> dict[str, Any]:
        """Begin a scene; returns its entry, whose `scene` is a name that no other scene of the run has."""
        path = path.encode("utf-8", "replace").decode()  # a file name can be any bytes
        name = self._unique(Path(path).stem if path != "-" else "stdin")
        entry = {"scene": name, "path": path, "width": width, "height": height, **facts, "pictures": []}
        self.data["scenes"].append(entry)
        return entry

    def add_picture(
        self, entry: dict[str, Any], facts: Mapping[str, Any], levels: NDArray[np.floating[Any]] | None
    ) -> None:
        """Record what became of one renderer on one scene, and its picture as linear EXR and 8 bit PNG."""
        image = None
        if levels is not None:
            name = f"{IMAGES}/{slug(entry['scene'])}/{slug(facts['renderer'])}"
            make_folder((self.folder / name).parent)
            for ending in (".exr", ".png"):
                write_image(self.folder / (name + ending), levels)
            image = name
        entry["pictures"].append({**facts, "image": image})
        self._save()

    def add_terms(self, entry: dict[str, Any], found: Mapping[str, tuple[str, NDArray[np.floating[Any]]]]) -> None:
        """Record the reference's terms: by name a title and a picture, an 8 bit PNG and a linear EXR."""
        entry["terms"] = []
        for name, (title, levels) in found.items():
            image = f"{IMAGES}/{slug(entry['scene'])}/term-{slug(name)}"
            for ending in (".exr", ".png"):
                write_image(self.folder / (image + ending), levels)
            entry["terms"].append({"name": name, "title": title, "image": image, "comparisons": []})
        self._save()

    def add_term_comparison(self, entry: dict[str, Any], name: str, facts: Mapping[str, Any]) -> None:
        """Record how a renderer's term compares with the reference's."""
        for term in entry["terms"]:
            if term["name"] == name:
                term["comparisons"].append(dict(facts))
        self._save()

    def picture_file(self, name: str, path: Path) -> dict[str, Any]:
        """The facts of a picture that nobody rendered here."""
        return unrendered(name, path.name)

    def _unique(self, name: str) -> str:
        taken = {slug(entry["scene"]) for entry in self.data["scenes"]}
        names = [name, *(f"{name[:60]}-{number}" for number in range(2, len(taken) + 3))]
        return next(candidate for candidate in names if slug(candidate) not in taken)

    def _save(self) -> None:
        write_run(self.folder, self.data)


def unrendered(renderer: str, title: str) -> dict[str, Any]:
    """The facts of a picture that nobody rendered here."""
    return {
        "renderer": renderer,
        "title": title,
        "status": "rendered",
        "version": None,
        "reason": None,
        "seconds": None,
        "trace_seconds": None,
        "command": "",
        "log": "",
        "notes": [],
        "limits": {},
        "summary": None,
        "threads": None,
    }


def write_run(folder: Path, run: dict[str, Any]) -> None:
    """Replace the record in a run's folder. Raises OutputError."""
    write_text(folder / RUN, json.dumps(run, indent=1, allow_nan=False) + "\n")


def read_run(folder: Path) -> dict[str, Any]:
    """The record in a run's folder. Raises InputError where there is none."""
    try:
        run: dict[str, Any] = json.loads((folder / RUN).read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"{folder / RUN}:1:1: expected the record of a run, found {error}") from error
    if not isinstance(run, dict) or not isinstance(run.get("scenes"), list):
        raise InputError(f"{folder / RUN}:1:1: expected the record of a run, found something else")
    return run


def find_picture(folder: Path, run: dict[str, Any], text: str, renderer: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """The entries of the scene with that text and of a renderer's picture of it. Raises InputError where missing."""
    place = f"{folder / RUN}:1:1"
    entry = next((entry for entry in run["scenes"] if entry["text"] == text), None)
    if entry is None:
        raise InputError(f"{place}: expected the scene as it is now, found it changed or not checked; check it again")
    picture = next((picture for picture in entry["pictures"] if picture["renderer"] == renderer), None)
    if picture is None or picture["image"] is None:
        raise InputError(f"{place}: expected a picture by {renderer}, found none")
    return entry, picture


def slug(name: str) -> str:
    """A file name that is safe anywhere, at most 80 characters."""
    return re.sub(r"[^A-Za-z0-9._-]+", "_", name).strip("._")[:80] or "scene"


def environment() -> dict[str, Any]:
    """What the run's numbers depend on: machine and versions."""
    versions: dict[str, str | None] = {}
    for package in PACKAGES:
        try:
            versions[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            versions[package] = None
    return {
        "python": platform.python_version(),
        "system": f"{platform.system()} {platform.machine()}",
        "processor": _processor(),
        "cores": len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count(),
        "packages": versions,
    }


def _processor() -> str:
    try:
        match = re.search(r"model name\s*:\s*(.+)", Path("/proc/cpuinfo").read_text(encoding="utf-8"))
    except OSError:
        match = None
    return match[1] if match else platform.processor()
