"""A scene on the device, and the colours that rays bring back from it, step by step as the model says."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import drjit as dr
import numpy as np
from numpy.typing import NDArray

from reference.acceleration import ROUNDING, Tree
from reference.device import Types
from reference.intersection import Ray, blocked, nearest
from reference.model import Model, Number, Vector, is_convention
from reference.scene import EYE, LIGHT, SCREEN, Scene, extent, holds_light
from reference.tables import MATERIAL, NOTHING, UNROLLED, Path, Rows, column, materials, pixel_places

WIDTH = 8  # numbers in a row of geometry
FARTHER = 1 + 2.0**-20  # so that a rounded distance is no nearer
LARGEST_TREE = 1e12  # of a coordinate, which single precision must square


@dataclass(frozen=True)
class View:
    """The size of a picture in pixels, and how many bounces follow the primary hit."""

    width: int
    height: int
    depth: int


class World(Rows):
    """A scene on the device and the model that reads it."""

    def __init__(self, scene: Scene, model: Model, types: Types, single: Types) -> None:
        scene = model.surfaces(scene)
        tree, order = None, np.arange(len(scene.spheres))
        if len(scene.spheres) + len(scene.planes) > UNROLLED and is_convention(model) and extent(scene) < LARGEST_TREE:
            tree = Tree(single, column(scene.spheres, "centre"), column(scene.spheres, "radius").ravel())
            order = tree.order
            scene = replace(scene, spheres=tuple(map(scene.spheres.__getitem__, order)))
        self.model, self.scene = model, scene
        spheres, planes = _sphere_rows(scene, order), _plane_rows(scene)
        self.light_on_sphere = bool(spheres[:, 4].any())
        super().__init__(types, len(spheres), np.concatenate([spheres, planes]), WIDTH, tree)
        self.materials = Rows(types, len(spheres), materials(scene), MATERIAL)
        self.ambient = self.Vector(*map(self.uniform, scene.ambient))
        self.ambient_coefficient = self.uniform(scene.ambient_coefficient)
        self.light = self.Vector(*LIGHT)

    def path(self, ray: Ray, reach: Callable[..., Number]) -> Path | None:
        """What a tree needs to know of rays; `reach` is the t beyond which nothing matters, a function of the state."""
        if self.tree is None:
            return None
        single = self.tree.types
        origin, d = single.Vector3(ray.origin), single.Vector3(ray.d)
        far = dr.abs(origin.x) + dr.abs(origin.y) + dr.abs(origin.z) + self.tree.extent
        return Path(origin, d, far * ROUNDING, lambda *state: single.Float(reach(*state)) * FARTHER)

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


def _sphere_rows(scene: Scene, order: NDArray[np.intp]) -> NDArray[np.float64]:
    """Centre, radius, whether the light lies on the sphere, and when it is listed."""
    rows = np.zeros((len(scene.spheres), WIDTH))
    if len(rows):
        rows[:, :3], rows[:, 3:4] = column(scene.spheres, "centre"), column(scene.spheres, "radius")
        near = np.isclose(np.linalg.norm(rows[:, :3] - LIGHT, axis=1), rows[:, 3])
        for place in np.flatnonzero(near):
            rows[place, 4] = holds_light(scene.spheres[place])
        rows[:, 5] = order
    return rows


def _plane_rows(scene: Scene) -> NDArray[np.float64]:
    """Point, unit normal, how far the plane is from the light along it."""
    return np.array([(*p.point, 0, *p.unit_normal, p.distance_from(LIGHT)) for p in scene.planes]).reshape(-1, WIDTH)


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
