"""What Radiance cannot do better, and the scenes that it cannot carry for that."""

from __future__ import annotations

import math

from reference.scene import EYE, LIGHT, SCREEN_DISTANCE, Plane, Sphere, holds_light
from translator.contract import Limits, Unsupported

TINY, HUGE = 1e-6, 1e10  # FTINY and FHUGE: distances that count as zero and as infinite; TINY also bounds |d.n|
HORIZON = 1e-5  # |d.n| from which on rays meet planes before infinity
FARTHEST = 1e8  # of surfaces
DEEPEST = 1000  # bounces: several thousand overflow rtrace's stack
LAMP, SMALLEST_LAMP = 100.0, 0.01  # radius
LAMP_SHARE = 1e-6  # smallest radius of a lamp over the distance from which double precision must find it
DARKEST = 1e-6  # luminance of a diffuse colour that is left out
LUMINANCE = (0.265, 0.67, 0.065)  # of red, green and blue
LOST = 0.1  # levels that a colour left out may come to

Surfaces = dict[str, Sphere | Plane]  # by name


def unit_for(planes: dict[str, Plane]) -> float:
    """What a length of 1 becomes: small enough for rays to meet planes down to HORIZON."""
    farthest = max(map(reach, planes.values()), default=0.0)
    unit = 1.0
    while farthest * unit > HUGE * HORIZON:
        unit /= 10
    return unit


def limits_for(planes: dict[str, Plane], unit: float) -> Limits:
    """Of surfaces within TINY along a ray any may be seen; rays within TINY of being parallel miss planes."""
    far = min([HUGE / unit, *(max(1.0, reach(plane)) / TINY for plane in planes.values())])
    return Limits(precision=TINY / unit / SCREEN_DISTANCE, gap=TINY / unit, far=far)


def refuse(surfaces: Surfaces, depth: int, unit: float) -> None:
    """Raise Unsupported for places, sizes, mirrors and depths that Radiance cannot carry."""
    if depth > DEEPEST:
        raise Unsupported(f"Radiance follows at most {DEEPEST} bounces, not {depth}")
    for name, surface in surfaces.items():
        if surface.reflection < 0:
            raise Unsupported(f"Radiance follows no ray of negative weight: {name} reflects {surface.reflection:g}")
        if reach(surface) > FARTHEST:
            raise Unsupported(f"Radiance's double precision is too coarse beyond {FARTHEST:g}: {name} reaches farther")
        if isinstance(surface, Sphere) and surface.radius * unit <= TINY:
            raise Unsupported(f"Radiance knows no radius up to {TINY / unit:g}: {name} has {surface.radius:g}")
    smallest = max([SMALLEST_LAMP, 2 * TINY / unit, *(LAMP_SHARE * reach(surface) for surface in surfaces.values())])
    for name, surface in surfaces.items():
        if (room := _room_for_lamp(surface)) < smallest:
            raise Unsupported(f"Radiance finds no lamp smaller than {smallest:g}: {name} leaves room for {room:g}")


def refuse_dark(colours: dict[str, list[float]], surfaces: Surfaces, depth: int) -> None:
    """Raise Unsupported for linear colours that Radiance leaves out for being dark and mirrors would brighten."""
    brightest = max((surface.reflection for surface in surfaces.values()), default=0.0)
    gain = math.exp(min(700.0, depth * math.log(max(1.0, brightest))))
    for name, colour in colours.items():
        luminance = sum(share * value for share, value in zip(LUMINANCE, colour, strict=True))
        if luminance <= DARKEST and 255 * max(colour) * gain > LOST:
            raise Unsupported(f"Radiance leaves out what is as dark as {name}, which mirrors would brighten")


def lamp_radius(surfaces: Surfaces) -> float:
    """Of a lamp that no surface comes near."""
    return min([LAMP, *map(_room_for_lamp, surfaces.values())])


def reach(surface: Sphere | Plane) -> float:
    """The farthest coordinate of a sphere; how far a plane is from the eye."""
    if isinstance(surface, Plane):
        return abs(surface.distance_from(EYE))
    return max(map(abs, surface.centre)) + surface.radius


def height_of_light(surface: Sphere | Plane) -> float:
    """How far the light is from the surface, negative behind or inside, exactly 0 on it."""
    if isinstance(surface, Plane):
        return -surface.distance_from(LIGHT)
    return 0.0 if holds_light(surface) else math.dist(surface.centre, LIGHT) - surface.radius


def _room_for_lamp(surface: Sphere | Plane) -> float:
    """The radius of a lamp that the surface leaves room for."""
    if isinstance(surface, Sphere) and holds_light(surface):
        return SMALLEST_LAMP  # as the part of the sphere within the lamp casts no shadow
    return abs(height_of_light(surface)) / 2 or LAMP
