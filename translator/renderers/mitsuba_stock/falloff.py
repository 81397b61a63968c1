"""Falloff undone: the lamp's light falls off with the square of the distance r, and reflectances grow with it."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterable

from reference.scene import EYE, LIGHT, Plane, Sphere, Triple
from translator.renderers.mitsuba_stock.elements import constant, matrix, moved

REACH = 2.0**10  # how far along a plane r^2 is right, as a multiple of the light's distance from it
# Three cells in a row, of values 2, 0 and 2, as Mitsuba's format for volumes: a valley with straight slopes. A weight
# of 1 is half a cell from its middle. The bounds after the sizes are unused.
VALLEY = struct.pack("<3sB5i6f3f", b"VOL", 3, 1, 3, 1, 1, 1, 0, 0, 0, 2, 2, 2, 2, 0, 2).decode("ascii") + "\n"
VALLEY_SIZE = 6  # of the row, as a multiple of the distance at which the weight is 1


def undo_falloff(surface: Sphere | Plane, colour: list[float]) -> list[str]:
    """The lines of a BSDF of reflectance colour x r^2, where r is the distance of the lamp."""
    if not any(colour):
        return _matte(colour, 0)
    light = moved(LIGHT)
    if isinstance(surface, Sphere):
        centre = moved(surface.centre)
        arm = [a - b for a, b in zip(centre, light, strict=True)]
        distance = math.hypot(*arm)
        axis = [value / distance for value in arm]
        start = [a - surface.radius * b for a, b in zip(centre, axis, strict=True)]
        ends = [(distance - surface.radius) ** 2, (distance + surface.radius) ** 2]
        return _blend(_distance(start, axis, 2 * surface.radius), *(_matte(colour, end) for end in ends))
    gap = surface.distance_from(LIGHT)
    foot = [a + gap * b for a, b in zip(light, surface.unit_normal, strict=True)]
    brightest = max(abs(value * surface.diffuse / 255) for value in surface.colour)
    reach = REACH * max(1.0, brightest) * abs(gap)
    near, far = _matte(colour, gap**2), _matte(colour, gap**2 + 2 * reach**2)
    squares = []
    for tangent in surface.tangents:
        share = _distance(foot, tangent, reach)
        squares.append(_blend(share, near, _blend(share, near, far)))
    return _blend('<float name="weight" value="0.5"/>', *squares)


def _blend(weight: str, one: list[str], other: list[str]) -> list[str]:
    return ['<bsdf type="blendbsdf">', *(f"  {line}" for line in [weight, *one, *other]), "</bsdf>"]


def _matte(colour: list[float], square: float) -> list[str]:
    return [f'<bsdf type="diffuse">{constant("reflectance", [value * square for value in colour])}</bsdf>']


def _distance(point: Iterable[float], axis: Iterable[float], reach: float) -> str:
    """A weight: the distance from the plane through `point` across `axis`, as a share of `reach`."""
    size = reach * VALLEY_SIZE
    corner = [a - size / 2 * b for a, b in zip(point, axis, strict=True)]
    columns = [[size * value for value in vector] for vector in (axis, *_across(axis))]
    place = matrix(columns, corner)
    return (
        f'<texture type="volume" name="weight"><volume type="gridvolume" name="volume">{place}'
        '<string name="filename" value="distance.vol"/><boolean name="raw" value="true"/></volume></texture>'
    )


def _across(axis: Iterable[float]) -> tuple[Triple, Triple]:
    """Two unit vectors that with the unit vector `axis` are a basis."""
    x, y, z = axis
    return Plane((0, 0, 0), EYE, (x, y, z), 0, 0).tangents
