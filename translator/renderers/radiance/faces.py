"""The objects of Radiance: the sides of the surfaces that rays can meet.

Rays start on the screen and pass no surface, so that they meet no other sides than those that face a point of the
screen. Objects that have one side only keep a ray from meeting again, by rounding, the surface that it leaves.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

from reference.scene import EYE, SCREEN, SCREEN_CORNERS, SCREEN_DISTANCE, Plane, Sphere, Triple
from translator.contract import number
from translator.renderers.radiance.limits import HUGE, TINY

PLANE_RADIUS = HUGE  # of the disk that a plane is, in Radiance's units
THICKNESS = TINY  # of a plane that is seen from both sides, in Radiance's units
LARGE = 1e5  # radius from which on rounding can put the start of a ray inside a sphere that it leaves

SHAPE = """
{material} {kind} {name}
0
0
{numbers}
"""


class Face(NamedTuple):
    """An object of Radiance: one side of a surface, or both."""

    name: str  # of the surface
    surface: Sphere | Plane
    is_given: bool  # its front is the side of the given normal, on a sphere the outside
    is_double: bool = False  # its back is the other side, else nothing
    shift: float = 0.0  # of a plane, along the given normal, in Radiance's units

    @property
    def material(self) -> str:
        """Such as `front-of-plane-1`."""
        names = ("front", "back") if isinstance(self.surface, Plane) else ("outside", "inside")
        return f"{'surface' if self.is_double else names[not self.is_given]}-of-{_word(self.name)}"


def faces_of(name: str, surface: Sphere | Plane) -> Iterator[Face]:
    """The sides of a surface that face a point of the screen."""
    if isinstance(surface, Sphere):
        yield from _sides_of_sphere(name, surface)
    else:
        yield from _sides_of_plane(name, surface)


def _sides_of_sphere(name: str, sphere: Sphere) -> Iterator[Face]:
    x, y, _ = (min(SCREEN, max(-SCREEN, value)) for value in sphere.centre)
    is_inside = math.dist((x, y, SCREEN_DISTANCE), sphere.centre) < sphere.radius
    is_outside = max(math.dist(corner, sphere.centre) for corner in SCREEN_CORNERS) > sphere.radius
    if is_outside and sphere.radius <= LARGE:
        yield Face(name, sphere, True, is_double=True)
        return
    if is_outside:
        yield Face(name, sphere, True)
    if is_inside:
        yield Face(name, sphere, False)


def _sides_of_plane(name: str, plane: Plane) -> Iterator[Face]:
    distances = [plane.distance_from(corner) for corner in SCREEN_CORNERS]
    if not any(distances):  # the screen itself, which rays leave along z
        yield Face(name, plane, is_given=plane.normal[2] > 0)
        return
    in_front, behind = min(distances) < 0, max(distances) > 0
    shift = THICKNESS / 2 if in_front and behind else 0.0
    if in_front:
        yield Face(name, plane, True, shift=shift)
    if behind:
        yield Face(name, plane, False, shift=-shift)


def shape(face: Face, unit: float) -> str:
    """The object in Radiance's language; `unit` is what a length of 1 becomes."""
    surface = face.surface
    if isinstance(surface, Sphere):
        kind = "sphere" if face.is_given else "bubble"
        numbers = f"4 {spaced(surface.centre, unit)}  {number(surface.radius * unit)}"
    else:
        kind = "ring"
        normal = surface.unit_normal
        foot = spaced(normal, surface.distance_from(EYE) * unit + face.shift)
        numbers = f"8 {foot}  {spaced(normal, 1 if face.is_given else -1)}  0 {PLANE_RADIUS:g}"
    return SHAPE.format(material=face.material, kind=kind, name=_word(face.name), numbers=numbers)


def spaced(point: Triple, factor: float = 1.0) -> str:
    """A point or a direction, z negated; never -0.0."""
    x, y, z = point
    return " ".join(number(value * factor + 0.0) for value in (x, y, -z))


def _word(name: str) -> str:
    return name.replace(" ", "-")
