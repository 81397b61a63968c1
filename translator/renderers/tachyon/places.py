"""Where the surfaces of a scene lie, as far as it matters to Tachyon: around the eye, the light and the screen."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator
from itertools import combinations

from reference.scene import EYE, LIGHT, SCREEN, SCREEN_CORNERS, SCREEN_DISTANCE, Plane, Sphere, Triple, exact


def holds(sphere: Sphere, point: Triple) -> bool:
    """Whether the point is inside the sphere."""
    return math.dist(sphere.centre, point) < sphere.radius


def reach(sphere: Sphere) -> float:
    """How far from the eye its farthest point is."""
    return math.hypot(*sphere.centre) + sphere.radius


def is_lit(plane: Plane) -> bool:
    """Whether the light is on the side that the normal points to, and has an effect there."""
    return plane.diffuse != 0 and plane.distance_from(LIGHT) < 0


def slants(plane: Plane) -> bool:
    """Whether points far away on the plane are off it by rounding."""
    return sum(map(bool, plane.normal)) > 1


def angle_between(one: Plane, two: Plane) -> float:
    """Radians, for small angles; at most 1."""
    (x, y, z), (u, v, w) = one.unit_normal, two.unit_normal
    return math.hypot(y * w - z * v, z * u - x * w, x * v - y * u)


def only_between(spheres: dict[str, Sphere], planes: dict[str, Plane]) -> str | None:
    """The only surface between eye and light, which no ray crosses: it may be lit, where several leave all unlit."""
    between = [name for name, sphere in spheres.items() if holds(sphere, EYE) != holds(sphere, LIGHT)]
    for name, plane in planes.items():
        eye, light = plane.distance_from(EYE), plane.distance_from(LIGHT)
        if min(eye, light) < 0 < max(eye, light):
            between.append(name)
    return between[0] if len(between) == 1 else None


def is_sphere_before_screen(sphere: Sphere) -> bool:
    """Whether the sphere meets the pyramid of the eye and the screen, which may also be inside it as a whole."""
    slope = SCREEN / SCREEN_DISTANCE
    x, y, z = abs(sphere.centre[0]), abs(sphere.centre[1]), sphere.centre[2]

    def distance(depth: float) -> float:
        """From the centre to the pyramid's part at that z."""
        return math.hypot(max(x - slope * depth, 0), max(y - slope * depth, 0), z - depth)

    # The square of the distance is a convex chain of parabolas in z: its least value is at the bottom of one of them.
    sides: tuple[tuple[float, ...], ...] = ((), (x,), (y,), (x, y))
    bottoms = [(z + slope * sum(active)) / (1 + slope * slope * len(active)) for active in sides]
    nearest = min(distance(min(max(depth, 0), SCREEN_DISTANCE)) for depth in bottoms)
    return nearest < sphere.radius and not all(holds(sphere, point) for point in (EYE, *SCREEN_CORNERS))


def is_plane_before_screen(plane: Plane) -> bool:
    """Whether rays of the camera meet the plane on the screen or before it."""
    normal, offset = plane.unit_normal, plane.distance_from(EYE)
    middle = SCREEN_DISTANCE * normal[2]  # n.d over the screen is middle -+ spread; the plane is met at offset / n.d
    spread = SCREEN * (abs(normal[0]) + abs(normal[1]))
    return offset != 0 and (middle + spread >= offset if offset > 0 else middle - spread <= offset)


def edges_toward_eye(spheres: dict[str, Sphere]) -> Iterator[tuple[str, str]]:
    """The mirrors that cut another sphere in a circle whose plane holds the eye, so that rays may meet it exactly."""
    powers = defaultdict(list)
    for name, sphere in spheres.items():
        powers[sum(exact(value) ** 2 for value in sphere.centre) - exact(sphere.radius) ** 2].append(name)
    for name, other in (pair for names in powers.values() for pair in combinations(names, 2)):
        one, two = spheres[name], spheres[other]
        cut = abs(one.radius - two.radius) < math.dist(one.centre, two.centre) < one.radius + two.radius
        if cut and (one.reflection or two.reflection):
            yield name, other
