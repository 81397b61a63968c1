"""Scene files: text to Scene and back. Everything wrong is refused with its place, counted from 1."""

from __future__ import annotations

import codecs
import math
import re
import sys
import warnings
from pathlib import Path
from typing import NoReturn

from reference.errors import SceneError, SceneWarning
from reference.plain import parse_plain
from reference.scene import Plane, Scene, Sphere, Triple

NUMBER = r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
GROUPS = {1: re.compile(rf"\s*({NUMBER})\s*"), 3: re.compile(rf"\s*({NUMBER})\s+({NUMBER})\s+({NUMBER})\s*")}
LINE_END = re.compile(r"\r\n|\n|\r")
LARGEST_FILE = 1 << 30  # bytes
SURFACE_LINES = 5  # a sphere or a plane takes five


def load(path: str | Path) -> Scene:
    """Read the scene file at `path` (`-` is standard input). Raises SceneError, issues SceneWarning."""
    name = str(path)
    try:
        if name == "-":
            name = "<stdin>"
            if sys.stdin is None:
                raise SceneError(name, 1, 1, "a readable scene file", "standard input closed")
            data = sys.stdin.buffer.read(LARGEST_FILE + 1)
        else:
            if Path(path).is_dir():
                raise SceneError(name, 1, 1, "a scene file", "a directory")
            with open(path, "rb") as file:
                data = file.read(LARGEST_FILE + 1)
    except (OSError, ValueError) as error:
        reason = error.strerror.lower() if isinstance(error, OSError) and error.strerror else str(error)
        raise SceneError(name, 1, 1, "a readable scene file", reason) from error
    if len(data) > LARGEST_FILE:
        raise SceneError(name, 1, 1, "a scene of at most 1 GiB", "more")
    return parse(data, name)


def parse(text: str | bytes, path: str = "<text>") -> Scene:
    """Read a scene from text or from the bytes of a file (UTF-8, with or without a byte order mark)."""
    text = _decode(text, path) if isinstance(text, bytes) else text.removeprefix("\ufeff")
    return parse_plain(text) or parse_carefully(text, path)


def parse_carefully(text: str, path: str) -> Scene:
    """Read a scene line by line, so that every refusal and warning has its place."""
    reader = _Reader(text, path)
    ambient = reader.colour("the ambient colour")
    coefficient = reader.coefficient("the ambient coefficient")
    spheres = tuple(reader.sphere(f"sphere {i + 1}") for i in range(reader.count("spheres")))
    planes = tuple(reader.plane(f"plane {i + 1}") for i in range(reader.count("planes")))
    reader.end("plane" if planes else "plane count")
    return Scene(ambient, coefficient, spheres, planes)


def dump(scene: Scene) -> str:
    """The scene as text; reading it back gives an equal scene."""
    rows: list[tuple[float, ...]] = [scene.ambient, (scene.ambient_coefficient,), (len(scene.spheres),)]
    for sphere in scene.spheres:
        rows += [sphere.colour, sphere.centre, (sphere.radius,), (sphere.diffuse,), (sphere.reflection,)]
    rows.append((len(scene.planes),))
    for plane in scene.planes:
        rows += [plane.colour, plane.point, plane.normal, (plane.diffuse,), (plane.reflection,)]
    return "".join(" ".join(map(_spell, row)) + "\n" for row in rows)


def _spell(value: float) -> str:
    spelling = repr(value)
    return spelling[:-2] if spelling.endswith(".0") and spelling != "-0.0" else spelling


def _decode(data: bytes, path: str) -> str:
    data = data.removeprefix(codecs.BOM_UTF8)
    try:
        return data.decode()
    except UnicodeDecodeError as error:
        before = data[: error.start].decode()
        lines = LINE_END.split(before)
        found = f"the byte 0x{data[error.start]:02x}"
        raise SceneError(path, len(lines), len(lines[-1]) + 1, "text in UTF-8", found) from error


class _Reader:
    """Walks the non-blank lines of a scene file; every method reads one value group, one a line."""

    def __init__(self, text: str, path: str) -> None:
        self.path = path
        self.lines = [(number, line) for number, line in enumerate(LINE_END.split(text), 1) if line.strip()]
        self.last = len(LINE_END.split(text)) if not self.lines else self.lines[-1][0]
        self.position = 0

    def numbers(self, count: int, what: str) -> tuple[float, ...]:
        if self.position == len(self.lines):
            column = len(self.lines[-1][1]) + 1 if self.lines else 1
            raise SceneError(self.path, self.last, column, f"{what} ({_plural(count)})", "the end of the file")
        line = self.lines[self.position][1]
        match = GROUPS[count].fullmatch(line)
        values = tuple(map(float, match.groups())) if match else ()
        if not match or not all(map(math.isfinite, values)):
            self._explain(line, count, what)
        self.position += 1
        return values

    def _explain(self, line: str, count: int, what: str) -> NoReturn:
        """Raise for the first thing wrong in a line that is not `count` finite numbers."""
        group = f"{what} ({_plural(count)})"
        for index, token in enumerate(re.finditer(r"\S+", line)):
            if index == count:
                self.refuse(f"nothing after {group}", _quote(token[0]), token.start(), done=0)
            if not re.fullmatch(NUMBER, token[0]) or not math.isfinite(float(token[0])):
                wanted = (
                    "a finite number" if re.fullmatch(rf"{NUMBER}|(?i:[+-]?(nan|inf\w*))", token[0]) else "a number"
                )
                self.refuse(f"{wanted} in {group}", _quote(token[0]), token.start(), done=0)
        self.refuse(group, f"only {_plural(len(line.split()))}", len(line.rstrip()), done=0)

    def refuse(self, expected: str, found: str, offset: int | None = None, done: int = 1) -> NoReturn:
        """Raise for the line read last (done=1) or the one being read (done=0)."""
        number, column = self._place(offset, done)
        raise SceneError(self.path, number, column, expected, found)

    def _place(self, offset: int | None, done: int) -> tuple[int, int]:
        number, line = self.lines[self.position - done]
        return number, (len(line) - len(line.lstrip()) if offset is None else offset) + 1

    def _warn_outside(self, low: float, high: float, what: str, values: tuple[float, ...]) -> None:
        for index, value in enumerate(values):
            if not low <= value <= high:
                offset = [token.start() for token in re.finditer(r"\S+", self.lines[self.position - 1][1])][index]
                number, column = self._place(offset, 1)
                message = f"{self.path}:{number}:{column}: {what}: {_spell(value)} is outside {low:g}..{high:g}"
                warnings.warn(message, SceneWarning, stacklevel=2)

    def scalar(self, what: str) -> float:
        return self.numbers(1, what)[0]

    def triple(self, what: str) -> Triple:
        x, y, z = self.numbers(3, what)
        return (x, y, z)

    def colour(self, what: str) -> Triple:
        colour = self.triple(what)
        self._warn_outside(0, 255, what, colour)
        return colour

    def coefficient(self, what: str) -> float:
        coefficient = self.scalar(what)
        self._warn_outside(0, 1, what, (coefficient,))
        return coefficient

    def count(self, what: str) -> int:
        count = self.scalar(f"the number of {what}")
        left = len(self.lines) - self.position
        if count < 0 or count != int(count):
            self.refuse(f"a whole number of {what}, 0 or more", _spell(count))
        room = (left + SURFACE_LINES - 1) // SURFACE_LINES  # a surface cut short is refused where the file ends
        if count > room:
            self.refuse(f"{what}: at most {room}, as many as the rest of the file can hold", _spell(count))
        return int(count)

    def sphere(self, name: str) -> Sphere:
        colour = self.colour(f"{name}: colour")
        first = self.lines[self.position - 1][0]
        centre = self.triple(f"{name}: position")
        radius = self.scalar(f"{name}: radius")
        if radius <= 0:
            self.refuse(f"{name}: a radius above 0", _spell(radius))
        return Sphere(colour, centre, radius, *self._coefficients(name), (first, self.lines[self.position - 1][0]))

    def plane(self, name: str) -> Plane:
        colour = self.colour(f"{name}: colour")
        first = self.lines[self.position - 1][0]
        point = self.triple(f"{name}: point")
        normal = self.triple(f"{name}: normal")
        if not any(normal):
            self.refuse(f"{name}: a normal that is not zero", "0 0 0")
        return Plane(colour, point, normal, *self._coefficients(name), (first, self.lines[self.position - 1][0]))

    def _coefficients(self, name: str) -> tuple[float, float]:
        return (
            self.coefficient(f"{name}: diffuse coefficient"),
            self.coefficient(f"{name}: reflection coefficient"),
        )

    def end(self, last: str) -> None:
        if self.position < len(self.lines):
            token = self.lines[self.position][1].split()[0]
            self.refuse(f"the end of the file after the last {last}", _quote(token), done=0)


def _plural(count: int, noun: str = "number") -> str:
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def _quote(token: str) -> str:
    return ascii(token if len(token) <= 40 else token[:37] + "...")
