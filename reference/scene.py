"""A scene of the assignment: spheres and planes, one ambient light, a fixed camera and a fixed point light."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import lru_cache
from math import dist, hypot, inf, isclose
from pathlib import Path
from typing import Any

Triple = tuple[float, float, float]

EYE: Triple = (0.0, 0.0, 0.0)
SCREEN = 50.0  # half the width and height of the screen, centred on the z axis: x right, y up
SCREEN_DISTANCE = 100.0  # from the eye along z, into the scene
SCREEN_CORNERS = [(x, y, SCREEN_DISTANCE) for x in (-SCREEN, SCREEN) for y in (-SCREEN, SCREEN)]
LIGHT: Triple = (500.0, 500.0, 500.0)  # white, without distance falloff
LARGEST_SIDE = 1 << 16  # pixels
LARGEST_DEPTH = 1 << 20  # bounces


@dataclass(frozen=True, slots=True)
class Sphere:
    """A sphere. Colour in levels (0..255), coefficients usually 0..1, `lines` are its first and last in the file."""

    colour: Triple
    centre: Triple
    radius: float
    diffuse: float
    reflection: float
    lines: tuple[int, int] = field(default=(0, 0), compare=False)


@dataclass(frozen=True, slots=True)
class Plane:
    """An infinite plane. The normal is kept as written, of any length; shading uses `unit_normal`."""

    colour: Triple
    point: Triple
    normal: Triple
    diffuse: float
    reflection: float
    lines: tuple[int, int] = field(default=(0, 0), compare=False)

    @property
    def unit_normal(self) -> Triple:
        """The normal at unit length, safe for components from 1e-308 to 1e308; never flipped toward the viewer."""
        largest = max(abs(value) for value in self.normal)
        x, y, z = (value / largest for value in self.normal)
        length = hypot(x, y, z)
        return (x / length, y / length, z / length)

    @property
    def tangents(self) -> tuple[Triple, Triple]:
        """Two unit vectors along the plane; with the normal they are a right-handed basis."""
        normal = self.unit_normal
        x, y, z = (float(index == min(range(3), key=lambda i: abs(normal[i]))) for index in range(3))
        across = _cross((x, y, z), normal)
        length = hypot(*across)
        across = (across[0] / length, across[1] / length, across[2] / length)
        return across, _cross(normal, across)

    def distance_from(self, origin: Triple) -> float:
        """(point - origin) . unit_normal, rounded only at the end: 0 exactly if `origin` lies in the plane.

        Infinite where it is too far for a number.
        """
        largest = max(abs(value) for value in self.normal)
        normal = [exact(value) / exact(largest) for value in self.normal]
        arm = [exact(a) - exact(b) for a, b in zip(self.point, origin, strict=True)]
        along = sum(a * b for a, b in zip(arm, normal, strict=True))
        try:
            return float(along) / hypot(*map(float, normal))
        except OverflowError:
            return inf if along > 0 else -inf


def _cross(a: Triple, b: Triple) -> Triple:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@dataclass(frozen=True, slots=True)
class Scene:
    """What a scene file says: ambient colour (levels), ambient coefficient, spheres and planes in file order."""

    ambient: Triple
    ambient_coefficient: float
    spheres: tuple[Sphere, ...] = ()
    planes: tuple[Plane, ...] = ()

    @staticmethod
    def load(path: str | Path) -> Scene:
        """Read a scene file. Raises SceneError; issues SceneWarning for unusual colours and coefficients."""
        from reference.text import load

        return load(path)

    def render(self, show: bool = False) -> None:
        """Draw the scene into `scene.jpg` in the working directory, as the document asks; `show` opens a window."""
        from reference.image import show_window, write_image
        from reference.tracer import render

        levels = render(self)
        write_image(Path("scene.jpg"), levels)
        if show:
            show_window(levels)


def merge_coincident(scene: Scene) -> Scene:
    """Drop every surface that occupies exactly the same points as an earlier one (first listed stays).

    Compared on the decimals as written, without rounding. Planes coincide whichever way their normals point.
    """
    return replace(
        scene, spheres=_those(scene.spheres, _first_spheres(scene)), planes=_those(scene.planes, _first_planes(scene))
    )


def distinct_spheres(scene: Scene) -> dict[str, Sphere]:
    """The spheres that `merge_coincident` keeps, by name: `sphere 2` is the file's second."""
    return {f"sphere {place + 1}": scene.spheres[place] for place in _first_spheres(scene)}


def distinct_planes(scene: Scene) -> dict[str, Plane]:
    """The planes that `merge_coincident` keeps, by name: `plane 2` is the file's second."""
    return {f"plane {place + 1}": scene.planes[place] for place in _first_planes(scene)}


def _those(surfaces: tuple[Any, ...], places: Collection[int]) -> tuple[Any, ...]:
    return surfaces if len(places) == len(surfaces) else tuple(surfaces[place] for place in places)


def _first_spheres(scene: Scene) -> Collection[int]:
    if len({sphere.centre for sphere in scene.spheres}) == len(scene.spheres):  # soon seen of a million
        return range(len(scene.spheres))
    return _first_of_each((sphere.centre, sphere.radius) for sphere in scene.spheres)


def _first_planes(scene: Scene) -> Collection[int]:
    return _first_of_each(map(_plane_identity, scene.planes))


def _first_of_each(identities: Iterable[tuple[object, ...]]) -> Collection[int]:
    """The first place of each identity."""
    first: dict[tuple[object, ...], int] = {}
    for place, identity in enumerate(identities):
        first.setdefault(identity, place)
    return first.values()


def holds_light(sphere: Sphere) -> bool:
    """Whether the light lies exactly on the sphere."""
    if not isclose(dist(sphere.centre, LIGHT), sphere.radius, rel_tol=1e-9):
        return False
    arm = [exact(a) - exact(b) for a, b in zip(sphere.centre, LIGHT, strict=True)]
    return sum(value * value for value in arm) == exact(sphere.radius) ** 2


def _plane_identity(plane: Plane) -> tuple[Fraction, ...]:
    normal = [exact(value) for value in plane.normal]
    leading = next(value for value in normal if value)
    direction = [value / leading for value in normal]
    offset = sum((a * exact(b) for a, b in zip(direction, plane.point, strict=True)), Fraction(0))
    return (*direction, offset)


@lru_cache(maxsize=1024)
def exact(value: float) -> Fraction:
    """The decimal that was written for `value` (its shortest spelling), without rounding."""
    return Fraction(repr(value))
