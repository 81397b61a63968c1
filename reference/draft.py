"""The picture in single precision, with a proof for each pixel that it is the one of double precision.

Each ray carries how far its start may be off and by how much it may be turned; each colour, how far off it may be. A
pixel whose rays may meet other surfaces, or whose colour may be off by more than `FAITHFUL`, is in doubt.

A ray that passes e beside its way meets a surface, under the cosine c, at most 2 e / c off: more than e / c, since a
sphere of radius r curves away, but no more than that while 8 e < r c^2. The normal is off by that over r, the mirrored
ray is turned by up to four times as much, and a cosine is off by no more than the normal and the direction to the light.
"""

from __future__ import annotations

from dataclasses import fields

import drjit as dr

from reference.device import Types
from reference.model import CONVENTIONS, Mask, Model, Number, Vector, mirrored
from reference.scene import EYE, LIGHT, Plane, Scene, Sphere
from reference.search import Search, Sight, blocked, is_clear, nearest
from reference.tables import MATERIAL, NOTHING, Rows, State, shading
from reference.world import View, World

FAITHFUL = 0.009  # levels
CERTAIN = 1 + 2.0**-20  # farther by that is farther, whatever distances lose in single precision
FREE = {"name", "summary", "camera_direction"}  # what a model may change without touching the proofs
STEADY = 2.0**-12  # radians; a ray that may be turned by more is given up
GRAZED = 1.1e-3  # |d.n| up to which some convention misses a plane
ROUNDOFF = 2.0**-24


def is_draftable(scene: Scene, model: Model) -> bool:
    """Whether the proofs are about this model, a convention, and this scene, with nothing before the screen."""
    steps = [field.name for field in fields(Model) if field.name not in FREE]
    return is_clear(scene) and any(
        all(getattr(model, step) is getattr(known, step) for step in steps) for known in CONVENTIONS.values()
    )


class Draft:
    """A scene on the device in single precision, beside the `world` where it is in double."""

    def __init__(self, world: World, single: Types) -> None:
        self.model, self.world, scene = world.model, world, world.scene
        self.search = Search(scene, single)
        surfaces: tuple[Sphere | Plane, ...] = (*scene.spheres, *scene.planes)
        shades = [(*m[:5], _brightness(m, scene), *_rounding(s)) for m, s in zip(shading(scene), surfaces, strict=True)]
        self.shades = Rows(single, len(scene.spheres), shades, MATERIAL)
        self.ambient = self.shades.Vector(*map(self.shades.uniform, scene.ambient))
        self.ambient_coefficient = self.shades.uniform(scene.ambient_coefficient)
        self.light = self.search.Vector(*LIGHT)

    def draw(self, view: View, top: int, count: int) -> Number:
        """Red, green and blue of each pixel in turn, in `count` rows from `top` on."""
        kind = self.search.Index
        pixel = dr.arange(kind, count * view.width)
        colour, doubt = radiance(self, self.world.directions(view, top, pixel), dr.opaque(kind, view.depth))
        picture = dr.ravel(colour + dr.zeros(self.search.Vector, count * view.width))
        dr.eval(picture, doubt)
        again = dr.compress(doubt)
        if len(again):
            right = self.search.Float(self.world.colours(view, top, again))
            place = dr.arange(kind, 3 * len(again))
            dr.scatter(picture, right, 3 * dr.gather(kind, again, place // 3) + place % 3)
        return picture


def _brightness(material: State, scene: Scene) -> float:
    """The most that a surface may send out at once."""
    red, green, blue, diffuse, *_ = map(abs, material)
    ambient = max(map(abs, scene.ambient)) * abs(scene.ambient_coefficient) / 256
    return float(max(red, green, blue) * (diffuse + ambient))


def _rounding(surface: Sphere | Plane) -> tuple[float, float]:
    """Share of the coordinates that rounding may move a hit, and how far it may turn a mirrored ray.

    Less for a plane across an axis, where d.n is one coordinate of d, and the mirrored ray has its sign changed.
    """
    if isinstance(surface, Plane) and surface.unit_normal.count(0) == 2:
        return 1.25 * ROUNDOFF, 0
    return (9 if isinstance(surface, Plane) else 1.25) * ROUNDOFF, 8 * ROUNDOFF


class Landing:
    """Where rays meet a surface. The point may be off by `shift` and the normal by `tilt`; a ray mirrored there passes
    up to `off` beside the true one, and is turned by up to `turn`.
    """

    def __init__(
        self, hit: Number, point: Vector, normal: Vector, errors: tuple[Number, Number, Number, Number], doubt: Mask
    ) -> None:
        self.hit, self.point, self.normal, self.doubt = hit, point, normal, doubt
        self.shift, self.tilt, self.off, self.turn = errors


@dr.syntax
def radiance(draft: Draft, camera: Vector, limit: Number) -> tuple[Vector, Mask]:
    """The colour that each camera ray brings back, and which pixels are in doubt."""
    search = draft.search
    direction = search.Vector(camera)
    direction *= dr.rcp(dr.norm(direction))
    seen = _look(draft, camera, direction)
    colour, error, open_, mirror, bend = _shade(draft, seen, search.Float(0))
    doubt = seen.doubt | open_
    depth = search.Index(1)
    weight = draft.model.reflected_weight(search.Float(1), mirror, depth)
    origin = draft.model.reflected_origin(seen.point, seen.normal)
    direction = mirrored(direction, seen.normal)
    leaving = search.Index(seen.hit)
    off, turn, shift = seen.off, seen.turn + bend, seen.shift
    while (leaving != NOTHING) & (depth <= limit) & (weight != 0) & ~doubt:
        met = _follow(draft, Sight(origin, direction, off, turn, shift, leaving))
        local, loss, open_met, mirror_met, bend_met = _shade(draft, met, search.Float(depth))
        found = met.hit != NOTHING
        colour = dr.select(found, dr.fma(local, weight, colour), colour)
        error = dr.select(found, dr.fma(dr.abs(weight), loss, error), error)
        doubt |= met.doubt | (found & open_met)
        depth += 1
        weight = draft.model.reflected_weight(weight, mirror_met, depth)
        origin = draft.model.reflected_origin(met.point, met.normal)
        direction = mirrored(direction, met.normal)
        leaving = met.hit
        off, turn, shift = met.off, met.turn + bend_met, met.shift
    return dr.select(seen.hit != NOTHING, colour, 0), doubt | ((seen.hit != NOTHING) & ~(error < FAITHFUL))


def _look(draft: Draft, camera: Vector, unit: Vector) -> Landing:
    """Where the camera's rays meet surfaces, worked out in double precision and rounded once."""
    world, search, none = draft.world, draft.search, draft.search.Float(0)
    turn = search.Float(6 * ROUNDOFF)
    sight = Sight(search.Vector(*EYE), unit, none, turn, none, search.Index(NOTHING))
    hit, rival, doubt = nearest(search, sight, search.Mask(True))
    row, is_sphere = world.row(hit), hit < world.first_plane
    place, across = world.Vector(*row[:3]), world.Vector(*row[4:7])
    near, _ = draft.model.sphere_distances(-place, camera, dr.dot(camera, camera), row[3], False)
    far = draft.model.plane_distance(place, across, dr.dot(camera, across), False)
    exact = camera * dr.select(is_sphere, near, far)
    normal = search.Vector(dr.select(is_sphere, draft.model.sphere_normal(exact, place, row[3]), across))
    point = search.Vector(exact)
    shift = (dr.abs(point.x) + dr.abs(point.y) + dr.abs(point.z)) * ROUNDOFF
    clear = (dr.dot(point, unit) * CERTAIN < rival) & (dr.abs(dr.dot(unit, normal)) > GRAZED)
    return Landing(hit, point, normal, (shift, 2 * ROUNDOFF, shift, turn), doubt | ((hit != NOTHING) & ~clear))


def _follow(draft: Draft, ray: Sight) -> Landing:
    """Where mirrored rays meet surfaces."""
    search = draft.search
    hit, rival, doubt = nearest(search, ray, search.Mask(True))
    row, is_sphere = search.row(hit), hit < search.first_plane
    place, size = search.Vector(*row[:3]), dr.abs(row[3])
    p = ray.origin - place
    h = dr.dot(p, ray.d)
    way = dr.fma(ray.d, -h, p)
    near = -h - dr.sqrt(dr.fma(row[3], row[3], -dr.dot(way, way)))
    t = dr.select(is_sphere, near, (row[3] - dr.dot(place, ray.origin)) * dr.rcp(dr.dot(place, ray.d)))
    point = dr.fma(ray.d, t, ray.origin)
    normal = dr.select(is_sphere, draft.model.sphere_normal(point, place, row[3]), place)
    curvature = dr.select(is_sphere, dr.rcp(row[3]), 0)
    along = dr.dot(ray.d, normal)
    slope = dr.select(is_sphere, -along, dr.abs(along))

    slack = draft.shades.row(hit)[6]
    far = dr.abs(point.x) + dr.abs(point.y) + dr.abs(point.z)
    aside = dr.fma(t + far, slack, dr.fma(8 * ROUNDOFF, size, 1.25 * dr.fma(ray.turn, t, ray.off)))
    onto = dr.fma(16, t, dr.fma(1.2, far, 9 * size)) * ROUNDOFF
    shift = dr.fma(aside, dr.rcp(slope), onto)
    tilt = dr.fma(shift, curvature, 2 * ROUNDOFF)
    clear = ((t + shift) * CERTAIN < rival) & (slope > GRAZED) & (8 * aside * curvature < slope * slope)
    doubt |= ~(ray.turn < STEADY) | ((hit != NOTHING) & ~clear)
    errors = shift, tilt, dr.fma(2 * onto, slope, 3.5 * aside), dr.fma(2, dr.fma(onto, curvature, tilt), ray.turn)
    return Landing(hit, point, normal, errors, doubt)


def _shade(draft: Draft, at: Landing, depth: Number) -> tuple[Vector, Number, Mask, Number, Number]:
    """The colour sent out, how far off it may be, where that is in doubt, the mirror and what rounding turns there."""
    search = draft.search
    red, green, blue, diffuse, mirror, brightness, _, bend = draft.shades.row(at.hit)
    surface, to_light = search.Vector(red, green, blue), draft.light - at.point
    distance, cosine = dr.norm(to_light), draft.model.cosine(at.normal, to_light)
    facing = cosine != 0
    dark, open_ = blocked(search, at.point, to_light, distance, at.shift, at.hit, facing)
    diffused = draft.model.diffuse(surface, diffuse, cosine)
    colour = draft.model.ambient(surface, draft.ambient, draft.ambient_coefficient)
    colour += dr.select(facing & ~dark, diffused, 0)
    loss = dr.fma(at.shift, dr.rcp(distance), at.tilt) + dr.fma(depth, 2, 16) * ROUNDOFF
    return colour, brightness * loss, facing & open_, mirror, bend
