"""The tracer: a scene and a model become a picture, in one Dr.Jit kernel.

Surfaces are one numbered list, spheres before planes. Up to `UNROLLED` of them the kernel is straight code over uniform
values, one kernel for each pair of counts; beyond that it loops over the surfaces, one kernel for every scene.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import chain
from typing import Any

import drjit as dr
import numpy as np
from numpy.typing import DTypeLike, NDArray

from reference.device import Types, array_types
from reference.errors import InputError
from reference.model import DOCUMENT, Mask, Model, Number, Vector, Window
from reference.scene import EYE, LARGEST_DEPTH, LARGEST_SIDE, LIGHT, Plane, Scene, Sphere, holds_light

UNROLLED = 16  # surfaces; beyond this, compile time outweighs what straight code gains
BAND = 1 << 22  # pixels a kernel launch, which bounds the memory of large pictures
MATERIAL = 8  # numbers in a row of materials
NOTHING = 0xFFFFFFFF  # the index of no surface
LARGEST_NUMBER = {"double": 1e100, "single": 1e12}  # of a coordinate: products of several must stay finite

State = tuple[Number, ...]


def render(
    scene: Scene,
    model: Model = DOCUMENT,
    *,
    width: int = 1000,
    height: int = 1000,
    depth: int = 3,
    precision: str = "double",
    device: str = "auto",
    dtype: DTypeLike = np.float32,
) -> NDArray[Any]:
    """The picture: height x width x 3, linear, in levels (0..255) that are not clamped, of type `dtype`.

    `depth` counts the bounces after the primary hit; `precision` is that of the computation (double or single).
    Raises InputError for a size or depth out of range and DeviceError where Dr.Jit cannot compute.
    """
    picture = np.empty((height, width, 3), dtype)
    top = 0
    for band in render_bands(scene, model, width=width, height=height, depth=depth, precision=precision, device=device):
        picture[top : top + len(band)] = band
        top += len(band)
    return picture


def render_bands(
    scene: Scene,
    model: Model = DOCUMENT,
    *,
    width: int = 1000,
    height: int = 1000,
    depth: int = 3,
    precision: str = "double",
    device: str = "auto",
) -> Iterator[NDArray[Any]]:
    """The picture of `render` from top to bottom, some rows at a time: rows x width x 3."""
    check_request(width, height, depth)
    types = array_types(precision, device)
    _check_magnitudes(scene, precision)
    world = World(scene, model, types)
    limit = dr.opaque(world.Index, depth)
    rows = max(1, BAND // width)
    for top in range(0, height, rows):
        count = min(rows, height - top)
        direction = world.Vector(*model.camera_direction(*pixel_places(world, width, height, top, count)))
        colour = dr.ravel(_radiance(world, direction, limit)).numpy()
        yield np.broadcast_to(colour.reshape(-1, 3), (count * width, 3)).reshape(count, width, 3)  # constant if empty


def check_request(width: int, height: int, depth: int) -> None:
    """Raise InputError for a size or depth out of range."""
    if not (0 < width <= LARGEST_SIDE and 0 < height <= LARGEST_SIDE):
        raise InputError(f"expected a size of 1 to {LARGEST_SIDE} pixels a side, found {width}x{height}")
    if not 0 <= depth <= LARGEST_DEPTH:
        raise InputError(f"expected a depth of 0 to {LARGEST_DEPTH}, found {depth}")


def _check_magnitudes(scene: Scene, precision: str) -> None:
    """Raise InputError for coordinates so large that their squares would overflow unseen."""
    largest = LARGEST_NUMBER[precision]
    coordinates = [value for s in scene.spheres for value in (*s.centre, s.radius)]
    coordinates += [value for p in scene.planes for value in p.point]
    if (found := max(map(abs, coordinates), default=0.0)) > largest:
        raise InputError(f"expected coordinates up to {largest:g} in {precision} precision, found {found:g}")


class Rows:
    """Numbers of each surface on the device, spheres before planes: `width` in `geometry`, 8 in `materials`."""

    def __init__(self, types: Types, spheres: int, geometry: list[State], materials: list[State], width: int) -> None:
        self.Float, self.Index, self.Mask = types.Float, types.Index, types.Mask
        self.Vector, self.Packet = types.Vector3, types.Vector4
        self.spheres, self.surfaces, self.width = spheres, len(geometry), width
        self.geometry, self.materials = self._table(geometry, width), self._table(materials, MATERIAL)
        self.uniform = [[self._uniform(value) for value in row] for row in geometry[: UNROLLED + 1]]
        self.first_plane = dr.opaque(self.Index, spheres)

    def _uniform(self, value: float) -> Number:
        """A number that is an input of the kernel, not a part of its code."""
        return dr.opaque(self.Float, value)

    def _table(self, rows: list[State], width: int) -> Number:
        """All rows in one array; one of zeros where there is none, so that there is something to gather."""
        # Dr.Jit borrows NumPy arrays where they lie, and the kernel would depend on how they are aligned.
        return self.Float(list(chain.from_iterable(rows or [(0.0,) * width])))

    def row(self, index: Number, active: Mask = True) -> list[Number]:
        """The geometry of a surface."""
        return self._gather(self.geometry, self.width // 4, index, active)

    def material(self, index: Number, active: Mask = True) -> list[Number]:
        """The material of a surface."""
        return self._gather(self.materials, MATERIAL // 4, index, active)

    def _gather(self, table: Number, packets: int, index: Number, active: Mask) -> list[Number]:
        """A row, fetched in packets of four."""
        parts = (dr.gather(self.Packet, table, packets * index + part, active) for part in range(packets))
        return [number for packet in parts for number in packet]

    def fold(
        self, first: int, last: int, step: Callable[..., State], state: State, going: Callable[..., Mask]
    ) -> State:
        """Apply `state = step(index, geometry, *state)` to surfaces first..last-1, while rays are `going(*state)`."""
        if self.surfaces <= UNROLLED:
            for index in range(first, last):
                state = step(self.Index(index), self.uniform[index], *state)
            return state

        def body(index: Number, *state: Number) -> State:
            return (index + 1, *step(index, self.row(index), *state))

        start, end = dr.opaque(self.Index, first), dr.opaque(self.Index, last)
        _, *folded = dr.while_loop((start, *state), lambda index, *state: (index < end) & going(*state), body)
        return tuple(folded)


class World(Rows):
    """A scene on the device and the model that reads it."""

    def __init__(self, scene: Scene, model: Model, types: Types) -> None:
        scene = model.surfaces(scene)
        self.model = model
        lit = [holds_light(sphere) for sphere in scene.spheres]
        self.light_on_sphere = any(lit)
        geometry: list[State] = [(*s.centre, s.radius, on, 0, 0, 0) for s, on in zip(scene.spheres, lit, strict=True)]
        geometry += [(*p.point, 0, *p.unit_normal, p.distance_from(LIGHT)) for p in scene.planes]
        super().__init__(types, len(scene.spheres), geometry, materials(scene), width=8)
        self.ambient = self.Vector(*map(self._uniform, scene.ambient))
        self.ambient_coefficient = self._uniform(scene.ambient_coefficient)
        self.light = self.Vector(*LIGHT)


def materials(scene: Scene) -> list[State]:
    """Colour, diffuse and reflection coefficient of each surface."""
    surfaces: tuple[Sphere | Plane, ...] = (*scene.spheres, *scene.planes)
    return [(*s.colour, s.diffuse, s.reflection, 0, 0, 0) for s in surfaces]


def pixel_places(rows: Rows, width: int, height: int, top: int, count: int) -> tuple[Number, ...]:
    """Column and row of each pixel in `count` rows from `top` on, and the picture's width and height."""
    pixel = dr.arange(rows.Index, count * width)
    across, down = dr.opaque(rows.Index, width), dr.opaque(rows.Index, height)
    row = pixel // across
    column = pixel - row * across
    row += dr.opaque(rows.Index, top)
    return tuple(map(rows.Float, (column, row, across, down)))


@dr.syntax
def _radiance(world: World, direction: Vector, limit: Number) -> Vector:
    """The colour that each camera ray brings back, bounce by bounce."""
    colour = world.Vector(0)
    weight = world.Float(1)
    depth = world.Index(0)
    origin = world.Vector(*EYE)
    t, hit = nearest(world, world.model.camera, origin, direction, world.Index(NOTHING), world.Mask(True))
    while hit != NOTHING:
        x, y, z, radius, normal_x, normal_y, normal_z, _ = world.row(hit)
        red, green, blue, diffuse, mirror, _, _, _ = world.material(hit)
        point = dr.fma(direction, t, origin)
        sphere_normal = world.model.sphere_normal(point, world.Vector(x, y, z), radius)
        normal = dr.select(hit < world.first_plane, sphere_normal, world.Vector(normal_x, normal_y, normal_z))

        surface = world.Vector(red, green, blue)
        to_light = world.light - point
        cosine = world.model.cosine(normal, to_light)
        lit = (cosine != 0) & ~blocked(world, point, to_light, hit, cosine != 0)
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
            t, hit = nearest(world, world.model.reflection, origin, direction, leaving, onward)
    return colour


def nearest(
    world: World, window: Window, origin: Vector, d: Vector, leaving: Number, active: Mask
) -> tuple[Number, Number]:
    """Distance and index of the first surface along each ray; of a tie the first listed, NOTHING for a miss."""
    model, dd = world.model, dr.dot(d, d)

    def closer(index: Number, t: Number, counts: Mask, best: Number, hit: Number) -> State:
        counts &= t < best
        return dr.select(counts, t, best), dr.select(counts, index, hit)

    def meet_sphere(index: Number, row: list[Number], best: Number, hit: Number) -> State:
        left = leaving == index
        near, far = model.sphere_distances(origin - world.Vector(*row[:3]), d, dd, row[3], left)
        t = dr.select(window.sphere(near, left), near, far)
        return closer(index, t, window.sphere(t, left), best, hit)

    def meet_plane(index: Number, row: list[Number], best: Number, hit: Number) -> State:
        left, normal = leaving == index, world.Vector(*row[4:7])
        facing = dr.dot(d, normal)
        t = model.plane_distance(world.Vector(*row[:3]) - origin, normal, facing, left)
        return closer(index, t, window.plane(t, facing, left), best, hit)

    miss = (world.Float(dr.inf), world.Index(NOTHING))
    found = world.fold(0, world.spheres, meet_sphere, miss, lambda *_: active)
    t, hit = world.fold(world.spheres, world.surfaces, meet_plane, found, lambda *_: active)
    return t, hit


def blocked(world: World, origin: Vector, d: Vector, leaving: Number, active: Mask) -> Mask:
    """Whether any surface stands between each point and the light, which is at t = 1 along `d`."""
    model, window, dd = world.model, world.model.shadow, dr.dot(d, d)

    def meet_sphere(index: Number, row: list[Number], dark: Mask) -> State:
        left, p = leaving == index, origin - world.Vector(*row[:3])
        near, far = model.sphere_distances(p, d, dd, row[3], left)
        if world.light_on_sphere:  # t = 1 is one root, exactly; the product of both is (p.p - r^2) / d.d
            other = dr.select(left, 0, dr.fma(-row[3], row[3], dr.dot(p, p))) / dd
            near, far = (dr.select(row[4] != 0, other, t) for t in (near, far))
        return (dark | window.sphere(near, left) | window.sphere(far, left),)

    def meet_plane(index: Number, row: list[Number], dark: Mask) -> State:
        left, normal, q = leaving == index, world.Vector(*row[4:7]), world.Vector(*row[:3]) - origin
        facing = dr.dot(q, normal) - row[7]  # d.n, so that t = 1 exactly for a plane that holds the light
        t = model.plane_distance(q, normal, facing, left)
        return (dark | window.plane(t, facing, left),)

    lit = (world.Mask(False),)
    found = world.fold(0, world.spheres, meet_sphere, lit, lambda dark: active & ~dark)
    (dark,) = world.fold(world.spheres, world.surfaces, meet_plane, found, lambda dark: active & ~dark)
    return dark
