"""The `exact` convention for a whole picture in ball arithmetic: proven colours wherever every branch is decided.

The same rays as the tracer's, with no other epsilon than the balls' own radii; a ray whose way is open gives its pixel
up. Reflected directions keep the length of the camera's, on which no term depends.
"""

from __future__ import annotations

from itertools import chain

import drjit as dr
import numpy as np
from flint import arb
from numpy.typing import NDArray

from reference.balls import UNIT, Arrow, Ball, Mask, Number
from reference.device import Types, array_types
from reference.enclosure import HeldPlane, HeldSphere, Tables, precision
from reference.scene import EYE, LIGHT, SCREEN, SCREEN_DISTANCE, Plane, Scene, Sphere, Triple, merge_coincident
from reference.tables import BAND, MATERIAL, NOTHING, Rows, State, pixel_places, shading

SMALLEST, LARGEST = 1e-30, 1e30  # of the scene's numbers, so that no product under- or overflows
STRAIGHT = 2.0**-20  # the largest relative error of a direction, beyond which a ray gives up
FAINTEST = 1e-200  # share of a ray: what is fainter may come back only where mirrors make it brighter again
WIDTH = 12  # numbers of each surface
PRECISION = 128  # bits, of the numbers before they are rounded


def sweep(scene: Scene, *, width: int, height: int, depth: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The picture (height x width x 3, levels, not clamped), and how far each pixel may be off (infinity: open).

    Raises DeviceError where Dr.Jit cannot compute.
    """
    picture, radius = np.zeros((height, width, 3)), np.full((height, width), np.inf)
    scene = merge_coincident(scene)
    if not _is_tame(scene):
        return picture, radius
    world = BallWorld(scene, array_types())
    limit = dr.opaque(world.Index, depth)
    rows = max(1, BAND // width)
    for top in range(0, height, rows):
        band = slice(top, min(top + rows, height))
        colour, error = _radiance(world, *_camera(world, width, height, top, band.stop - top), limit)
        dr.eval(colour, error)
        # Without surfaces there is one value for all pixels.
        picture[band].reshape(-1, 3)[:] = dr.ravel(colour).numpy().reshape(-1, 3)
        radius[band].reshape(-1)[:] = error.numpy()
    return picture, np.where(np.isnan(radius), np.inf, radius)


def _is_tame(scene: Scene) -> bool:
    surfaces: tuple[Sphere | Plane, ...] = (*scene.spheres, *scene.planes)
    numbers = [*scene.ambient, scene.ambient_coefficient]
    numbers += chain.from_iterable((*s.colour, s.diffuse, s.reflection) for s in surfaces)
    numbers += chain.from_iterable((*s.centre, s.radius) for s in scene.spheres)
    numbers += chain.from_iterable(p.point for p in scene.planes)
    return all(SMALLEST < abs(number) < LARGEST for number in numbers if number)


class BallWorld(Rows):
    """A scene on the device: every number rounded once from the decimals, with what that lost.

    Geometry of a sphere: centre, its error, radius^2, radius, |eye - centre|^2 - r^2, its error, and where the light is
    (1 outside, 0 on it, -1 inside). Of a plane: unit normal, its error, how far the plane is from the eye, error, and
    from the light, error, all along the normal, where the light is (1 farther that way, 0 in it, -1), and whether the
    camera may see it: not if it holds the eye or is the screen.
    """

    def __init__(self, scene: Scene, types: Types) -> None:
        with precision(PRECISION):
            tables = Tables(scene)
            geometry = [_sphere_row(s) if isinstance(s, HeldSphere) else _plane_row(s) for s in tables.surfaces]
            ambient = [_nearest(value)[0] for value in tables.ambient]
        super().__init__(types, len(scene.spheres), geometry, WIDTH)
        materials = shading(scene)
        self.materials = Rows(types, len(scene.spheres), materials, MATERIAL)
        self.fading = all(abs(mirror) <= 1 for mirror in materials[:, 4])
        self.ambient = self.Vector(*map(self.uniform, ambient))
        self.brightest = self.uniform(max(map(abs, ambient)))
        self.eye, self.light = self.held(EYE), self.held(LIGHT)

    def held(self, point: Triple | list[Number], radius: Number = 0) -> Arrow:
        """A point of the scene, up to `radius` away."""
        vector = self.Vector(*point)
        length = dr.abs(vector.x) + dr.abs(vector.y) + dr.abs(vector.z) + radius
        return Arrow(vector, self.Float(radius), length)


def _sphere_row(sphere: HeldSphere) -> State:
    centre, errors = zip(*map(_nearest, sphere.centre), strict=True)
    squared, radius = _nearest(sphere.radius**2)[0], _nearest(sphere.radius)[0]
    return (*centre, sum(errors), squared, radius, *_nearest(sphere.at_eye), _sign(sphere.at_light), 0, 0, 0)


def _plane_row(plane: HeldPlane) -> State:
    normal, errors = zip(*(_nearest(value / plane.length) for value in plane.normal), strict=True)
    from_eye, from_light = _nearest(plane.offset / plane.length), _nearest(plane.from_light / plane.length)
    seen = not (plane.offset.is_zero() or plane.is_screen)
    return (*normal, sum(errors), *from_eye, *from_light, -_sign(plane.from_light), seen, 0, 0)


def _nearest(ball: arb) -> tuple[float, float]:
    """A number in double precision and twice the most that it may be off."""
    value = float(ball.mid())
    return value, 2 * float((ball - arb(value)).abs_upper())


def _sign(ball: arb) -> int:
    return int(bool(ball > 0)) - int(bool(ball < 0))


class _Ray:
    """`dd` is d.d, the same at every bounce."""

    def __init__(self, origin: Arrow, d: Arrow, dd: Ball, leaving: Number) -> None:
        self.origin, self.d, self.dd, self.leaving = origin, d, dd, leaving


def _camera(world: BallWorld, width: int, height: int, top: int, count: int) -> tuple[Arrow, Ball]:
    """Directions to the centres of pixels, two coordinates rounded once, and the squares of their lengths."""
    pixel = dr.arange(world.Index, count * width)
    place, line = pixel_places(world, width, pixel)
    column, row = world.Float(place), world.Float(line + dr.opaque(world.Index, top))
    across, down = world.uniform(width), world.uniform(height)
    x = (2 * column + 1 - across) * SCREEN / across
    y = (down - 1 - 2 * row) * SCREEN / down
    square = dr.fma(x, x, dr.fma(y, y, SCREEN_DISTANCE**2))
    length = dr.sqrt(square) * (1 + STRAIGHT)
    return Arrow(world.Vector(x, y, SCREEN_DISTANCE), length * UNIT, length), Ball(square, square * (4 * UNIT))


@dr.syntax
def _radiance(world: BallWorld, d: Arrow, dd: Ball, limit: Number) -> tuple[Number, Number]:
    """The colour that each camera ray brings back, and how far off it may be in any channel."""
    colour, radius = world.Vector(0), world.Float(SMALLEST)
    weight, depth = world.Float(1), world.Index(0)
    origin, origin_radius = world.Vector(*EYE), world.Float(0)
    direction, direction_radius = d.value, d.radius
    t, t_radius, hit, lost = nearest(world, _Ray(world.eye, d, dd, world.Index(NOTHING)), True, world.Mask(True))
    while hit != NOTHING:
        row = world.row(hit)
        red, green, blue, diffuse, mirror, _, _, _ = world.materials.row(hit)
        onto = Arrow(direction, direction_radius, d.length)
        point = Arrow(origin, origin_radius, world.Float(0)).along(Ball(t, t_radius), onto)
        normal = _normal(world, hit, row, point)
        to_light = world.light - point
        distance = to_light.square().root()
        cosine = normal.dot(to_light).where(hit < world.first_plane, Ball(-row[6], row[7])) / distance
        lost |= ~(distance.beyond(0) & (normal.radius < STRAIGHT / 2))

        lit, dark = cosine.beyond(0), cosine.below(0)
        blocked, free = shadow(world, point, to_light, hit, lit)
        lit_surely, dark_surely = lit & free, dark | (lit & blocked)
        shown = dr.select(lit_surely, cosine.value, 0)
        open_ = dr.select(lit_surely, cosine.radius, dr.select(dark_surely, 0, dr.abs(cosine.value) + cosine.radius))
        surface = world.Vector(red, green, blue)
        brightest = dr.max(dr.abs(surface))
        local = surface * dr.fma(world.Vector(diffuse), shown, world.ambient)
        rounding = (world.brightest + dr.abs(diffuse)) * (UNIT * (4 + 2 * world.Float(depth)))
        colour = dr.fma(local, weight, colour)
        radius = dr.fma(dr.abs(weight) * brightest, dr.fma(dr.abs(diffuse), open_, rounding), radius)
        radius = dr.fma(dr.max(dr.abs(colour)), UNIT, radius)

        depth += 1
        weight *= mirror
        leaving = hit
        hit = world.Index(NOTHING)
        if not world.fading:
            lost |= (mirror != 0) & (dr.abs(weight) < FAINTEST)
        onward = (depth <= limit) & (weight != 0) & ~lost
        if onward:
            mirrored = _mirrored(onto, normal)
            origin, origin_radius = point.value, point.radius
            direction, direction_radius = mirrored.value, mirrored.radius
            t, t_radius, hit, lost = nearest(world, _Ray(point, mirrored, dd, leaving), False, onward)
            lost |= ~(direction_radius < d.length * (STRAIGHT / 4))
        radius = dr.select(lost, dr.inf, radius)
    return colour, dr.select(lost, dr.inf, radius)


def _normal(world: BallWorld, hit: Number, row: list[Number], point: Arrow) -> Arrow:
    """Of unit length, within what it is off."""
    outward = point - world.held(row[:3], row[3])
    is_sphere = hit < world.first_plane
    value = dr.select(is_sphere, outward.value / row[5], world.Vector(*row[:3]))
    radius = dr.select(is_sphere, dr.fma(UNIT, 3, outward.radius / row[5]), row[3])
    return Arrow(value, radius, world.Float(1 + STRAIGHT))


def _mirrored(d: Arrow, normal: Arrow) -> Arrow:
    """The direction d - 2 (d.n) n. A mirror keeps the error of d; that of n counts 2 |d| (2 + error) times."""
    value = dr.fma(normal.value, -2 * dr.dot(d.value, normal.value), d.value)
    radius = dr.fma(d.length, dr.fma(4 + STRAIGHT * 4, normal.radius, 12 * UNIT), d.radius)
    return Arrow(value, radius, d.length)


def nearest(world: BallWorld, ray: _Ray, from_eye: bool, active: Mask) -> tuple[Number, Number, Number, Mask]:
    """Distance, its error and the index of what each ray hits first, and where that is open (then NOTHING)."""
    least = 1 if from_eye else 0

    def meet(index: Number, t: Ball, counts: Mask, open_: Mask, state: State) -> State:
        best, error, hit, rival, lost = state
        closer = counts & (t.value < best)
        behind = dr.select(closer, best - error, dr.select(counts, t.value - t.radius, dr.inf))
        return (
            dr.select(closer, t.value, best),
            dr.select(closer, t.radius, error),
            dr.select(closer, index, hit),
            dr.minimum(rival, behind),
            lost | open_,
        )

    def meet_sphere(index: Number, row: list[Number], *state: Number) -> State:
        left = ray.leaving == index
        p = ray.origin - world.held(row[:3], row[3])
        half = p.dot(ray.d)
        if from_eye:
            constant = Ball(row[6], row[7])
        else:
            zero = Ball(world.Float(0), world.Float(0))
            constant = zero.where(left, p.square() - Ball(row[4], row[4] * UNIT))
        squared = half.squared() - ray.dd * constant
        root = squared.root()
        near, far = -(half + root) / ray.dd, (root - half) / ray.dd
        other = -(half + half) / ray.dd  # of a ray that leaves the sphere
        hits = squared.beyond(0) | left
        first = near.beyond(least) & ~left
        t = other.where(left, near.where(first, far))
        counts = hits & (first | (t.beyond(least) & (left | near.below(least))))
        misses = (squared.below(0) & ~left) | (hits & t.below(least))
        return meet(index, t, counts, ~counts & ~misses, state)

    def meet_plane(index: Number, row: list[Number], *state: Number) -> State:
        met = row[9] != 0 if from_eye else ray.leaving != index
        normal = Arrow(world.Vector(*row[:3]), row[3], world.Float(1 + STRAIGHT))
        side = Ball(row[4], row[5])
        if not from_eye:
            side -= ray.origin.dot(normal)
        facing = ray.d.dot(normal)
        t = side / facing
        crosses = facing.beyond(0) | facing.below(0)
        counts = met & crosses & t.beyond(least)
        return meet(index, t, counts, met & ~counts & ~(crosses & t.below(least)), state)

    start = (world.Float(dr.inf), world.Float(0), world.Index(NOTHING), world.Float(dr.inf), world.Mask(False))
    going = lambda *state: active & ~state[-1]  # noqa: E731
    found = world.fold(0, world.spheres, meet_sphere, start, going)
    t, error, hit, rival, lost = world.fold(world.spheres, world.surfaces, meet_plane, found, going)
    lost |= (hit != NOTHING) & ~(rival > t + error)
    return t, error, dr.select(lost, NOTHING, hit), lost


def shadow(world: BallWorld, point: Arrow, to_light: Arrow, leaving: Number, active: Mask) -> tuple[Mask, Mask]:
    """Where something surely stands before the light, and where surely nothing does.

    By signs alone: a plane does if point and light are on different sides of it, a sphere if one of them is inside, or
    if the way between them dips into it. A surface that faces the light does not block it.
    """
    dd = to_light.square()

    def meet_sphere(index: Number, row: list[Number], dark: Mask, open_: Mask) -> State:
        left = leaving == index
        p = point - world.held(row[:3], row[3])
        half = p.dot(to_light)
        side = p.square() - Ball(row[4], row[4] * UNIT)
        squared = half.squared() - dd * side
        ahead, over = half.below(0), (half + dd).beyond(0)
        outside, inside = side.beyond(0), side.below(0)
        away = half.beyond(0) | (half + dd).below(0)
        light_outside, light_inside = row[8] > 0, row[8] < 0
        near_light = (side - dd).below(0)
        hides = dr.select(
            light_outside,
            inside | (ahead & over & squared.beyond(0)),
            outside & (light_inside | near_light),
        )
        clear = dr.select(
            light_outside,
            squared.below(0) | (outside & away),
            inside | (~light_inside & (side - dd).beyond(0)),
        )
        return dark | (hides & ~left), open_ | ~(hides | clear | left)

    def meet_plane(index: Number, row: list[Number], dark: Mask, open_: Mask) -> State:
        aside = (leaving == index) | (row[8] == 0)
        side = Ball(row[4], row[5]) - point.dot(Arrow(world.Vector(*row[:3]), row[3], world.Float(1 + STRAIGHT)))
        toward, behind = side.beyond(0), side.below(0)  # the plane lies ahead of the point, along its normal
        hides = ~aside & dr.select(row[8] > 0, toward, behind)
        clear = aside | dr.select(row[8] > 0, behind, toward)
        return dark | hides, open_ | ~(hides | clear)

    start = (world.Mask(False), world.Mask(False))
    going = lambda dark, open_: active & ~dark  # noqa: E731
    found = world.fold(0, world.spheres, meet_sphere, start, going)
    dark, open_ = world.fold(world.spheres, world.surfaces, meet_plane, found, going)
    return dark, ~dark & ~open_
