"""The colours that one pixel may have by the `exact` convention, proven in ball arithmetic of rising precision (Arb).

Every number is a ball that holds the true one; inputs are the decimals as written. Where the balls cannot decide which
way a ray goes, not even at the highest precision, the pixel is a knife edge and every way is followed.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import NamedTuple

from flint import arb, fmpq

from reference.enclosure import Point, Tables, precision
from reference.rules import EXACT_RULES, Rules
from reference.scene import SCREEN, SCREEN_DISTANCE, Scene, Triple, merge_coincident
from reference.walk import Ray, UnboundedError, UndecidedError, Walk

PRECISIONS = (128, 512, 2048)  # bits; both sides of an undecided branch are followed only at the last one
PROVEN = 1e-6  # levels (for a channel over 255, of 255ths of it): the largest radius of a proven colour
LARGEST_SET = 100  # ways that are followed; the colours of more than that would say nothing


class Colour(NamedTuple):
    """A ball of colours: levels, not clamped, and the radius of each channel."""

    value: Triple
    radius: Triple


@dataclass(frozen=True)
class Admissible:
    """All colours that a pixel may have, first the one that the model's rule for ties gives.

    `complete` is False where there are more than could be followed; `exhausted` is True where that is for want of
    precision or because there were too many ways. `bits` is the precision that it took.
    """

    colours: tuple[Colour, ...]
    complete: bool
    bits: int
    exhausted: bool = False
    rays: tuple[Ray, ...] = field(default=(), compare=False, repr=False)  # of the first colour

    @property
    def proven(self) -> bool:
        """Whether there is exactly one colour."""
        return self.complete and len(self.colours) == 1


class Prover:
    """Proves pixels of one picture: row 0 on top, `depth` bounces at most after the primary hit."""

    def __init__(self, scene: Scene, *, width: int = 1000, height: int = 1000, depth: int = 3) -> None:
        self.scene = merge_coincident(scene)
        self.width, self.height, self.depth = width, height, depth
        self.surfaces = len(self.scene.spheres) + len(self.scene.planes)
        self._tables: dict[int, Tables] = {}

    def admissible(self, column: int, row: int, rules: Rules = EXACT_RULES) -> Admissible:
        """The colours of a pixel under `rules`; with leeway, each is a ball as wide as the leeway makes it."""
        if rules.has_leeway:
            return self._follow(column, row, rules, PRECISIONS[0], last=True)
        for bits in PRECISIONS[:-1]:
            try:
                return self._follow(column, row, rules, bits, last=False)
            except UndecidedError:
                continue
        return self._follow(column, row, rules, PRECISIONS[-1], last=True)

    def _follow(self, column: int, row: int, rules: Rules, bits: int, last: bool) -> Admissible:
        """Every path through the choices, depth first; raises UndecidedError unless this is the last precision."""
        found: list[Colour] = []
        rays: list[Ray] = []
        complete, exhausted = True, False
        path: list[int] | None = []
        with self.tables(bits) as tables:
            for _ in range(LARGEST_SET):
                walk = Walk(tables, rules, path or [], may_choose=last)
                try:
                    colour = _rounded(walk.colour(self.direction(column, row), self.depth))
                except UnboundedError:
                    complete = False
                else:
                    sharp = rules.has_leeway or _is_sharp(colour)
                    if not (sharp or last):
                        raise UndecidedError
                    finite = all(map(math.isfinite, colour.value))
                    exhausted |= not (sharp and finite)
                    if finite and not any(_covers(other, colour) for other in found):
                        found.append(colour)
                rays = rays or walk.rays
                path = walk.next_path()
                if path is None:
                    break
        exhausted |= path is not None
        return Admissible(tuple(found), complete and not exhausted, bits, exhausted, tuple(rays))

    @contextmanager
    def tables(self, bits: int) -> Iterator[Tables]:
        """The scene at so many bits, which are in force meanwhile."""
        with precision(bits):
            self._tables[bits] = self._tables.get(bits) or Tables(self.scene)
            yield self._tables[bits]

    def direction(self, column: int, row: int) -> Point:
        """From the eye to the middle of a pixel."""
        x = fmpq((2 * column + 1 - self.width) * int(SCREEN), self.width)
        y = fmpq((self.height - 1 - 2 * row) * int(SCREEN), self.height)
        return (arb(x), arb(y), arb(SCREEN_DISTANCE))


def _rounded(colour: Point) -> Colour:
    """In double precision, the rounding added to the radius."""
    value = (float(colour[0].mid()), float(colour[1].mid()), float(colour[2].mid()))
    red, green, blue = (float(ball.rad()) + math.ulp(centre) for ball, centre in zip(colour, value, strict=True))
    return Colour(value, (red, green, blue))


def _is_sharp(colour: Colour) -> bool:
    """Whether each channel is proven; infinity and NaN are not."""
    return all(
        math.isfinite(v) and r <= PROVEN * max(1.0, abs(v) / 255)
        for v, r in zip(colour.value, colour.radius, strict=True)
    )


def _covers(one: Colour, other: Colour) -> bool:
    """Whether `one` holds all of `other`, but for what a proof leaves open."""
    return all(
        abs(a - b) + other_radius <= radius + PROVEN * max(1.0, abs(a) / 255)
        for a, b, radius, other_radius in zip(one.value, other.value, one.radius, other.radius, strict=True)
    )
