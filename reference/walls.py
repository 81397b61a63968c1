"""The colours where planes are all that rays meet, in single precision: no sphere is looked for, no shadow, no error.

`reference/beams.py` says where that is so, and how far off the colours are at most.
"""

from __future__ import annotations

import drjit as dr

from reference.device import Types
from reference.model import Model, Number, Vector
from reference.scene import EYE, LIGHT, Scene
from reference.search import ambient_light, distance, toward_eye
from reference.tables import NOTHING, Rows, State


class Walls(Rows):
    """The planes of a scene whose light is on the eye's side of all of them.

    A row: unit normal toward the eye, how far the plane is behind the eye, colour, how far it is behind the light, as
    the diffuse light sees it, reflection coefficient.
    """

    def __init__(self, scene: Scene, model: Model, types: Types) -> None:
        rows: list[State] = []
        for plane in scene.planes:
            behind = -distance(plane, LIGHT)  # below zero where the normal points away: the light is not seen then
            rows.append((*toward_eye(plane), *plane.colour, plane.diffuse * max(0, behind), plane.reflection, 0, 0, 0))
        super().__init__(types, 0, rows, 12)
        self.model = model
        self.ambient = self.Vector(*map(self.uniform, ambient_light(scene)))
        self.light = self.Vector(*LIGHT)


@dr.syntax
def radiance(walls: Walls, camera: Vector, limit: Number) -> Vector:
    """The colour that each camera ray brings back, bounce by bounce."""
    colour, origin = walls.Vector(0), walls.Vector(*EYE)
    direction = dr.normalize(camera)
    weight, depth = walls.Float(1), walls.Index(0)
    hit, t, slope = _nearest(walls, origin, direction)
    while hit != NOTHING:
        x, y, z, _, red, green, blue, diffuse, mirror, *_ = walls.row(hit)
        normal, point = walls.Vector(x, y, z), dr.fma(direction, t, origin)
        # n.l is how far the plane is behind the light over how far the light is.
        light = diffuse * dr.rcp(dr.norm(walls.light - point))
        colour = dr.fma(walls.Vector(red, green, blue) * (walls.ambient + light), weight, colour)
        depth += 1
        weight = walls.model.reflected_weight(weight, mirror, depth)
        origin = walls.model.reflected_origin(point, normal)
        direction = dr.fma(normal, 2 * slope, direction)
        hit = walls.Index(NOTHING)
        if (depth <= limit) & (weight != 0):
            hit, t, slope = _nearest(walls, origin, direction)
    return colour


def _nearest(walls: Walls, origin: Vector, d: Vector) -> State:
    """Index of the first plane along each ray, its distance, and how steeply the ray meets it, -d.n."""

    def meet(index: Number, row: list[Number], hit: Number, height: Number, slope: Number) -> State:
        normal = walls.Vector(*row[:3])
        facing, above = -dr.dot(normal, d), dr.dot(normal, origin) + row[3]
        closer = (facing > 0) & (above * slope < height * facing)  # distances are height / slope
        return dr.select(closer, index, hit), dr.select(closer, above, height), dr.select(closer, facing, slope)

    nothing = walls.Index(NOTHING), walls.Float(1), walls.Float(0)
    hit, height, slope = walls.fold(0, walls.surfaces, meet, nothing, lambda *_: True)
    return hit, height * dr.rcp(slope), slope
