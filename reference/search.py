"""What each ray meets, looked up in single precision with proof.

Every surface is looked for as if it reached farther by all that errors can move it or the ray, so that a distance found
is a lower bound of the true one, and what is not found is not there. What is closer to call than that is in doubt.

Rays start outside all spheres, since they are followed from surface to surface, and what does not is in doubt as well.

u = 2^-24 is the roundoff of single precision, S bounds all coordinates in play. Rounding the ray and the surfaces, and
p = origin - centre, h = p.d, l = p - h d, each move the ray's way past the centre by a few u S, by 18 u S in all, and
h and the distance of a plane by no more.
"""

from __future__ import annotations

from math import copysign, dist, hypot

import drjit as dr

from reference.device import Types
from reference.model import SHIFT, Mask, Number, Vector
from reference.scene import EYE, LIGHT, SCREEN_CORNERS, SCREEN_DISTANCE, Plane, Scene, Triple
from reference.tables import NOTHING, Rows, State

ROUNDING = 24 * 2.0**-24  # of S: what looking a surface up may be off
PARALLEL = 8 * 2.0**-24  # what rounding may leave of d.n for unit vectors
CLOSE = 1.01 * SHIFT  # up to this distance some convention does not look for surfaces
WIDEST = 1e3  # an error beyond this, or one that is not a number, is no bound at all


class Sight:
    """Rays of unit length, with how far each may be `off` its way, turned (radians), and its start shifted along it."""

    def __init__(self, origin: Vector, d: Vector, off: Number, turn: Number, shift: Number, leaving: Number) -> None:
        self.origin, self.d, self.leaving = origin, d, leaving
        self.off, self.turn, self.shift = off, turn, shift


class Search(Rows):
    """The surfaces of a scene in single precision.

    A sphere's row: centre, radius. A plane's: unit normal, on the side of the light, and how far it is along it.
    """

    def __init__(self, scene: Scene, types: Types) -> None:
        rows: list[State] = [(*s.centre, s.radius) for s in scene.spheres]
        rows += [_toward_light(plane) for plane in scene.planes]
        super().__init__(types, len(scene.spheres), rows, width=4)
        reach = [hypot(*s.centre) + s.radius for s in scene.spheres] + [abs(height) for *_, height in rows]
        self.size = self.uniform(max([*reach, hypot(*LIGHT)]))
        clear = [dist(s.centre, LIGHT) - s.radius for s in scene.spheres]
        clear += [abs(_distance(p, LIGHT)) for p in scene.planes]
        self.room = self.uniform(min([WIDEST, *clear]) / 2 - 0.01)

    def error(self, point: Vector, off: Number, turn: Number) -> Number:
        """How far from its place a surface may seem along a ray from `point`, which may be `off` and turned."""
        scale = dr.abs(point.x) + dr.abs(point.y) + dr.abs(point.z) + self.size
        return dr.fma(scale, turn + ROUNDING, off)


def _toward_light(plane: Plane) -> State:
    normal = plane.unit_normal
    sign = -copysign(1, _distance(plane, LIGHT))
    return (*(sign * value for value in normal), sign * _distance(plane, EYE))


def _distance(plane: Plane, place: Triple) -> float:
    return sum(n * (a - b) for n, a, b in zip(plane.unit_normal, plane.point, place, strict=True))


def is_clear(scene: Scene) -> bool:
    """Whether the camera's rays meet nothing before the screen: it would count only beyond."""
    spheres = all(s.centre[2] - s.radius > 1.001 * SCREEN_DISTANCE for s in scene.spheres)
    return spheres and all(_holds_no_part(plane) for plane in scene.planes)


def _holds_no_part(plane: Plane) -> bool:
    """Whether the eye and the corners of the screen are well on one side of the plane."""
    sides = [_distance(plane, place) for place in (EYE, *SCREEN_CORNERS)]
    return min(sides) > 0.001 * max(sides) > 0 or max(sides) < 0.001 * min(sides) < 0


def nearest(search: Search, ray: Sight, active: Mask) -> tuple[Number, Number, Mask]:
    """Index of what each ray meets first, a distance that nothing else comes before, and where that is in doubt."""
    error = search.error(ray.origin, ray.off, ray.turn)
    near = error + ray.shift

    def closer(index: Number, ahead: Mask, t: Number, best: Number, rival: Number, hit: Number) -> State:
        t = dr.select(ahead & (ray.leaving != index), t, dr.inf)
        later = dr.select(t < best, best, t)
        return dr.select(t < best, t, best), dr.select(later < rival, later, rival), dr.select(t < best, index, hit)

    def meet_sphere(index: Number, row: list[Number], *found: Number) -> State:
        p, radius = ray.origin - search.Vector(*row[:3]), row[3] + error
        h = dr.dot(p, ray.d)
        way = dr.fma(ray.d, -h, p)
        root = dr.sqrt(dr.fma(radius, radius, -dr.dot(way, way)))
        return closer(index, root - h > -near, -h - root, *found)

    def meet_plane(index: Number, row: list[Number], *found: Number) -> State:
        normal = search.Vector(*row[:3])
        height, facing = row[3] - dr.dot(normal, ray.origin), dr.dot(normal, ray.d)
        ahead = dr.mulsign(height, facing)
        t = (ahead - error) * dr.rcp(dr.abs(facing) + (ray.turn + PARALLEL))
        return closer(index, ahead > -near, t, *found)

    nothing = search.Float(dr.inf), search.Float(dr.inf), search.Index(NOTHING)
    best, rival, hit = search.through(meet_sphere, meet_plane, nothing, lambda *_: active)
    return hit, rival - error, ~(best > near + CLOSE) | ~(error < WIDEST)


def blocked(
    search: Search, point: Vector, to_light: Vector, distance: Number, off: Number, leaving: Number, active: Mask
) -> tuple[Mask, Mask]:
    """Whether anything stands between each point, which may be `off`, and the light, and where that is in doubt."""
    d = to_light * dr.rcp(distance)
    error = search.error(point, off, search.Float(0))
    close = dr.fma(distance, CLOSE, error)
    twice, small = 2 * error, close * close

    def hidden(inside: Number, edge: Number, between: Mask, surely: Number, perhaps: Number) -> State:
        inside = dr.select(between, inside, -dr.inf)
        sure, open_ = inside - edge, inside + edge
        return dr.select(sure > surely, sure, surely), dr.select(open_ > perhaps, open_, perhaps)

    def meet_sphere(index: Number, row: list[Number], *found: Number) -> State:
        p = point - search.Vector(*row[:3])
        h = dr.dot(p, d)
        way = dr.fma(d, -h, p)
        inside = dr.fma(row[3], row[3], -dr.dot(way, way))
        return hidden(inside, dr.fma(twice, row[3], small), (leaving != index) & (h < close) & (h > -distance), *found)

    def meet_plane(index: Number, row: list[Number], *found: Number) -> State:
        return hidden(row[3] - dr.dot(search.Vector(*row[:3]), point), close, leaving != index, *found)

    nothing = search.Float(-dr.inf), search.Float(-dr.inf)
    going = lambda surely, perhaps: active & ~(surely > 0)  # noqa: E731
    surely, perhaps = search.through(meet_sphere, meet_plane, nothing, going)
    dark = surely > 0
    return dark, ~dark & ((perhaps > 0) | ~(error < search.room))
