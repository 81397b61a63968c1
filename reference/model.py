"""The shading model as a record of small steps. A convention, or a mistake, is the record with a step replaced.

Every step is a function of Dr.Jit arrays (one entry a ray): `Number` a scalar, `Vector` three of them, `Mask` truth
values. Distances t count in units of the ray's direction, which is not normalised for camera and shadow rays.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from typing import Any

import drjit as dr

from reference.scene import LIGHT, SCREEN, SCREEN_DISTANCE, Scene, Triple, merge_coincident

Number = Any
Vector = Any
Mask = Any

SHIFT = 1e-4  # "shifted a little": the document's smallest distance for shadow and reflected rays
GRAZING = 1e-6  # the document's "epsilon": planes with |d.n| up to this are missed
ROUNDING = 1e-15  # what rounding leaves of d.n for a unit direction that is parallel to a plane


@dataclass(frozen=True)
class Window:
    """Which distances count along one kind of ray. `leaving` marks the surface that the ray starts on."""

    sphere: Callable[[Number, Mask], Mask]  # t, leaving
    plane: Callable[[Number, Number, Mask], Mask]  # t, d.n, leaving


@dataclass(frozen=True)
class Model:
    """One reading of the assignment, step by step."""

    name: str
    summary: str
    light: Triple
    surfaces: Callable[[Scene], Scene]
    camera_direction: Callable[[Number, Number, Number, Number], tuple[Number, Number, Number]]
    sphere_distances: Callable[[Vector, Vector, Number, Number, Mask], tuple[Number, Number]]
    plane_arm: Callable[[Vector, Vector], Vector]
    plane_distance: Callable[[Vector, Vector, Number, Mask], Number]
    nearer: Callable[[Number, Number], Mask]
    sphere_normal: Callable[[Vector, Vector, Number], Vector]
    plane_normal: Callable[[Vector, Vector, Vector], Vector]
    camera: Window
    shadow: Window
    reflection: Window
    cosine: Callable[[Vector, Vector], Number]
    ambient: Callable[[Vector, Vector, Number], Vector]
    diffuse: Callable[[Vector, Number, Number], Vector]
    local: Callable[[Vector, Vector, Mask, Number], Vector]
    reflected_origin: Callable[[Vector, Vector], Vector]
    reflected_direction: Callable[[Vector, Vector], Vector]
    reflected_weight: Callable[[Number, Number, Number], Number]


def pixel_direction(column: Number, row: Number, across: Number, down: Number) -> tuple[Number, Number, Number]:
    """From the eye to the centre of a pixel (row 0 on top) of a size: t = 1 lies on the screen."""
    return (column + 0.5) * across - SCREEN, SCREEN - (row + 0.5) * down, SCREEN_DISTANCE


def sphere_distances(p: Vector, d: Vector, dd: Number, radius: Number, leaving: Mask) -> tuple[Number, Number]:
    """Roots of d.d t^2 + 2 p.d t + p.p - r^2, p = origin - centre; NaN for a miss.

    A ray that starts on the sphere has p.p = r^2, so that its roots are exactly 0 and -2 p.d / d.d.
    """
    half = dr.dot(p, d)
    constant = dr.select(leaving, 0, dr.fma(-radius, radius, dr.dot(p, p)))
    root = dr.sqrt(dr.fma(half, half, -dd * constant))
    scale = dr.rcp(dd)
    return (-half - root) * scale, (root - half) * scale


def plane_arm(point: Vector, origin: Vector) -> Vector:
    """From the start of a ray to a point of a plane."""
    return point - origin


def plane_distance(q: Vector, normal: Vector, facing: Number, leaving: Mask) -> Number:
    """q.n / d.n, q = point of the plane - origin, facing = d.n; exactly 0 for a ray that starts on the plane."""
    return dr.select(leaving, 0, dr.dot(q, normal)) / facing


def nearer(t: Number, best: Number) -> Mask:
    """Whether a surface is met before the nearest so far; of equal ones the first listed stays."""
    return t < best


def sphere_normal(point: Vector, centre: Vector, radius: Number) -> Vector:
    """Outward, of unit length."""
    return (point - centre) * dr.rcp(radius)


def plane_normal(point: Vector, place: Vector, normal: Vector) -> Vector:
    """As it is given, of unit length, at any point; `place` is the plane's own point."""
    return normal


def cosine(normal: Vector, to_light: Vector) -> Number:
    """max(0, n.l) with l at unit length."""
    along = dr.dot(normal, to_light) * dr.rcp(dr.norm(to_light))
    return dr.select(along > 0, along, 0)


def ambient(surface: Vector, colour: Vector, coefficient: Number) -> Vector:
    """ambient_colour * ka * surface_colour / 256, in shadow too."""
    return surface * colour * (coefficient / 256)


def diffuse(surface: Vector, coefficient: Number, cosine: Number) -> Vector:
    """surface_colour * kd * cosine, for a point that the light reaches."""
    return surface * (coefficient * cosine)


def local(ambient: Vector, diffuse: Vector, dark: Mask, depth: Number) -> Vector:
    """The colour without reflections, of a point that the light does not reach where `dark`; `depth` counts bounces."""
    return ambient + dr.select(dark, 0, diffuse)


def reflected_direction(d: Vector, normal: Vector) -> Vector:
    """The mirrored direction d - 2 (d.n) n, at unit length."""
    return dr.normalize(mirrored(d, normal))


def mirrored(d: Vector, normal: Vector) -> Vector:
    """The direction d - 2 (d.n) n, as long as d."""
    return dr.fma(normal, -2 * dr.dot(d, normal), d)


def reflected_weight(weight: Number, coefficient: Number, depth: Number) -> Number:
    """How much of the colour found at `depth` (1 for the first bounce) reaches the eye."""
    return weight * coefficient


def beyond(least: float, grazing: float) -> Window:
    """Counts t > least; planes that the ray grazes, |d.n| <= grazing, are missed."""
    return Window(
        sphere=lambda t, leaving: t > least,
        plane=lambda t, facing, leaving: (t > least) & (dr.abs(facing) > grazing),
    )


def before_light(least: float, grazing: float) -> Window:
    """Counts 1 > t > least: what blocks the light, which is at t = 1."""
    return Window(
        sphere=lambda t, leaving: (t > least) & (t < 1),
        plane=lambda t, facing, leaving: (t > least) & (t < 1) & (dr.abs(facing) > grazing),
    )


DOCUMENT = Model(
    name="document",
    summary="the assignment's text, literally",
    light=LIGHT,
    surfaces=merge_coincident,
    camera_direction=pixel_direction,
    sphere_distances=sphere_distances,
    plane_arm=plane_arm,
    plane_distance=plane_distance,
    nearer=nearer,
    sphere_normal=sphere_normal,
    plane_normal=plane_normal,
    camera=beyond(1, GRAZING),
    shadow=before_light(SHIFT, GRAZING),
    reflection=beyond(SHIFT, GRAZING),
    cosine=cosine,
    ambient=ambient,
    diffuse=diffuse,
    local=local,
    reflected_origin=lambda point, normal: point,
    reflected_direction=reflected_direction,
    reflected_weight=reflected_weight,
)

EXACT = replace(
    DOCUMENT,
    name="exact",
    summary="no epsilons beyond rounding: only the surface that a ray leaves is excluded, symbolically",
    camera=beyond(1, 100 * ROUNDING),  # the camera's directions are about 100 long
    shadow=before_light(0, 0),
    reflection=beyond(0, ROUNDING),
)

PUBLISHED_GRAZING = 0.001
PUBLISHED = replace(
    DOCUMENT,
    name="published",
    summary="the public program behind the document's pictures, where it differs from the text",
    surfaces=lambda scene: scene,
    camera=Window(
        sphere=lambda t, leaving: t > 1,
        plane=lambda t, facing, leaving: (t >= 1) & (dr.abs(facing) >= PUBLISHED_GRAZING),
    ),
    shadow=Window(
        sphere=lambda t, leaving: (t > SHIFT) & (t < 1) & ~leaving,
        plane=lambda t, facing, leaving: (t > SHIFT) & (t < 1) & ~leaving & (dr.abs(facing) >= PUBLISHED_GRAZING),
    ),
    reflection=Window(
        sphere=lambda t, leaving: (t > SHIFT) & ~leaving,
        plane=lambda t, facing, leaving: (t >= SHIFT) & ~leaving & (dr.abs(facing) >= PUBLISHED_GRAZING),
    ),
    reflected_origin=lambda point, normal: dr.fma(normal, SHIFT, point),
    reflected_weight=lambda weight, coefficient, depth: weight * coefficient / depth,
)

CONVENTIONS = {model.name: model for model in (DOCUMENT, PUBLISHED, EXACT)}


def is_convention(model: Model) -> bool:
    """Whether this is one of the conventions, wherever the camera's rays go: what searches and proofs are about."""
    steps = [field.name for field in fields(Model) if field.name not in ("name", "summary", "camera_direction")]
    return any(all(getattr(model, step) is getattr(known, step) for step in steps) for known in CONVENTIONS.values())
