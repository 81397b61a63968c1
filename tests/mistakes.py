"""Mistakes that people make in this assignment, most of which its four examples hide: the picture that each one makes.

A mistake is the document's model with a step replaced. What no step says is worked out from pictures of that model.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise
from math import hypot
from typing import Any

import drjit as dr
import numpy as np
from numpy.typing import NDArray

from reference.image import quantise
from reference.model import (
    DOCUMENT,
    GRAZING,
    SHIFT,
    Mask,
    Model,
    Number,
    Window,
    before_light,
    beyond,
    pixel_direction,
    sphere_distances,
)
from reference.scene import Plane, Scene, Sphere, Triple, merge_coincident
from reference.tracer import render

Levels = NDArray[Any]
Picture = NDArray[np.uint8]

SIDE = 200  # pixels
DEPTH = 3  # bounces that are followed
GREY = 128


@dataclass(frozen=True)
class Mistake:
    """One mistake; `draw` makes the picture of a scene that a tracer with this mistake alone would make."""

    summary: str
    draw: Callable[[Scene], Picture]
    rounding: bool = False  # changes no more than one level


def levels(scene: Scene, model: Model = DOCUMENT, depth: int = DEPTH) -> Levels:
    return render(scene, model, width=SIDE, height=SIDE, depth=depth, dtype=float)


@cache
def right(scene: Scene) -> Picture:
    return quantise(levels(scene))


@cache
def share(scene: Scene, mistake: Mistake) -> float:
    """The share of pixels that are off by more than 8 levels; by any, where the mistake is one of rounding."""
    error = np.abs(right(scene).astype(int) - mistake.draw(scene)).max(axis=-1)
    return float(np.mean(error > (0 if mistake.rounding else 8)))


def replacing(summary: str, *, depth: int = DEPTH, rounding: bool = False, **steps: Any) -> Mistake:
    """The mistake of a model that is the document's but for these steps."""
    model = replace(DOCUMENT, **steps)
    return Mistake(summary, lambda scene: quantise(levels(scene, model, depth)), rounding)


def unit_direction(*pixel: Number) -> tuple[Number, Number, Number]:
    x, y, z = pixel_direction(*pixel)
    scale = dr.rsqrt(x * x + y * y + z * z)
    return x * scale, y * scale, z * scale


def near_root(*ray: Any) -> tuple[Number, Number]:
    near, far = sphere_distances(*ray)
    return near, far * dr.nan


def two_roots(*ray: Any) -> tuple[Number, Number]:
    near, far = sphere_distances(*ray)
    return dr.select(near < far, near, dr.nan), dr.select(near < far, far, dr.nan)


def never(t: Number, *_: Any) -> Mask:
    return t < -dr.inf


def facing_only(window: Window) -> Window:
    return replace(window, plane=lambda t, facing, leaving: window.plane(t, facing, leaving) & (facing < 0))


class RawPlane(Plane):
    """A plane whose normal is used as it is written."""

    __slots__ = ()

    @property
    def unit_normal(self) -> Triple:
        return self.normal

    def distance_from(self, origin: Triple) -> float:
        return super().distance_from(origin) * hypot(*self.normal)


def raw_normals(scene: Scene) -> Scene:
    planes = merge_coincident(scene).planes
    raw = [RawPlane(plane.colour, plane.point, plane.normal, plane.diffuse, plane.reflection) for plane in planes]
    return replace(merge_coincident(scene), planes=tuple(raw))


def last_listed_first(scene: Scene) -> Scene:
    return merge_coincident(replace(scene, spheres=scene.spheres[::-1], planes=scene.planes[::-1]))


def painted(scene: Scene, colour: Callable[[Sphere | Plane], Triple]) -> Scene:
    return replace(
        scene,
        spheres=tuple(replace(sphere, colour=colour(sphere)) for sphere in scene.spheres),
        planes=tuple(replace(plane, colour=colour(plane)) for plane in scene.planes),
    )


def tinted(scene: Scene) -> Scene:
    """The scene in the colours that it has in its ambient light."""

    def colour(surface: Sphere | Plane) -> Triple:
        red, green, blue = (a * b / 256 for a, b in zip(surface.colour, scene.ambient, strict=True))
        return red, green, blue

    return painted(merge_coincident(scene), colour)


# The colour of a surface is what it sends out, whatever the light.
SHINING = replace(DOCUMENT, ambient=lambda surface, *_: surface, diffuse=lambda surface, *_: surface * 0)


def bounces(scene: Scene, model: Model) -> list[Levels]:
    """What the camera's ray and each bounce after it add to the picture."""
    upto = [levels(scene, model, depth) for depth in range(DEPTH + 1)]
    return [upto[0], *(more - less for less, more in pairwise(upto))]


def clamped_at_each_bounce(scene: Scene) -> Picture:
    """A bounce reaches the eye with a weight, and so does the most that a bounce can be, 255."""
    added = bounces(scene, DOCUMENT)
    most = bounces(painted(scene, lambda _: (255, 255, 255)), SHINING)
    seen = np.zeros_like(added[0])
    for one, limit in zip(reversed(added), reversed(most), strict=True):
        seen = np.minimum(one + seen, limit)
    return quantise(seen)


def grey_at_the_limit(scene: Scene) -> Picture:
    """The surfaces met at the limit reflect grey: they send out grey times their coefficient, besides their own."""
    reflecting = painted(scene, lambda surface: (GREY * surface.reflection,) * 3)
    return quantise(levels(scene) + bounces(reflecting, SHINING)[DEPTH])


def wrapped(scene: Scene) -> Picture:
    return np.floor(levels(scene)).astype(np.int64).astype(np.uint8)


def rounded(scene: Scene) -> Picture:
    return quantise(np.rint(levels(scene)))


CAMERA, SHADOW, REFLECTION = DOCUMENT.camera, DOCUMENT.shadow, DOCUMENT.reflection

# Letter and number are those of the project's list of classic mistakes; the mistakes named by a word are not in it.
MISTAKES = {
    "C8": replacing(
        "spheres at t < 0 are seen",
        camera=replace(CAMERA, sphere=lambda t, leaving: (t < 0) | CAMERA.sphere(t, leaving)),
    ),
    "C9": replacing("no near cut: the camera sees from t > 0", camera=beyond(SHIFT, GRAZING)),
    "C10": replacing("camera directions have unit length, the near cut is still at 1", camera_direction=unit_direction),
    "I4": replacing("hits from inside a sphere are ignored", sphere_distances=near_root),
    "P4": replacing(
        "planes are not met from the back",
        camera=facing_only(CAMERA),
        shadow=facing_only(SHADOW),
        reflection=facing_only(REFLECTION),
    ),
    "P5": replacing("normals of planes are not normalised", surfaces=raw_normals),
    "S3": replacing("what is beyond the light casts shadows: no t < 1", shadow=beyond(SHIFT, GRAZING)),
    "S5": replacing("shadow rays start far too late: t > 0.01", shadow=before_light(0.01, GRAZING)),
    "S7": replacing("planes cast no shadow", shadow=replace(SHADOW, plane=never)),
    "L8": replacing(
        "the ambient colour tints the diffuse term",
        surfaces=tinted,
        ambient=lambda surface, _, coefficient: surface * coefficient,
    ),
    "A1": replacing(
        "ambient / 255 instead of / 256",
        ambient=lambda surface, colour, coefficient: surface * colour * (coefficient / 255),
        rounding=True,
    ),
    "R5": replacing("the near cut t > 1 holds for reflected rays too", reflection=beyond(1, GRAZING)),
    "R7": replacing(
        "reflected light is divided by the depth",
        reflected_weight=lambda weight, coefficient, depth: weight * coefficient / depth,
    ),
    "R12/0": replacing("no reflection", depth=0),
    "R12/1": replacing("one bounce instead of three", depth=1),
    "R12/2": replacing("two bounces instead of three", depth=2),
    "R13": Mistake("the depth limit returns grey", grey_at_the_limit),
    "Q1": Mistake("levels above 255 wrap around", wrapped),
    "Q2": Mistake("levels are clamped at each bounce", clamped_at_each_bounce),
    "Q3": Mistake("levels are rounded instead of truncated", rounded, rounding=True),
    "tie": replacing("of two surfaces at the same distance the last listed wins", surfaces=last_listed_first),
    "touch": replacing("a ray that touches a sphere in one point misses it", sphere_distances=two_roots),
    "grazing": replacing("the camera misses planes where d.n is less than 1", camera=beyond(1, 1)),
    "far": replacing(
        "planes at t > 100000 are not seen",
        camera=replace(CAMERA, plane=lambda t, facing, leaving: (t < 1e5) & CAMERA.plane(t, facing, leaving)),
    ),
}
