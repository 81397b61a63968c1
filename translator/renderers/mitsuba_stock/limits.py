"""What stock Mitsuba's arithmetic cannot do better, what is refused, and the sides of surfaces."""

from __future__ import annotations

import math

from reference.scene import LIGHT, SCREEN, SCREEN_CORNERS, SCREEN_DISTANCE, Plane, Sphere
from translator.contract import Limits, Settings, Unsupported

ORIGIN = (0.0, -100.0, 250.0)  # what becomes (0, 0, 0): rays start ahead in proportion to their coordinates there
PLANE_RADIUS = 1e9  # a plane is a disk of this radius

RAY_EPSILON = 1500 * 2.0**-24  # rays start ahead of a point by this times 1 + its largest coordinate, along the normal
SHADOW_EPSILON = 10 * RAY_EPSILON  # shadow rays end before the light by this share of the way

# What Mitsuba carries: one side of each surface, in single precision.
COARSE = "Mitsuba's single precision is too coarse"
DEEPEST_BETWEEN_BALLS = 8  # bounces, where several spheres mirror each other and each magnifies the error
MANY_BALLS = 20  # more ways lead between more of them
DEEPEST_BETWEEN_MANY = 5  # bounces
FARTHEST = 1e6  # of a sphere
LARGEST_RADIUS = 2000
APART = 1e-3  # between a surface and the screen
LIGHT_GAP = 10  # between a surface and the light
# Single precision, as it adds up in interval arithmetic.
LIMITS = Limits(2.0**-20, far=0.9 * PLANE_RADIUS, ahead=RAY_EPSILON, origin=ORIGIN, short=SHADOW_EPSILON)


def refuse(spheres: dict[str, Sphere], planes: dict[str, Plane], settings: Settings) -> None:
    """Raise Unsupported for what stock Mitsuba cannot carry."""
    if settings.width != settings.height:
        raise Unsupported("Mitsuba's camera has square pixels, so that a square screen needs a square picture")
    balls = sum(sphere.reflection != 0 for sphere in spheres.values())
    deepest = DEEPEST_BETWEEN_BALLS if balls < MANY_BALLS else DEEPEST_BETWEEN_MANY
    if balls > 1 and settings.depth > deepest:
        between = f"{settings.depth} bounces between {balls} mirroring spheres"
        raise Unsupported(f"{COARSE} for {between} (at most {deepest})")
    for name, sphere in spheres.items():
        if math.hypot(*sphere.centre) + sphere.radius > FARTHEST:
            raise Unsupported(f"{COARSE} beyond {FARTHEST:g}: {name} reaches farther")
        if sphere.radius > LARGEST_RADIUS:
            raise Unsupported(f"{COARSE} for a radius over {LARGEST_RADIUS}: {name} has {sphere.radius:g}")
        _refuse_sides(name, sphere, *_distances_from_screen(sphere))
        _refuse_light_gap(name, math.dist(sphere.centre, LIGHT) - sphere.radius)
    for name, plane in planes.items():
        sides = [-plane.distance_from(corner) for corner in SCREEN_CORNERS]
        _refuse_sides(name, plane, min(sides), max(sides))
        if gap := plane.distance_from(LIGHT):
            _refuse_light_gap(name, gap)


def is_lit(surface: Sphere | Plane) -> bool:
    """Whether the side that the normal points to has light, if nothing is in its way."""
    if isinstance(surface, Sphere):
        return surface.diffuse != 0 and math.dist(surface.centre, LIGHT) > surface.radius
    return surface.diffuse != 0 and surface.distance_from(LIGHT) < 0


def is_seen_from_back(surface: Sphere | Plane) -> bool:
    """Whether the screen, where all rays start, is on the side that the normal points away from."""
    if isinstance(surface, Sphere):
        return math.dist(surface.centre, SCREEN_CORNERS[0]) < surface.radius
    return surface.distance_from(SCREEN_CORNERS[0]) > 0


def _refuse_light_gap(name: str, gap: float) -> None:
    """Shadow rays end before the light, by 0.09 % of the way."""
    if abs(gap) < LIGHT_GAP:
        raise Unsupported(f"Mitsuba's shadow rays end short of the light: {name} passes it at {abs(gap):g}")


def _refuse_sides(name: str, surface: Sphere | Plane, least: float, most: float) -> None:
    """Materials and emitters have one side, so that each surface must be seen from one side, and not lit on the other.

    `least` and `most` are the distances of the screen's points from the surface, negative at its back.
    """
    if least < APART and most > -APART:
        raise Unsupported(f"Mitsuba's emitters have one side: {name} meets the screen, so that both its sides are seen")
    if most < 0 and is_lit(surface):
        raise Unsupported(f"Mitsuba's materials have one side: {name} is seen from its back and lit in front")


def _distances_from_screen(sphere: Sphere) -> tuple[float, float]:
    x, y, _ = sphere.centre
    nearest = (min(max(x, -SCREEN), SCREEN), min(max(y, -SCREEN), SCREEN), SCREEN_DISTANCE)
    farthest = (math.copysign(SCREEN, -x), math.copysign(SCREEN, -y), SCREEN_DISTANCE)
    return math.dist(sphere.centre, nearest) - sphere.radius, math.dist(sphere.centre, farthest) - sphere.radius
