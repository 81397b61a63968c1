"""What each ray meets, looked up in single precision with proof.

Every surface is looked for as if it reached farther by all that errors can move it or the ray, so that a distance found
is a lower bound of the true one, and what is not found is not there. What is closer to call than that is in doubt.

Rays are followed from the eye, surface by surface, so they stay outside all spheres and on the eye's side of every
plane: a sphere lies ahead where p.d < 0, p = origin - centre, a plane where d.n < 0, n toward the eye; the surface left
does neither. Where the light is on that side as well, no plane throws a shadow.

u = 2^-24 is the roundoff of single precision, S bounds all coordinates in play. Rounding the ray and the surfaces, and
p, h = p.d, l = p - h d, each move the ray's way past the centre by a few u S, by 18 u S in all, and h and the distance
of a plane by no more. For camera rays, of length 1 but for 5 u, (c.d)^2 - c.c is off by 21 u c.c.
"""

from __future__ import annotations

from math import copysign, dist, hypot

import drjit as dr
from numpy import float32

from reference.device import Types
from reference.model import SHIFT, Mask, Number, Vector
from reference.scene import EYE, LIGHT, SCREEN_CORNERS, SCREEN_DISTANCE, Plane, Scene, Sphere, Triple
from reference.tables import NOTHING, Rows, State

ROUNDOFF = 2.0**-24
ROUNDING = 24 * ROUNDOFF  # of S: what looking a surface up may be off
SQUARED = 32 * ROUNDOFF  # of c.c: what rounding may leave of (c.d)^2 - c.c
PARALLEL = 8 * ROUNDOFF  # what rounding may leave of d.n for unit vectors
CAMERA_TURN = 6 * ROUNDOFF  # radians; what rounding may turn a camera ray
GRAZED = 1.1e-3  # |d.n| up to which some convention misses a plane
WINDOW = 1.01 * SHIFT  # of the way to the light, up to which some convention does not look for surfaces
CLOSE = WINDOW / GRAZED  # a ray that has come so far is farther than SHIFT from the surface that it left
FARTHEST = 1e12  # of what scenes extend to
APART = 2.0**-9  # of the scene's size: how far the light must be from surfaces
ASIDE = 2.0**-16  # of the scene's size: how far the eye must be from surfaces, several times what errors move them


class Sight:
    """Rays of unit length, which may be `off` their way and turned (radians). `scale` bounds what they have in play."""

    def __init__(self, origin: Vector, d: Vector, off: Number, turn: Number, shift: Number, scale: Number) -> None:
        self.origin, self.d, self.off, self.turn, self.shift, self.scale = origin, d, off, turn, shift, scale


class Search(Rows):
    """The surfaces of a scene in single precision.

    A row: centre, radius and curvature of a sphere; unit normal of a plane toward the eye, how far it is behind the
    eye, and zero. Then of both: reflection coefficient, the most that is sent out at once.
    """

    def __init__(self, scene: Scene, types: Types) -> None:
        planes = [toward_eye(plane) for plane in scene.planes]
        size = extent(scene)
        error = size * (CAMERA_TURN + ROUNDING)
        surfaces: tuple[Sphere | Plane, ...] = (*scene.spheres, *scene.planes)
        light = ambient_light(scene)
        rows: list[State] = [(*s.centre, s.radius, 1 / s.radius) for s in scene.spheres]
        rows += [(*plane, 0) for plane in planes]
        rows = [(*row, s.reflection, brightness(s, light), 0) for row, s in zip(rows, surfaces, strict=True)]
        super().__init__(types, len(scene.spheres), rows, width=8)
        self.ahead = Rows(
            types,
            len(scene.spheres),
            [_sphere_seen(s.centre, s.radius, error) for s in scene.spheres]
            + [
                (*(value / (height - error) for value in normal), (CAMERA_TURN + PARALLEL) / (height - error))
                for *normal, height in planes
            ],
            4,
        )
        self.size = self.uniform(size)
        self.coarse = self.uniform(max(_coarseness(row) for row in [*rows, (0.0,)]))
        clear = [dist(s.centre, LIGHT) - s.radius for s in scene.spheres]
        self.room = self.uniform(min([*clear, *(abs(distance(p, LIGHT)) for p in scene.planes), size]) / 8)
        skew = any(p.unit_normal.count(0) < 2 for p in scene.planes)
        self.slack = self.uniform((9 if skew else 1.25) * ROUNDOFF)
        self.camera_slack = self.uniform((9 if skew else 0.75) * ROUNDOFF)
        self.bend = self.uniform(12 * ROUNDOFF if skew else 0)
        self.sharpest = self.uniform(max((1 / s.radius for s in scene.spheres), default=0))


def _coarseness(row: State) -> float:
    """How far single precision moves a surface, but for what it turns a plane."""
    *place, size = (abs(value - float(float32(value))) for value in row[:4])
    return 1.001 * float(hypot(*place) + size)


def extent(scene: Scene) -> float:
    """A bound of all coordinates of surfaces and of the light."""
    reach = [hypot(*s.centre) + s.radius for s in scene.spheres] + [abs(distance(p, EYE)) for p in scene.planes]
    return 1 + max([*reach, hypot(*LIGHT)])


def _sphere_seen(centre: Triple, radius: float, error: float) -> State:
    """What camera rays need of a sphere: p = centre / k and k', for the root 1 / t = p.d + sqrt((p.d)^2 - 1 / k')."""
    square = sum(value * value for value in centre)
    beyond = square - (radius + error) ** 2
    return (*(value / beyond for value in centre), SQUARED * square / beyond**2 - 1 / beyond)


def ambient_light(scene: Scene) -> list[float]:
    """Ambient light by channel, as a share of a surface's colour."""
    return [value * scene.ambient_coefficient / 256 for value in scene.ambient]


def brightness(surface: Sphere | Plane, ambient: list[float]) -> float:
    """The most that a surface may send out at once."""
    return max(map(abs, surface.colour)) * (abs(surface.diffuse) + max(map(abs, ambient)))


def toward_eye(plane: Plane) -> State:
    """Unit normal toward the eye, and how far the plane is behind the eye."""
    height = -distance(plane, EYE)
    sign = copysign(1, height)
    return (*(sign * value for value in plane.unit_normal), sign * height)


def distance(plane: Plane, place: Triple) -> float:
    """How far the place is behind the plane, along its unit normal; rounded."""
    return sum(n * (a - b) for n, a, b in zip(plane.unit_normal, plane.point, place, strict=True))


def is_clear(scene: Scene) -> bool:
    """Whether the camera's rays meet nothing before the screen: it would count only beyond.

    And whether the light is apart from all surfaces, outside the spheres and on the eye's side of the planes, and no
    square overflows.
    """
    size = extent(scene)
    room = APART * size
    near = [dist(s.centre, EYE) - s.radius for s in scene.spheres] + [abs(distance(p, EYE)) for p in scene.planes]
    if size > FARTHEST or min(near, default=size) < ASIDE * size:
        return False
    spheres = all(
        s.centre[2] - s.radius > 1.001 * SCREEN_DISTANCE and dist(s.centre, LIGHT) - s.radius > room
        for s in scene.spheres
    )
    return spheres and all(_holds_no_part(plane, room) for plane in scene.planes)


def _holds_no_part(plane: Plane, room: float) -> bool:
    """Whether the eye, the light and the corners of the screen are well on one side of the plane."""
    sides = [distance(plane, place) for place in (EYE, *SCREEN_CORNERS)]
    light = distance(plane, LIGHT)
    return (min(sides) > 0.001 * max(sides) > 0 and light > room) or (
        max(sides) < 0.001 * min(sides) < 0 and light < -room
    )


def _closer(index: Number, t: Number, best: Number, rival: Number, hit: Number) -> State:
    """The two nearest; a distance that is not a number is none."""
    later = dr.select(t < best, best, t)
    return dr.select(t < best, t, best), dr.select(later < rival, later, rival), dr.select(t < best, index, hit)


def seen(search: Search, d: Vector) -> tuple[Number, Number, Number]:
    """Index of what each camera ray meets first, and two reciprocals: of a distance that this does not come before, and
    of one that nothing else comes before.
    """

    def closer(index: Number, near: Number, best: Number, rival: Number, hit: Number) -> State:
        later = dr.select(near > best, best, near)
        rival = dr.select(later > rival, later, rival)
        return dr.select(near > best, near, best), rival, dr.select(near > best, index, hit)

    def meet_sphere(index: Number, row: list[Number], *found: Number) -> State:
        ahead = dr.dot(search.Vector(*row[:3]), d)
        return closer(index, ahead + dr.sqrt(dr.fma(ahead, ahead, row[3])), *found)

    def meet_plane(index: Number, row: list[Number], *found: Number) -> State:
        return closer(index, row[3] - dr.dot(search.Vector(*row[:3]), d), *found)

    nothing = search.Float(0), search.Float(0), search.Index(NOTHING)
    best, rival, hit = search.ahead.through(meet_sphere, meet_plane, nothing, lambda *_: True)
    return hit, best, rival


def nearest(search: Search, ray: Sight, active: Mask) -> tuple[Number, Number, Number, Mask]:
    """Index of what each ray meets first, how far it is, a distance that nothing else comes before, and where even that
    is in doubt.
    """
    widened = ray.turn + PARALLEL
    error = dr.fma(ray.scale, ray.turn + ROUNDING, ray.off)
    near = error + ray.shift

    def closer(index: Number, t: Number, keep: Number, best: Number, rival: Number, hit: Number, kept: Number) -> State:
        return *_closer(index, t, best, rival, hit), dr.select(t < best, keep, kept)

    def meet_sphere(index: Number, row: list[Number], *found: Number) -> State:
        p, radius = ray.origin - search.Vector(*row[:3]), row[3] + error
        h = dr.dot(p, ray.d)
        way = dr.fma(ray.d, -h, p)
        root = dr.sqrt(dr.fma(radius, radius, -dr.dot(way, way)))
        return closer(index, dr.select(h < near, -h - root, dr.inf), root, *found)

    def meet_plane(index: Number, row: list[Number], *found: Number) -> State:
        normal = search.Vector(*row[:3])
        facing = widened - dr.dot(normal, ray.d)
        t = (dr.dot(normal, ray.origin) + row[3] - error) * dr.rcp(facing)
        return closer(index, dr.select(facing > 0, t, dr.inf), facing, *found)

    nothing = search.Float(dr.inf), search.Float(dr.inf), search.Index(NOTHING), search.Float(0)
    best, rival, hit, kept = search.through(meet_sphere, meet_plane, nothing, lambda *_: active)
    size = search.row(hit, hit != NOTHING)[3]  # without the error, which widened the root and moved the plane
    root = dr.sqrt(dr.fma(kept, kept, -error * dr.fma(2, size, error)))
    plane = dr.fma(best, kept, error) * dr.rcp(kept - widened)
    t = dr.select(hit < search.first_plane, best + (kept - root), plane)
    return hit, t, rival, ~(best > near + CLOSE)


def blocked(search: Search, point: Vector, d: Vector, length: Number, error: Number, active: Mask) -> tuple[Mask, Mask]:
    """Whether a sphere stands between each point, which may be off by `error`, and the light, and where that is in
    doubt.
    """
    close = dr.fma(length, WINDOW, error)
    # (r^2 - l.l) / r is less than twice how far inside the ray passes; a ray from outside that is past the centre by
    # less than `close` may have l.l as small as r^2 - close^2.
    edge = dr.fma(close * close, search.sharpest, 2 * error)

    def meet_sphere(index: Number, row: list[Number], deepest: Number) -> State:
        p = point - search.Vector(*row[:3])
        h = dr.dot(p, d)
        way = dr.fma(d, -h, p)
        inside = dr.select((h < close) & (h > -length), dr.fma(-dr.dot(way, way), row[4], row[3]), -dr.inf)
        return (dr.select(inside > deepest, inside, deepest),)

    def meet_plane(index: Number, row: list[Number], deepest: Number) -> State:
        return (deepest,)

    nothing = (search.Float(-dr.inf),)
    (deepest,) = search.through(meet_sphere, meet_plane, nothing, lambda deepest: active & ~(deepest > edge))
    dark = deepest > edge
    return dark, ~dark & ~(deepest < -edge)
