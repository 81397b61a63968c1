"""Where rays meet surfaces, by the model's steps."""

from __future__ import annotations

from typing import TYPE_CHECKING

import drjit as dr

from reference.model import Mask, Number, Vector, Window
from reference.tables import NOTHING, State

if TYPE_CHECKING:
    from reference.world import World


class Ray:
    """A ray as the model counts t: `d` has a length of its own, whose square is `dd`. `leaving` is where it starts."""

    def __init__(self, origin: Vector, d: Vector, dd: Number, leaving: Number) -> None:
        self.origin, self.d, self.dd, self.leaving = origin, d, dd, leaving


def nearest(world: World, window: Window, ray: Ray, active: Mask) -> tuple[Number, Number]:
    """Distance and index of the first surface along each ray; of a tie the first listed, NOTHING for a miss."""

    def meet_sphere(index: Number, row: list[Number], best: Number, hit: Number, listed: Number) -> State:
        t, counts = reach_sphere(world, window, ray, index, row)
        number = dr.gather(world.Index, world.listed, index) if world.tree else index
        counts &= (t < best) | ((t == best) & (number < listed)) if world.tree else world.model.nearer(t, best)
        return dr.select(counts, t, best), dr.select(counts, index, hit), dr.select(counts, number, listed)

    def meet_plane(index: Number, row: list[Number], best: Number, hit: Number, listed: Number) -> State:
        t, counts = reach_plane(world, window, ray, index, row)
        counts &= world.model.nearer(t, best)
        return dr.select(counts, t, best), dr.select(counts, index, hit), dr.select(counts, NOTHING, listed)

    miss = (world.Float(dr.inf), world.Index(NOTHING), world.Index(0))
    path = world.path(ray, lambda best, *_: best)
    t, hit, _ = world.through(meet_sphere, meet_plane, miss, lambda *_: active, path)
    return t, hit


def reach_sphere(world: World, window: Window, ray: Ray, index: Number, row: list[Number]) -> tuple[Number, Mask]:
    """Distance of the first of a sphere's two roots that counts, and whether one does."""
    left = ray.leaving == index
    near, far = world.model.sphere_distances(ray.origin - world.Vector(*row[:3]), ray.d, ray.dd, row[3], left)
    t = dr.select(window.sphere(near, left), near, far)
    return t, window.sphere(t, left)


def reach_plane(world: World, window: Window, ray: Ray, index: Number, row: list[Number]) -> tuple[Number, Mask]:
    """Distance of a plane, and whether it counts."""
    left, normal = ray.leaving == index, world.Vector(*row[4:7])
    facing = dr.dot(ray.d, normal)
    t = world.model.plane_distance(world.model.plane_arm(world.Vector(*row[:3]), ray.origin), normal, facing, left)
    return t, window.plane(t, facing, left)


def blocked(world: World, ray: Ray, active: Mask) -> Mask:
    """Whether any surface stands between the start of each ray and the light, which is at t = 1."""
    model, window = world.model, world.model.shadow

    def meet_sphere(index: Number, row: list[Number], dark: Mask) -> State:
        left, p = ray.leaving == index, ray.origin - world.Vector(*row[:3])
        near, far = model.sphere_distances(p, ray.d, ray.dd, row[3], left)
        if world.light_on_sphere:  # t = 1 is one root, exactly; the product of both is (p.p - r^2) / d.d
            other = dr.select(left, 0, dr.fma(-row[3], row[3], dr.dot(p, p))) / ray.dd
            near, far = (dr.select(row[4] != 0, other, t) for t in (near, far))
        return (dark | window.sphere(near, left) | window.sphere(far, left),)

    def meet_plane(index: Number, row: list[Number], dark: Mask) -> State:
        left, normal, q = ray.leaving == index, world.Vector(*row[4:7]), world.Vector(*row[:3]) - ray.origin
        facing = dr.dot(q, normal) - row[7]  # d.n, so that t = 1 exactly for a plane that holds the light
        t = model.plane_distance(model.plane_arm(world.Vector(*row[:3]), ray.origin), normal, facing, left)
        return (dark | window.plane(t, facing, left),)

    path = world.path(ray, lambda dark: world.Float(1))
    (dark,) = world.through(meet_sphere, meet_plane, (world.Mask(False),), lambda dark: active & ~dark, path)
    return dark
