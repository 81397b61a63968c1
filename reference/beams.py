"""Which tiles of a picture see planes alone, all along their rays: there, spheres need not be looked for.

All camera rays of a tile are followed at once, as a beam around the ray of its middle. Unit directions that differ by
`spread` lead, a distance t from the eye, to points no more than spread * t apart, and still do when all are mirrored by
the same plane, which is an isometry. So a beam that leaves no doubt which plane it meets, and passes all spheres on its
way and on the light's, remains one. Rays that meet the plane before the middle one does are, until that does, no
farther from where it does than light is looked for.

On the way it is added up how far off `reference/walls.py` may be, by the bounds of `reference/draft.py` for the worst
ray of the beam.
"""

from __future__ import annotations

import drjit as dr

from reference.model import SHIFT, Mask, Number, Vector
from reference.scene import EYE, LIGHT
from reference.search import CAMERA_TURN, CLOSE, GRAZED, ROUNDOFF, Search
from reference.tables import NOTHING, State
from reference.walls import Walls

LOST = 2.0**-16  # of what is in play: many times what following a beam in single precision may lose


class Beam:
    """Rays around a middle one, from `origin` in unit direction `d`: at a distance t, up to `wide + spread * t` off."""

    def __init__(self, origin: Vector, d: Vector, wide: Number, spread: Number) -> None:
        self.origin, self.d, self.wide, self.spread = origin, d, wide, spread


@dr.syntax
def plain(search: Search, walls: Walls, middle: Vector, spread: Number, limit: Number) -> tuple[Mask, Number]:
    """Whether all rays whose unit directions are up to `spread` from that of `middle` meet the same planes, in the
    light, and no spheres; and how far off the colour of such a ray may be in single precision.
    """
    rounding = dr.fma(search.Float(limit), 2, 18) * ROUNDOFF
    origin, d = search.Vector(*EYE), dr.normalize(middle)
    wide, error = search.size * LOST, search.Float(0)
    off, turn = search.Float(0), search.Float(CAMERA_TURN)
    weight, depth = search.Float(1), search.Index(0)
    sure, going = search.Mask(True), search.Mask(True)
    while going:
        beam = Beam(origin, d, wide, spread)
        first, rival, hit = _planes(search, beam)
        met = hit != NOTHING
        x, y, z, height, _, mirror, brightness, _ = search.row(hit, met)
        normal = search.Vector(x, y, z)
        slope = -dr.dot(normal, d)
        least = slope - spread
        above = dr.dot(normal, origin) + height
        last = (above + wide) * dr.rcp(least)
        sure = ~met | ((least > GRAZED) & (first > CLOSE) & (last < rival))
        sure &= ~_touched(search, beam, dr.select(met, last, dr.inf))

        origin = dr.fma(d, above * dr.rcp(slope), origin)
        reach = dr.fma(spread, last, wide) + last - first
        far = dr.abs(origin.x) + dr.abs(origin.y) + dr.abs(origin.z) + 2 * reach
        aside = dr.fma(1.25, dr.fma(turn, last, off), search.coarse) + (last + far) * search.slack
        onto = dr.fma(16, last, dr.fma(6, far, 9 * search.size)) * ROUNDOFF
        shift = dr.fma(aside, dr.rcp(least), onto)
        shaded, length = _shaded(search, origin, reach + shift)
        moved = dr.fma(1.15, shift, aside + onto) * dr.rcp(length - reach)
        error += dr.select(met, dr.abs(weight) * brightness * (moved + rounding), 0)
        sure &= ~met | ~(shaded | (length < 2 * reach))

        depth += 1
        weight = walls.model.reflected_weight(weight, mirror, depth)
        d = dr.fma(normal, 2 * slope, d)
        wide += dr.fma(spread, last, 2 * SHIFT)
        off, turn = aside + 2 * onto, turn + search.bend
        going = sure & met & (depth <= limit) & (weight != 0)
    return sure, error


def _planes(search: Search, beam: Beam) -> tuple[Number, Number, Number]:
    """From where on a beam may meet a plane, from where on it may meet another, and the index of the first."""

    def meet(index: Number, row: list[Number], best: Number, rival: Number, hit: Number) -> State:
        normal = search.Vector(*row[:3])
        closing = beam.spread - dr.dot(normal, beam.d)
        above = dr.dot(normal, beam.origin) + row[3] - beam.wide
        t = dr.select(closing > 0, above * dr.rcp(closing), dr.inf)
        later = dr.select(t < best, best, t)
        rival = dr.select(later < rival, later, rival)
        return dr.select(t < best, t, best), rival, dr.select(t < best, index, hit)

    nothing = search.Float(dr.inf), search.Float(dr.inf), search.Index(NOTHING)
    best, rival, hit = search.fold(search.spheres, search.surfaces, meet, nothing, lambda *_: True)
    return best, rival, hit


def _touched(search: Search, beam: Beam, end: Number) -> Mask:
    """Whether any ray of a beam may meet a sphere before `end`."""
    narrow = 1 - beam.spread * beam.spread

    def meet(index: Number, row: list[Number], touched: Mask) -> State:
        p = search.Vector(*row[:3]) - beam.origin
        along = dr.dot(p, beam.d)
        ahead = dr.select(along > 0, along, 0)
        aside = dr.fma(-ahead, ahead, dr.dot(p, p))
        reach = row[3] + dr.fma(beam.spread, ahead, beam.wide)
        return (touched | ((along - reach < end) & ~(aside * narrow > reach * reach)),)

    (touched,) = search.fold(0, search.spheres, meet, (search.Mask(False),), lambda touched: ~touched)
    return touched


def _shaded(search: Search, point: Vector, reach: Number) -> tuple[Mask, Number]:
    """Whether a sphere may stand between the light and a place up to `reach` from a point, and how far the light is."""
    to_light = search.Vector(*LIGHT) - point
    length = dr.norm(to_light)
    d = to_light * dr.rcp(length)

    def meet(index: Number, row: list[Number], shaded: Mask) -> State:
        p = search.Vector(*row[:3]) - point
        along = dr.dot(p, d)
        within = dr.select(along > 0, dr.select(along < length, along, length), 0)
        aside = dr.fma(within, within - 2 * along, dr.dot(p, p))
        near = row[3] + reach
        return (shaded | ~(aside > near * near),)

    (shaded,) = search.fold(0, search.spheres, meet, (search.Mask(False),), lambda shaded: ~shaded)
    return shaded, length
