"""The ray tree behind one pixel: the model's own steps, applied to plain numbers, with everything that they found.

For the conventions that can be certified, each ray starts afresh from the proven one: no error grows from bounce to
bounce, and at an edge the ray goes where the proof says.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from reference.device import load_drjit
from reference.enclosure import Point
from reference.errors import InputError
from reference.image import quantise
from reference.model import DOCUMENT, EXACT, Model, Window
from reference.proof import Prover
from reference.rules import DOCUMENT_RULES, EXACT_RULES, Rules
from reference.scene import EYE, LIGHT, SCREEN, Plane, Scene, Sphere, Triple, holds_light
from reference.walk import Ray

Surface = Sphere | Plane
LARGEST_PROOF = 5000  # surfaces, so that an answer takes less than a second


@dataclass(frozen=True)
class Crossing:
    """Where a ray's line meets a surface: every t, and those of them that count for this kind of ray."""

    surface: str
    distances: tuple[float, ...]
    counted: tuple[float, ...]


@dataclass(frozen=True)
class Bounce:
    """One ray of the tree and the shading of what it hit. Colours are in levels, before the weight is applied.

    Where the ray hit nothing, all that follows `crossings` is None or empty.
    """

    depth: int  # 0 for the camera's ray
    weight: float  # the share of this ray's colour that reaches the eye
    origin: Triple
    direction: Triple
    crossings: tuple[Crossing, ...]
    hit: str | None = None
    t: float | None = None
    point: Triple | None = None
    normal: Triple | None = None
    ambient: Triple | None = None
    cosine: float | None = None  # max(0, n.l)
    to_light: Triple | None = None
    lit: bool = False  # whether there is a diffuse term
    blockers: tuple[Crossing, ...] = ()
    diffuse: Triple | None = None
    contribution: Triple | None = None  # weight * (ambient + diffuse)


@dataclass(frozen=True)
class Certified:
    """What is proven of a pixel: its colour, or the admissible ones if it is a knife edge (all, if `complete`).

    Levels, not clamped; the first is that of the model's rule for ties.
    """

    proven: bool
    complete: bool
    colours: tuple[Triple, ...]


@dataclass(frozen=True)
class Explanation:
    """A pixel's rays, first to last, and what they add up to.

    `certified` is None for a model that cannot be certified, and for scenes of more than 5000 surfaces.
    """

    convention: str
    column: int
    row: int
    bounces: tuple[Bounce, ...]
    colour: Triple  # levels, not clamped
    bytes: tuple[int, int, int]  # clamped and truncated
    certified: Certified | None


def explain(
    scene: Scene,
    model: Model = DOCUMENT,
    *,
    column: int,
    row: int,
    width: int = 1000,
    height: int = 1000,
    depth: int = 3,
) -> Explanation:
    """Follow the ray through one pixel of a width x height picture, row 0 on top, for up to `depth` bounces.

    Raises InputError for a pixel outside the picture.
    """
    if not (0 <= column < width and 0 <= row < height):
        raise InputError(f"expected a pixel within {width}x{height}, counted from 0, found column {column}, row {row}")
    load_drjit()
    from drjit.scalar import Array3f64 as Vector

    tracer = _Tracer(scene, model, Vector)
    proof = None
    if (rules := _rules(model)) and len(tracer.surfaces) <= LARGEST_PROOF:
        proof = Prover(scene, width=width, height=height, depth=depth).admissible(column, row, rules)
    camera = Vector(*model.camera_direction(float(column), float(row), 2 * SCREEN / width, 2 * SCREEN / height))
    bounces = tuple(tracer.follow(Vector(*EYE), camera, depth, proof.rays if proof else ()))
    shares = [bounce.contribution or (0.0, 0.0, 0.0) for bounce in bounces]
    red, green, blue = (sum(channel) for channel in zip(*shares, strict=True))
    quantised = quantise(np.array([red, green, blue]))
    levels = (int(quantised[0]), int(quantised[1]), int(quantised[2]))
    certified = (
        None
        if proof is None
        else Certified(proof.proven, proof.complete, tuple(colour.value for colour in proof.colours))
    )
    return Explanation(model.name, column, row, bounces, (red, green, blue), levels, certified)


def _rules(model: Model) -> Rules | None:
    """How the model departs from the one that proofs are about, if that is known."""
    return next((rules for known, rules in ((DOCUMENT, DOCUMENT_RULES), (EXACT, EXACT_RULES)) if model is known), None)


class _Tracer:
    """A scene's surfaces by name, spheres before planes, and the model that reads them."""

    def __init__(self, scene: Scene, model: Model, vector: Any) -> None:
        read = model.surfaces(scene)
        self.model, self.scene, self.Vector = model, read, vector
        self.surfaces: list[tuple[str, Surface]] = [
            *((_name("sphere", sphere, scene.spheres), sphere) for sphere in read.spheres),
            *((_name("plane", plane, scene.planes), plane) for plane in read.planes),
        ]

    def follow(self, origin: Any, direction: Any, limit: int, proven: Sequence[Ray]) -> Iterator[Bounce]:
        """Each ray in turn, as far as they are `proven` from the proven one, until one hits nothing or none is left."""
        model, weight, leaving, window = self.model, 1.0, None, self.model.camera
        camera_length = direction @ direction
        for depth in range(limit + 1):
            truth = proven[depth] if depth < len(proven) else None
            if truth and depth:
                origin, direction = self.vector(truth.origin), self.vector(truth.d)
                direction /= math.sqrt(direction @ direction)
            crossings = self.cross(origin, direction, window, leaving)
            ray = Bounce(depth, weight, _triple(origin), _triple(direction), tuple(crossings))
            met = [(crossing.counted[0], place) for place, crossing in enumerate(crossings) if crossing.counted]
            if truth:
                shrunk = math.sqrt(camera_length / (direction @ direction))
                met = [(float(truth.hit.t.mid()) * shrunk, truth.hit.place)] if truth.hit else []
            if not met:
                yield ray
                return
            t, leaving = min(met)
            bounce, point, normal = self.shade(ray, origin, direction, t, leaving, truth)
            yield bounce
            weight = float(model.reflected_weight(weight, self.surfaces[leaving][1].reflection, depth + 1))
            if weight == 0:
                return
            origin, direction = model.reflected_origin(point, normal), model.reflected_direction(direction, normal)
            window = model.reflection

    def vector(self, point: Point) -> Any:
        """A proven point or direction, rounded."""
        return self.Vector(*(float(value.mid()) for value in point))

    def shade(self, ray: Bounce, origin: Any, d: Any, t: float, hit: int, truth: Ray | None) -> tuple[Bounce, Any, Any]:
        """The bounce with its shading, the point and the normal."""
        model, (name, surface) = self.model, self.surfaces[hit]
        point = origin + d * t
        if isinstance(surface, Sphere):
            normal = model.sphere_normal(point, self.Vector(*surface.centre), surface.radius)
        else:
            normal = self.Vector(*surface.unit_normal)
        colour, to_light = self.Vector(*surface.colour), self.Vector(*LIGHT) - point
        ambient = model.ambient(colour, self.Vector(*self.scene.ambient), self.scene.ambient_coefficient)
        cosine = float(model.cosine(normal, to_light))
        crossings = self.cross(point, to_light, model.shadow, hit, shadow=True) if cosine else []
        blockers = tuple(crossing for crossing in crossings if crossing.counted)
        lit = truth.lit if truth and surface.diffuse else bool(cosine) and not blockers
        diffuse = model.diffuse(colour, surface.diffuse, cosine) if lit else self.Vector(0)
        shaded = replace(
            ray,
            hit=name,
            t=t,
            point=_triple(point),
            normal=_triple(normal),
            ambient=_triple(ambient),
            cosine=cosine,
            to_light=_triple(to_light),
            lit=lit,
            blockers=blockers,
            diffuse=_triple(diffuse),
            contribution=_triple((ambient + diffuse) * ray.weight),
        )
        return shaded, point, normal

    def cross(self, origin: Any, d: Any, window: Window, leaving: int | None, shadow: bool = False) -> list[Crossing]:
        """Every surface and where the ray's line meets it, in the scene's order."""
        return [
            self._cross(name, surface, origin, d, window, place == leaving, shadow)
            for place, (name, surface) in enumerate(self.surfaces)
        ]

    def _cross(
        self, name: str, surface: Surface, origin: Any, d: Any, window: Window, left: bool, shadow: bool
    ) -> Crossing:
        """As the tracer does: where the light is on the surface itself, a shadow ray's t = 1 is exact."""
        if isinstance(surface, Sphere):
            p, dd = origin - self.Vector(*surface.centre), d @ d
            roots = [float(t) for t in self.model.sphere_distances(p, d, dd, surface.radius, left)]
            if shadow and holds_light(surface):
                roots = [0.0 if left else (p @ p - surface.radius**2) / dd]
            counted = [t for t in roots if window.sphere(t, left)]
        else:
            normal = self.Vector(*surface.unit_normal)
            q = self.Vector(*surface.point) - origin
            facing = float(q @ normal) - surface.distance_from(LIGHT) if shadow else float(d @ normal)
            roots = [float(self.model.plane_distance(q, normal, facing, left))] if facing else []
            counted = [t for t in roots if window.plane(t, facing, left)]
        return Crossing(name, tuple(filter(math.isfinite, roots)), tuple(filter(math.isfinite, counted)))


def _name(kind: str, surface: Surface, listed: tuple[Surface, ...]) -> str:
    """Where a surface stands in the file, as in `sphere 2, lines 9-13`."""
    number = next((place for place, other in enumerate(listed, 1) if other is surface), 0)
    first, last = surface.lines
    return f"{kind} {number}" + (f", lines {first}-{last}" if first else "")


def _triple(vector: Any) -> Triple:
    x, y, z = vector
    return (float(x), float(y), float(z))
