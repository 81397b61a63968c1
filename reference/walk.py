"""One ray tree in ball arithmetic, with a choice wherever the balls cannot tell which way a ray goes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from itertools import chain
from typing import NamedTuple

import numpy as np
from flint import arb, fmpq
from numpy.typing import NDArray

from reference.scene import EYE, LIGHT, SCREEN_DISTANCE, Plane, Scene, Sphere, exact

Point = tuple[arb, arb, arb]
Verdict = bool | None  # None: the balls cannot tell

ZERO, ONE = arb(0), arb(1)
FEW = 24  # spheres that are cheaper met one by one
ROUNDING = 1e-14  # more than what a handful of operations in double precision lose, relatively


@dataclass(frozen=True)
class Rules:
    """In what a tracer departs from the `exact` convention; as they are by default, in nothing.

    `shadow`: blockers count from this share of the way to the light. `reflection`: what mirrors show counts from this
    distance. `grazing`: planes with |d.n| up to this are missed. The others are leeway, within which every outcome is
    admissible: `precision`: relative error of each point and direction. `gap`: what is nearer than this to the start
    of a secondary ray may count or not.
    """

    shadow: float = 0.0
    reflection: float = 0.0
    grazing: float = 0.0
    precision: float = 0.0
    gap: float = 0.0

    @property
    def has_leeway(self) -> bool:
        """Whether a pixel's colours are ranges."""
        return bool(self.precision or self.gap)


EXACT_RULES = Rules()
DOCUMENT_RULES = Rules(shadow=1e-4, reflection=1e-4, grazing=1e-6)


class UndecidedError(Exception):
    """The balls are too wide at this precision."""


class UnboundedError(Exception):
    """A mirrored ray starts at an unlimited distance, among surfaces that it does not leave behind."""


class HeldSphere(NamedTuple):
    """A sphere in balls."""

    colour: Point
    diffuse: arb
    reflection: arb
    centre: Point
    radius: arb
    at_eye: arb  # |eye - centre|^2 - r^2
    at_light: arb  # |light - centre|^2 - r^2, exactly 0 if the light is on the sphere


class HeldPlane(NamedTuple):
    """A plane in balls."""

    colour: Point
    diffuse: arb
    reflection: arb
    normal: Point  # as written, of any length
    length: arb
    offset: arb  # point.normal, exactly 0 if the eye is in the plane
    from_light: arb  # (point - light).normal, exactly 0 if the light is in the plane
    is_screen: bool


class Hit(NamedTuple):
    """Where a ray may hit: `sure` if it does, `ruled` if it does by the model's rule for ties."""

    t: arb
    place: int
    sure: bool
    ruled: bool
    bounded: bool = True  # else t is the least that it can be


class _Window(NamedTuple):
    """What counts along a ray: from `least` on, surely from `clear` on; planes with |d.n| up to `missed` do not."""

    least: arb
    clear: arb
    missed: arb


class Ray(NamedTuple):
    """A ray of the tree: what it hit, None for nothing, and whether that has a diffuse term."""

    origin: Point
    d: Point  # as long as the camera's
    hit: Hit | None
    lit: bool


class Tables:
    """A scene as balls of the precision in force."""

    def __init__(self, scene: Scene) -> None:
        self.ambient = _point(exact(value) * exact(scene.ambient_coefficient) / 256 for value in scene.ambient)
        self.light, self.eye = _point(map(exact, LIGHT)), _point(map(exact, EYE))
        self.surfaces: list[HeldSphere | HeldPlane] = [*map(_sphere, scene.spheres), *map(_plane, scene.planes)]
        self.centres = np.array([sphere.centre for sphere in scene.spheres], dtype=float).reshape(-1, 3)
        self.radii = np.array([sphere.radius for sphere in scene.spheres], dtype=float)
        self.planes = range(len(scene.spheres), len(self.surfaces))

    def along(self, origin: Point, d: Point) -> Iterator[tuple[int, HeldSphere | HeldPlane]]:
        """The surfaces that a line may meet, with their places: all but spheres that it surely misses."""
        places: Iterable[int] = range(len(self.surfaces))
        if len(self.radii) > FEW:
            places = chain(np.flatnonzero(~self._misses(origin, d)).tolist(), self.planes)
        return ((place, self.surfaces[place]) for place in places)

    def _misses(self, origin: Point, d: Point) -> NDArray[np.bool_]:
        """For each sphere, whether half^2 < dd (p.p - r^2) beyond all doubt: in double precision, with its error."""
        (start, start_error), (direction, direction_error) = map(_rounded_point, (origin, d))
        p = start - self.centres
        reach, length = np.sqrt((p * p).sum(axis=1)), float(np.sqrt(direction @ direction))
        half, dd = p @ direction, length * length
        p_error = start_error + ROUNDING * np.abs(self.centres).max(axis=1)
        half_error = p_error * length + direction_error * (reach + p_error) + ROUNDING * reach * length
        outside = reach * reach - self.radii**2
        error = half_error * (2 * np.abs(half) + half_error) + dd * p_error * (2 * reach + p_error)
        error += direction_error * (2 * length + direction_error) * np.abs(outside)
        error += ROUNDING * (half * half + dd * (reach * reach + self.radii**2))
        return np.asarray(half * half - dd * outside < -2 * error)


class Walk:
    """One way through the choices: `path` lists the first of them; `taken` all, each with the number of its ways."""

    def __init__(self, tables: Tables, rules: Rules, path: list[int], may_choose: bool) -> None:
        self.tables, self.rules, self.path, self.may_choose = tables, rules, path, may_choose
        self.taken: list[tuple[int, int]] = []
        self.rays: list[Ray] = []

    def choose(self, ways: int) -> int:
        """Which way to go where the balls cannot tell; the first is the model's rule for ties."""
        if not self.may_choose:
            raise UndecidedError
        place = len(self.taken)
        way = self.path[place] if place < len(self.path) else 0
        self.taken.append((way, ways))
        return way

    def next_path(self) -> list[int] | None:
        """The path that differs from this one in the last choice that has another way."""
        taken = list(self.taken)
        while taken and taken[-1][0] + 1 == taken[-1][1]:
            taken.pop()
        return [*(way for way, _ in taken[:-1]), taken[-1][0] + 1] if taken else None

    def colour(self, d: Point, limit: int) -> Point:
        """What the camera's ray along `d` brings back; raises UndecidedError and UnboundedError."""
        total: Point = (ZERO, ZERO, ZERO)
        weight, origin, leaving = ONE, self.tables.eye, None
        d = self.loosened(d)
        for depth in range(limit + 1):
            hit = self.nearest(origin, d, leaving)
            if hit is None:
                self.rays.append(Ray(origin, d, None, lit=False))
                break
            surface = self.tables.surfaces[hit.place]
            point = self.loosened(_along(origin, hit.t, d))
            arm = _minus(point, surface.centre) if isinstance(surface, HeldSphere) else surface.normal
            cosine = self.cosine(surface, point, arm, hit.place) if hit.bounded else self.far_cosine(hit, origin, d)
            self.rays.append(Ray(origin, d, hit, lit=not cosine.is_zero()))
            lit = surface.diffuse * cosine
            red, green, blue = (
                sum_ + weight * colour * (ambient + lit)
                for sum_, colour, ambient in zip(total, surface.colour, self.tables.ambient, strict=True)
            )
            total = (red, green, blue)
            if surface.reflection.is_zero() or depth == limit:
                break
            if not hit.bounded:
                self.leave_behind(hit, origin, d)
                break
            weight = weight * surface.reflection
            origin, d, leaving = point, self.loosened(_mirrored(d, arm, surface)), hit.place
        return total

    def loosened(self, point: Point) -> Point:
        """With the error that the rules' precision allows."""
        if not self.rules.precision:
            return point
        error = arb(0, self.rules.precision * max(float(value.abs_upper()) for value in point))
        return (point[0] + error, point[1] + error, point[2] + error)

    def nearest(self, origin: Point, d: Point, leaving: int | None) -> Hit | None:
        """The first hit along the ray; by choice where several may be the first."""
        dd = _dot(d, d)
        window = self.window(leaving, dd.sqrt())
        hits: list[Hit] = []
        for index, surface in self.tables.along(origin, d):
            if isinstance(surface, HeldSphere):
                hits += _meet_sphere(index, surface, origin, d, dd, leaving, window)
            elif index != leaving:
                hits += _meet_plane(index, surface, origin, d, leaving, window)
        sure = [hit for hit in hits if hit.sure]
        if not sure:
            return _choose_hit(self, [*hits, None])
        first = min(sure, key=lambda hit: float(hit.t.upper()))
        return _choose_hit(self, [hit for hit in hits if not hit.t > first.t])

    def window(self, leaving: int | None, length: arb) -> _Window:
        """What counts along a ray; the rules of mirrored rays are about directions at unit length."""
        missed = _ball(self.rules.grazing)
        if leaving is None:
            return _Window(ONE, ONE, missed)
        clear = max(self.rules.reflection, self.rules.gap)
        return _Window(_ball(self.rules.reflection) / length, _ball(clear) / length, missed * length)

    def cosine(self, surface: HeldSphere | HeldPlane, point: Point, arm: Point, index: int) -> arb:
        """n.l where the light reaches the point, else 0."""
        to_light = _minus(self.tables.light, point)
        distance = _dot(to_light, to_light).sqrt()
        if isinstance(surface, HeldSphere):
            cosine = _dot(arm, to_light) / (surface.radius * distance)
        else:
            cosine = -surface.from_light / (surface.length * distance)
        if surface.diffuse.is_zero() or cosine <= 0:
            return ZERO
        if not cosine > 0:
            return ZERO.union(cosine.upper())  # whether or not something blocks it
        return ZERO if self.blocked(point, to_light, distance, index) else cosine

    def blocked(self, point: Point, to_light: Point, distance: arb, leaving: int) -> bool:
        """Whether a surface stands before the light; by choice where that is open."""
        start = _ball(self.rules.shadow)
        late = max(start, arb(self.rules.gap) / distance, key=lambda share: float(share.upper()))
        doubts = []
        for index, surface in self.tables.along(point, to_light):
            verdict, ruled = self.blocks(surface, point, to_light, index == leaving, start)
            if verdict and self.rules.gap:
                verdict, ruled = self.blocks(surface, point, to_light, index == leaving, late)[0] or None, True
            if verdict:
                return True
            if verdict is None:
                doubts.append(ruled)
        if not doubts:
            return False
        return any(doubts) is (self.choose(2) == 0)

    def blocks(
        self, surface: HeldSphere | HeldPlane, point: Point, to_light: Point, left: bool, start: arb
    ) -> tuple[Verdict, bool]:
        """Whether the surface is met at start < t < 1, and whether it is so by the model's rule for ties."""
        if isinstance(surface, HeldSphere):
            return _sphere_blocks(surface, point, to_light, left, start)
        if left or surface.from_light.is_zero():
            return False, False
        side = surface.offset - _dot(point, surface.normal)
        if self.rules.grazing and abs(side - surface.from_light) <= arb(self.rules.grazing) * surface.length:
            return False, False
        return _opposite(side * (1 - start) + surface.from_light * start, surface.from_light), False

    def far_cosine(self, hit: Hit, origin: Point, d: Point) -> arb:
        """n.l of a plane at a distance of at least hit.t along d: at most its distance from the light over that."""
        plane = self.tables.surfaces[hit.place]
        assert isinstance(plane, HeldPlane)
        to_light = _minus(self.tables.light, origin)
        least = hit.t * _dot(d, d).sqrt() - _dot(to_light, to_light).sqrt()
        if not least > 0:
            raise UnboundedError
        return ZERO.union((abs(plane.from_light) / (plane.length * least)).upper())

    def leave_behind(self, hit: Hit, origin: Point, d: Point) -> None:
        """Raise UnboundedError unless the ray mirrored at a distance of at least hit.t meets nothing any more."""
        plane = self.tables.surfaces[hit.place]
        assert isinstance(plane, HeldPlane)
        onward = _mirrored(d, plane.normal, plane)
        for index, surface in enumerate(self.tables.surfaces):
            if index == hit.place:
                continue
            if isinstance(surface, HeldSphere):
                p = _minus(origin, surface.centre)
                behind = hit.t * _dot(d, onward) > abs(_dot(p, onward))
                behind &= hit.t * _dot(d, d).sqrt() > _dot(p, p).sqrt() + surface.radius
            else:
                slope, slope_onward = _dot(d, surface.normal), _dot(onward, surface.normal)
                behind = slope * slope_onward > 0
                behind &= hit.t * abs(slope) > abs(surface.offset - _dot(origin, surface.normal))
            if not behind:
                raise UnboundedError


def _choose_hit(walk: Walk, ways: list[Hit | None]) -> Hit | None:
    """Where several hits may be the first: by the model's rule the first listed of those that tie, then the others."""
    if len(ways) == 1:
        return ways[0]
    ruled = [hit for hit in ways if hit and hit.ruled]
    nearest = min(ruled, key=lambda hit: float(hit.t.lower()), default=None)
    first = next((hit for hit in ruled if nearest and not hit.t > nearest.t), None)
    return [first, *(way for way in ways if way is not first)][walk.choose(len(ways))]


def _meet_sphere(
    index: int, sphere: HeldSphere, origin: Point, d: Point, dd: arb, leaving: int | None, window: _Window
) -> Iterator[Hit]:
    """The roots that may count, up to the first that surely does if the ray meets the sphere at all."""
    p = _minus(origin, sphere.centre)
    half = _dot(p, d)
    sure = True
    if index == leaving:
        roots = [-2 * half / dd]
    else:
        constant = sphere.at_eye if leaving is None else _dot(p, p) - sphere.radius**2
        squared = half * half - dd * constant
        if squared < 0:
            return
        sure = bool(squared > 0)
        root = squared.sqrt() if sure else ZERO.union(squared.upper().sqrt())
        roots = [(-half - root) / dd, (root - half) / dd]
    for t in roots:
        counts, clear = bool(t > window.least), bool(t > window.clear)
        if counts or not t <= window.least:
            yield Hit(t, index, sure and clear, counts)
        if clear:
            return


def _meet_plane(
    index: int, plane: HeldPlane, origin: Point, d: Point, leaving: int | None, window: _Window
) -> Iterator[Hit]:
    """The crossing if it may count. Along a plane, what is farther than any bound, or a miss by the rule for ties."""
    if leaving is None and (plane.offset.is_zero() or plane.is_screen):
        return
    side = plane.offset if leaving is None else plane.offset - _dot(origin, plane.normal)
    facing = _dot(d, plane.normal)
    slope, missed = abs(facing), window.missed * plane.length
    if not missed.is_zero() and slope <= missed:
        return
    if facing > 0 or facing < 0:
        t = side / facing
        counts = bool(t > window.least)
        if counts or not t <= window.least:
            yield Hit(t, index, bool(t > window.clear and (missed.is_zero() or slope > missed)), counts)
        return
    farther = side.abs_lower() / facing.abs_upper()
    yield Hit(farther, index, sure=False, ruled=False, bounded=False)


def _sphere_blocks(sphere: HeldSphere, point: Point, to_light: Point, left: bool, start: arb) -> tuple[Verdict, bool]:
    """Whether dd t^2 + 2 half t + constant has a root in start < t < 1, by its signs; a double root counts."""
    p, dd = _minus(point, sphere.centre), _dot(to_light, to_light)
    half = _dot(p, to_light)
    constant = ZERO if left else _dot(p, p) - sphere.radius**2
    if sphere.at_light.is_zero():  # one root is 1, so that the other is constant / dd
        return _both(_positive(constant - start * dd), _positive(dd - constant)), False
    if left and start.is_zero():
        return _both(_positive(-half), _positive(sphere.at_light)), False
    slope, end_slope = half + dd * start, half + dd
    at_start = constant + (half + slope) * start
    squared = half * half - dd * constant
    if squared < 0:
        return False, False
    if sphere.at_light < 0:
        return _positive(at_start), False
    if not sphere.at_light > 0:
        return None, False
    dips = _both(_positive(-slope), _positive(end_slope))
    if at_start < 0 or (dips and squared > 0):
        return True, True
    if at_start > 0:
        return dips and None, True
    return None, False


def _both(one: Verdict, other: Verdict) -> Verdict:
    return False if one is False or other is False else None if one is None or other is None else True


def _positive(value: arb) -> Verdict:
    return True if value > 0 else False if value <= 0 else None


def _opposite(one: arb, other: arb) -> Verdict:
    """Whether two balls have opposite signs."""
    return _positive(-one * other)


def _mirrored(d: Point, arm: Point, surface: HeldSphere | HeldPlane) -> Point:
    """The mirrored direction d - 2 (d.n) n, as long as d: no term depends on the length."""
    length = surface.radius if isinstance(surface, HeldSphere) else surface.length
    return _along(d, -2 * _dot(d, arm) / length**2, arm)


def _sphere(sphere: Sphere) -> HeldSphere:
    centre, radius = [exact(value) for value in sphere.centre], exact(sphere.radius)
    at_eye, at_light = (
        _ball(sum((a - exact(b)) ** 2 for a, b in zip(centre, point, strict=True)) - radius**2)
        for point in (EYE, LIGHT)
    )
    return HeldSphere(*_material(sphere), _point(centre), _ball(radius), at_eye, at_light)


def _plane(plane: Plane) -> HeldPlane:
    normal, point = [exact(value) for value in plane.normal], [exact(value) for value in plane.point]
    offset, from_light = (
        _ball(sum(n * (a - exact(b)) for n, a, b in zip(normal, point, origin, strict=True))) for origin in (EYE, LIGHT)
    )
    is_screen = not any(normal[:2]) and point[2] == exact(SCREEN_DISTANCE)
    length = _ball(sum(n * n for n in normal)).sqrt()
    return HeldPlane(*_material(plane), _point(normal), length, offset, from_light, is_screen)


def _material(surface: Sphere | Plane) -> tuple[Point, arb, arb]:
    return _point(map(exact, surface.colour)), _ball(exact(surface.diffuse)), _ball(exact(surface.reflection))


def _ball(value: Fraction | float) -> arb:
    fraction = value if isinstance(value, Fraction) else exact(value)
    return arb(fmpq(fraction.numerator, fraction.denominator))


def _point(values: Iterable[Fraction]) -> Point:
    x, y, z = map(_ball, values)
    return (x, y, z)


def _rounded_point(point: Point) -> tuple[NDArray[np.float64], float]:
    """In double precision, and the most that it is off."""
    value = np.array([float(ball.mid()) for ball in point])
    error = sum(float(ball.rad()) for ball in point)
    return value, float(error + ROUNDING * np.abs(value).max())


def _dot(a: Point, b: Point) -> arb:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _minus(a: Point, b: Point) -> Point:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def _along(origin: Point, t: arb, d: Point) -> Point:
    return (origin[0] + t * d[0], origin[1] + t * d[1], origin[2] + t * d[2])
