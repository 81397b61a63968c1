"""A scene on the device, and the colours that rays bring back from it, step by step as the model says."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import drjit as dr
import numpy as np
from numpy.typing import NDArray

from reference.acceleration import ROUNDING, Tree
from reference.device import Types
from reference.errors import InputError
from reference.intersection import Ray, blocked, nearest
from reference.model import Model, Number, Vector, is_convention
from reference.scene import EYE, LIGHT, SCREEN, Scene, holds_light
from reference.tables import (
    MATERIAL,
    NOTHING,
    PIXELS,
    UNROLLED,
    Path,
    Rows,
    column,
    geometry,
    pixel_places,
    shading,
    tile_corners,
    tile_places,
    tiles_across,
    upload,
)

FARTHER = 1 + 2.0**-20  # so that a rounded distance is no nearer
LARGEST = {"double": 1e100, "single": 1e12}  # of a coordinate: products of several must stay finite


@dataclass(frozen=True)
class View:
    """The size of a picture in pixels, and how many bounces follow the primary hit."""

    width: int
    height: int
    depth: int


class World(Rows):
    """A scene on the device and the model that reads it.

    A sphere's row: centre, radius, whether the light lies on it, when it is listed. A plane's: point, unit normal, and
    last how far it is from the light along that.
    """

    def __init__(self, scene: Scene, model: Model, types: Types, single: Types) -> None:
        scene = model.surfaces(scene)
        spheres, materials = geometry(scene), shading(scene)
        _check_magnitudes(scene, spheres, types)
        tree, order = None, np.arange(len(spheres))
        if len(materials) > UNROLLED and is_convention(model) and _largest(spheres) < LARGEST["single"]:
            tree = Tree(single, spheres[:, :3], spheres[:, 3])
            order = tree.order
        self.model, self.scene = model, scene
        lit = _lit(scene, spheres)
        self.light_on_sphere = bool(lit.any())
        planes = [(*p.point, 0, *p.unit_normal, p.distance_from(model.light)) for p in scene.planes]
        rows = np.zeros((len(materials), 8))
        rows[: len(order), :4] = np.take(spheres, order, axis=0)
        rows[: len(order), 4], rows[: len(order), 5] = lit[order], order
        rows[len(order) :] = planes or 0
        super().__init__(types, len(order), rows, 8, tree)
        self.listed = upload(self.Index, order.astype(np.uint32)) if tree else None
        listed = np.append(order, np.arange(len(order), len(materials)))
        self.materials = Rows(types, len(order), np.take(materials, listed, axis=0), MATERIAL)
        self.ambient = self.Vector(*map(self.uniform, scene.ambient))
        self.ambient_coefficient = self.uniform(scene.ambient_coefficient)
        self.light = self.Vector(*map(self.uniform, model.light))

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
        start = dr.opaque(self.Index, top)
        if self.tree is None:
            pixel = dr.arange(self.Index, count * view.width)
            return dr.ravel(self.colours(view, start, *pixel_places(self, view.width, pixel)))
        inner = dr.arange(self.Index, tiles_across(view.width) * tiles_across(count) * PIXELS)
        column, row = tile_places(tile_corners(self, view.width, inner // PIXELS), inner % PIXELS)
        picture = dr.empty(self.Float, 3 * count * view.width)
        inside = (column < dr.opaque(self.Index, view.width)) & (row < dr.opaque(self.Index, count))
        pixel = dr.fma(row, dr.opaque(self.Index, view.width), column)
        dr.scatter(picture, self.colours(view, start, column, row), pixel, inside)
        return picture

    def colours(self, view: View, top: Number, column: Number, row: Number) -> Vector:
        """The colours of some pixels, whose rows are counted from row `top` on."""
        colour = _radiance(self, self.directions(view, top, column, row), dr.opaque(self.Index, view.depth))
        return colour + dr.zeros(self.Vector, dr.width(column))  # one for each, be they all the same

    def directions(self, view: View, top: Number, column: Number, row: Number) -> Vector:
        """Directions of the camera's rays, not of unit length."""
        size = (dr.opaque(self.Float, 2 * SCREEN / side) for side in (view.width, view.height))
        return self.Vector(*self.model.camera_direction(self.Float(column), self.Float(row + top), *size))


def _check_magnitudes(scene: Scene, spheres: NDArray[np.float64], types: Types) -> None:
    """Raise InputError for coordinates so large that their squares would overflow unseen."""
    precision = "double" if types.Float is types.Double else "single"
    found = max(_largest(spheres), _largest(column(scene.planes, "point", 3)))
    if found > LARGEST[precision]:
        raise InputError(f"expected coordinates up to {LARGEST[precision]:g} in {precision} precision, found {found:g}")


def _largest(numbers: NDArray[np.float64]) -> float:
    """The largest magnitude."""
    return float(max(numbers.max(initial=0), -numbers.min(initial=0)))


def _lit(scene: Scene, spheres: NDArray[np.float64]) -> NDArray[np.bool_]:
    """On which spheres the light lies."""
    lit: NDArray[np.bool_] = np.isclose(np.linalg.norm(spheres[:, :3] - LIGHT, axis=1), spheres[:, 3])
    for place in np.flatnonzero(lit):
        lit[place] = holds_light(scene.spheres[place])
    return lit


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
        flat = world.model.plane_normal(point, world.Vector(x, y, z), world.Vector(normal_x, normal_y, normal_z))
        normal = dr.select(hit < world.first_plane, sphere_normal, flat)

        surface = world.Vector(red, green, blue)
        to_light = world.light - point
        cosine = world.model.cosine(normal, to_light)
        shadow = Ray(point, to_light, dr.dot(to_light, to_light), hit)
        lit = (cosine != 0) & ~blocked(world, shadow, cosine != 0)
        ambient = world.model.ambient(surface, world.ambient, world.ambient_coefficient)
        local = world.model.local(ambient, world.model.diffuse(surface, diffuse, cosine), ~lit, depth)
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
