"""Steps of the model as people get them wrong, and pictures that no step alone makes. `mistakes.py` names them.

Steps are functions of Dr.Jit arrays, as in `reference/model.py`. Pictures are height x width x 3, in levels.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from math import hypot
from typing import Any

import drjit as dr
import numpy as np
from numpy.typing import NDArray

from reference.model import DOCUMENT, Mask, Model, Number, Vector, Window, mirrored, pixel_direction, sphere_distances
from reference.scene import LIGHT, SCREEN, SCREEN_DISTANCE, Plane, Scene, Sphere, Triple, merge_coincident
from reference.tracer import render
from reference.world import View

Levels = NDArray[Any]
GREY = 128.0
TINY = 1e-30  # a cosine that is not 0, so that shadows are looked for, and adds nothing
FAR = 1e9  # radius of a sphere around everything
USUAL = 700.0  # how far the light is, or so


def draw(scene: Scene, model: Model, view: View) -> Levels:
    """The picture of a model, in double precision, not clamped: float32."""
    return render(scene, model, width=view.width, height=view.height, depth=view.depth, precision="double")


def opaque(like: Number, value: float) -> Number:
    """A number that is no part of the kernel's code."""
    return dr.opaque(type(like), value)


# Where camera rays go


def seen_through(view: Callable[..., tuple[Number, Number]]) -> Callable[..., tuple[Number, Number, Number]]:
    """Camera rays whose x and y are made of the right ones."""

    def direction(column: Number, row: Number, across: Number, down: Number) -> tuple[Number, Number, Number]:
        x, y, z = pixel_direction(column, row, across, down)
        return (*view(x, y), z)

    return direction


def transposed(column: Number, row: Number, across: Number, down: Number) -> tuple[Number, Number, Number]:
    return pixel_direction(row, column, down, across)


def corners(column: Number, row: Number, across: Number, down: Number) -> tuple[Number, Number, Number]:
    return pixel_direction(column - 0.5, row + 0.5, across, down)


def both_ends(column: Number, row: Number, across: Number, down: Number) -> tuple[Number, Number, Number]:
    """np.linspace(-50, 50, n): the first and last pixel are on the screen's edges."""
    pitch, fall = (2 * SCREEN / (2 * SCREEN * dr.rcp(step) - 1) for step in (across, down))
    return column * pitch - SCREEN, SCREEN - row * fall, SCREEN_DISTANCE


def a_row_off(column: Number, row: Number, across: Number, down: Number) -> tuple[Number, Number, Number]:
    return pixel_direction(column, row - 1, across, down)


def of_unit_length(column: Number, row: Number, across: Number, down: Number) -> tuple[Number, Number, Number]:
    x, y, z = pixel_direction(column, row, across, down)
    scale = dr.rsqrt(x * x + y * y + z * z)
    return x * scale, y * scale, z * scale


def zoomed(width: float) -> Callable[..., tuple[Number, Number, Number]]:
    """The screen `width` times as wide and high."""
    return seen_through(lambda x, y: (x * opaque(x, width), y * opaque(y, width)))


# What rays meet


def roots(change: Callable[[Number, Number, Number], tuple[Number, Number]]) -> Callable[..., tuple[Number, Number]]:
    """Distances of a sphere that are made of the right ones and d.d."""

    def distances(p: Vector, d: Vector, dd: Number, radius: Number, leaving: Mask) -> tuple[Number, Number]:
        return change(*sphere_distances(p, d, dd, radius, leaving), dd)

    return distances


def sum_of_squares(p: Vector, d: Vector, dd: Number, radius: Number, leaving: Mask) -> tuple[Number, Number]:
    """The document's misprint: p.p + r^2."""
    half = dr.dot(p, d)
    root = dr.sqrt(dr.fma(half, half, -dd * dr.fma(radius, radius, dr.dot(p, p))))
    return (-half - root) / dd, (root - half) / dd


def behind_first(near: Number, far: Number, dd: Number) -> tuple[Number, Number]:
    return far, far * dr.nan


def never(t: Number, *_: Any) -> Mask:
    return t < -dr.inf


def facing_only(window: Window) -> Window:
    return replace(window, plane=lambda t, facing, leaving: window.plane(t, facing, leaving) & (facing < 0))


def touching(window: Window) -> Window:
    """As without epsilon: the surface that a ray leaves counts, at t = 0."""
    return Window(
        sphere=lambda t, leaving: window.sphere(t, leaving) | (leaving & (t == 0)),
        plane=lambda t, facing, leaving: window.plane(t, facing, leaving) | (leaving & (t == 0)),
    )


def skipping(window: Window) -> Window:
    """The surface that a ray leaves does not count."""
    return Window(
        sphere=lambda t, leaving: window.sphere(t, leaving) & ~leaving,
        plane=lambda t, facing, leaving: window.plane(t, facing, leaving) & ~leaving,
    )


def between(least: float, most: float = 1.0) -> Window:
    """What counts has most > t > least."""
    return Window(
        sphere=lambda t, leaving: (t > opaque(t, least)) & (t < opaque(t, most)),
        plane=lambda t, facing, leaving: (t > opaque(t, least)) & (t < opaque(t, most)),
    )


# The scene as it is read


class RawPlane(Plane):
    """A plane whose normal is used as it is written."""

    __slots__ = ()

    @property
    def unit_normal(self) -> Triple:
        return self.normal

    def distance_from(self, origin: Triple) -> float:
        return Plane.distance_from(self, origin) * hypot(*self.normal)


def raw_normals(scene: Scene) -> Scene:
    merged = merge_coincident(scene)
    planes = [RawPlane(p.colour, p.point, p.normal, p.diffuse, p.reflection, p.lines) for p in merged.planes]
    return replace(merged, planes=tuple(planes))


def each(change: Callable[[Any], Any]) -> Callable[[Scene], Scene]:
    """All surfaces changed, after coincident ones are merged."""

    def changed(scene: Scene) -> Scene:
        merged = merge_coincident(scene)
        return replace(merged, spheres=tuple(map(change, merged.spheres)), planes=tuple(map(change, merged.planes)))

    return changed


def half_as_large(scene: Scene) -> Scene:
    merged = merge_coincident(scene)
    return replace(merged, spheres=tuple(replace(sphere, radius=sphere.radius / 2) for sphere in merged.spheres))


def scaled(surface: Any, share: float) -> Any:
    """A surface of so much of its colour."""
    red, green, blue = surface.colour
    return replace(surface, colour=(red * share, green * share, blue * share))


def tinted(scene: Scene) -> Scene:
    """The scene in the colours that it has in its ambient light."""

    def lit(surface: Sphere | Plane) -> Any:
        red, green, blue = (a * b / 256 for a, b in zip(surface.colour, scene.ambient, strict=True))
        return replace(surface, colour=(red, green, blue))

    return each(lit)(scene)


# Light


def sine_or_cosine(change: Callable[[Number], Number]) -> Callable[[Vector, Vector], Number]:
    """n.l, with l at unit length, and what is made of it."""
    return lambda normal, to_light: change(dr.dot(normal, to_light) * dr.rcp(dr.norm(to_light)))


def at_least(least: float) -> Callable[[Number], Number]:
    return lambda along: dr.select(along > least, along, least)


def raw_cosine(normal: Vector, to_light: Vector) -> Number:
    return at_least(0)(dr.dot(normal, to_light))


def parallel_light(normal: Vector, to_light: Vector) -> Number:
    """The light's place taken for its direction."""
    length = hypot(*LIGHT)
    x, y, z = (value / length for value in LIGHT)
    return at_least(0)(normal.x * x + normal.y * y + normal.z * z)


def fading(reach: float) -> Callable[[Vector, Vector], Number]:
    """Light that falls off with the square of the distance: full at `reach`."""

    def cosine(normal: Vector, to_light: Vector) -> Number:
        squared = dr.squared_norm(to_light)
        return at_least(0)(dr.dot(normal, to_light) * dr.rsqrt(squared)) * (opaque(squared, reach * reach) / squared)

    return cosine


def spotted(point: Vector, place: Vector, normal: Vector) -> Vector:
    """From the plane's own point to where it is met."""
    return dr.normalize(point - place)


# Reflections


def mirrored_wrong_way(d: Vector, normal: Vector) -> Vector:
    return dr.normalize(dr.fma(normal, 2 * dr.dot(d, normal), d))


def mirrored_backward(d: Vector, normal: Vector) -> Vector:
    return dr.normalize(-mirrored(d, normal))


def mirrored_by_component(d: Vector, normal: Vector) -> Vector:
    return dr.normalize(d - 2 * (d * normal) * normal)


# Pictures that no step alone makes: of a model that may have others replaced

# The colour of a surface is what it sends out, whatever the light.
SHINING: dict[str, Any] = {"ambient": lambda surface, *_: surface, "diffuse": lambda surface, *_: surface * 0}
GLOW: dict[str, Any] = SHINING | {"local": DOCUMENT.local}


def painted(scene: Scene, colour: Callable[[Sphere | Plane], Triple]) -> Scene:
    return replace(
        scene,
        spheres=tuple(replace(sphere, colour=colour(sphere)) for sphere in scene.spheres),
        planes=tuple(replace(plane, colour=colour(plane)) for plane in scene.planes),
    )


def bounces(scene: Scene, model: Model, view: View) -> list[Levels]:
    """What the camera's ray and each bounce after it add to the picture."""
    upto = [draw(scene, model, replace(view, depth=depth)) for depth in range(view.depth + 1)]
    return [upto[0], *(more - less for less, more in pairwise(upto))]


def clamped_at_each_bounce(scene: Scene, model: Model, view: View) -> Levels:
    """A bounce reaches the eye with a weight, and so does the most that a bounce can be, 255."""
    added = bounces(scene, model, view)
    most = bounces(painted(scene, lambda _: (255.0, 255.0, 255.0)), replace(model, **GLOW), view)
    seen = np.zeros_like(added[0])
    for one, limit in zip(reversed(added), reversed(most), strict=True):
        seen = np.minimum(one + seen, limit)
    return seen


def grey_at_the_limit(scene: Scene, model: Model, view: View) -> Levels:
    """The surfaces met at the limit reflect grey: they send out grey times their coefficient, besides their own."""
    reflecting = painted(scene, lambda surface: (GREY * surface.reflection,) * 3)
    return draw(scene, model, view) + bounces(reflecting, replace(model, **GLOW), view)[view.depth]


def tinted_reflection(scene: Scene, model: Model, view: View) -> Levels:
    """Each channel is drawn with the coefficients that its tint leaves."""

    def mirror(channel: int) -> Callable[[Any], Any]:
        return lambda surface: replace(surface, reflection=surface.reflection * surface.colour[channel] / 255)

    def read(channel: int) -> Callable[[Scene], Scene]:
        return lambda scene: each(mirror(channel))(model.surfaces(scene))

    channels = [draw(scene, replace(model, surfaces=read(channel)), view) for channel in range(3)]
    return np.stack([picture[:, :, channel] for channel, picture in enumerate(channels)], axis=-1)


def averaged(scene: Scene, model: Model, view: View) -> Levels:
    """Where a mirrored ray meets something, its colour and the surface's own are averaged."""
    added = bounces(scene, model, view)
    glow = bounces(painted(scene, lambda _: (1.0, 1.0, 1.0)), replace(model, **GLOW), view)
    seen = np.zeros_like(added[0])
    for one, further in zip(reversed(added), [np.zeros_like(seen), *reversed(glow[1:])], strict=True):
        seen = np.where(further > 0, 0.5 * (one + seen), one)
    return seen


def missing(scene: Scene, model: Model, view: View) -> Levels:
    """How much of what rays see that meet nothing reaches each pixel: a share."""
    around = Sphere((1.0, 1.0, 1.0), (0.0, 0.0, 0.0), FAR, 0.0, 0.0)
    black = painted(scene, lambda _: (0.0, 0.0, 0.0))
    return draw(replace(black, spheres=(*black.spheres, around)), replace(model, **GLOW), view)


def before(colour: Triple) -> Callable[[Scene, Model, View], Levels]:
    """Rays that meet nothing bring back a colour."""
    return lambda scene, model, view: draw(scene, model, view) + missing(scene, model, view) * np.asarray(colour)


# What becomes of the levels at the end


def wrapped(levels: Levels) -> Levels:
    return np.mod(np.floor(levels), 256)


def brightened(gamma: float) -> Callable[[Levels], Levels]:
    return lambda levels: 255 * (np.clip(levels, 0, 255) / 255) ** (1 / gamma)


def normalised(levels: Levels) -> Levels:
    return levels * (255 / max(float(levels.max(initial=0)), 1e-9))
