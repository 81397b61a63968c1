"""What Tachyon's arithmetic cannot do better, and what is refused for it. The figures come from comparing pictures."""

from __future__ import annotations

import math
from itertools import permutations

from reference.scene import EYE, LIGHT, Plane, Sphere
from translator.contract import Limits, Settings, Unsupported
from translator.renderers.tachyon.places import (
    angle_between,
    edges_toward_eye,
    holds,
    is_lit,
    is_plane_before_screen,
    is_sphere_before_screen,
    only_between,
    reach,
    slants,
)

UNIT = 2.0**-10  # what a length of 1 becomes: Tachyon's tolerance is absolute and suits this scale
TOLERANCE = 1e-9 / UNIT  # a mirrored ray starts so far ahead, and no ray sees what is nearer to its start
ENDLESS = 2.0**30  # where a triangle ends that stands for a plane
LIMITS = Limits(precision=2.0**-30, gap=2 * TOLERANCE, far=ENDLESS)
FAINTEST = 0.001959  # coefficients up to this count as 0

DEEPEST = 4096  # bounces: each takes up stack
MOST_PIXELS = 2**31 // 3  # it counts their channels in 32 bits
FARTHEST = 1e7  # of a sphere
FARTHEST_PLANE = 1e8
LIGHT_GAP = 1e-5  # between a surface and the light
PARALLEL = 0.01  # radians between a slanting mirror and any other plane

FROM_WITHIN = "Tachyon darkens spheres seen from within"


def refuse(spheres: dict[str, Sphere], planes: dict[str, Plane], settings: Settings) -> None:
    """Raise Unsupported for what Tachyon cannot carry."""
    if settings.depth > DEEPEST:
        raise Unsupported(f"Tachyon follows at most {DEEPEST} bounces, not {settings.depth}")
    if (pixels := settings.width * settings.height) > MOST_PIXELS:
        raise Unsupported(f"Tachyon draws at most {MOST_PIXELS} pixels, not {pixels}")
    for name, sphere in spheres.items():
        _refuse_place(name, reach(sphere), FARTHEST, is_sphere_before_screen(sphere))
        _refuse_light_gap(name, math.dist(sphere.centre, LIGHT) - sphere.radius)
    for name, plane in planes.items():
        _refuse_place(name, abs(plane.distance_from(EYE)), FARTHEST_PLANE, is_plane_before_screen(plane))
        if gap := plane.distance_from(LIGHT):
            _refuse_light_gap(name, gap)
    name = only_between(spheres, planes) or ""
    if name in spheres and spheres[name].diffuse and holds(spheres[name], EYE):
        raise Unsupported(f"{FROM_WITHIN}: {name} holds the eye and not the light")
    if settings.depth > 0:
        _refuse_mirrors(spheres, planes)


def _refuse_place(name: str, farthest: float, most: float, before_screen: bool) -> None:
    if farthest > most:
        raise Unsupported(f"Tachyon's rays stray beyond {most:g}: {name} reaches farther")
    if before_screen:
        raise Unsupported(f"Tachyon's camera sees what is before the screen: {name} comes into its view there")


def _refuse_light_gap(name: str, gap: float) -> None:
    if abs(gap) < LIGHT_GAP:
        raise Unsupported(f"Tachyon decides by rounding whether {name} hides the light, which is {abs(gap):g} from it")


def _refuse_mirrors(spheres: dict[str, Sphere], planes: dict[str, Plane]) -> None:
    surfaces: dict[str, Sphere | Plane] = {**spheres, **planes}
    if not any(surface.reflection for surface in surfaces.values()):
        return
    for name, surface in surfaces.items():
        if surface.reflection and surface.reflection <= FAINTEST:
            raise Unsupported(f"Tachyon leaves out reflections under 1/512: {name} has {surface.reflection:g}")
    for one, two in edges_toward_eye(spheres):
        raise Unsupported(f"{FROM_WITHIN}: rays may get in at the edge of {one} and {two}, which cut each other")
    for name, plane in planes.items():
        if is_lit(plane) and not plane.distance_from(EYE):
            raise Unsupported(f"Tachyon darkens planes seen from their back: mirrors may show both sides of {name}")
    for (name, plane), (other_name, other) in permutations(planes.items(), 2):
        if plane.reflection and slants(plane) and angle_between(plane, other) < PARALLEL:
            raise Unsupported(f"Tachyon's slanting mirrors end far away: {name} shows {other_name} even there")
