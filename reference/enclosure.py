"""A scene in balls (Arb): every number holds the decimal as written, at the precision in force."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from fractions import Fraction
from itertools import chain
from typing import NamedTuple

import numpy as np
from flint import arb, ctx, fmpq
from numpy.typing import NDArray

from reference.scene import EYE, LIGHT, SCREEN_DISTANCE, Plane, Scene, Sphere, exact

Point = tuple[arb, arb, arb]

FEW = 24  # spheres that are cheaper met one by one
ROUNDING = 1e-14  # more than what a handful of operations in double precision lose, relatively


@contextmanager
def precision(bits: int) -> Iterator[None]:
    """Compute with so many bits."""
    before, ctx.prec = ctx.prec, bits
    try:
        yield
    finally:
        ctx.prec = before


class HeldSphere(NamedTuple):
    """A sphere in balls."""

    colour: Point
    diffuse: arb
    reflection: arb
    centre: Point
    radius: arb
    at_eye: arb  # |eye - centre|^2 - r^2
    at_light: arb  # |light - centre|^2 - r^2, exactly 0 if the light is on the sphere


class HeldPlane(NamedTuple):
    """A plane in balls."""

    colour: Point
    diffuse: arb
    reflection: arb
    normal: Point  # as written, of any length
    length: arb
    offset: arb  # point.normal, exactly 0 if the eye is in the plane
    from_light: arb  # (point - light).normal, exactly 0 if the light is in the plane
    is_screen: bool


class Tables:
    """A scene as balls of the precision in force."""

    def __init__(self, scene: Scene) -> None:
        self.ambient = point(exact(value) * exact(scene.ambient_coefficient) / 256 for value in scene.ambient)
        self.light, self.eye = point(map(exact, LIGHT)), point(map(exact, EYE))
        self.surfaces: list[HeldSphere | HeldPlane] = [*map(_sphere, scene.spheres), *map(_plane, scene.planes)]
        self.centres = np.array([sphere.centre for sphere in scene.spheres], dtype=float).reshape(-1, 3)
        self.radii = np.array([sphere.radius for sphere in scene.spheres], dtype=float)
        self.planes = range(len(scene.spheres), len(self.surfaces))

    def along(self, origin: Point, d: Point) -> Iterator[tuple[int, HeldSphere | HeldPlane]]:
        """The surfaces that a line may meet, with their places: all but spheres that it surely misses."""
        places: Iterable[int] = range(len(self.surfaces))
        if len(self.radii) > FEW:
            with np.errstate(all="ignore"):  # what overflows is not surely missed
                places = chain(np.flatnonzero(~self._misses(origin, d)).tolist(), self.planes)
        return ((place, self.surfaces[place]) for place in places)

    def _misses(self, origin: Point, d: Point) -> NDArray[np.bool_]:
        """For each sphere, whether half^2 < dd (p.p - r^2) beyond all doubt: in double precision, with its error."""
        (start, start_error), (direction, direction_error) = map(_rounded_point, (origin, d))
        p = start - self.centres
        reach, length = np.sqrt((p * p).sum(axis=1)), float(np.sqrt(direction @ direction))
        half, dd = p @ direction, length * length
        p_error = start_error + ROUNDING * np.abs(self.centres).max(axis=1)
        half_error = p_error * length + direction_error * (reach + p_error) + ROUNDING * reach * length
        outside = reach * reach - self.radii**2
        error = half_error * (2 * np.abs(half) + half_error) + dd * p_error * (2 * reach + p_error)
        error += direction_error * (2 * length + direction_error) * np.abs(outside)
        error += ROUNDING * (half * half + dd * (reach * reach + self.radii**2))
        return np.asarray(half * half - dd * outside < -2 * error)


def mirrored(d: Point, arm: Point, surface: HeldSphere | HeldPlane) -> Point:
    """The mirrored direction d - 2 (d.n) n, as long as d: no term depends on the length."""
    length = surface.radius if isinstance(surface, HeldSphere) else surface.length
    return along(d, -2 * dot(d, arm) / length**2, arm)


def _sphere(sphere: Sphere) -> HeldSphere:
    centre, radius = [exact(value) for value in sphere.centre], exact(sphere.radius)
    at_eye, at_light = (
        ball(sum((a - exact(b)) ** 2 for a, b in zip(centre, point, strict=True)) - radius**2) for point in (EYE, LIGHT)
    )
    return HeldSphere(*_material(sphere), point(centre), ball(radius), at_eye, at_light)


def _plane(plane: Plane) -> HeldPlane:
    normal, place = [exact(value) for value in plane.normal], [exact(value) for value in plane.point]
    offset, from_light = (
        ball(sum(n * (a - exact(b)) for n, a, b in zip(normal, place, origin, strict=True))) for origin in (EYE, LIGHT)
    )
    is_screen = not any(normal[:2]) and place[2] == exact(SCREEN_DISTANCE)
    length = ball(sum(n * n for n in normal)).sqrt()
    return HeldPlane(*_material(plane), point(normal), length, offset, from_light, is_screen)


def _material(surface: Sphere | Plane) -> tuple[Point, arb, arb]:
    return point(map(exact, surface.colour)), ball(exact(surface.diffuse)), ball(exact(surface.reflection))


def ball(value: Fraction | float) -> arb:
    """A number, or the decimal that was written for one in double precision."""
    fraction = value if isinstance(value, Fraction) else exact(value)
    return arb(fmpq(fraction.numerator, fraction.denominator))


def point(values: Iterable[Fraction]) -> Point:
    """Three numbers."""
    x, y, z = map(ball, values)
    return (x, y, z)


def _rounded_point(point: Point) -> tuple[NDArray[np.float64], float]:
    """In double precision, and the most that it is off."""
    value = np.array([float(ball.mid()) for ball in point])
    error = sum(float(ball.rad()) for ball in point)
    return value, float(error + ROUNDING * np.abs(value).max())


def dot(a: Point, b: Point) -> arb:
    """The scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def minus(a: Point, b: Point) -> Point:
    """The way from b to a."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def along(origin: Point, t: arb, d: Point) -> Point:
    """The point origin + t d."""
    return (origin[0] + t * d[0], origin[1] + t * d[1], origin[2] + t * d[2])
