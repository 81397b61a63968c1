"""The picture in single precision, with a proof for each pixel that it is the one of double precision.

Each ray carries how far its start may be off and by how much it may be turned; each colour, how far off it may be. A
pixel whose rays may meet other surfaces, or whose colour may be off by more than `FAITHFUL`, is in doubt.

A ray that passes e beside its way meets a surface, under the cosine c, at most 2 e / c off: more than e / c, since a
sphere of radius r curves away, but no more than that while 8 e < r c^2. The normal is off by that over r, the mirrored
ray is turned by up to four times as much. A cosine is off by no more than the normal, and than a shift s and a point
at distance n from the surface turn the direction to the light, at distance l: cos s / l + n / l to first order.
"""

from __future__ import annotations

import drjit as dr

from reference.device import Types
from reference.model import DOCUMENT, Mask, Model, Number, Vector, is_convention, mirrored
from reference.scene import EYE, LIGHT, Plane, Scene, Sphere
from reference.search import (
    CAMERA_TURN,
    GRAZED,
    ROUNDING,
    ROUNDOFF,
    Search,
    Sight,
    ambient_light,
    blocked,
    brightness,
    distance,
    is_clear,
    nearest,
    seen,
)
from reference.tables import NOTHING, Rows, State
from reference.world import View, World

FAITHFUL = 0.009  # levels
CERTAIN = 1 + 2.0**-20  # farther by that is farther, whatever distances lose in single precision
BRIGHTEST = 1e30  # levels
STEADY = 2.0**-12  # radians; a ray that may be turned by more is given up


def is_draftable(scene: Scene, model: Model) -> bool:
    """Whether the proofs are about this model, a convention, and this scene: see `is_clear`.

    Nothing may be so bright that it is seen by way of mirrors whose coefficients multiply to less than can be told from
    zero in single precision. Where mirrored rays start beside the surface, normals must be toward the eye, as here.
    """
    if not is_convention(model) or model.camera_direction is not DOCUMENT.camera_direction or not is_clear(scene):
        return False
    if model.reflected_origin is not DOCUMENT.reflected_origin and any(distance(p, EYE) > 0 for p in scene.planes):
        return False
    surfaces: list[Sphere | Plane] = [*scene.spheres, *scene.planes]
    return max((brightness(surface, ambient_light(scene)) for surface in surfaces), default=0.0) < BRIGHTEST


class Draft:
    """A scene on the device in single precision, beside the `world` where it is in double."""

    def __init__(self, world: World, single: Types) -> None:
        self.model, self.world, scene = world.model, world, world.scene
        self.search = Search(scene, single)
        surfaces: tuple[Sphere | Plane, ...] = (*scene.spheres, *scene.planes)
        self.shades = Rows(single, len(scene.spheres), [_shade_row(s) for s in surfaces], 4)
        self.ambient = self.shades.Vector(*map(self.shades.uniform, ambient_light(scene)))
        self.light = self.search.Vector(*LIGHT)

    def colours(self, view: View, top: Number, column: Number, row: Number) -> tuple[Vector, Mask]:
        """The colours of some pixels, whose rows are counted from row `top` on, and which of them are in doubt."""
        camera = self.world.directions(view, top, column, row)
        found: tuple[Vector, Mask] = radiance(self, camera, dr.opaque(self.search.Index, view.depth))
        return found


def _shade_row(surface: Sphere | Plane) -> State:
    """Colour and diffuse coefficient.

    All planes have the light on the eye's side, as `is_clear` says: those whose normal points away are not lit.
    """
    away = isinstance(surface, Plane) and distance(surface, LIGHT) >= 0
    return (*surface.colour, 0 if away else surface.diffuse)


class Landing:
    """Where rays of direction d meet a surface at t, which may be `shift` off, and `onto` beside the surface. Rays
    mirrored there pass up to `off` beside the true ones and are turned by up to `turn`.

    A ray that is mirrored by a plane passes as far beside the true one as before, one mirrored by a sphere up to 3.5
    times as far.
    """

    def __init__(
        self,
        draft: Draft,
        hit: Number,
        met: tuple[Number, Vector, Vector, Number],
        d: Vector,
        mirror: Number,
        most: Number,
    ) -> None:
        self.mirror, self.brightness = mirror, most
        self.hit, (self.t, self.point, self.normal, self.curvature) = hit, met
        self.is_sphere = hit < draft.search.first_plane
        self.direction, self.slope = mirrored(d, self.normal), -dr.dot(d, self.normal)
        self.far = dr.abs(self.point.x) + dr.abs(self.point.y) + dr.abs(self.point.z)
        self.scale = self.far + draft.search.size
        self.spread = dr.select(self.is_sphere, 3.5, 1)
        self.bend = dr.select(self.is_sphere, 12 * ROUNDOFF, draft.search.bend)

    def bound(self, aside: Number, onto: Number, turn: Number) -> None:
        """The errors of rays that pass up to `aside` beside their way and are turned by up to `turn`."""
        self.onto, self.shift = onto, dr.fma(aside, dr.rcp(self.slope), onto)
        self.off = dr.fma(2 * onto, self.slope, self.spread * aside)
        self.turn = dr.fma(2 * self.curvature, self.shift + onto, turn + self.bend)
        clear = (turn < STEADY) & (dr.fma(8 * aside, self.curvature, GRAZED * GRAZED) < self.slope * self.slope)
        self.doubt = ~clear


@dr.syntax
def radiance(draft: Draft, camera: Vector, limit: Number) -> tuple[Vector, Mask]:
    """The colour that each camera ray brings back, and which pixels are in doubt."""
    search = draft.search
    rounding = dr.fma(search.Float(limit), 2, 18) * ROUNDOFF
    first = _look(draft, camera)
    lit = first.hit != NOTHING
    colour, error, reflection = _shade(draft, first, rounding)
    error = dr.select(lit, error, 0)
    depth = search.Index(1)
    weight = dr.select(lit, draft.model.reflected_weight(search.Float(1), reflection, depth), 0)
    colour = dr.select(lit, colour, 0)
    origin = draft.model.reflected_origin(first.point, first.normal)
    direction, off, turn, shift, scale = search.Vector(first.direction), first.off, first.turn, first.shift, first.scale
    while (depth <= limit) & (weight != 0):
        hit, t, rival, doubt = _next(search, origin, direction, off, turn, shift, scale)
        error = dr.select(doubt, dr.inf, error)
        depth += 1
        found = hit != NOTHING
        if found:
            met = _follow(draft, Sight(origin, direction, off, turn, shift, scale), hit, t, rival)
            local, loss, mirror = _shade(draft, met, rounding)
            colour = dr.fma(local, weight, colour)
            error = dr.fma(dr.abs(weight), loss, error)
            weight = draft.model.reflected_weight(weight, mirror, depth)
            origin = draft.model.reflected_origin(met.point, met.normal)
            direction, off, turn, shift, scale = met.direction, met.off, met.turn, met.shift, met.scale
        else:
            weight = search.Float(0)
    return colour, ~(error < FAITHFUL)


def _look(draft: Draft, camera: Vector) -> Landing:
    """Where the camera's rays meet surfaces, corrected once by how far the point is from the surface."""
    search = draft.search
    toward = search.Vector(camera)
    per_length = dr.rcp(dr.norm(toward))
    d = toward * per_length
    hit, near, rival = seen(search, d)
    is_sphere = hit < search.first_plane
    x, y, z, size, curvature, mirror, most, _ = search.row(hit, hit != NOTHING)
    place = search.Vector(x, y, z)
    along, t = dr.dot(place, d), dr.rcp(near)
    centre = dr.select(is_sphere, place, 0)
    q = dr.fma(toward, t * per_length, -centre)
    left = dr.select(is_sphere, 0.5 * dr.fma(size, size, -dr.dot(q, q)), -size - dr.dot(place, q))
    step = left * dr.rcp(dr.select(is_sphere, dr.dot(q, d), along))
    q = dr.fma(d, step, q)
    landing = Landing(
        draft, hit, (t, q + centre, dr.select(is_sphere, q * curvature, place), curvature), d, mirror, most
    )
    aside = dr.fma(step * step, curvature, search.coarse + dr.select(is_sphere, 4 * ROUNDOFF * size, 0))
    aside = dr.fma(landing.far, search.camera_slack, aside)
    landing.bound(aside, landing.far * (2.5 * ROUNDOFF), search.Float(CAMERA_TURN))
    landing.doubt |= ~((t + dr.abs(step) + landing.shift) * CERTAIN * rival < 1)
    return landing


def _next(
    search: Search, origin: Vector, d: Vector, off: Number, turn: Number, shift: Number, scale: Number
) -> tuple[Number, Number, Number, Mask]:
    return nearest(search, Sight(origin, d, off, turn, shift, scale), search.Mask(True))


def _follow(draft: Draft, ray: Sight, hit: Number, t: Number, rival: Number) -> Landing:
    """Where mirrored rays meet surfaces."""
    search = draft.search
    is_sphere = hit < search.first_plane
    x, y, z, size, curvature, mirror, most, _ = search.row(hit, hit != NOTHING)
    point, place = dr.fma(ray.d, t, ray.origin), search.Vector(x, y, z)
    normal = dr.select(is_sphere, (point - place) * curvature, place)
    landing = Landing(draft, hit, (t, point, normal, curvature), ray.d, mirror, most)
    aside = dr.fma(1.25, dr.fma(ray.turn, t, ray.off), search.coarse + dr.select(is_sphere, 8 * ROUNDOFF * size, 0))
    aside = dr.fma(t + landing.far, search.slack, aside)
    onto = dr.fma(16, t, dr.fma(1.2, landing.far, 9 * size)) * ROUNDOFF
    landing.bound(aside, onto, ray.turn)
    landing.doubt |= ~((t + landing.shift) * CERTAIN < rival)
    return landing


def _shade(draft: Draft, at: Landing, rounding: Number) -> tuple[Vector, Number, Number]:
    """The colour sent out, its error as a share of the brightest, infinite where in doubt, and the mirror.

    Ambient and diffuse light as in the model, with their common factor taken out.
    """
    search = draft.search
    red, green, blue, diffuse = draft.shades.row(at.hit, at.hit != NOTHING)
    to_light = draft.light - at.point
    length = dr.norm(to_light)
    nearness = dr.rcp(length)
    d = to_light * nearness
    cosine = dr.dot(at.normal, d)
    facing = cosine > 0
    error = dr.fma(at.scale, ROUNDING, at.shift)
    dark, open_ = blocked(search, at.point, d, length, error, facing)
    light = dr.select(facing & ~dark, diffuse * cosine, 0)
    colour = search.Vector(red, green, blue) * (draft.ambient + light)
    moved = dr.fma(1.15 * dr.abs(cosine), at.shift, at.off + at.onto)
    loss = at.brightness * dr.fma(moved, nearness, dr.fma(at.shift, at.curvature, rounding))
    return colour, dr.select(at.doubt | ~(error < search.room) | (facing & open_), dr.inf, loss), at.mirror
