"""Scene files in which nothing is wrong or unusual, read several times faster than line by line.

What reads them keeps no account of places: it either gives the scene or gives up, and `reference.text` then reads the
file again and says what is the matter, and where.
"""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager
from math import inf

from reference.scene import Plane, Scene, Sphere, Triple

NUMBER = b"0123456789+-.eE"  # of these characters alone, `float` accepts what the format calls a number
# What is left of each line without them, where no blank is more than it must be.
HEAD, SPHERE, PLANE = b"  \n\n\n", b"  \n  \n\n\n\n", b"  \n  \n  \n\n\n"
LINES = 5  # of a sphere or a plane
BEGINNING = 1000  # characters of a file, within which the number of spheres is looked for


@contextmanager
def _collecting_nothing() -> Iterator[None]:
    """Garbage collection would go through the growing scene again and again."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


@_collecting_nothing()
def parse_plain(text: str) -> Scene | None:
    """The scene, or None for a text that may have to be refused or warned about, or is not written plainly."""
    try:
        blanks = text.replace("\r\n", "\n").encode("ascii").translate(None, NUMBER)
        spheres = int(text[:BEGINNING].split("\n")[2])
        planes = (len(blanks) - len(HEAD) - len(SPHERE) * spheres) // len(PLANE)  # the last line may have no end
        if min(spheres, planes) < 0:
            return None
        plain = HEAD + SPHERE * spheres + b"\n" + PLANE * planes
        if blanks not in (plain, plain[:-1]):
            return None
        numbers = list(map(float, text.split()))
    except (ValueError, IndexError):
        return None
    # A line has at most one word more than blanks; as there are so many in all, each has exactly that.
    if len(numbers) != 6 + 9 * spheres + 11 * planes or numbers[5 + 9 * spheres] != planes:
        return None
    balls = _columns(numbers, 5, 9, spheres)
    flats = _columns(numbers, 6 + 9 * spheres, 11, planes)
    normals = list(_triples(flats[6:9]))
    levels = [numbers[:3], *balls[:3], *flats[:3]]
    shares = [numbers[3:4], *balls[7:], *flats[9:]]
    if not (_within(levels, 0, 255) and _within(shares, 0, 1)) or min(balls[6], default=1) <= 0:
        return None
    if not (-inf < min(numbers) and max(numbers) < inf and all(map(any, normals))):
        return None
    before = 5 + LINES * spheres
    return Scene(
        (numbers[0], numbers[1], numbers[2]),
        numbers[3],
        tuple(map(Sphere, _triples(balls[:3]), _triples(balls[3:6]), *balls[6:], _lines(4, spheres))),
        tuple(map(Plane, _triples(flats[:3]), _triples(flats[3:6]), normals, *flats[9:], _lines(before, planes))),
    )


def _columns(numbers: list[float], start: int, width: int, count: int) -> list[list[float]]:
    """The numbers of so many surfaces, each kind of number by itself."""
    end = start + width * count
    return [numbers[start + column : end : width] for column in range(width)]


def _triples(columns: list[list[float]]) -> zip[Triple]:
    return zip(*columns, strict=True)


def _within(columns: list[list[float]], low: float, high: float) -> bool:
    return all(low <= min(column) and max(column) <= high for column in columns if column)


def _lines(first: int, count: int) -> zip[tuple[int, int]]:
    """The first and the last line of so many surfaces."""
    end = first + LINES * count
    return zip(range(first, end, LINES), range(first + LINES - 1, end, LINES), strict=True)
