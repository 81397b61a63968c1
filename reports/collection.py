"""Whose picture is which scene's: the files of a class, by the places and names that they have."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from reference.errors import InputError

PICTURES = (".jpg", ".jpeg", ".png", ".exr", ".tif", ".tiff", ".bmp", ".gif", ".webp", ".ppm", ".tga", ".hdr")
SKIPPED = ("__MACOSX", "__pycache__", "node_modules")
LARGEST_CLASS = 100_000  # files in one folder
SEPARATORS = r"[-_. ]+"
BLANKS = {"student": r"(?P<student>[^/]+)", "scene": r"(?P<scene>[^/]+)"}


@dataclass(frozen=True)
class Entry:
    """One student's picture of one scene; `path` is None where there is none."""

    student: str
    scene: str
    path: Path | None


@dataclass(frozen=True)
class Collection:
    """All entries, by student and then in the order of the scenes, and the files left out, each with the reason."""

    entries: list[Entry]
    ignored: list[tuple[Path, str]]


def collect(scenes: Sequence[str], places: Sequence[Path], pattern: str | None = None) -> Collection:
    """Find the pictures of `scenes` (names such as `example1`) at `places`, files or folders.

    A file is the picture of the scene that its name tells, alone (`example1.jpg`) or beside the student's
    (`anna_example1.jpg`); with one scene it may have any name. In a folder, files belong to the student whom their
    folder is named after, or whom the rest of their name tells. A `pattern` such as `{student}/{scene}.jpg` says it
    outright. A folder that holds pictures named exactly like scenes, or nothing at all, is one student's.

    Raises InputError for a file named outright that belongs to no scene, and for a pattern that cannot be one.
    """
    found: dict[tuple[str, str], Path] = {}
    ignored: list[tuple[Path, str]] = []
    students: dict[str, None] = {}
    for place in places:
        whole = place.is_dir()
        for entry in _in_folder(scenes, place, pattern, ignored) if whole else [_file(scenes, place)]:
            student = entry.student if whole else _unlike(entry, found)
            students[student] = None
            if entry.path is None:
                continue
            if other := found.get((student, entry.scene)):
                ignored.append((entry.path, f"{other.name} is taken for {entry.scene}"))
            else:
                found[student, entry.scene] = entry.path
    entries = [Entry(student, scene, found.get((student, scene))) for student in students for scene in scenes]
    return Collection(entries, ignored)


def _unlike(entry: Entry, found: Mapping[tuple[str, str], Path]) -> str:
    """The student's name, or where files of the same name were given, one that is free."""
    names = [entry.student, *(f"{entry.student} ({number})" for number in range(2, len(found) + 3))]
    return next(name for name in names if (name, entry.scene) not in found)


def _file(scenes: Sequence[str], path: Path) -> Entry:
    """A picture named on the command line."""
    student, scene = _parts(scenes, path.stem)
    if len(scenes) == 1 and (student or not scene):
        return Entry(_shown(path.stem), scenes[0], path)
    if not scene:
        raise InputError(f"{path}:1:1: expected a name that tells the scene, one of {', '.join(scenes)}")
    return Entry(student or _shown(path.resolve().parent.name), scene, path)


def _in_folder(
    scenes: Sequence[str], folder: Path, pattern: str | None, ignored: list[tuple[Path, str]]
) -> Iterator[Entry]:
    files = sorted(_pictures(folder), key=lambda path: (len(path.parts), path))
    ignored += [(path, "it is a link") for path in files if path.is_symlink()]
    files = [path for path in files if not path.is_symlink()]
    if pattern is not None:
        yield from _by_pattern(scenes, folder, files, _expression(pattern), ignored)
        return
    inner_folders = [path for path in sorted(folder.iterdir()) if path.is_dir() and not _is_skipped(path)]
    tops = {_parts(scenes, path.stem) for path in files if path.parent == folder}
    whole = _shown(folder.resolve().name)  # of a folder that is one student's
    only = bool(tops & {("", scene) for scene in scenes}) or not (files or inner_folders)
    for path in files:
        student, scene = _owner(scenes, path.relative_to(folder))
        student = whole if only else student
        if not scene:
            ignored.append((path, f"its name tells none of {', '.join(scenes)}"))
        yield Entry(student, scene or scenes[0], path if scene else None)
    names = [whole] if only else [_shown(path.name) for path in inner_folders if _scene(scenes, path.name) is None]
    for student in names:
        yield Entry(student, scenes[0], None)  # who handed in nothing is in the class too


def _owner(scenes: Sequence[str], path: Path) -> tuple[str, str]:
    """The student and the scene that a path inside a class's folder tells; the scene is empty where it does not."""
    student, scene = _parts(scenes, path.stem)
    folders = [name for name in path.parts[:-1] if _scene(scenes, name) is None]
    if not scene:
        told = [found for name in path.parts[:-1] if (found := _scene(scenes, name))]
        scene = told[-1] if told else scenes[0] if len(scenes) == 1 else ""
    return _shown(folders[0] if folders else student or path.stem), scene


def _scene(scenes: Sequence[str], name: str) -> str | None:
    """The scene that has exactly that name."""
    return next((scene for scene in scenes if scene.lower() == name.lower()), None)


def _by_pattern(
    scenes: Sequence[str],
    folder: Path,
    files: Sequence[Path],
    expression: re.Pattern[str],
    ignored: list[tuple[Path, str]],
) -> Iterator[Entry]:
    for path in files:
        match = expression.fullmatch(_shown(path.relative_to(folder).as_posix()))
        names = match.groupdict() if match else {}
        scene = names.get("scene", scenes[0])
        if match and scene in scenes:
            yield Entry(names.get("student", _shown(folder.resolve().name)), scene, path)
        else:
            ignored.append((path, "it does not fit the pattern"))


def _expression(pattern: str) -> re.Pattern[str]:
    """Raises InputError for blanks other than {student} and {scene}."""
    words = re.split(r"\{(\w*)\}", pattern)
    if unknown := [word for word in words[1::2] if word not in BLANKS]:
        raise InputError(f"expected a pattern of {{student}} and {{scene}}, found {{{unknown[0]}}}")
    written = [
        BLANKS[word] if place % 2 else re.escape(word).replace(r"\*", "[^/]*") for place, word in enumerate(words)
    ]
    try:
        return re.compile("".join(written))
    except re.error as error:
        raise InputError(
            f"expected each of {{student}} and {{scene}} once in the pattern, found {pattern!r}"
        ) from error


def _pictures(folder: Path) -> Iterator[Path]:
    """All pictures below, links too but nothing behind them: that could be somebody else's."""
    for count, path in enumerate(sorted(folder.iterdir())):
        if count >= LARGEST_CLASS:
            raise InputError(f"{folder}:1:1: expected at most {LARGEST_CLASS} files in a folder, found more")
        if _is_skipped(path):
            continue
        if path.is_dir() and not path.is_symlink():
            yield from _pictures(path)
        elif path.suffix.lower() in PICTURES and (path.is_file() or path.is_symlink()):
            yield path


def _is_skipped(path: Path) -> bool:
    return path.name.startswith(".") or path.name in SKIPPED


def _parts(scenes: Sequence[str], stem: str) -> tuple[str, str]:
    """The student and the scene that a file's name tells, each empty where it does not; the longest scene wins."""
    for scene in sorted(scenes, key=len, reverse=True):
        name = re.escape(scene)
        for form in (name, rf"(?P<student>.+?){SEPARATORS}{name}", rf"{name}{SEPARATORS}(?P<student>.+)"):
            if match := re.fullmatch(form, stem, re.IGNORECASE | re.DOTALL):
                return _shown(match.groupdict().get("student") or ""), scene
    return "", ""


def _shown(name: str) -> str:
    """A name that any file can hold: file names can be any bytes."""
    return name.encode("utf-8", "replace").decode()
