"""A scene on the device, and the colours that rays bring back from it, step by step as the model says."""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr

from reference.device import Types
from reference.intersection import Ray, blocked, nearest
from reference.model import Model, Number, Vector
from reference.scene import EYE, LIGHT, SCREEN, Scene, holds_light
from reference.tables import MATERIAL, NOTHING, Rows, State, materials, pixel_places


@dataclass(frozen=True)
class View:
    """The size of a picture in pixels, and how many bounces follow the primary hit."""

    width: int
    height: int
    depth: int


class World(Rows):
    """A scene on the device and the model that reads it."""

    def __init__(self, scene: Scene, model: Model, types: Types) -> None:
        scene = model.surfaces(scene)
        self.model, self.scene = model, scene
        lit = [holds_light(sphere) for sphere in scene.spheres]
        self.light_on_sphere = any(lit)
        rows: list[State] = [(*s.centre, s.radius, on, 0, 0, 0) for s, on in zip(scene.spheres, lit, strict=True)]
        rows += [(*p.point, 0, *p.unit_normal, p.distance_from(LIGHT)) for p in scene.planes]
        super().__init__(types, len(scene.spheres), rows, 8)
        self.materials = Rows(types, len(scene.spheres), materials(scene), MATERIAL)
        self.ambient = self.Vector(*map(self.uniform, scene.ambient))
        self.ambient_coefficient = self.uniform(scene.ambient_coefficient)
        self.light = self.Vector(*LIGHT)

    def draw(self, view: View, top: int, count: int) -> Number:
        """Red, green and blue of each pixel in turn, in `count` rows from `top` on."""
        return self.colours(view, top, dr.arange(self.Index, count * view.width))

    def colours(self, view: View, top: int, pixel: Number) -> Number:
        """Red, green and blue of some pixels in turn, which are counted from the start of row `top`."""
        colour = _radiance(self, self.directions(view, top, pixel), dr.opaque(self.Index, view.depth))
        return dr.ravel(colour + dr.zeros(self.Vector, dr.width(pixel)))  # one for each, be they all the same

    def directions(self, view: View, top: int, pixel: Number) -> Vector:
        """Directions of the camera's rays, not of unit length."""
        size = self.uniform(2 * SCREEN / view.width), self.uniform(2 * SCREEN / view.height)
        return self.Vector(*self.model.camera_direction(*pixel_places(self, view.width, top, pixel), *size))


@dr.syntax
def _radiance(world: World, direction: Vector, limit: Number) -> Vector:
    """The colour that each camera ray brings back, bounce by bounce."""
    colour = world.Vector(0)
    weight = world.Float(1)
    depth = world.Index(0)
    origin = world.Vector(*EYE)
    ray = Ray(origin, direction, dr.dot(direction, direction), world.Index(NOTHING))
    t, hit = nearest(world, world.model.camera, ray, world.Mask(True))
    while hit != NOTHING:
        x, y, z, radius, normal_x, normal_y, normal_z, _ = world.row(hit)
        red, green, blue, diffuse, mirror, _, _, _ = world.materials.row(hit)
        point = dr.fma(direction, t, origin)
        sphere_normal = world.model.sphere_normal(point, world.Vector(x, y, z), radius)
        normal = dr.select(hit < world.first_plane, sphere_normal, world.Vector(normal_x, normal_y, normal_z))

        surface = world.Vector(red, green, blue)
        to_light = world.light - point
        cosine = world.model.cosine(normal, to_light)
        shadow = Ray(point, to_light, dr.dot(to_light, to_light), hit)
        lit = (cosine != 0) & ~blocked(world, shadow, cosine != 0)
        local = world.model.ambient(surface, world.ambient, world.ambient_coefficient)
        local += dr.select(lit, world.model.diffuse(surface, diffuse, cosine), 0)
        colour = dr.fma(local, weight, colour)

        depth += 1
        weight = world.model.reflected_weight(weight, mirror, depth)
        origin = world.model.reflected_origin(point, normal)
        direction = world.model.reflected_direction(direction, normal)
        leaving = hit
        hit = world.Index(NOTHING)
        onward = (depth <= limit) & (weight != 0)
        if onward:
            t, hit = nearest(world, world.model.reflection, Ray(origin, direction, 1, leaving), onward)
    return colour
